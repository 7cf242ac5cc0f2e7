//! Moves that split: some of the visits of a vertex become a vertex of their own.

use super::hypothesis::{Hypothesis, NOWHERE};
use super::moves::Workshop;
use rand_core::Rng;

/// How many neighbours of a vertex are parted into groups; further ones stay with the first group.
const GROUPED: usize = 8;

impl<const V: usize, const T: usize> Workshop<'_, V, T> {
    /// The neighbours of a vertex are parted into two groups between which the robot seldom passed, and the visits from
    /// and to one of the groups become a vertex of their own.
    pub(super) fn split_by_context(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
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
    pub(super) fn split_by_label(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
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
}
