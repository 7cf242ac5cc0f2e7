//! The distinct hypotheses, ranked: growing them by one place, and taking in one that a move made.

use super::hypothesis::Hypothesis;
use super::prices::Prices;
use super::record::{Entry, Record};

/// A hypothesis this far below the best one has no place even where there is room, in nats.
const UNLIKELY: f32 = 1000.0;

/// A hypothesis to be: a parent, and the vertex that its newest place is taken for.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    score: f32,
    gain: f32,
    key: u32,
    /// The slot of the parent.
    parent: u8,
    vertex: u8,
}

const NONE: Candidate = Candidate { score: f32::NEG_INFINITY, gain: 0.0, key: 0, parent: 0, vertex: 0 };

/// Up to `N` hypotheses of which no two have the same map and place.
#[derive(Clone, Debug)]
pub(crate) struct Beam<const N: usize, const V: usize, const T: usize> {
    slots: [Hypothesis<V, T>; N],
    /// The slots of the hypotheses, the best first; behind `len` the free ones.
    order: [u8; N],
    len: usize,
}

impl<const N: usize, const V: usize, const T: usize> Beam<N, V, T> {
    pub(crate) const fn new() -> Self {
        Self { slots: [Hypothesis::NONE; N], order: [0; N], len: 0 }
    }

    /// Begins with the hypothesis that knows nothing.
    pub(crate) fn clear(&mut self) {
        for (number, slot) in (0..).zip(&mut self.order) {
            *slot = number;
        }
        self.len = 1;
        if let Some(first) = self.slots.first_mut() {
            first.clear();
        }
    }

    /// Begins with one hypothesis.
    pub(crate) fn begin_with(&mut self, hypothesis: &Hypothesis<V, T>) {
        self.clear();
        if let Some(first) = self.slots.first_mut() {
            first.clone_from(hypothesis);
        }
    }

    /// Begins with no hypothesis, for those that are [appended](Beam::append).
    #[cfg(feature = "snapshot")]
    pub(crate) fn begin_empty(&mut self) {
        self.clear();
        self.len = 0;
    }

