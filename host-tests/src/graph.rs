//! The labelled graph of Section II: places, their fingerprints, and which places are adjacent.

use std::collections::BTreeSet;

/// A labelled, undirected graph `G = (V, E, L)`. Vertices are numbered from 0. A vertex may be its own neighbour.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    labels: Vec<f64>,
    neighbours: Vec<BTreeSet<usize>>,
}

impl Graph {
    /// A graph without vertices.
    pub fn new() -> Self {
        Self::default()
    }

    /// A graph with these labels (millimetres) and these edges.
    pub fn with(labels: &[f64], edges: &[(usize, usize)]) -> Self {
        let mut graph = Self::new();
        for &label_mm in labels {
            graph.add_vertex(label_mm);
        }
        for &(a, b) in edges {
            graph.add_edge(a, b);
        }
        graph
    }

    /// The line graph of a history: one vertex for each observation, an edge between consecutive ones.
    pub fn line(history_mm: &[f64]) -> Self {
        let mut line = Self::with(history_mm, &[]);
        for after in 1..history_mm.len() {
            line.add_edge(after - 1, after);
        }
        line
    }

    /// Adds a vertex and returns its number.
    pub fn add_vertex(&mut self, label_mm: f64) -> usize {
        self.labels.push(label_mm);
        self.neighbours.push(BTreeSet::new());
        self.labels.len() - 1
    }

    /// Makes two vertices adjacent; adding an edge again changes nothing.
    pub fn add_edge(&mut self, a: usize, b: usize) {
        self.neighbours[a].insert(b);
        self.neighbours[b].insert(a);
    }

    /// How many vertices there are.
    pub fn vertices(&self) -> usize {
        self.labels.len()
    }

    /// **Eq. 1**: the label of a vertex, in millimetres.
    pub fn label(&self, vertex: usize) -> f64 {
        self.labels[vertex]
    }

    /// The labels of all vertices in order.
    pub fn labels(&self) -> &[f64] {
        &self.labels
    }

    /// Changes the label of a vertex.
    pub fn set_label(&mut self, vertex: usize, label_mm: f64) {
        self.labels[vertex] = label_mm;
    }

    /// The vertices adjacent to a vertex.
    pub fn neighbours(&self, vertex: usize) -> &BTreeSet<usize> {
        &self.neighbours[vertex]
    }

    /// Every edge once, as `(a, b)` with `a <= b`, in order.
    pub fn edges(&self) -> Vec<(usize, usize)> {
        let from = |a: usize| self.neighbours[a].range(a..).map(move |&b| (a, b));
        (0..self.vertices()).flat_map(from).collect()
    }

    /// The same graph with every label changed by `change`.
    pub fn map_labels(&self, change: impl Fn(f64) -> f64) -> Self {
        Self { labels: self.labels.iter().map(|&label| change(label)).collect(), neighbours: self.neighbours.clone() }
    }
}
