//! The consistency of a map with a set of n-grams: the Hausdorff distance of Eq. 2 and 3, exact and in integers, without
//! enumeration of the walks of the map.
//!
//! The distance is the smallest threshold at which the map explains every n-gram of the evidence (`explained`) and the evidence
//! confirms every walk of the map (`confirmed`). Both are monotone in the threshold, so a search over integers finds it.

mod confirmed;
mod evidence;
mod explained;
mod readings;
mod state_set;
mod witness;

pub use evidence::Evidence;

use crate::filter::NgramLength;
use crate::map::Map;
use crate::map::PerVertex;
use readings::Readings;
use state_set::StateSet;
use witness::Witnesses;

/// Which half of Eq. 2 counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The larger of the two directed distances: Eq. 2 as printed.
    TwoSided,
    /// From the walks of the map to the evidence: evidence that is not on the map does not count.
    MapToHistory,
    /// From the evidence to the walks of the map: walks without evidence do not count.
    HistoryToMap,
}

/// The memory of the consistency measure for maps of `V` vertices and evidence of `WORDS` words.
///
/// `INDICES` is 1 for a [`History`](crate::History), whose labels read the same at every index of an n-gram, and 7 for
/// an [`NgramTable`](crate::NgramTable). Memory: about `4 · (2 · INDICES + 9) · V · (WORDS + 1) + 56 · WORDS` bytes.
///
/// ```
/// use toposlam::{Consistency, Direction, Fingerprint, History, Map, NgramLength};
///
/// // A corridor of three places, there and back; the last radius is 20 mm off.
/// let radius = Fingerprint::from_radius_mm;
/// let mut history = History::<1>::new();
/// let mut map = Map::<16>::new();
/// for radius_mm in [500, 800, 600, 800, 520] {
///     history.push(radius(radius_mm)?);
/// }
/// let [a, b, c] = [500, 800, 600].map(|radius_mm| map.add_vertex(radius(radius_mm).unwrap()).unwrap());
/// map.add_edge(a, b);
/// map.add_edge(b, c);
/// let (length, mut consistency) = (NgramLength::new(3)?, Consistency::<16, 1, 1>::new());
/// let steps = consistency.distance_steps(&map, &history, length, Direction::HistoryToMap).unwrap();
/// assert_eq!(steps * length.label_step_mm(), 20);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Consistency<const V: usize, const WORDS: usize, const INDICES: usize> {
    readings: Readings<V, WORDS, INDICES>,
    /// The states that straight readings of the evidence reach at each vertex; two generations, used in turn.
    reached: [PerVertex<StateSet<WORDS>, V>; 2],
    arms: confirmed::Arms<V, WORDS>,
    witnesses: Witnesses,
}

impl<const V: usize, const WORDS: usize, const INDICES: usize> Consistency<V, WORDS, INDICES> {
    /// Memory that is empty.
    pub const fn new() -> Self {
        Self {
            readings: Readings::new(),
            reached: [PerVertex::filled(StateSet::EMPTY); 2],
            arms: confirmed::Arms::new(),
            witnesses: Witnesses::new(),
        }
    }

    /// The distance of **Eq. 2**, or one directed half of it, in units of [`NgramLength::label_step_mm`].
    ///
    /// `None` stands for an infinite distance: the minimum over an empty set. The maximum over an empty set is 0.
    /// Cost: O(log(range) · V · Δⁿᐟ² · WORDS) for a largest degree of Δ in the sparse maps of buildings.
    pub fn distance_steps(
        &mut self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        direction: Direction,
    ) -> Option<u16> {
        self.readings.forget();
        let largest = crate::place::Fingerprint::MAX.steps() >> length.coarsening();
        self.search(map, evidence, length, direction, (0, largest))
    }

    /// The distance if it is not above `limit`. The search starts at `known`, a lower bound. Readings are kept from call to call, so
    /// call [`Consistency::forget`] when the evidence changes.
    pub(crate) fn search(
        &mut self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        direction: Direction,
        (known, limit): (u16, u16),
    ) -> Option<u16> {
        let mut holds = |distance: u16| self.holds(map, evidence, length, direction, distance);
        if known > limit {
            return None;
        }
        if holds(known) {
            return Some(known);
        }
        let mut refuted = known;
        let mut stride = 1;
        let mut confirmed = loop {
            if refuted >= limit {
                return None;
            }
            let farther = refuted.saturating_add(stride).min(limit);
            if holds(farther) {
                break farther;
            }
            refuted = farther;
            stride *= 2;
        };
        while confirmed - refuted > 1 {
            let middle = refuted + (confirmed - refuted) / 2;
            if holds(middle) { confirmed = middle } else { refuted = middle }
        }
        Some(confirmed)
    }

    fn holds(
        &mut self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        direction: Direction,
        distance: u16,
    ) -> bool {
        let (confirmed, explained) = match direction {
            Direction::TwoSided => (true, true),
            Direction::MapToHistory => (true, false),
            Direction::HistoryToMap => (false, true),
        };
        (!confirmed || self.confirms(map, evidence, length, distance))
            && (!explained || self.explains(map, evidence, length, distance))
    }

    /// Drops the readings of the evidence, because it changes.
    pub(crate) fn forget(&mut self) {
        self.readings.forget();
    }
}

impl<const V: usize, const WORDS: usize> Consistency<V, WORDS, 1> {
    /// Updates the readings of a history with its newest observation.
    pub(crate) fn include_newest(&mut self, history: &crate::filter::History<WORDS>, length: NgramLength) {
        self.readings.include_newest(history, length);
    }
}

impl<const V: usize, const WORDS: usize, const INDICES: usize> Default for Consistency<V, WORDS, INDICES> {
    fn default() -> Self {
        Self::new()
    }
}
