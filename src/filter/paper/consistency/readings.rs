//! The states at which one label of the evidence agrees with one vertex of the map, kept from one threshold to the next.

use super::{evidence::Evidence, state_set::StateSet};
use crate::filter::{History, NgramLength};
use crate::map::PerVertex;
use crate::map::VertexId;
use crate::place::Fingerprint;

/// The label and the threshold of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Key {
    label: Fingerprint,
    /// One more than the distance in units of the n-gram's steps; 0 where nothing was read yet, so that the initial
    /// value is zero and in `.bss`.
    above_distance: u16,
}

const NOTHING: Key = Key { label: Fingerprint::ZERO, above_distance: 0 };

/// How many readings are kept for a vertex and an index: one for each remainder of the distance, because the search
/// alternates between neighbouring distances.
const PLANES: usize = 2;

/// The latest readings.
#[derive(Clone, Debug)]
pub(super) struct Readings<const V: usize, const WORDS: usize, const INDICES: usize> {
    sets: [[PerVertex<StateSet<WORDS>, V>; PLANES]; INDICES],
    keys: [[PerVertex<Key, V>; PLANES]; INDICES],
}

/// All steps of a fingerprint that lie within a distance of a label, the distance in units of the n-gram's steps.
fn range_steps(length: NgramLength, label: Fingerprint, distance: u16) -> (u16, u16) {
    let coarse = label.steps() >> length.coarsening();
    let low = coarse.saturating_sub(distance) << length.coarsening();
    let high = coarse.saturating_add(distance).min(Fingerprint::MAX.steps() >> length.coarsening());
    (low, high << length.coarsening() | ((1 << length.coarsening()) - 1))
}

impl<const V: usize, const WORDS: usize, const INDICES: usize> Readings<V, WORDS, INDICES> {
    pub(super) const fn new() -> Self {
        Self {
            sets: [[PerVertex::filled(StateSet::EMPTY); PLANES]; INDICES],
            keys: [[PerVertex::filled(NOTHING); PLANES]; INDICES],
        }
    }

    /// The states of the evidence whose label number `index` is within `distance` of the label of a vertex.
    pub(super) fn at(
        &mut self,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        (vertex, label): (VertexId, Fingerprint),
        index: u8,
        distance: u16,
    ) -> &StateSet<WORDS> {
        let index_slot = if INDICES == 1 { 0 } else { usize::from(index) };
        let plane = usize::from(distance) % PLANES;
        let (Some(sets), Some(keys)) = (self.sets.get_mut(index_slot), self.keys.get_mut(index_slot)) else {
            return const { &StateSet::EMPTY };
        };
        let (set, key) = (&mut sets[plane][vertex], &mut keys[plane][vertex]);
        let wanted = Key { label, above_distance: distance + 1 };
        if *key != wanted {
            *set = evidence.reading(length, index, range_steps(length, label, distance));
            *key = wanted;
        }
        set
    }

    pub(super) fn forget(&mut self) {
        self.keys.as_flattened_mut().fill(PerVertex::filled(NOTHING));
    }
}

impl<const V: usize, const WORDS: usize> Readings<V, WORDS, 1> {
    pub(super) fn include_newest(&mut self, history: &History<WORDS>, length: NgramLength) {
        let Some(newest) = history.newest(0) else { return };
        for (sets, keys) in self.sets.as_flattened_mut().iter_mut().zip(self.keys.as_flattened()) {
            for (set, key) in sets.values_mut().iter_mut().zip(keys.values()) {
                let (low, high) = range_steps(length, key.label, key.above_distance.wrapping_sub(1));
                set.assign(history.newest_slot(), (low..=high).contains(&newest.steps()));
            }
        }
    }
}
