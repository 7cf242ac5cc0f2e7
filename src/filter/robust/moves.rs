//! Repair moves: what turns a hypothesis into another one that may explain the record better.

use super::decode::Decoder;
use super::forward::Forward;
use super::hypothesis::{Hypothesis, NOWHERE};
use super::lattice::{Model, Weighing};
use super::prices::Prices;
use super::record::Record;
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// Labels that differ by much more than this are seldom merged, in steps.
const MERGE_SCALE_STEPS: f32 = 75.0;

/// How far below the best merge, in nats, others are drawn.
const MERGE_TEMPERATURE: f32 = 2.0;

/// The longest stretch that is unfolded, in places.
const STRETCH: usize = 16;

/// How many neighbours of a vertex are parted into groups; further ones stay with the first group.
const GROUPED: usize = 8;

/// How often a path is decoded anew after a move, as long as it gets better.
const REFINEMENTS: usize = 2;

/// What all moves work with.
pub(super) struct Workshop<'a, const V: usize, const T: usize> {
    pub(super) prices: &'a Prices,
    pub(super) record: &'a Record<T>,
    pub(super) model: &'a mut Model<V>,
    pub(super) decoder: &'a mut Decoder<T>,
    pub(super) forward: &'a mut Forward<V>,
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
            0 | 1 if vertices > 2 => self.merge_well(hypothesis),
            2 if vertices > 2 => self.merge(hypothesis),
            3 if vertices > 2 => {
                let gone = self.below(vertices) as u8;
                hypothesis.is_recent(gone) && self.decode(hypothesis, !(1 << gone), false)
            }
            4 | 5 if vertices < V => self.split_by_context(hypothesis),
            6 if vertices < V => self.split_by_label(hypothesis),
            7 | 8 if vertices < V => self.unfold(hypothesis),
            _ => self.decode(hypothesis, u32::MAX, true),
        };
        if changed {
            hypothesis.rebuild(self.prices, self.record);
            self.soften(hypothesis);
            for _ in 0..REFINEMENTS {
                if !self.refine(hypothesis, false) {
                    break;
                }
            }
        }
        changed
    }

    /// Decodes the record anew and keeps what comes out when it is better; tells whether it was.
    fn refine(&mut self, hypothesis: &mut Hypothesis<V, T>, perturbed: bool) -> bool {
        // The path and the place before it tell the hypothesis, as long as no number changes.
        let before = hypothesis.score();
        let path = hypothesis.path;
        self.decode(hypothesis, u32::MAX, perturbed);
        hypothesis.rebuild(self.prices, self.record);
        self.soften(hypothesis);
        if hypothesis.score() > before {
            return true;
        }
        hypothesis.path = path;
        hypothesis.rebuild(self.prices, self.record);
        self.soften(hypothesis);
        false
    }

    /// Computes how much the map of a hypothesis gains from its other paths.
    pub(super) fn soften(&mut self, hypothesis: &mut Hypothesis<V, T>) {
        if self.prices.weight > 0.0 {
            self.model.read(self.prices, self.record, hypothesis, Weighing::Expected);
            hypothesis.surplus =
                self.prices.weight * self.forward.surplus(self.prices, self.record, self.model, hypothesis);
        }
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

    /// Merges two vertices that are no neighbours, drawn by how well the map does without one of them.
    fn merge_well(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
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
    fn unfold(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
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

    /// The neighbours of a vertex are parted into two groups between which the robot seldom passed, and the visits from
    /// and to one of the groups become a vertex of their own.
    fn split_by_context(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertex = self.below(hypothesis.vertices.into()) as u8;
        let row = hypothesis.row(vertex);
        let degree = row.count_ones() as usize;
        if degree < 2 {
            return false;
        }
        let mut passages = [[0_u16; GROUPED]; GROUPED];
        let number = |neighbour: u8| (row & ((1 << (neighbour & 31)) - 1)).count_ones() as usize;
        let mut before = hypothesis.before;
        for (index, entry) in self.record.iter().enumerate() {
            if entry.begins() {
                before = NOWHERE;
            }
            let here = hypothesis.at(index);
            if here == vertex && before != NOWHERE {
                let goes_on = self.record.get(index + 1).is_some_and(|next| !next.begins());
                let after = hypothesis.at(index + 1);
                if goes_on {
                    let (a, b) = (number(before), number(after));
                    for (a, b) in [(a, b), (b, a)] {
                        if let Some(count) = passages.get_mut(a).and_then(|row| row.get_mut(b)) {
                            *count += 1;
                        }
                    }
                }
            }
            before = here;
        }
        let grouped = degree.min(GROUPED);
        let first = self.below(grouped);
        let count = |a: usize, b: usize| passages.get(a).and_then(|row| row.get(b)).copied().unwrap_or(0);
        let offset = self.below(grouped);
        // The neighbour least connected with the first one by passages, in proportion to its own.
        let total = |a: usize| (0..grouped).map(|b| f32::from(count(a, b))).sum::<f32>() + 1.0;
        let mut second = (f32::INFINITY, first);
        for number in (0..grouped).map(|number| (number + offset) % grouped).filter(|&number| number != first) {
            let share = f32::from(count(first, number)) / total(number);
            if share < second.0 {
                second = (share, number);
            }
        }
        let second = second.1;
        let mut group = 1_u32 << second;
        for _ in 0..2 {
            for number in (0..grouped).filter(|&number| number != first && number != second) {
                let mut with = [0.0_f32; 2];
                for other in (0..grouped).filter(|&other| other != number) {
                    let side = (group >> other & 1) as usize;
                    if let Some(with) = with.get_mut(side) {
                        *with += f32::from(count(number, other)) / total(other);
                    }
                }
                let [stays, leaves] = with;
                if leaves > stays || leaves == stays && self.random.next_u32() >> 31 == 1 {
                    group |= 1 << number;
                } else {
                    group &= !(1 << number);
                }
            }
        }
        let coin = self.random.next_u32();
        self.split(hypothesis, vertex, |before, after, index, _| {
            let side = |neighbour: u8| neighbour != NOWHERE && group >> (number(neighbour) & 31) & 1 == 1;
            match (before, after) {
                (NOWHERE, after) => side(after),
                (before, NOWHERE) => side(before),
                (before, after) if side(before) == side(after) => side(after),
                _ => coin.rotate_left(index as u32).wrapping_mul(0x9E37_79B9) >> 31 == 1,
            }
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
