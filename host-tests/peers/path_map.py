"""The map that a path describes: the one data type that peers return and scores judge."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass

Edge = tuple[int, int]


def undirected(edges: Iterable[Sequence[int]]) -> frozenset[Edge]:
    """Every edge once, the smaller end first."""
    return frozenset((min(a, b), max(a, b)) for a, b in edges)


@dataclass(frozen=True)
class PathMap:
    """A path and the undirected graph it was walked on; the vertices are `0..vertex_count`."""

    path: tuple[int, ...]
    """The vertex of every step."""
    vertex_count: int
    edges: frozenset[Edge]


def map_of_path(states: Iterable[Hashable]) -> PathMap:
    """The map of a sequence of states of any model.

    Its vertices are the states that were visited, numbered by their first visit. Its edges join states that follow
    each other, whichever way. A self-loop is in it only where a state follows itself.
    """
    numbers: dict[Hashable, int] = {}
    path = tuple(numbers.setdefault(state, len(numbers)) for state in states)
    return PathMap(path, len(numbers), undirected(zip(path, path[1:])))


def chain_criterion(states: Sequence[Hashable]) -> float:
    """The negative Bayesian information criterion of a path as a Markov chain of its states; the larger is the better.

    Every transition that the path takes counts as a parameter. Fewer are free, for those of a state add up to one, but
    counted so a path that never returns to a state would cost nothing.
    """
    steps = Counter(zip(states, states[1:]))
    leaves = Counter(states[:-1])
    log_likelihood = sum(count * math.log(count / leaves[start]) for (start, _), count in steps.items())
    return 2 * log_likelihood - len(steps) * math.log(max(len(states), 1))
