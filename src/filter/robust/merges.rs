//! Moves that merge: two vertices become one, or a stretch of the path is told apart and merged anew.

use super::hypothesis::{Hypothesis, NOWHERE};
use super::moves::Workshop;

/// Labels that differ by much more than this are seldom merged, in steps.
const MERGE_SCALE_STEPS: f32 = 75.0;

/// How far below the best merge, in nats, others are drawn.
const MERGE_TEMPERATURE: f32 = 2.0;

/// The longest stretch that is unfolded, in places.
const STRETCH: usize = 16;

impl<const V: usize, const T: usize> Workshop<'_, V, T> {
    /// Merges two vertices that are no neighbours, drawn by how well the map does without one of them.
    pub(super) fn merge_well(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let mut best = (f32::NEG_INFINITY, 0, 0);
        for kept in 0..hypothesis.vertices {
            for gone in kept + 1..hypothesis.vertices {
                let gain = hypothesis.merge_gain(self.prices, kept, gone);
                if gain == f32::NEG_INFINITY {
                    continue;
                }
                let drawn = gain / MERGE_TEMPERATURE - libm::logf(-libm::logf(self.uniform() + 1e-7));
                if drawn > best.0 {
                    best = (drawn, kept, gone);
                }
            }
        }
        if best.0 == f32::NEG_INFINITY {
            return false;
        }
        hypothesis.merge(best.1, best.2, self.record.len());
        true
    }

    /// A stretch of the path gets vertices of its own, which are then merged with others as long as that pays, but one of
    /// them not with the vertex it was part of: this undoes the folding of one part of a building onto another.
    pub(super) fn unfold(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let len = self.record.len();
        let length = 2 + self.below(STRETCH);
        let first = self.below(len);
        let mut fresh = [NOWHERE; 32];
        let old = hypothesis.vertices;
        let pivot = hypothesis.at(first);
        for (index, entry) in self.record.iter().enumerate().skip(first).take(length) {
            if entry.begins() && index > first {
                break;
            }
            let Some(vertex) = hypothesis.path.get_mut(index) else { break };
            let Some(name) = fresh.get_mut(usize::from(*vertex)) else { break };
            if *name == NOWHERE {
                if usize::from(hypothesis.vertices) == V {
                    break;
                }
                *name = hypothesis.vertices;
                hypothesis.vertices += 1;
            }
            *vertex = *name;
        }
        if hypothesis.vertices == old {
            return false;
        }
        hypothesis.recount(self.prices, self.record);
        let pivot_fresh = fresh.get(usize::from(pivot)).copied().unwrap_or(NOWHERE);
        loop {
            let mut best = (0.0, 0, 0);
            for gone in old..hypothesis.vertices {
                if hypothesis.tally(gone).visits == 0 {
                    continue;
                }
                for kept in 0..gone {
                    let is_pivot = kept == pivot && gone == pivot_fresh;
                    if is_pivot || hypothesis.tally(kept).visits == 0 {
                        continue;
                    }
                    let gain = hypothesis.merge_gain(self.prices, kept, gone);
                    if gain > best.0 {
                        best = (gain, kept, gone);
                    }
                }
            }
            if best.0 <= 0.0 {
                break;
            }
            hypothesis.unite(best.1, best.2, len);
        }
        true
    }

    /// Merges a vertex with one that has a similar label.
    pub(super) fn merge(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertices = hypothesis.vertices;
        let kept = self.below(vertices.into()) as u8;
        let mean = hypothesis.tally(kept).mean();
        let weight = |other: u8| {
            let off = (hypothesis.tally(other).mean() - mean) / MERGE_SCALE_STEPS;
            if other == kept { 0.0 } else { libm::expf(-off * off) }
        };
        let total: f32 = (0..vertices).map(weight).sum();
        let mut target = self.uniform() * total;
        let gone = (0..vertices).find(|&other| {
            target -= weight(other);
            other != kept && target <= 0.0
        });
        let Some(gone) = gone else { return false };
        if hypothesis.settled_row(kept) >> gone & 1 == 1 {
            return false;
        }
        let are_adjacent = hypothesis.is_edge(kept, gone);
        let len = self.record.len();
        hypothesis.merge(kept, gone, len);
        if are_adjacent {
            // The path would stay at one vertex for two places: it has to be found anew.
            hypothesis.tally_merged(kept, gone);
            self.decode(hypothesis, !(1 << gone), false);
        }
        true
    }
}
