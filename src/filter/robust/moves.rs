//! Repair moves: what turns a hypothesis into another one that may explain the record better.

use super::decode::Decoder;
use super::hypothesis::{Hypothesis, NOWHERE};
use super::lattice::{Model, Weighing};
use super::prices::Prices;
use super::record::Record;
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// Labels that differ by much more than this are seldom merged, in steps.
const MERGE_SCALE_STEPS: f32 = 75.0;

/// What all moves work with.
pub(super) struct Workshop<'a, const V: usize, const T: usize> {
    pub(super) prices: &'a Prices,
    pub(super) record: &'a Record<T>,
    pub(super) model: &'a mut Model<V>,
    pub(super) decoder: &'a mut Decoder<T>,
    pub(super) random: &'a mut Xoshiro128PlusPlus,
}

impl<const V: usize, const T: usize> Workshop<'_, V, T> {
    /// A random number below a bound; 0 when the bound is 0.
    pub(super) fn below(&mut self, bound: usize) -> usize {
        ((u64::from(self.random.next_u32()) * bound as u64) >> 32) as usize
    }

    fn uniform(&mut self) -> f32 {
        (self.random.next_u32() >> 8) as f32 / (1 << 24) as f32
    }

    /// Changes a hypothesis by a random move; tells whether there was one to make.
    pub(super) fn change(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertices = usize::from(hypothesis.vertices);
        let changed = match self.below(10) {
            0..=2 if vertices > 2 => self.merge(hypothesis),
            3 if vertices > 2 => {
                let gone = self.below(vertices) as u8;
                hypothesis.is_recent(gone) && self.decode(hypothesis, !(1 << gone), false)
            }
            4 | 5 if vertices < V => self.split_by_neighbour(hypothesis),
            6 if vertices < V => self.split_by_neighbours(hypothesis),
            7 if vertices < V => self.split_by_label(hypothesis),
            8 => self.decode(hypothesis, u32::MAX, true),
            _ => return self.refine(hypothesis),
        };
        if changed {
            hypothesis.rebuild(self.prices, self.record);
            self.refine(hypothesis);
        }
        changed
    }

    /// Decodes the record anew and keeps what comes out when it is better; tells whether it was.
    fn refine(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        // The path alone tells the hypothesis: it is kept to go back.
        let before = hypothesis.evidence;
        let (path, before_record) = (hypothesis.path, hypothesis.before);
        self.decode(hypothesis, u32::MAX, false);
        hypothesis.rebuild(self.prices, self.record);
        if hypothesis.evidence > before {
            return true;
        }
        let _ = before_record;
        hypothesis.path = path;
        hypothesis.rebuild(self.prices, self.record);
        false
    }

    fn decode(&mut self, hypothesis: &mut Hypothesis<V, T>, allowed: u32, perturbed: bool) -> bool {
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
        true
    }

    /// Merges a vertex with one that has a similar label.
    fn merge(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
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
        let are_adjacent = hypothesis.row(kept) >> gone & 1 == 1;
        let len = self.record.len();
        hypothesis.merge(kept, gone, len);
        if are_adjacent {
            // The path would stay at one vertex for two places: it has to be found anew.
            hypothesis.tally_merged(kept, gone);
            self.decode(hypothesis, !(1 << gone), false);
        }
        true
    }

    /// The visits of a vertex on the way from and to one neighbour become a vertex of their own.
    fn split_by_neighbour(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let Some((vertex, neighbour)) = self.edge(hypothesis) else { return false };
        let coin = self.random.next_u32();
        self.split(hypothesis, vertex, |before, after, index, _| {
            let count = u8::from(before == neighbour) + u8::from(after == neighbour);
            count == 2 || count == 1 && coin.rotate_left(index as u32).wrapping_mul(0x9E37_79B9) >> 31 == 1
        })
    }

    /// The visits of a vertex between two of its neighbours become a vertex of their own.
    fn split_by_neighbours(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let Some((vertex, first)) = self.edge(hypothesis) else { return false };
        let second = self.neighbour(hypothesis, vertex);
        self.split(hypothesis, vertex, |before, after, _, _| {
            (before == first && (after == second || after == NOWHERE))
                || (before == second && (after == first || after == NOWHERE))
                || (before == NOWHERE && (after == first || after == second))
        })
    }

    /// The visits of a vertex with labels above its mean become a vertex of their own.
    fn split_by_label(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertex = self.below(hypothesis.vertices.into()) as u8;
        let mean = hypothesis.tally(vertex).mean();
        self.split(hypothesis, vertex, |_, _, _, steps| f32::from(steps) > mean)
    }

    fn split(
        &mut self,
        hypothesis: &mut Hypothesis<V, T>,
        vertex: u8,
        leaves: impl Fn(u8, u8, usize, u16) -> bool,
    ) -> bool {
        let fresh = hypothesis.vertices;
        let mut before = hypothesis.before;
        let mut moved = 0;
        for index in 0..self.record.len() {
            let Some(entry) = self.record.get(index) else { break };
            if entry.begins() {
                before = NOWHERE;
            }
            let here = hypothesis.at(index);
            if here == vertex {
                let goes_on = self.record.get(index + 1).is_some_and(|next| !next.begins());
                let after = if goes_on { hypothesis.at(index + 1) } else { NOWHERE };
                if leaves(before, after, index, entry.steps) {
                    if let Some(slot) = hypothesis.path.get_mut(index) {
                        *slot = fresh;
                    }
                    moved += 1;
                }
            }
            before = here;
        }
        if moved == 0 {
            return false;
        }
        hypothesis.vertices += 1;
        true
    }

    /// A random vertex and a random neighbour of it.
    fn edge(&mut self, hypothesis: &Hypothesis<V, T>) -> Option<(u8, u8)> {
        let vertex = self.below(hypothesis.vertices.into()) as u8;
        (hypothesis.degree(vertex) > 0).then(|| (vertex, self.neighbour(hypothesis, vertex)))
    }

    fn neighbour(&mut self, hypothesis: &Hypothesis<V, T>, vertex: u8) -> u8 {
        let row = u64::from(hypothesis.row(vertex));
        let number = self.below(row.count_ones() as usize);
        crate::map::bits(row).nth(number).unwrap_or(0)
    }
}
