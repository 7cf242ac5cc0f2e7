//! The beam: the best distinct hypotheses of a filter, ranked.

use crate::top_k::{TopK, insertion_sort};

/// A hypothesis this far below the best one is not kept even where there is room, in nats.
const UNLIKELY: f32 = 1000.0;

/// A hypothesis of a beam.
pub(crate) trait Ranked: Clone {
    /// What a slot holds that was never used.
    const UNUSED: Self;

    /// Becomes the hypothesis before the first observation.
    fn clear(&mut self);

    /// The logarithm of its weight.
    fn score(&self) -> f32;

    /// Identifies its map and the place of the robot.
    fn key(&self) -> u32;
}

/// How a hypothesis can continue.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate<C> {
    /// The score of the child.
    pub(crate) score: f32,
    /// The key of the child.
    pub(crate) key: u32,
    /// The slot of the hypothesis.
    pub(crate) parent: u8,
    pub(crate) choice: C,
}

impl<C: Copy> Candidate<C> {
    /// The best candidates; `filler` is any choice.
    pub(crate) const fn none<const N: usize>(filler: C) -> TopK<Self, N> {
        TopK::new(Self { score: f32::NEG_INFINITY, key: 0, parent: 0, choice: filler })
    }

    fn goes_first(one: &Self, other: &Self) -> bool {
        one.score >= other.score
    }

    /// Inserts the candidate into the best `wanted` ones, of which no two have the same key.
    pub(crate) fn insert_into<const N: usize>(self, chosen: &mut TopK<Self, N>, wanted: usize) {
        let is_full = chosen.as_slice().len() >= wanted.min(N);
        if is_full && chosen.as_slice().last().is_some_and(|worst| Self::goes_first(worst, &self)) {
            return;
        }
        match chosen.as_slice().iter().position(|held| held.key == self.key) {
            Some(same) if chosen.as_slice().get(same).is_some_and(|held| Self::goes_first(held, &self)) => {}
            Some(same) => chosen.replace(same, self, Self::goes_first),
            None => chosen.insert_within(wanted, self, Self::goes_first),
        }
    }
}

/// Up to `N` hypotheses, of which no two have the same key.
#[derive(Clone, Debug)]
pub(crate) struct Beam<H, const N: usize> {
    slots: [H; N],
    /// The slots of the hypotheses, the best first; after `len` the free ones.
    order: [u8; N],
    len: usize,
}

impl<H: Ranked, const N: usize> Beam<H, N> {
    pub(crate) const fn new() -> Self {
        Self { slots: [H::UNUSED; N], order: [0; N], len: 0 }
    }

    /// Starts with the hypothesis before the first observation.
    pub(crate) fn clear(&mut self) {
        for (number, slot) in (0..).zip(&mut self.order) {
            *slot = number;
        }
        self.len = 1;
        if let Some(first) = self.slots.first_mut() {
            first.clear();
        }
    }

    /// Starts with one hypothesis.
    pub(crate) fn start_with(&mut self, hypothesis: &H) {
        self.clear();
        if let Some(first) = self.slots.first_mut() {
            first.clone_from(hypothesis);
        }
    }

    /// Starts without a hypothesis, for those that are [appended](Beam::append).
    #[cfg(feature = "snapshot")]
    pub(crate) fn start_empty(&mut self) {
        self.clear();
        self.len = 0;
    }

    /// Appends a hypothesis, unless the beam is full or has one with the same key.
    #[cfg(feature = "snapshot")]
    pub(crate) fn append(&mut self, hypothesis: &H) {
        let key = hypothesis.key();
        if self.len < N && self.iter().all(|held| held.key() != key) {
            self.len += 1;
            if let Some(slot) = self.get_mut(self.len - 1) {
                slot.clone_from(hypothesis);
            }
        }
    }

    /// How many hypotheses there are.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no hypothesis: the filter was not started.
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The best hypothesis.
    pub(crate) fn best(&self) -> Option<&H> {
        self.get(0)
    }

    /// The best hypothesis.
    pub(crate) fn best_mut(&mut self) -> Option<&mut H> {
        self.get_mut(0)
    }

    /// The hypothesis of a rank, the best at 0.
    pub(crate) fn get(&self, rank: usize) -> Option<&H> {
        let slot = self.order.get(..self.len)?.get(rank)?;
        self.slots.get(usize::from(*slot))
    }

    fn get_mut(&mut self, rank: usize) -> Option<&mut H> {
        let slot = self.order.get(..self.len)?.get(rank)?;
        self.slots.get_mut(usize::from(*slot))
    }

