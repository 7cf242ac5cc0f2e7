//! What the drive did at each place of the history, and what that tells of the ways of a vertex.

use super::local_planner::Exits;
use crate::map::PerVertex;
use crate::{Filter, VertexId};

/// A place has at most so many ways; the seventh and eighth have no room in the note of a place.
pub(super) const WAYS: usize = 7;
const EXIT_SHIFT: u8 = 3;
const COUNT_MASK: u8 = 7;

/// For each of the newest `HISTORY` places how many ways it had and by which the robot left, numbered counter-clockwise from the
/// one it came by: one byte a place, 0 when unknown.
#[derive(Clone, Debug)]
pub(super) struct Departures<const HISTORY: usize> {
    notes: [u8; HISTORY],
    /// How many places there were.
    places: u32,
}

/// One way out of the place that the robot is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Way {
    /// The vertex it leads to, as far as the best path tells.
    pub(super) leads_to: Option<VertexId>,
    /// How often it was driven, either way.
    pub(super) uses: u16,
}

/// Whether a byte is the note of a place: the number of the way is below the number of ways.
#[cfg(feature = "snapshot")]
pub(crate) fn is_departure(note: u8) -> bool {
    note == 0 || note >> EXIT_SHIFT < note & COUNT_MASK
}

impl<const HISTORY: usize> Departures<HISTORY> {
    pub(super) const fn new() -> Self {
        Self { notes: [0; HISTORY], places: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.places = 0;
    }

    /// The robot is at a new place. What it did at the one before stays as noted.
    pub(super) fn arrive(&mut self) {
        self.places = self.places.wrapping_add(1);
        self.note(0);
    }

    /// The robot leaves the newest place by this way.
    pub(super) fn depart(&mut self, ways: Exits, exit: u8) {
        let known = ways.is_entry_first && usize::from(ways.count) <= WAYS && exit < ways.count;
        self.note(if known { ways.count | exit << EXIT_SHIFT } else { 0 });
    }

    /// What the robot did at the newest place led nowhere.
    pub(super) fn forget(&mut self) {
        self.note(0);
    }

    /// The notes of the places that are remembered, the oldest first.
    #[cfg(feature = "snapshot")]
    pub(super) fn iter(&self) -> impl ExactSizeIterator<Item = u8> + '_ {
        let remembered = (self.places as usize).min(HISTORY);
        (0..remembered).rev().map(|ago| self.notes.get(self.slot(ago)).copied().unwrap_or(0))
    }

    /// Replaces all notes by others, the oldest first.
    #[cfg(feature = "snapshot")]
    pub(super) fn replace(&mut self, notes: impl Iterator<Item = u8>) {
        self.clear();
        for note in notes {
            self.arrive();
            self.note(note);
        }
    }

    fn note(&mut self, note: u8) {
        let newest = self.slot(0);
        if let Some(slot) = self.notes.get_mut(newest) {
            *slot = note;
        }
    }

    fn slot(&self, ago: usize) -> usize {
        (self.places as usize).wrapping_sub(ago).checked_rem(HISTORY).unwrap_or(0)
    }

    /// How many ways a place had, and by which the robot left; `None` when that is unknown.
    fn exit(&self, ago: usize) -> Option<(u8, u8)> {
        let note = self.notes.get(self.slot(ago)).copied().filter(|note| *note != 0)?;
        Some((note & COUNT_MASK, note >> EXIT_SHIFT))
    }

    /// Where the ways of the newest place lead to and how often they were driven, by all visits to its vertex on the best path.
    ///
    /// A visit says how many ways lie between the neighbour it came from and the one it went to. The robot knows
    /// where it came from; from there the numbers of all ways follow that are joined to it by such visits. Time
    /// O(count · HISTORY).
    pub(super) fn ways<const V: usize>(&self, filter: &impl Filter<V>, count: u8) -> [Way; WAYS] {
        let mut ways = [Way::default(); WAYS];
        let mut way_to = PerVertex::<Option<u8>, V>::filled(None);
        let (Some(here), Some(came_from)) = (filter.recent(0), filter.recent(1)) else { return ways };
        // It came by way 0, unless it was carried here or does not know how it left.
        if self.exit(1).is_none() {
            return ways;
        }
        way_to[came_from] = Some(0);
        let visits = || {
            let known = (1..HISTORY.saturating_sub(1)).take(self.places as usize);
            known.filter_map(|ago| {
                let (ways, exit) = self.exit(ago).filter(|(ways, _)| *ways == count)?;
                let from = filter.recent(ago + 1)?;
                (filter.recent(ago) == Some(here)).then_some((from, exit.checked_rem(ways)?, filter.recent(ago - 1)?))
            })
        };
        for _ in 0..count {
            let mut has_changed = false;
            for (from, exit, to) in visits() {
                let (known, vertex, turned) = match (way_to[from], way_to[to]) {
                    (Some(way), None) => (way, to, exit),
                    (None, Some(way)) => (way, from, count - exit),
                    _ => continue,
                };
                if let Some(way) = known.saturating_add(turned).checked_rem(count) {
                    way_to[vertex] = Some(way);
                    has_changed = true;
                }
            }
            if !has_changed {
                break;
            }
        }
        let mut used = |way: Option<u8>, vertex: VertexId| {
            if let Some(way) = way.and_then(|way| ways.get_mut(usize::from(way))) {
                way.leads_to = Some(vertex);
                way.uses = way.uses.saturating_add(1);
            }
        };
        used(Some(0), came_from);
        for (from, _, to) in visits() {
            used(way_to[from], from);
            used(way_to[to], to);
        }
        ways
    }
}
