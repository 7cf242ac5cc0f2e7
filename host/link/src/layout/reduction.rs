//! Reduces a graph to the part that determines planarity: removes trees and contracts paths of degree-2 vertices.

use super::graph::Graph;

/// A graph without its trees, in which each path through vertices of degree 2 is one edge.
pub(super) struct Reduction {
    /// The reduced graph; its vertex `n` is `kept[n]`.
    pub(super) graph: Graph,
    pub(super) kept: Vec<usize>,
    /// The vertices of the trees, outermost first.
    pub(super) leaves: Vec<usize>,
    /// The vertices of degree 2, each with its two neighbours at the time of its removal.
    pub(super) bends: Vec<(usize, (usize, usize))>,
}

impl Reduction {
    pub(super) fn of(graph: &Graph) -> Self {
        let mut neighbours: Vec<Vec<usize>> =
            (0..graph.vertices()).map(|vertex| graph.neighbours(vertex).to_vec()).collect();
        let mut is_kept = vec![true; graph.vertices()];
        let (mut leaves, mut bends) = (Vec::new(), Vec::new());
        while let Some(leaf) = (0..is_kept.len()).find(|&vertex| is_kept[vertex] && neighbours[vertex].len() < 2) {
            is_kept[leaf] = false;
            leaves.push(leaf);
            if let Some(stem) = neighbours[leaf].pop() {
                neighbours[stem].retain(|&other| other != leaf);
            }
        }
        let is_bend = |neighbours: &[Vec<usize>], vertex: usize| match neighbours[vertex][..] {
            [one, other] => !neighbours[one].contains(&other),
            _ => false,
        };
        while let Some(bend) = (0..is_kept.len()).find(|&vertex| is_kept[vertex] && is_bend(&neighbours, vertex)) {
            let (one, other) = (neighbours[bend][0], neighbours[bend][1]);
            is_kept[bend] = false;
            bends.push((bend, (one, other)));
            for (from, to) in [(one, other), (other, one)] {
                neighbours[from].iter_mut().filter(|next| **next == bend).for_each(|next| *next = to);
            }
        }
        let kept: Vec<usize> = (0..is_kept.len()).filter(|&vertex| is_kept[vertex]).collect();
        let number = |original: &usize| kept.binary_search(original).ok();
        if graph.is_ordered() {
            let order = |&original: &usize| neighbours[original].iter().filter_map(number).collect();
            let graph = Graph::ordered(kept.iter().map(order).collect());
            return Self { graph, kept, leaves, bends };
        }
        let mut reduced = Graph::new(kept.len());
        for (vertex, &original) in kept.iter().enumerate() {
            for &other in &neighbours[original] {
                if let Some(other) = number(&other) {
                    reduced.connect(vertex, other);
                }
            }
        }
        Self { graph: reduced, kept, leaves, bends }
    }

    /// The reduction that removes nothing.
    pub(super) fn none(graph: &Graph) -> Self {
        Self { graph: graph.clone(), kept: (0..graph.vertices()).collect(), leaves: Vec::new(), bends: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_with_a_tail_reduces_to_a_triangle() {
        let mut graph = Graph::new(7);
        [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (2, 5), (5, 6)].into_iter().for_each(|(a, b)| graph.connect(a, b));
        let reduction = Reduction::of(&graph);
        assert_eq!((reduction.graph.vertices(), reduction.graph.edges().len()), (3, 3));
        assert_eq!(reduction.leaves, [6, 5]);
        assert_eq!(reduction.bends, [(0, (1, 4)), (1, (4, 2))]);
        assert_eq!(reduction.kept, [2, 3, 4]);
    }

    #[test]
    fn all_vertices_of_a_tree_are_removed_as_leaves() {
        let mut graph = Graph::new(4);
        [(0, 1), (1, 2), (1, 3)].into_iter().for_each(|(a, b)| graph.connect(a, b));
        assert_eq!(Reduction::of(&graph).leaves.len(), 4);
    }
}