    /// The hypotheses, the best first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &H> {
        self.parents().map(|(_, hypothesis)| hypothesis)
    }

    /// The hypotheses with their slots, the best first.
    pub(crate) fn parents(&self) -> impl Iterator<Item = (u8, &H)> {
        let slots = self.order.iter().take(self.len);
        slots.filter_map(|&slot| Some((slot, self.slots.get(usize::from(slot))?)))
    }

    /// The slots, those of the hypotheses first.
    #[cfg(test)]
    pub(crate) const fn slots_by_rank(&self) -> &[u8; N] {
        &self.order
    }

    /// Changes each hypothesis, the best first. [`Beam::sort`] restores the order.
    pub(crate) fn for_each(&mut self, mut change: impl FnMut(&mut H)) {
        for &slot in self.order.iter().take(self.len) {
            if let Some(hypothesis) = self.slots.get_mut(usize::from(slot)) {
                change(hypothesis);
            }
        }
    }

    /// Drops all hypotheses but the best one.
    pub(crate) fn keep_best(&mut self) {
        self.len = self.len.min(1);
    }

    /// The score that a new hypothesis must exceed, if the beam holds `wanted` hypotheses.
    pub(crate) fn threshold(&self, wanted: usize) -> f32 {
        let worst = self.get(self.len.saturating_sub(1)).filter(|_| self.len >= wanted.min(N));
        let best = self.best().map_or(f32::NEG_INFINITY, H::score);
        worst.map_or(best - UNLIKELY, H::score)
    }

    /// Restores the order by score.
    pub(crate) fn sort(&mut self) {
        let Self { slots, order, len } = self;
        let score = |slot: u8| slots.get(usize::from(slot)).map_or(f32::NEG_INFINITY, H::score);
        insertion_sort(order.get_mut(..*len).unwrap_or(&mut []), |&one, &other| score(one) >= score(other));
    }

    /// Replaces the hypotheses by the children of the candidates, the best first; `extend` makes a copy of the parent the child
    /// of the rank.
    pub(crate) fn replace<C: Copy>(
        &mut self,
        candidates: &mut TopK<Candidate<C>, N>,
        mut extend: impl FnMut(&mut H, &C, usize),
    ) {
        let candidates = candidates.as_mut_slice();
        self.assign_slots(candidates);
        for (rank, candidate) in candidates.iter().enumerate() {
            if let Some(hypothesis) = self.slots.get_mut(usize::from(candidate.parent)) {
                extend(hypothesis, &candidate.choice, rank);
            }
        }
    }

    /// Gives each candidate a slot of its own with its parent: all but the last candidate of a parent get a copy, in the slot of
    /// a hypothesis without candidates.
    fn assign_slots<C>(&mut self, candidates: &mut [Candidate<C>]) {
        let mut left = [0_u8; N];
        for candidate in &*candidates {
            if let Some(left) = left.get_mut(usize::from(candidate.parent)) {
                *left += 1;
            }
        }
        let mut is_taken = left.map(|left| left > 0);
        for candidate in &mut *candidates {
            let parent = usize::from(candidate.parent);
            let Some(left) = left.get_mut(parent) else { continue };
            *left -= 1;
            if *left > 0
                && let Some(free) = is_taken.iter().position(|is_taken| !is_taken)
            {
                copy(&mut self.slots, parent, free);
                is_taken.iter_mut().skip(free).take(1).for_each(|is_taken| *is_taken = true);
                candidate.parent = free as u8;
            }
        }
        let taken = candidates.iter().map(|candidate| candidate.parent);
        let free = (0..).zip(&is_taken).filter(|(_, is_taken)| !**is_taken).map(|(slot, _)| slot);
        self.order.iter_mut().zip(taken.chain(free)).for_each(|(order, slot)| *order = slot);
        self.len = candidates.len();
    }

    /// Inserts a hypothesis into a beam of at most `wanted`: in place of the one with the same key if it is better than that, else
    /// in a free slot, else in place of the worst. Returns whether it was inserted.
    pub(crate) fn insert(&mut self, hypothesis: &H, wanted: usize) -> bool {
        let key = hypothesis.key();
        let rank = self.iter().position(|held| held.key() == key);
        let has_room = rank.is_none() && self.len < wanted.min(N);
        if has_room {
            self.len += 1;
        }
        let Some(held) = self.get_mut(rank.unwrap_or(self.len.saturating_sub(1))) else { return false };
        if !has_room && held.score() >= hypothesis.score() {
            return false;
        }
        held.clone_from(hypothesis);
        self.sort();
        true
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
