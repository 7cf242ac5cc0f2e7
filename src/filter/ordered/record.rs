//! The newest observations, packed: what every hypothesis explains.

use crate::filter::{Exit, Observation, Ways};
use crate::map::{Bearing, LN_TRAVEL_UNIT, WAYS_MAX};

/// Flags beside the number of ways, which takes bits 0 to 3.
const STARTS: u8 = 1 << 4;
const KIDNAPPED: u8 = 1 << 5;
const EXIT_ON: u8 = 1 << 6;
const EXIT_BEARING: u8 = 1 << 7;

/// One observation as the inference reads it: 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    pub(crate) steps: u16,
    /// ln of the travel time in [`LN_TRAVEL_UNIT`]; 0 when it is unknown.
    pub(crate) ln_travel: u16,
    /// The bytes of the ways. The first one holds the flags too.
    ways: [u8; WAYS_MAX],
    exit: u8,
}

impl Entry {
    pub(super) const NONE: Self = Self { steps: 0, ln_travel: 0, ways: [0; WAYS_MAX], exit: 0 };

    pub(super) fn new(observation: &Observation) -> Self {
        let frames = observation.travel_frames.unwrap_or(0);
        let mut ways = observation.ways.map_or([0; WAYS_MAX], Ways::to_bytes);
        let (exit_flag, exit) = match observation.exit {
            None => (0, 0),
            Some(Exit::On) => (EXIT_ON, 0),
            Some(Exit::Back) => (EXIT_BEARING, 0),
            Some(Exit::Bearing(bearing)) => (EXIT_BEARING, bearing),
        };
        let start_flag = if observation.starts_sequence { STARTS } else { 0 };
        let [flags, ..] = &mut ways;
        *flags |= exit_flag | start_flag;
        Self {
            steps: observation.fingerprint.steps(),
            // One frame would be 0, which stands for unknown.
            ln_travel: if frames == 0 { 0 } else { (libm::logf(frames.into()) * LN_TRAVEL_UNIT) as u16 + 1 },
            ways,
            exit,
        }
    }

    /// The ways, the flags and the exit as the 8 bytes of a snapshot.
    #[cfg(feature = "snapshot")]
    pub(crate) const fn to_bytes(self) -> [u8; WAYS_MAX + 1] {
        let [a, b, c, d, e, f, g] = self.ways;
        [a, b, c, d, e, f, g, self.exit]
    }

    /// From the radius, the travel time and the bytes of a snapshot.
    #[cfg(feature = "snapshot")]
    pub(crate) const fn from_bytes(steps: u16, ln_travel: u16, bytes: [u8; WAYS_MAX + 1]) -> Self {
        let [a, b, c, d, e, f, g, exit] = bytes;
        Self { steps, ln_travel, ways: [a, b, c, d, e, f, g], exit }
    }

    const fn flags(&self) -> u8 {
        let [flags, ..] = self.ways;
        flags
    }

    /// Whether the robot did not drive here from the place before.
    pub(crate) const fn starts(&self) -> bool {
        self.flags() & (STARTS | KIDNAPPED) != 0
    }

    /// The ways seen.
    pub(super) fn ways(&self) -> Option<Ways> {
        Ways::from_bytes(self.ways)
    }

    /// The number of ways seen with their bearings, including the one the robot came by; 0 when they are unknown.
    pub(super) fn count(&self) -> u8 {
        self.ways().filter(|ways| ways.others().is_some()).map_or(0, Ways::count)
    }

    /// The bearings of the other ways relative to the one the robot came by.
    pub(super) fn others(&self) -> impl Iterator<Item = Bearing> + '_ {
        let others = self.ways.get(1..usize::from(self.count())).unwrap_or(&[]);
        others.iter().map(|&bearing| u16::from(bearing) << 8)
    }

    /// The exit by which the robot left the place before.
    pub(super) fn exit(&self) -> Option<Exit> {
        match self.flags() {
            flags if flags & EXIT_BEARING != 0 && self.exit == 0 => Some(Exit::Back),
            flags if flags & EXIT_BEARING != 0 => Some(Exit::Bearing(self.exit)),
            flags if flags & EXIT_ON != 0 => Some(Exit::On),
            _ => None,
        }
    }
}

/// The newest `T` observations, the oldest first.
#[derive(Clone, Debug)]
pub(crate) struct Record<const T: usize> {
    entries: [Entry; T],
    len: usize,
}

impl<const T: usize> Record<T> {
    pub(super) const fn new() -> Self {
        Self { entries: [Entry::NONE; T], len: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn is_full(&self) -> bool {
        self.len == T
    }

    pub(crate) fn push(&mut self, entry: Entry) {
        if let Some(slot) = self.entries.get_mut(self.len) {
            *slot = entry;
            self.len += 1;
        }
    }

    /// Drops the oldest `count` observations.
    pub(super) fn drop_oldest(&mut self, count: usize) {
        let count = count.min(self.len).min(T);
        self.entries.copy_within(count.., 0);
        self.len -= count;
    }

    pub(crate) fn get(&self, index: usize) -> Entry {
        self.entries.get(..self.len).and_then(|entries| entries.get(index)).copied().unwrap_or(Entry::NONE)
    }

    /// Notes whether the robot seems to have been kidnapped on the way to an observation.
    pub(super) fn set_kidnapped(&mut self, index: usize, is_kidnapped: bool) {
        if let Some(entry) = self.entries.get_mut(index) {
            let [flags, ..] = &mut entry.ways;
            *flags = if is_kidnapped { *flags | KIDNAPPED } else { *flags & !KIDNAPPED };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::Fingerprint;

    #[test]
    fn entries_hold_what_was_observed() {
        let all_ways = [None, Ways::from_count(7).ok(), Ways::from_bearings_mrad(&[1000, 3000]).ok()];
        for ways in all_ways {
            for exit in [None, Some(Exit::Back), Some(Exit::On), Some(Exit::Bearing(200))] {
                for starts_sequence in [false, true] {
                    let fingerprint = Fingerprint::from_steps(77).unwrap();
                    let observation = Observation { ways, exit, starts_sequence, ..Observation::new(fingerprint) };
                    let entry = Entry::new(&observation);
                    assert_eq!((entry.ways(), entry.exit(), entry.starts()), (ways, exit, starts_sequence));
                    assert_eq!(entry.steps, 77);
                }
            }
        }
    }
}
