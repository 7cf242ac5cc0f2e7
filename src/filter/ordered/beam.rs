//! The distinct hypotheses, ranked: growing them by one place, and taking in one that a move made.

use super::choice::{Choice, Gain, Target};
use super::hypothesis::Hypothesis;
use super::model::Model;
use super::record::Record;
use crate::map::NONE;

/// A hypothesis this far below the best one is dropped, in nats.
const UNLIKELY: f32 = 1000.0;

/// Exits that cost more than this are not considered on line, in nats.
const WORST_EXIT: f32 = -8.0;

#[derive(Clone, Copy, Debug)]
struct Candidate {
    score: f32,
    gain: Gain,
    key: u32,
    parent: u8,
    choice: Choice,
}

const EMPTY: Candidate = Candidate {
    score: f32::NEG_INFINITY,
    gain: Gain { labels: 0.0, rest: 0.0 },
    key: 0,
    parent: 0,
    choice: Choice { exit: NONE, target: Target::Known },
};

/// Up to `N` hypotheses. No two have the same map and the same place.
#[derive(Clone, Debug)]
pub(crate) struct Beam<const N: usize, const V: usize, const D: usize, const T: usize> {
    slots: [Hypothesis<V, D, T>; N],
    /// The slots of the hypotheses, the best first; behind `len` the free ones.
    order: [u8; N],
    len: usize,
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> Beam<N, V, D, T> {
    pub(super) const fn new() -> Self {
        Self { slots: [Hypothesis::ZERO; N], order: [0; N], len: 0 }
    }

    /// Starts with the hypothesis that knows nothing.
    pub(super) fn clear(&mut self) {
        for (number, slot) in (0..).zip(&mut self.order) {
            *slot = number;
        }
        self.len = 1;
        if let Some(first) = self.slots.first_mut() {
            first.clear();
        }
    }

    /// Starts with one hypothesis.
    pub(super) fn start_with(&mut self, hypothesis: &Hypothesis<V, D, T>) {
        self.clear();
        if let Some(first) = self.slots.first_mut() {
            first.clone_from(hypothesis);
        }
    }

    /// Drops all hypotheses but the best one.
    pub(super) fn keep_best(&mut self) {
        self.len = self.len.min(1);
    }

    /// Whether the filter was not started.
    /// Starts without any hypothesis; [`Beam::append`] follows.
    #[cfg(feature = "snapshot")]
    pub(crate) fn start_empty(&mut self) {
        self.clear();
        self.len = 0;
    }

    /// Appends a hypothesis that is not better than the last one. A full beam drops it.
    #[cfg(feature = "snapshot")]
    pub(crate) fn append(&mut self, hypothesis: &Hypothesis<V, D, T>) {
        if let Some(slot) = self.slots.get_mut(self.len) {
            slot.clone_from(hypothesis);
            self.len += 1;
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn get(&self, rank: usize) -> Option<&Hypothesis<V, D, T>> {
        let slot = self.order.get(..self.len)?.get(rank)?;
        self.slots.get(usize::from(*slot))
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Hypothesis<V, D, T>> {
        self.order.iter().take(self.len).filter_map(|&slot| self.slots.get(usize::from(slot)))
    }

    pub(super) fn each(&mut self, mut change: impl FnMut(&mut Hypothesis<V, D, T>)) {
        for &slot in self.order.iter().take(self.len) {
            if let Some(hypothesis) = self.slots.get_mut(usize::from(slot)) {
                change(hypothesis);
            }
        }
    }

    /// The score that a new hypothesis has to exceed.
    pub(super) fn threshold(&self) -> f32 {
        let worst = self.get(self.len.saturating_sub(1)).filter(|_| self.len >= N);
        let best = self.get(0).map_or(f32::NEG_INFINITY, Hypothesis::score);
        worst.map_or(best - UNLIKELY, Hypothesis::score)
    }

    /// Restores the order by score.
    pub(super) fn sort(&mut self) {
        let Self { slots, order, len } = self;
        let score = |slot: u8| slots.get(usize::from(slot)).map_or(f32::NEG_INFINITY, Hypothesis::score);
        for end in 1..*len {
            let mut rank = end;
            while let (Some(&before), Some(&here)) = (order.get(rank.wrapping_sub(1)), order.get(rank)) {
                if score(before) >= score(here) {
                    break;
                }
                order.swap(rank - 1, rank);
                rank -= 1;
            }
        }
    }

    /// Takes observation `index` of the record: of all explanations by all hypotheses the best `N` distinct ones stay. Returns
    /// whether the best of all, or a way that was seen, found no room.
    pub(super) fn grow(&mut self, model: &Model, record: &Record<T>, index: usize) -> bool {
        let mut chosen = [EMPTY; N];
        let mut count = 0;
        let mut missed = f32::NEG_INFINITY;
        for &slot in self.order.iter().take(self.len) {
            let Some(parent) = self.slots.get(usize::from(slot)) else { continue };
            parent.propose(model, record, index, WORST_EXIT, |choice, gain| {
                let score = parent.score() + gain.total();
                if parent.has_room(choice) {
                    let key = parent.key_with(choice);
                    insert(&mut chosen, &mut count, Candidate { score, gain, key, parent: slot, choice });
                } else {
                    missed = missed.max(score);
                }
            });
        }
        let mut lacks_room =
            chosen.first().is_none_or(|best| missed > best.score || best.choice.target == Target::OffMap);
        if count == 0 {
            return true;
        }
        let entry = record.get(index);
        self.replace(&mut chosen, count, |hypothesis, candidate, rank| {
            let is_full = hypothesis.extend(&entry, index, candidate.choice, candidate.gain, 0);
            lacks_room |= is_full && rank == 0;
        });
        lacks_room
    }

    /// Replaces the hypotheses by the children of the chosen candidates, the best first; `extend` makes a child of a copy of its
    /// parent.
    fn replace(
        &mut self,
        chosen: &mut [Candidate; N],
        count: usize,
        mut extend: impl FnMut(&mut Hypothesis<V, D, T>, &Candidate, usize),
    ) {
        let mut children = [0_u8; N];
        for candidate in chosen.iter().take(count) {
            if let Some(children) = children.get_mut(usize::from(candidate.parent)) {
                *children += 1;
            }
        }
        // All but the last child of a parent get a copy of it, in the slot of a hypothesis without children.
        let mut left = children;
        let mut free = 0;
        for candidate in chosen.iter_mut().take(count) {
            let parent = usize::from(candidate.parent);
            let Some(left) = left.get_mut(parent) else { continue };
            *left -= 1;
            if *left > 0 {
                while children.get(free).is_some_and(|&children| children > 0) {
                    free += 1;
                }
                copy(&mut self.slots, parent, free);
                candidate.parent = free as u8;
                free += 1;
            }
        }
        let mut taken = [false; N];
        for (rank, (candidate, order)) in chosen.iter().take(count).zip(&mut self.order).enumerate() {
            *order = candidate.parent;
            let slot = usize::from(candidate.parent);
            if let (Some(hypothesis), Some(taken)) = (self.slots.get_mut(slot), taken.get_mut(slot)) {
                extend(hypothesis, candidate, rank);
                *taken = true;
            }
        }
        let free = (0..).zip(&taken).filter(|(_, taken)| !**taken).map(|(slot, _)| slot);
        self.order.iter_mut().skip(count).zip(free).for_each(|(order, slot)| *order = slot);
        self.len = count;
    }

    /// Takes observation `index` of the record for a visit on the map that all hypotheses have.
    pub(super) fn localise(&mut self, model: &Model, record: &Record<T>, index: usize) {
        let mut chosen = [EMPTY; N];
        let mut count = 0;
        for (rank, &slot) in self.order.iter().take(self.len).enumerate() {
            let Some(parent) = self.slots.get(usize::from(slot)) else { continue };
            parent.localisations(model, record, index, rank == 0, |at, gain| {
                let choice = Choice { exit: NONE, target: Target::At(at) };
                let candidate =
                    Candidate { score: parent.score() + gain.total(), gain, key: at.into(), parent: slot, choice };
                insert(&mut chosen, &mut count, candidate);
            });
        }
        self.replace(&mut chosen, count, |hypothesis, candidate, _| {
            if let Target::At(at) = candidate.choice.target {
                hypothesis.follow_to(index, at, candidate.gain);
            }
        });
    }

    /// Takes in a hypothesis: in place of the one with the same map and place if it is better than that, else in a free
    /// slot, else in place of the worst. Returns whether it was taken.
    pub(super) fn insert(&mut self, hypothesis: &Hypothesis<V, D, T>) -> bool {
        let key = hypothesis.key();
        let rank = self.iter().position(|held| held.key() == key);
        let has_room = rank.is_none() && self.len < N;
        if has_room {
            self.len += 1;
        }
        let rank = rank.unwrap_or(self.len.saturating_sub(1));
        let Some(held) = self.order.get(rank).and_then(|&slot| self.slots.get_mut(usize::from(slot))) else {
            return false;
        };
        if !has_room && held.score() >= hypothesis.score() {
            return false;
        }
        held.clone_from(hypothesis);
        self.sort();
        true
    }
}

/// Puts a candidate among the best distinct ones.
fn insert<const N: usize>(chosen: &mut [Candidate; N], count: &mut usize, candidate: Candidate) {
    if *count == N && chosen.get(N - 1).is_some_and(|worst| candidate.score <= worst.score) {
        return;
    }
    let mut slot = match chosen.iter().take(*count).position(|held| held.key == candidate.key) {
        Some(same) if chosen.get(same).is_some_and(|held| held.score >= candidate.score) => return,
        Some(same) => same,
        None if *count < N => {
            *count += 1;
            *count - 1
        }
        None => N - 1,
    };
    while let Some(&before) = slot.checked_sub(1).and_then(|before| chosen.get(before)) {
        if before.score >= candidate.score {
            break;
        }
        if let Some(to) = chosen.get_mut(slot) {
            *to = before;
        }
        slot -= 1;
    }
    if let Some(to) = chosen.get_mut(slot) {
        *to = candidate;
    }
}

fn copy<H: Clone>(slots: &mut [H], from: usize, to: usize) {
    if from == to {
        return;
    }
    let (low, high) = slots.split_at_mut_checked(from.max(to)).unwrap_or((&mut [], &mut []));
    if let (Some(low), Some(high)) = (low.get_mut(from.min(to)), high.first_mut()) {
        if from < to { high.clone_from(low) } else { low.clone_from(high) }
    }
}