    /// Puts a hypothesis behind the others; one with the map and place of another, or without room, is left out.
    #[cfg(feature = "snapshot")]
    pub(crate) fn append(&mut self, hypothesis: &Hypothesis<V, T>) {
        let key = hypothesis.key();
        if self.len < N && self.iter().all(|held| held.key() != key) {
            self.len += 1;
            if let Some(slot) = self.get_mut(self.len - 1) {
                slot.clone_from(hypothesis);
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn get(&self, rank: usize) -> Option<&Hypothesis<V, T>> {
        let slot = self.order.get(..self.len)?.get(rank)?;
        self.slots.get(usize::from(*slot))
    }

    pub(crate) fn get_mut(&mut self, rank: usize) -> Option<&mut Hypothesis<V, T>> {
        let slot = self.order.get(..self.len)?.get(rank)?;
        self.slots.get_mut(usize::from(*slot))
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Hypothesis<V, T>> {
        self.order.iter().take(self.len).filter_map(|&slot| self.slots.get(usize::from(slot)))
    }

    pub(crate) fn each(&mut self, mut change: impl FnMut(&mut Hypothesis<V, T>)) {
        for &slot in self.order.iter().take(self.len) {
            if let Some(hypothesis) = self.slots.get_mut(usize::from(slot)) {
                change(hypothesis);
            }
        }
    }

    /// Forgets all hypotheses but the best one.
    pub(crate) fn keep_best(&mut self) {
        self.len = self.len.min(1);
    }

    /// The score that a new hypothesis has to exceed.
    pub(crate) fn threshold(&self, wanted: usize) -> f32 {
        let worst = self.get(self.len.saturating_sub(1)).filter(|_| self.len >= wanted.min(N));
        let best = self.get(0).map_or(f32::NEG_INFINITY, Hypothesis::score);
        worst.map_or(best - UNLIKELY, Hypothesis::score)
    }

    /// Restores the order by score.
    pub(crate) fn sort(&mut self) {
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

    /// Takes the newest observation, number `index` of the record: of all predictions of all hypotheses the best `wanted`
    /// distinct ones live on. When the map is `fixed` they differ in the place alone. Tells whether the best hypothesis
    /// would have had another vertex if there had been room. Cost: O(N · V) predictions.
    pub(crate) fn grow(
        &mut self,
        prices: &Prices,
        record: &Record<T>,
        (index, entry): (usize, Entry),
        wanted: usize,
        fixed: bool,
    ) -> bool {
        let mut chosen = [NONE; N];
        let mut count = 0;
        let wanted = wanted.min(N);
        let mut missed = f32::NEG_INFINITY;
        for &slot in self.order.iter().take(self.len) {
            let Some(parent) = self.slots.get(usize::from(slot)) else { continue };
            let vertices = if fixed { parent.vertices } else { parent.vertices + 1 };
            for vertex in 0..vertices {
                // A place is never its own neighbour, unless there is no other.
                if vertex == parent.place && !entry.begins() && vertices > 1 {
                    continue;
                }
                let (gain, key) = if fixed {
                    parent.arrival(prices, record, index, entry, vertex)
                } else {
                    parent.gain(prices, record, index, entry, vertex)
                };
                let score = parent.score() + gain;
                if usize::from(vertex) == V {
                    missed = missed.max(score);
                } else {
                    insert(&mut chosen, &mut count, wanted, Candidate { score, gain, key, parent: slot, vertex });
                }
            }
        }
        let lacks_room = count > 0 && chosen.first().is_some_and(|best| missed > best.score);
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
        for (candidate, order) in chosen.iter().take(count).zip(&mut self.order) {
            *order = candidate.parent;
            if let (Some(hypothesis), Some(taken)) =
                (self.slots.get_mut(usize::from(candidate.parent)), taken.get_mut(usize::from(candidate.parent)))
            {
                if fixed {
                    hypothesis.arrive(index, candidate.vertex, candidate.gain);
                } else {
                    hypothesis.extend(prices, record, index, entry, candidate.vertex, candidate.gain);
                }
                *taken = true;
            }
        }
        let free = (0..).zip(&taken).filter(|(_, taken)| !**taken).map(|(slot, _)| slot);
        self.order.iter_mut().skip(count).zip(free).for_each(|(order, slot)| *order = slot);
        self.len = count;
        lacks_room
    }

    /// Takes in a hypothesis: in place of the one with the same map and place if it is better than that, else in a free
    /// slot, else in place of the worst. Tells whether it was taken.
    pub(crate) fn insert(&mut self, hypothesis: &Hypothesis<V, T>, wanted: usize) -> bool {
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

/// Puts a candidate among the best distinct ones.
fn insert<const N: usize>(chosen: &mut [Candidate; N], count: &mut usize, wanted: usize, candidate: Candidate) {
    if *count == wanted && chosen.get(wanted - 1).is_some_and(|worst| candidate.score <= worst.score) {
        return;
    }
    let mut slot = match chosen.iter().take(*count).position(|held| held.key == candidate.key) {
        Some(same) if chosen.get(same).is_some_and(|held| held.score >= candidate.score) => return,
        Some(same) => same,
        None if *count < wanted => {
            *count += 1;
            *count - 1
        }
        None => wanted - 1,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Fingerprint, Observation, RobustConfig};
    use std::collections::BTreeSet;

    const WANTED: usize = 6;

    fn check(beam: &Beam<6, 5, 32>) {
        let keys: BTreeSet<u32> = beam.iter().map(Hypothesis::key).collect();
        assert_eq!(keys.len(), beam.len(), "no two have the same map and place");
        assert!(beam.iter().is_sorted_by(|better, worse| better.score() >= worse.score()));
        let slots: BTreeSet<u8> = beam.order.iter().copied().collect();
        assert_eq!(slots.len(), 6, "every slot is ranked once: {:?}", beam.order);
    }

    #[test]
    fn hypotheses_are_distinct_ranked_and_as_good_as_counted_anew() {
        let mut prices = Prices::new();
        prices.configure(&RobustConfig::DEFAULT);
        let mut record = Record::<32>::new();
        let mut beam = Box::new(Beam::<6, 5, 32>::new());
        beam.clear();
        for index in 0..32 {
            let steps = 500 + 60 * (index as u16 * 7 % 4) + index as u16 % 5;
            let observation = Observation::new(Fingerprint::from_steps(steps).unwrap());
            record.push(&Observation { starts_sequence: index % 12 == 0, degree: Some(2), ..observation });
            let entry = record.get(index).unwrap();
            beam.grow(&prices, &record, (index, entry), WANTED, false);
            check(&beam);
            for rank in 0..beam.len() {
                // As a move does: another vertex for one place, which may give a map that is there already.
                let mut other = *beam.get(rank).unwrap();
                let (evidence, key) = (other.evidence, other.key());
                other.rebuild(&prices, &record);
                assert!((other.evidence - evidence).abs() < 1e-2, "{} {evidence}", other.evidence);
                assert_eq!(other.key(), key);
                other.path[index / 2] = other.path[index / 3];
                other.rebuild(&prices, &record);
                if (0..5).all(|vertex| !other.is_edge(vertex, vertex)) {
                    beam.insert(&other, WANTED);
                }
                check(&beam);
            }
        }
        assert_eq!(beam.len(), WANTED);
    }

    #[test]
    fn an_equal_map_is_taken_in_only_when_it_is_better_and_in_place_of_the_other() {
        let mut beam = Box::new(Beam::<6, 5, 32>::new());
        beam.clear();
        let mut same = *beam.get(0).unwrap();
        assert!(!beam.insert(&same, WANTED));
        same.evidence = 1.0;
        assert!(beam.insert(&same, WANTED));
        assert_eq!((beam.len(), beam.get(0).map(Hypothesis::score)), (1, Some(1.0)));
        same.evidence = 0.5;
        assert!(!beam.insert(&same, WANTED));
        same.place = 1;
        assert!(beam.insert(&same, WANTED));
        assert_eq!(beam.len(), 2);
    }
}
