//! The exit taken at each place of the history, and from these the vertex behind each exit of the present place.

use super::local_planner::Exits;
use crate::filter::Filter;
use crate::map::PerVertex;
use crate::map::VertexId;

/// Maximum number of exits of a place that a departure represents.
pub(super) const MAX_EXITS: usize = 7;
/// A departure is the number of exits, and above it the exit taken; 0 when unknown.
const EXIT_SHIFT: u8 = 3;
const COUNT_MASK: u8 = 7;

/// The departures from the newest `HISTORY` places: the number of exits and the exit taken, counter-clockwise from the one by
/// which the robot entered. Memory: one byte for each place.
#[derive(Clone, Debug)]
pub(super) struct Departures<const HISTORY: usize> {
    departures: [u8; HISTORY],
    /// Number of places since the start.
    places: u32,
}

/// What is known of one exit of the present place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Exit {
    /// The vertex at its other end by the best path; `None` when unknown.
    pub(super) leads_to: Option<VertexId>,
    /// How often the robot drove through it, in either direction.
    pub(super) uses: u16,
}

/// Whether a byte is a departure: the exit taken is below the number of exits.
#[cfg(feature = "snapshot")]
pub(crate) fn is_departure(departure: u8) -> bool {
    departure == 0 || departure >> EXIT_SHIFT < departure & COUNT_MASK
}

impl<const HISTORY: usize> Departures<HISTORY> {
    pub(super) const fn new() -> Self {
        Self { departures: [0; HISTORY], places: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.places = 0;
    }

    /// Appends a place with an unknown departure.
    pub(super) fn arrive(&mut self) {
        self.places = self.places.wrapping_add(1);
        self.set_newest(0);
    }

    /// Records the exit taken at the newest place.
    pub(super) fn depart(&mut self, exits: Exits, exit: u8) {
        let is_known = exits.is_entry_first && usize::from(exits.count) <= MAX_EXITS && exit < exits.count;
        self.set_newest(if is_known { exits.count | exit << EXIT_SHIFT } else { 0 });
    }

    /// Makes the departure from the newest place unknown.
    pub(super) fn forget_newest(&mut self) {
        self.set_newest(0);
    }

    /// Iterates over the departures, oldest first.
    #[cfg(feature = "snapshot")]
    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = u8> + '_ {
        let remembered = (self.places as usize).min(HISTORY);
        (0..remembered).rev().map(|ago| self.departures.get(self.slot(ago)).copied().unwrap_or(0))
    }

    /// Replaces all departures, oldest first.
    #[cfg(feature = "snapshot")]
    pub(super) fn replace(&mut self, departures: impl Iterator<Item = u8>) {
        self.clear();
        for departure in departures {
            self.arrive();
            self.set_newest(departure);
        }
    }

    fn set_newest(&mut self, departure: u8) {
        let newest = self.slot(0);
        if let Some(slot) = self.departures.get_mut(newest) {
            *slot = departure;
        }
    }

    fn slot(&self, ago: usize) -> usize {
        (self.places as usize).wrapping_sub(ago).checked_rem(HISTORY).unwrap_or(0)
    }

    /// The number of exits and the exit taken, `ago` places before the newest; `None` when unknown.
    fn departure(&self, ago: usize) -> Option<(u8, u8)> {
        let departure = self.departures.get(self.slot(ago)).copied().filter(|departure| *departure != 0)?;
        Some((departure & COUNT_MASK, departure >> EXIT_SHIFT))
    }

    /// The vertex behind each of the `count` exits of the newest place, and their uses, from all visits of its vertex on the
    /// best path.
    ///
    /// A visit gives the number of exits between the neighbour it came from and the neighbour it went to. Exit 0 of the
    /// newest place leads to the vertex before it. From there, the exits of all neighbours that visits connect to it
    /// follow, counter-clockwise modulo `count`. Time O(count · HISTORY).
    pub(super) fn exits<const V: usize>(&self, filter: &impl Filter<V>, count: u8) -> [Exit; MAX_EXITS] {
        let mut exits = [Exit::default(); MAX_EXITS];
        let mut exit_to = PerVertex::<Option<u8>, V>::filled(None);
        let (Some(here), Some(came_from)) = (filter.recent(0), filter.recent(1)) else { return exits };
        // Exit 0 does not lead to the vertex before when the robot was moved, or when the departure from there is unknown.
        if self.departure(1).is_none() {
            return exits;
        }
        exit_to[came_from] = Some(0);
        let visits = || {
            let known = (1..HISTORY.saturating_sub(1)).take(self.places as usize);
            known.filter_map(|ago| {
                let (exits, taken) = self.departure(ago).filter(|(exits, _)| *exits == count)?;
                let from = filter.recent(ago + 1)?;
                (filter.recent(ago) == Some(here)).then_some((from, taken.checked_rem(exits)?, filter.recent(ago - 1)?))
            })
        };
        for _ in 0..count {
            let mut has_changed = false;
            for (from, taken, to) in visits() {
                let (known, vertex, offset) = match (exit_to[from], exit_to[to]) {
                    (Some(exit), None) => (exit, to, taken),
                    (None, Some(exit)) => (exit, from, count - taken),
                    _ => continue,
                };
                if let Some(exit) = known.saturating_add(offset).checked_rem(count) {
                    exit_to[vertex] = Some(exit);
                    has_changed = true;
                }
            }
            if !has_changed {
                break;
            }
        }
        let mut add_use = |exit: Option<u8>, vertex: VertexId| {
            if let Some(exit) = exit.and_then(|exit| exits.get_mut(usize::from(exit))) {
                exit.leads_to = Some(vertex);
                exit.uses = exit.uses.saturating_add(1);
            }
        };
        add_use(Some(0), came_from);
        for (from, _, to) in visits() {
            add_use(exit_to[from], from);
            add_use(exit_to[to], to);
        }
        exits
    }
}
