"""How right a map is. The same scores as `host/eval/src/score.rs`, so that peers and toposlam are comparable."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import networkx

from path_map import Edge, PathMap


@dataclass(frozen=True)
class Score:
    """The scores of one map. A map vertex stands for the class it was mostly visited at."""

    exact: bool
    """The vertices match the classes one to one and the edges are the same."""
    isomorphic: bool
    """The map without its labels is the true graph without its labels."""
    edge_f1: float
    """Harmonic mean of precision and recall of the pairs of classes that the map connects."""
    location_smoothed: float
    """The share of all steps at which the vertex that the path visits stands for the class the robot was at."""


def score_map(found: PathMap, class_count: int, true_edges: frozenset[Edge], classes: Sequence[int]) -> Score:
    """Scores a map against the true graph and the true class of every step.

    When a vertex was visited at two classes equally often, the lower class wins.
    """
    if len(found.path) != len(classes):
        raise ValueError(f"a path of {len(found.path)} steps cannot be judged by {len(classes)} classes")
    class_of_vertex = _majority_classes(found.path, classes)
    # The image of the map's edges. A vertex that was never visited stands for nothing.
    image = set()
    for a, b in found.edges:
        if a in class_of_vertex and b in class_of_vertex:
            ends = class_of_vertex[a], class_of_vertex[b]
            image.add((min(ends), max(ends)))
    # With as many vertices as classes, hitting every class makes the match one to one.
    one_to_one = found.vertex_count == class_count and len(set(class_of_vertex.values())) == class_count
    pairs = len(image) + len(true_edges)
    right = sum(class_of_vertex[vertex] == true_class for vertex, true_class in zip(found.path, classes))
    return Score(
        exact=one_to_one and image == true_edges,
        isomorphic=_isomorphic(found.vertex_count, found.edges, class_count, true_edges),
        edge_f1=2 * len(image & true_edges) / pairs if pairs else 1.0,
        location_smoothed=right / len(classes) if classes else 0.0,
    )


def _majority_classes(path: Sequence[int], classes: Sequence[int]) -> dict[int, int]:
    visits: dict[int, Counter[int]] = {}
    for vertex, true_class in zip(path, classes):
        visits.setdefault(vertex, Counter())[true_class] += 1
    return {vertex: min(counts, key=lambda c: (-counts[c], c)) for vertex, counts in visits.items()}


def _isomorphic(vertex_count: int, edges: frozenset[Edge], other_count: int, other_edges: frozenset[Edge]) -> bool:
    if vertex_count != other_count or len(edges) != len(other_edges):
        return False
    graphs = []
    for count, graph_edges in ((vertex_count, edges), (other_count, other_edges)):
        graph = networkx.Graph()
        graph.add_nodes_from(range(count))
        graph.add_edges_from(graph_edges)
        graphs.append(graph)
    # Self-loops take part in the comparison.
    return networkx.is_isomorphic(*graphs)
