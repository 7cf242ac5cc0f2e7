//! A plain undirected graph: an environment or a map without its labels.

use petgraph::{Undirected, algo::is_isomorphic};
use std::collections::BTreeSet;

/// An undirected graph over the vertices `0..vertex_count`, without parallel edges. Self-loops are possible.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Graph {
    vertex_count: usize,
    edges: BTreeSet<(usize, usize)>,
}

impl Graph {
    /// A graph of `vertex_count` vertices and no edges.
    pub fn new(vertex_count: usize) -> Self {
        Self { vertex_count, edges: BTreeSet::new() }
    }

    /// A graph from its edges.
    ///
    /// # Panics
    /// When an edge ends outside of `0..vertex_count`.
    pub fn from_edges(vertex_count: usize, edges: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut graph = Self::new(vertex_count);
        for (a, b) in edges {
            graph.add_edge(a, b);
        }
        graph
    }

    /// Connects two vertices; returns `false` when they are already connected.
    ///
    /// # Panics
    /// When a vertex is outside of `0..vertex_count`.
    pub fn add_edge(&mut self, a: usize, b: usize) -> bool {
        assert!(a.max(b) < self.vertex_count, "edge {a}-{b} is outside a graph of {} vertices", self.vertex_count);
        self.edges.insert((a.min(b), a.max(b)))
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Every edge once, the smaller vertex first, in ascending order.
    pub fn edges(&self) -> &BTreeSet<(usize, usize)> {
        &self.edges
    }

    /// The neighbours of every vertex, in ascending order; a vertex with a self-loop is its own neighbour.
    pub fn neighbours(&self) -> Vec<Vec<usize>> {
        let mut neighbours = vec![BTreeSet::new(); self.vertex_count];
        for &(a, b) in &self.edges {
            neighbours[a].insert(b);
            neighbours[b].insert(a);
        }
        neighbours.into_iter().map(|set| set.into_iter().collect()).collect()
    }

    /// Whether every vertex is reachable from the first one.
    pub fn is_connected(&self) -> bool {
        first_unreached(&self.neighbours()).is_none()
    }

    /// Whether the two graphs are isomorphic, regardless of labels.
    pub fn is_isomorphic_to(&self, other: &Self) -> bool {
        is_isomorphic(&self.to_petgraph(|_| ()), &other.to_petgraph(|_| ()))
    }

    /// The same graph for the algorithms of petgraph, each vertex with a label.
    pub(crate) fn to_petgraph<L>(&self, label: impl Fn(usize) -> L) -> petgraph::Graph<L, (), Undirected> {
        let mut graph = petgraph::Graph::with_capacity(self.vertex_count, self.edges.len());
        let vertices: Vec<_> = (0..self.vertex_count).map(|vertex| graph.add_node(label(vertex))).collect();
        for &(a, b) in &self.edges {
            graph.add_edge(vertices[a], vertices[b], ());
        }
        graph
    }
}

/// The first vertex that is not reachable from vertex 0.
pub(crate) fn first_unreached(neighbours: &[Vec<usize>]) -> Option<usize> {
    let mut reached = vec![false; neighbours.len()];
    let mut open = vec![0];
    while let Some(vertex) = open.pop() {
        if !std::mem::replace(reached.get_mut(vertex)?, true) {
            open.extend(&neighbours[vertex]);
        }
    }
    reached.iter().position(|&reached| !reached)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn renumbered_graphs_are_isomorphic() {
        let graph = Graph::from_edges(4, [(0, 1), (1, 2), (2, 3), (3, 3)]);
        let renumbered = Graph::from_edges(4, [(2, 0), (0, 3), (3, 1), (2, 2)]);
        assert!(!graph.is_isomorphic_to(&Graph::from_edges(4, [(0, 1), (1, 2), (2, 3), (1, 1)])));
        assert!(graph.is_isomorphic_to(&renumbered));
    }

    #[test]
    fn a_ring_of_six_is_not_two_triangles() {
        let ring = Graph::from_edges(6, (0..6).map(|v| (v, (v + 1) % 6)));
        let triangles = Graph::from_edges(6, [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3)]);
        assert!(!ring.is_isomorphic_to(&triangles));
    }
}
