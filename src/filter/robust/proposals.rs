//! Refinement proposals: changes of a hypothesis that may explain the history better.

use super::forward::Forward;
use super::history::ObservationHistory;
use super::hmm::{Emissions, Hmm};
use super::hypothesis::Hypothesis;
use super::lattice::Lattice;
use super::model::Model;
use super::viterbi::Viterbi;
use crate::filter::beam::Ranked as _;
use crate::map::{VertexId, VertexSet32};
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// How often a step decodes: the decoding of the proposal itself, if it has one, then others as long as they improve it.
const DECODINGS: u8 = 2;

/// A proposal that is this far below the worst hypothesis is dropped before the bound of its other paths is updated, in nats.
const SLACK: f32 = 6.0;

/// The state and the working memory of the proposals.
pub(super) struct Proposals<'a, const V: usize, const T: usize> {
    pub(super) model: &'a Model,
    pub(super) history: &'a ObservationHistory<T>,
    pub(super) hmm: &'a mut Hmm<V>,
    pub(super) lattice: &'a mut Lattice,
    pub(super) viterbi: &'a mut Viterbi<T>,
    pub(super) forward: &'a mut Forward<V>,
    pub(super) random: &'a mut Xoshiro128PlusPlus,
    /// The score that a proposal must exceed.
    pub(super) threshold: f32,
    /// How often this step has decoded.
    pub(super) decodings: u8,
}

impl<const V: usize, const T: usize> Proposals<'_, V, T> {
    /// A random number below a bound; 0 when the bound is 0.
    pub(super) fn below(&mut self, bound: usize) -> usize {
        ((u64::from(self.random.next_u32()) * bound as u64) >> 32) as usize
    }

    /// A random number from 0 to 1.
    pub(super) fn uniform(&mut self) -> f32 {
        (self.random.next_u32() >> 8) as f32 / (1 << 24) as f32
    }

    /// A random vertex of a hypothesis.
    pub(super) fn vertex(&mut self, hypothesis: &Hypothesis<V, T>) -> VertexId {
        let number = self.below(hypothesis.vertices.into());
        VertexId::new(number as u8).unwrap_or(VertexId::FIRST)
    }

    /// Changes a hypothesis by a random proposal and decodes its path. Returns whether the proposal is to be kept if its score
    /// is high enough.
    pub(super) fn step(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertices = usize::from(hypothesis.vertices);
        let changed = match self.below(10) {
            0 | 1 if vertices > 2 => self.merge_by_evidence(hypothesis),
            2 if vertices > 2 => self.merge_by_label(hypothesis),
            3 if vertices > 2 => self.delete(hypothesis),
            4 | 5 | 7..=9 if vertices < V => self.split_by_neighbours(hypothesis),
            6 if vertices < V => self.split_by_label(hypothesis),
            _ => {
                self.decode(hypothesis, VertexSet32::ALL, true);
                true
            }
        };
        changed && self.finish(hypothesis)
    }

    /// Computes what follows from a changed path, and decodes it. Returns whether the result is to be kept if its score is high enough.
    pub(super) fn finish(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        // The bound of the other paths stays until it is updated.
        hypothesis.rebuild(self.model, self.history);
        while self.decodings < DECODINGS && self.improve_path(hypothesis) {}
        if hypothesis.score() + SLACK < self.threshold {
            return false;
        }
        self.forward.update_bound(self.lattice, self.model, self.history, self.hmm, hypothesis);
        true
    }

    /// Deletes a vertex; its visits go to other vertices.
    fn delete(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let removed = self.vertex(hypothesis);
        let is_recent = hypothesis.is_recent(removed);
        if is_recent {
            self.decode(hypothesis, VertexSet32::ALL - VertexSet32::from(removed), false);
        }
        is_recent
    }

    /// Decodes the path and keeps the result if its evidence is higher. Returns whether it is.
    fn improve_path(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        // All else follows from the path.
        let before = hypothesis.evidence;
        let path = hypothesis.path;
        self.decode(hypothesis, VertexSet32::ALL, false);
        if hypothesis.path == path {
            return false;
        }
        hypothesis.rebuild(self.model, self.history);
        if hypothesis.evidence > before {
            return true;
        }
        hypothesis.path = path;
        hypothesis.rebuild(self.model, self.history);
        false
    }

    /// Finds the best path through some of the vertices, or, `perturbed`, draws one.
    pub(super) fn decode(&mut self, hypothesis: &mut Hypothesis<V, T>, allowed: VertexSet32, perturbed: bool) {
        self.decodings += 1;
        self.hmm.read(self.model, self.history, hypothesis, Emissions::Predictive);
        let noise = if perturbed { Some(&mut *self.random) } else { None };
        self.viterbi.decode(self.lattice, (self.model, self.history, self.hmm), allowed, noise, hypothesis);
    }
}
