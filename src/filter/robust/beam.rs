//! The beam: the best distinct hypotheses.

use super::history::{ObservationHistory, PackedObservation};
use super::hypothesis::Hypothesis;
use super::model::Model;
use crate::map::VertexId;
use crate::top_k::{TopK, insertion_sort};

/// A hypothesis this far below the best one is not kept even where there is room, in nats.
const UNLIKELY: f32 = 1000.0;

/// A prediction: that the newest observation of a hypothesis belongs to a vertex.
#[derive(Clone, Copy, Debug)]
struct Prediction {
    score: f32,
    gain: f32,
    key: u32,
    /// The slot of the hypothesis.
    parent: u8,
    vertex: VertexId,
}

impl Prediction {
    const NONE: Self = Self { score: f32::NEG_INFINITY, gain: 0.0, key: 0, parent: 0, vertex: VertexId::FIRST };
}

/// Up to `N` hypotheses, of which no two have the same map and vertex of the robot.
#[derive(Clone, Debug)]
pub(crate) struct Beam<const N: usize, const V: usize, const T: usize> {
    slots: [Hypothesis<V, T>; N],
    /// The slots of the hypotheses, the best first; after `len` the free ones.
    order: [u8; N],
    len: usize,
}

impl<const N: usize, const V: usize, const T: usize> Beam<N, V, T> {
    pub(crate) const fn new() -> Self {
        Self { slots: [Hypothesis::EMPTY; N], order: [0; N], len: 0 }
    }

    /// Starts with the empty hypothesis.
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
    pub(crate) fn start_with(&mut self, hypothesis: &Hypothesis<V, T>) {
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

    /// Appends a hypothesis, unless the beam is full or has one with the same map and vertex of the robot.
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

    /// How many hypotheses there are.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// The best hypothesis.
    pub(crate) fn best(&self) -> Option<&Hypothesis<V, T>> {
        self.get(0)
    }

    /// The best hypothesis.
    pub(crate) fn best_mut(&mut self) -> Option<&mut Hypothesis<V, T>> {
        self.get_mut(0)
    }

    /// The hypothesis of a rank, the best at 0.
    pub(crate) fn get(&self, rank: usize) -> Option<&Hypothesis<V, T>> {
        let slot = self.order.get(..self.len)?.get(rank)?;
        self.slots.get(usize::from(*slot))
    }

    /// The hypothesis of a rank, the best at 0.
    pub(crate) fn get_mut(&mut self, rank: usize) -> Option<&mut Hypothesis<V, T>> {
        let slot = self.order.get(..self.len)?.get(rank)?;
        self.slots.get_mut(usize::from(*slot))
    }

    /// The hypotheses, the best first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Hypothesis<V, T>> {
        self.order.iter().take(self.len).filter_map(|&slot| self.slots.get(usize::from(slot)))
    }

