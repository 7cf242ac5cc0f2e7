//! Merging two vertices of a hypothesis: the gain in evidence, and the merge itself.

use super::hypothesis::{Hypothesis, join, ln};
use super::model::{LN_EDGE, LN_VERTEX, Model};
use super::statistics::VertexStatistics;
use crate::map::{VertexId, VertexSet32};

/// A gain of the labels this low is not made up for by the other terms, in nats.
const HOPELESS: f32 = -30.0;

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// Merges two vertices in the path and in the marginalised statistics. The path may then stay at the vertex.
    pub(super) fn merge(&mut self, kept: VertexId, removed: VertexId, len: usize) {
        self.path.iter_mut().take(len).filter(|vertex| **vertex == removed).for_each(|vertex| *vertex = kept);
        if self.before == Some(removed) {
            self.before = Some(kept);
        }
        let statistics = core::mem::replace(&mut self.marginalised[removed], VertexStatistics::NONE);
        self.marginalised[kept].add(&statistics);
        for neighbour in self.marginalised_neighbours[removed].iter() {
            join(&mut self.marginalised_neighbours, kept, neighbour);
            self.marginalised_neighbours[neighbour].remove(removed);
        }
        self.marginalised_neighbours[removed] = VertexSet32::EMPTY;
    }

    /// The gain in evidence when two vertices a and b that are not neighbours become one vertex, without the turn hints; −∞ for
    /// neighbours. It is the sum of
    ///
    /// - [`Model::label_evidence`] of the merged vertex, minus that of a and of b;
    /// - [`Model::exit_evidence`] of the merged vertex with the neighbours of both, minus that of a and of b;
    /// - for each neighbour that they share, −[`LN_EDGE`] and the change of its [`Model::exit_evidence`] with one edge less;
    /// - −[`LN_VERTEX`], and ln K − ln (K − 1) for each start of a sequence.
    ///
    /// Cost: O(degree).
    pub(super) fn merge_gain(&self, model: &Model, a: VertexId, b: VertexId) -> f32 {
        if self.is_edge(a, b) {
            return f32::NEG_INFINITY;
        }
        let (one, other) = (&self.statistics[a], &self.statistics[b]);
        let mut merged = *one;
        merged.add(other);
        let (of_one, of_other) = (self.neighbours[a], self.neighbours[b]);
        let mut gain = model.label_evidence(&merged) - model.label_evidence(one) - model.label_evidence(other);
        if gain < HOPELESS {
            return gain;
        }
        gain += model.exit_evidence(&merged, (of_one | of_other).len() as u32)
            - model.exit_evidence(one, of_one.len() as u32)
            - model.exit_evidence(other, of_other.len() as u32);
        for neighbour in (of_one & of_other).iter() {
            let statistics = &self.statistics[neighbour];
            let degree = self.degree(neighbour);
            gain += -LN_EDGE + model.exit_evidence(statistics, degree - 1) - model.exit_evidence(statistics, degree);
        }
        gain - LN_VERTEX + f32::from(self.starts) * (ln(self.vertices) - ln(self.vertices.max(2) - 1))
    }

    /// Adds statistics and edges of a vertex to those of another.
    pub(super) fn unite_statistics(&mut self, kept: VertexId, removed: VertexId) {
        let statistics = self.statistics[removed];
        self.statistics[kept].add(&statistics);
        for neighbour in self.neighbours[removed].iter().filter(|&neighbour| neighbour != kept) {
            join(&mut self.neighbours, kept, neighbour);
        }
        self.neighbours.values_mut().iter_mut().for_each(|neighbours| neighbours.remove(removed));
    }
}
