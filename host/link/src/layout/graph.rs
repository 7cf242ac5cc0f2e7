//! The part of a map that determines the layout: no labels and no self-loops.

use crate::topology::TopologicalMap;

/// A simple graph over the vertices 0, 1, ….
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Graph {
    edges: Vec<(usize, usize)>,
    neighbours: Vec<Vec<usize>>,
}

impl Graph {
    pub(super) fn new(vertices: usize) -> Self {
        Self { edges: Vec::new(), neighbours: vec![Vec::new(); vertices] }
    }

    pub(super) fn of(map: &TopologicalMap) -> Self {
        let mut graph = Self::new(map.vertices.len());
        for &(a, b) in &map.edges {
            graph.connect(a.into(), b.into());
        }
        graph
    }

    /// Adds an edge, unless it is a self-loop, already exists, or has an end outside the graph.
    pub(super) fn connect(&mut self, a: usize, b: usize) {
        if a != b && a.max(b) < self.vertices() && !self.connects(a, b) {
            self.edges.push((a.min(b), a.max(b)));
            self.neighbours[a].push(b);
            self.neighbours[b].push(a);
        }
    }

    /// Removes the edge that was added last.
    pub(super) fn disconnect_last(&mut self) {
        if let Some((a, b)) = self.edges.pop() {
            self.neighbours[a].pop();
            self.neighbours[b].pop();
        }
    }

    pub(super) fn connects(&self, a: usize, b: usize) -> bool {
        self.neighbours[a].contains(&b)
    }

    pub(super) const fn vertices(&self) -> usize {
        self.neighbours.len()
    }

    pub(super) fn edges(&self) -> &[(usize, usize)] {
        &self.edges
    }

    pub(super) fn neighbours(&self, vertex: usize) -> &[usize] {
        &self.neighbours[vertex]
    }

    /// The connected components after removing some vertices, each in ascending order.
    pub(super) fn parts_without(&self, left_out: &[usize]) -> Vec<Vec<usize>> {
        let mut seen = vec![false; self.vertices()];
        left_out.iter().for_each(|&vertex| seen[vertex] = true);
        let mut parts = Vec::new();
        for first in 0..self.vertices() {
            let mut part = Vec::new();
            let mut open = vec![first];
            while let Some(vertex) = open.pop() {
                if !std::mem::replace(&mut seen[vertex], true) {
                    part.push(vertex);
                    open.extend(&self.neighbours[vertex]);
                }
            }
            if !part.is_empty() {
                part.sort_unstable();
                parts.push(part);
            }
        }
        parts
    }
}
