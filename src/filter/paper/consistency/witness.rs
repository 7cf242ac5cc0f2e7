//! Walks and n-grams that refuted a distance before. They mostly refute it again, so they are tried first.

use super::{evidence::Evidence, readings::Readings, state_set::StateSet};
use crate::filter::NgramLength;
use crate::map::{Map, VertexId, VertexSet};

/// How many witnesses of each kind are remembered.
const REMEMBERED: usize = 4;

/// A walk on a map; the first `n` vertices count.
pub(super) type Walk = [VertexId; NgramLength::MAX.get() as usize];

/// Walks that no n-gram was near, and n-grams that no walk was near, on similar maps. The result does not depend on them: each is
/// checked on the map and the evidence at hand.
#[derive(Clone, Debug)]
pub(super) struct Witnesses {
    walks: [Walk; REMEMBERED],
    /// The states at which the straight readings of n-grams end.
    ends: [u16; REMEMBERED],
    next_walk: u8,
    next_end: u8,
}

impl Witnesses {
    pub(super) const fn new() -> Self {
        Self { walks: [[VertexId::FIRST; 7]; REMEMBERED], ends: [0; REMEMBERED], next_walk: 0, next_end: 0 }
    }

    pub(super) fn remember_walk(&mut self, walk: Walk) {
        remember(&mut self.walks, &mut self.next_walk, walk);
    }

    pub(super) fn remember_end(&mut self, end: u16) {
        remember(&mut self.ends, &mut self.next_end, end);
    }

    /// Whether a remembered walk is one of the map and is farther than `distance` from the evidence.
    pub(super) fn refute_walks<const V: usize, const WORDS: usize, const INDICES: usize>(
        &self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        distance: u16,
        readings: &mut Readings<V, WORDS, INDICES>,
    ) -> bool {
        self.walks.iter().any(|walk| {
            let mut before = None;
            let mut states = StateSet::EMPTY;
            for (index, &vertex) in (0..length.get()).zip(walk) {
                if !map.contains(vertex) || before.is_some_and(|before| !map.neighbours(before).contains(vertex)) {
                    return false;
                }
                let reading = readings.at(evidence, length, (vertex, map.label_of(vertex)), index, distance);
                states = match before {
                    None => *reading,
                    Some(_) => evidence.around(&states).intersection(reading),
                };
                before = Some(vertex);
            }
            states.is_empty()
        })
    }

    /// Whether a remembered n-gram of the evidence is farther than `distance` from all walks of the map.
    pub(super) fn refute_ngrams<const V: usize, const WORDS: usize>(
        &self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        distance: u16,
    ) -> bool {
        let labels = evidence.straight_labels(length);
        self.ends.iter().any(|&end| {
            let mut reached = VertexSet::EMPTY;
            for index in 0..labels {
                let Some(label) = evidence.straight_label(length, end.into(), index) else { return false };
                let mut near = VertexSet::EMPTY;
                for (vertex, own) in map.vertices().zip(map.labels()) {
                    if (own.steps() >> length.coarsening()).abs_diff(label) <= distance {
                        near.insert(vertex);
                    }
                }
                if index > 0 {
                    near &= reached.iter().fold(VertexSet::EMPTY, |arriving, vertex| arriving | map.neighbours(vertex));
                }
                reached = near;
            }
            labels > 0 && reached.is_empty()
        })
    }
}

fn remember<T>(remembered: &mut [T; REMEMBERED], next: &mut u8, witness: T) {
    if let Some(slot) = remembered.get_mut(usize::from(*next) % REMEMBERED) {
        *slot = witness;
    }
    *next = next.wrapping_add(1);
}
