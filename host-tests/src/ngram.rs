//! n-grams of histories and of graphs (Definitions 3 to 5).

use crate::graph::Graph;
use std::cmp::Ordering;
use std::collections::BTreeSet;

/// **Definition 3**: a sequence of n labels, in millimetres.
///
/// A corridor can be driven both ways, so an n-gram is the same as its reversal (Table I prints one of the two). It is
/// kept in the orientation that compares smaller.
#[derive(Clone, Debug)]
pub struct Ngram(Vec<f64>);

impl Ngram {
    /// The n-gram of these labels.
    pub fn new(labels: &[f64]) -> Self {
        let forward = Self(labels.to_vec());
        let backward = Self(labels.iter().rev().copied().collect());
        forward.min(backward)
    }

    /// The labels, in millimetres.
    pub fn labels(&self) -> &[f64] {
        &self.0
    }
}

impl Ord for Ngram {
    fn cmp(&self, other: &Self) -> Ordering {
        let pairs = self.0.iter().zip(&other.0);
        let first_difference = pairs.map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
        first_difference.unwrap_or_else(|| self.0.len().cmp(&other.0.len()))
    }
}

impl PartialOrd for Ngram {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ngram {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Ngram {}

/// A set of n-grams, written Γ in the paper.
pub type NgramSet = BTreeSet<Ngram>;

/// **Definition 4**: `Grams_H(H, n)`, all n-grams that can be extracted from a history.
///
/// The robot may turn round at any place, so these are the labels of every walk of n vertices on the line graph of the
/// history. This reading, and no other that was tried, gives the 24 3-grams of Table I.
pub fn grams_of_history(history_mm: &[f64], n: usize) -> NgramSet {
    grams_of_graph(&Graph::line(history_mm), n)
}

/// **Definition 5**: `Grams_G(G, n)`, all n-grams that can be obtained by traversing a graph: the labels of every walk of
/// n vertices.
pub fn grams_of_graph(graph: &Graph, n: usize) -> NgramSet {
    let mut walks: Vec<Vec<usize>> = (0..graph.vertices()).map(|start| vec![start]).collect();
    for _ in 1..n {
        walks = walks.iter().flat_map(|walk| one_step_longer(graph, walk)).collect();
    }
    let labels_along = |walk: &Vec<usize>| walk.iter().map(|&vertex| graph.label(vertex)).collect::<Vec<_>>();
    walks.iter().map(|walk| Ngram::new(&labels_along(walk))).collect()
}

fn one_step_longer(graph: &Graph, walk: &[usize]) -> Vec<Vec<usize>> {
    let end = walk[walk.len() - 1];
    graph.neighbours(end).iter().map(|&next| [walk, &[next]].concat()).collect()
}
