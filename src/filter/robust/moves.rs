//! Repair moves: what turns a hypothesis into another one that may explain the record better.

use super::decode::Decoder;
use super::forward::Forward;
use super::hypothesis::Hypothesis;
use super::lattice::{Model, Weighing};
use super::prices::Prices;
use super::record::Record;
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// How often a path is decoded anew after a move, as long as it gets better.
const REFINEMENTS: usize = 2;

/// A hypothesis this far below the worst one is dropped before it is known what its other paths add, in nats.
const SLACK: f32 = 6.0;

/// What all moves work with.
pub(super) struct Workshop<'a, const V: usize, const T: usize> {
    pub(super) prices: &'a Prices,
    pub(super) record: &'a Record<T>,
    pub(super) model: &'a mut Model<V>,
    pub(super) decoder: &'a mut Decoder<T>,
    pub(super) forward: &'a mut Forward<V>,
    pub(super) random: &'a mut Xoshiro128PlusPlus,
    /// The score that a hypothesis has to exceed to be kept.
    pub(super) threshold: f32,
}

impl<const V: usize, const T: usize> Workshop<'_, V, T> {
    /// A random number below a bound; 0 when the bound is 0.
    pub(super) fn below(&mut self, bound: usize) -> usize {
        ((u64::from(self.random.next_u32()) * bound as u64) >> 32) as usize
    }

    pub(super) fn uniform(&mut self) -> f32 {
        (self.random.next_u32() >> 8) as f32 / (1 << 24) as f32
    }

    /// Changes a hypothesis by a random move; tells whether there was one to make.
    pub(super) fn change(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertices = usize::from(hypothesis.vertices);
        let changed = match self.below(10) {
            0 | 1 if vertices > 2 => self.merge_well(hypothesis),
            2 if vertices > 2 => self.merge(hypothesis),
            3 if vertices > 2 => self.delete(hypothesis),
            4 | 5 | 9 if vertices < V => self.split_by_context(hypothesis),
            6 if vertices < V => self.split_by_label(hypothesis),
            7 | 8 if vertices < V => self.unfold(hypothesis),
            _ => {
                self.decode(hypothesis, u32::MAX, true);
                true
            }
        };
        if !changed {
            return false;
        }
        // Until it is computed, what other paths add is taken to be what it was.
        hypothesis.rebuild(self.prices, self.record);
        for _ in 0..REFINEMENTS {
            if !self.refine(hypothesis) {
                break;
            }
        }
        if hypothesis.score() + SLACK < self.threshold {
            return false;
        }
        self.forward.soften(self.prices, self.record, self.model, hypothesis);
        true
    }

    /// Leaves the visits of a vertex to the others.
    fn delete(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let gone = self.below(hypothesis.vertices.into()) as u8;
        let can_go = hypothesis.is_recent(gone);
        if can_go {
            self.decode(hypothesis, !(1 << gone), false);
        }
        can_go
    }

    /// Decodes the record anew and keeps what comes out when it is better; tells whether it was.
    fn refine(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        // The path tells the hypothesis.
        let before = hypothesis.evidence;
        let path = hypothesis.path;
        self.decode(hypothesis, u32::MAX, false);
        hypothesis.rebuild(self.prices, self.record);
        if hypothesis.evidence > before {
            return true;
        }
        hypothesis.path = path;
        hypothesis.rebuild(self.prices, self.record);
        false
    }

    /// Finds the best path, or, perturbed, draws another one; `allowed` is the bit row of the vertices it may visit.
    pub(super) fn decode(&mut self, hypothesis: &mut Hypothesis<V, T>, allowed: u32, perturbed: bool) {
        self.model.read(self.prices, self.record, hypothesis, Weighing::Predictive);
        let random = &mut *self.random;
        let jitter = || {
            if perturbed {
                // Gumbel noise: the best of perturbed sums is a draw.
                let uniform = ((random.next_u32() >> 8) as f32 + 0.5) / (1 << 24) as f32;
                -libm::logf(-libm::logf(uniform))
            } else {
                0.0
            }
        };
        self.decoder.decode(self.prices, self.record, self.model, allowed, hypothesis, jitter);
    }
}
