//! Proposals that merge vertices.

use super::hypothesis::Hypothesis;
use super::proposals::Proposals;
use crate::map::{VertexId, VertexSet32};

/// The scale of label differences between vertices that are merged, in steps.
const MERGE_SCALE_STEPS: f32 = 75.0;

/// The temperature of the draw among merges by their gain.
const MERGE_TEMPERATURE: f32 = 2.0;

impl<const V: usize, const T: usize> Proposals<'_, V, T> {
    /// Merges two vertices that are not neighbours, drawn by [`Hypothesis::merge_gain`]: the highest gain after Gumbel noise.
    pub(super) fn merge_by_evidence(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let mut best = None;
        let mut highest = f32::NEG_INFINITY;
        for kept in hypothesis.vertices() {
            for removed in hypothesis.vertices().skip(kept.index() + 1) {
                let gain = hypothesis.merge_gain(self.model, kept, removed);
                if gain == f32::NEG_INFINITY {
                    continue;
                }
                let drawn = gain / MERGE_TEMPERATURE - libm::logf(-libm::logf(self.uniform() + 1e-7));
                if drawn > highest {
                    (highest, best) = (drawn, Some((kept, removed)));
                }
            }
        }
        let Some((kept, removed)) = best else { return false };
        hypothesis.merge(kept, removed, self.history.len());
        true
    }

    /// Merges a vertex with another, drawn by the similarity of their labels.
    pub(super) fn merge_by_label(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let kept = self.vertex(hypothesis);
        let mean = hypothesis.statistics[kept].mean;
        let weight = |other: VertexId| {
            let off = (hypothesis.statistics[other].mean - mean) / MERGE_SCALE_STEPS;
            if other == kept { 0.0 } else { libm::expf(-off * off) }
        };
        let total: f32 = hypothesis.vertices().map(weight).sum();
        let mut target = self.uniform() * total;
        let removed = hypothesis.vertices().find(|&other| {
            target -= weight(other);
            other != kept && target <= 0.0
        });
        let Some(removed) = removed else { return false };
        if hypothesis.marginalised_neighbours[kept].contains(removed) {
            return false;
        }
        let are_neighbours = hypothesis.is_edge(kept, removed);
        hypothesis.merge(kept, removed, self.history.len());
        if are_neighbours {
            // The path stays at the vertex now, so it has to be decoded.
            hypothesis.unite_statistics(kept, removed);
            self.decode(hypothesis, VertexSet32::ALL - VertexSet32::from(removed), false);
        }
        true
    }
}
