//! A simple graph, with or without an order of the neighbours: what determines the layout.

/// A simple graph over the vertices 0, 1, ….
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Graph {
    edges: Vec<(usize, usize)>,
    neighbours: Vec<Vec<usize>>,
    /// Whether a drawing must show the neighbours of each vertex counter-clockwise in the order of their list.
    is_ordered: bool,
}

impl Graph {
    pub(super) fn new(vertices: usize) -> Self {
        Self { edges: Vec::new(), neighbours: vec![Vec::new(); vertices], is_ordered: false }
    }

    /// A graph from the neighbours of each vertex in counter-clockwise order. The lists are symmetric and name each neighbour
    /// once.
    pub(super) fn ordered(neighbours: Vec<Vec<usize>>) -> Self {
        let of = |(vertex, neighbours): (usize, &Vec<usize>)| {
            neighbours.iter().filter(|&&other| vertex < other).map(|&other| (vertex, other)).collect::<Vec<_>>()
        };
        let edges = neighbours.iter().enumerate().flat_map(of).collect();
        Self { edges, neighbours, is_ordered: true }
    }

    pub(super) const fn is_ordered(&self) -> bool {
        self.is_ordered
    }

    /// The same graph without an order of the neighbours.
    pub(super) fn without_order(self) -> Self {
        Self { is_ordered: false, ..self }
    }

    /// The graph of a map without ways.
    #[cfg(test)]
    pub(super) fn of(map: &crate::topology::TopologicalMap) -> Self {
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
