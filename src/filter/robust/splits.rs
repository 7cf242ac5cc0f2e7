//! Moves that split: some of the visits of a vertex become a vertex of their own.

use super::hypothesis::{Hypothesis, NOWHERE};
use super::moves::Workshop;
use super::record::Record;
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
        for Visit { before, after, .. } in visits(self.record, hypothesis, vertex) {
            if before == NOWHERE || after == NOWHERE {
                continue;
            }
            let (a, b) = (number(before), number(after));
            for (a, b) in [(a, b), (b, a)] {
                if let Some(count) = passages.get_mut(a).and_then(|row| row.get_mut(b)) {
                    *count += 1;
                }
            }
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
        self.split(hypothesis, vertex, |&Visit { before, after, index, .. }| {
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
        self.split(hypothesis, vertex, |visit| f32::from(visit.steps) > mean)
    }

    /// Gives the visits that leave a vertex a new one; tells whether there were any.
    fn split(&mut self, hypothesis: &mut Hypothesis<V, T>, vertex: u8, leaves: impl Fn(&Visit) -> bool) -> bool {
        let fresh = hypothesis.vertices;
        let mut leaving = [false; T];
        for visit in visits(self.record, hypothesis, vertex).filter(leaves) {
            if let Some(leaving) = leaving.get_mut(visit.index) {
                *leaving = true;
            }
        }
        let mut moved = false;
        for (slot, _) in hypothesis.path.iter_mut().zip(leaving).filter(|(_, leaving)| *leaving) {
            *slot = fresh;
            moved = true;
        }
        hypothesis.vertices += u8::from(moved);
        moved
    }
}

/// A visit of a vertex.
struct Visit {
    index: usize,
    steps: u16,
    /// The vertices the robot came from and went to; [`NOWHERE`] where a sequence begins or ends.
    before: u8,
    after: u8,
}

/// The visits of a vertex in the record, the oldest first.
fn visits<const V: usize, const T: usize>(
    record: &Record<T>,
    hypothesis: &Hypothesis<V, T>,
    vertex: u8,
) -> impl Iterator<Item = Visit> {
    record.iter().enumerate().filter(move |&(index, _)| hypothesis.at(index) == vertex).map(move |(index, entry)| {
        let before = match index.checked_sub(1) {
            _ if entry.begins() => NOWHERE,
            None => hypothesis.before,
            Some(before) => hypothesis.at(before),
        };
        let goes_on = record.get(index + 1).is_some_and(|next| !next.begins());
        let after = if goes_on { hypothesis.at(index + 1) } else { NOWHERE };
        Visit { index, steps: entry.steps, before, after }
    })
}