    /// Changes each hypothesis, the best first. [`Beam::sort`] restores the order.
    pub(crate) fn for_each(&mut self, mut change: impl FnMut(&mut Hypothesis<V, T>)) {
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

    /// The score that a new hypothesis must exceed.
    pub(crate) fn threshold(&self, wanted: usize) -> f32 {
        let worst = self.get(self.len.saturating_sub(1)).filter(|_| self.len >= wanted.min(N));
        let best = self.best().map_or(f32::NEG_INFINITY, Hypothesis::score);
        worst.map_or(best - UNLIKELY, Hypothesis::score)
    }

    /// Restores the order by score.
    pub(crate) fn sort(&mut self) {
        let Self { slots, order, len } = self;
        let score = |slot: u8| slots.get(usize::from(slot)).map_or(f32::NEG_INFINITY, Hypothesis::score);
        insertion_sort(order.get_mut(..*len).unwrap_or(&mut []), |&one, &other| score(one) >= score(other));
    }

    /// Adds the newest observation, number `index` of the history: the best `wanted` distinct predictions of all hypotheses
    /// become the hypotheses. When the map is `fixed` they differ in the vertex of the robot alone. Returns whether the best
    /// prediction had no room for its vertex. Cost: O(N · V) predictions.
    pub(crate) fn grow(
        &mut self,
        model: &Model,
        history: &ObservationHistory<T>,
        newest: (usize, PackedObservation),
        wanted: usize,
        fixed: bool,
    ) -> bool {
        let mut chosen = TopK::<Prediction, N>::new(Prediction::NONE);
        let mut without_room = f32::NEG_INFINITY;
        for &slot in self.order.iter().take(self.len) {
            let Some(parent) = self.slots.get(usize::from(slot)) else { continue };
            let has_other = parent.vertices > 1 || !fixed && parent.vertices > 0;
            let new_vertex = if fixed { None } else { Some(None) };
            for vertex in parent.vertices().map(Some).chain(new_vertex) {
                // No path stays at a vertex, unless there is no other.
                if has_other && vertex.is_some() && vertex == parent.at && !newest.1.starts_sequence() {
                    continue;
                }
                let (gain, key) = match vertex {
                    Some(vertex) if fixed => parent.localisation_gain(model, history, newest, vertex),
                    _ => parent.gain(model, history, newest, vertex),
                };
                let score = parent.score() + gain;
                match vertex.or(parent.next_vertex()) {
                    Some(vertex) => {
                        insert_distinct(&mut chosen, wanted, Prediction { score, gain, key, parent: slot, vertex });
                    }
                    None => without_room = without_room.max(score),
                }
            }
        }
        let lacks_room = chosen.as_slice().first().is_some_and(|best| without_room > best.score);
        self.assign_slots(chosen.as_mut_slice());
        for prediction in chosen.as_slice() {
            if let Some(hypothesis) = self.slots.get_mut(usize::from(prediction.parent)) {
                if fixed {
                    hypothesis.localise(newest.0, prediction.vertex, prediction.gain);
                } else {
                    hypothesis.extend(model, history, newest, prediction.vertex, prediction.gain);
                }
            }
        }
        lacks_room
    }

    /// Gives each prediction a slot of its own with its parent: all but the last prediction of a parent get a copy, in the slot
    /// of a hypothesis without predictions.
    fn assign_slots(&mut self, predictions: &mut [Prediction]) {
        let mut left = [0_u8; N];
        for prediction in &*predictions {
            if let Some(left) = left.get_mut(usize::from(prediction.parent)) {
                *left += 1;
            }
        }
        let mut is_taken = left.map(|left| left > 0);
        for prediction in &mut *predictions {
            let parent = usize::from(prediction.parent);
            let Some(left) = left.get_mut(parent) else { continue };
            *left -= 1;
            if *left > 0
                && let Some(free) = is_taken.iter().position(|is_taken| !is_taken)
            {
                copy(&mut self.slots, parent, free);
                is_taken.iter_mut().skip(free).take(1).for_each(|is_taken| *is_taken = true);
                prediction.parent = free as u8;
            }
        }
        let taken = predictions.iter().map(|prediction| prediction.parent);
        let free = (0..).zip(&is_taken).filter(|(_, is_taken)| !**is_taken).map(|(slot, _)| slot);
        self.order.iter_mut().zip(taken.chain(free)).for_each(|(order, slot)| *order = slot);
        self.len = predictions.len();
    }

    /// Inserts a hypothesis: in place of the one with the same map and vertex of the robot if it is better than that, else in a
    /// free slot, else in place of the worst. Returns whether it was inserted.
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

/// Inserts a prediction into the best ones, of which no two have the same key.
fn insert_distinct<const N: usize>(chosen: &mut TopK<Prediction, N>, wanted: usize, prediction: Prediction) {
    let goes_first = |one: &Prediction, other: &Prediction| one.score >= other.score;
    let is_full = chosen.as_slice().len() >= wanted.min(N);
    if is_full && chosen.as_slice().last().is_some_and(|worst| goes_first(worst, &prediction)) {
        return;
    }
    match chosen.as_slice().iter().position(|held| held.key == prediction.key) {
        Some(same) if chosen.as_slice().get(same).is_some_and(|held| goes_first(held, &prediction)) => {}
        Some(same) => chosen.replace(same, prediction, goes_first),
        None => chosen.insert_within(wanted, prediction, goes_first),
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
    use crate::filter::{Observation, RobustConfig, Ways};
    use crate::place::Fingerprint;
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
    fn hypotheses_are_distinct_ranked_and_have_the_evidence_that_a_recount_gives() {
        let mut model = Model::new();
        model.configure(&RobustConfig::DEFAULT);
        let mut history = ObservationHistory::<32>::new();
        let mut beam = Box::new(Beam::<6, 5, 32>::new());
        beam.clear();
        for index in 0..32 {
            let steps = 500 + 60 * (index as u16 * 7 % 4) + index as u16 % 5;
            let observation = Observation::new(Fingerprint::from_steps(steps).unwrap());
            history.push(&Observation {
                starts_sequence: index % 12 == 0,
                ways: Ways::from_count(2).ok(),
                ..observation
            });
            let observation = history.get(index).unwrap();
            beam.grow(&model, &history, (index, observation), WANTED, false);
            check(&beam);
            for rank in 0..beam.len() {
                // As a move does: another vertex for one place, which may give a map that is there already.
                let mut other = *beam.get(rank).unwrap();
                let (evidence, key) = (other.evidence, other.key());
                other.rebuild(&model, &history);
                assert!((other.evidence - evidence).abs() < 1e-2, "{} {evidence}", other.evidence);
                assert_eq!(other.key(), key);
                other.path[index / 2] = other.path[index / 3];
                other.rebuild(&model, &history);
                if other.vertices().all(|vertex| !other.is_edge(vertex, vertex)) {
                    beam.insert(&other, WANTED);
                }
                check(&beam);
            }
        }
        assert_eq!(beam.len(), WANTED);
    }

    #[test]
    fn a_hypothesis_with_the_same_map_is_replaced_only_by_a_better_one() {
        let mut beam = Box::new(Beam::<6, 5, 32>::new());
        beam.clear();
        let mut same = *beam.best().unwrap();
        assert!(!beam.insert(&same, WANTED));
        same.evidence = 1.0;
        assert!(beam.insert(&same, WANTED));
        assert_eq!((beam.len(), beam.best().map(Hypothesis::score)), (1, Some(1.0)));
        same.evidence = 0.5;
        assert!(!beam.insert(&same, WANTED));
        same.at = VertexId::new(1);
        assert!(beam.insert(&same, WANTED));
        assert_eq!(beam.len(), 2);
    }
}
