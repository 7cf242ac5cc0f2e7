"""Peer: passive automata learning (ALERGIA, from AALpy), the states of a learned Markov chain taken for the places.

ALERGIA wants many sequences with the same first symbol; a robot has one. So every window of a fixed number of steps is
cut from the path, and a start symbol is put before each. The whole path is among the sequences as well, so the
automaton accepts it; the state it is in after each symbol is the path.

Choices: the symbols are the categories of `categories.py`; several window lengths and significances are tried, and the
whole path alone too; of all results the one with the best Bayesian information criterion is kept.
"""

from __future__ import annotations

import sys

from aalpy.learning_algs import run_Alergia

from categories import categorise
from path_map import chain_criterion

WINDOWS = (0, 3, 5, 8, 12)
"""How many steps a window has; without windows there is the whole path alone."""
SIGNIFICANCES = (0.005, 0.05, 0.5, 1.0)
START = -1
"""Comes before every sequence; no category has this number."""


def find_path(radii_mm: list[float], seed: int) -> list[str]:
    """The state of the automaton at every step."""
    symbols = categorise(radii_mm, seed)
    # ALERGIA compares and folds states recursively, as deep as the path is long.
    sys.setrecursionlimit(max(sys.getrecursionlimit(), 20 * len(symbols) + 1000))
    candidates = []
    for window in WINDOWS:
        sequences = [[START, *symbols]]
        if window > 0:
            sequences += [[START, *symbols[i : i + window]] for i in range(1, len(symbols) - window + 1)]
        for significance in SIGNIFICANCES:
            candidates.append(_path_of_automaton(sequences, significance, symbols))
    # The first of several that are equally good.
    return max(candidates, key=chain_criterion)


def _path_of_automaton(sequences: list[list[int]], significance: float, symbols: list[int]) -> list[str]:
    automaton = run_Alergia(sequences, automaton_type="mc", eps=significance)
    state = automaton.initial_state
    path = []
    for symbol in symbols:
        state = next(end for end, _ in state.transitions if end.output == symbol)
        path.append(state.state_id)
    return path
