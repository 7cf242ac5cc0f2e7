//! Proposals that merge vertices.

use super::hypothesis::Hypothesis;
use super::proposals::Proposals;
use crate::map::{PerVertex, VertexId, VertexSet32};

/// The scale of label differences between vertices that are merged, in steps.
const MERGE_SCALE_STEPS: f32 = 75.0;

/// The temperature of the draw among merges by their gain.
const MERGE_TEMPERATURE: f32 = 2.0;

/// The longest stretch that is unfolded is one place longer.
const STRETCH: usize = 16;

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

    /// Undoes the folding of one part of a building onto another, which no single split does: gives a stretch of the path
    /// vertices of its own, then merges each with the vertex of the highest gain while there is a gain, but the first one not
    /// with the vertex it was.
    pub(super) fn unfold(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let len = self.history.len();
        let length = 2 + self.below(STRETCH);
        let first = self.below(len);
        let mut own = PerVertex::<Option<VertexId>, V>::filled(None);
        let old = hypothesis.vertices;
        let pivot = hypothesis.vertex_of(first);
        for (index, observation) in self.history.iter().enumerate().skip(first).take(length) {
            if observation.starts_sequence() && index > first {
                break;
            }
            let Some(vertex) = hypothesis.vertex_of(index) else { break };
            if own[vertex].is_none() {
                let Some(next) = hypothesis.next_vertex() else { break };
                own[vertex] = Some(next);
                hypothesis.vertices += 1;
            }
            hypothesis.set_vertex_of(index, own[vertex].unwrap_or(vertex));
        }
        if hypothesis.vertices == old {
            return false;
        }
        hypothesis.recount(self.model, self.history);
        let own_pivot = pivot.and_then(|pivot| own[pivot]);
        loop {
            let mut best = None;
            let mut highest = 0.0;
            for removed in hypothesis.vertices().skip(old.into()) {
                if hypothesis.statistics[removed].visits == 0 {
                    continue;
                }
                for kept in VertexId::first(removed.index()) {
                    let is_pivot = Some(kept) == pivot && Some(removed) == own_pivot;
                    if is_pivot || hypothesis.statistics[kept].visits == 0 {
                        continue;
                    }
                    let gain = hypothesis.merge_gain(self.model, kept, removed);
                    if gain > highest {
                        (highest, best) = (gain, Some((kept, removed)));
                    }
                }
            }
            let Some((kept, removed)) = best else { break };
            hypothesis.unite(kept, removed, len);
        }
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
