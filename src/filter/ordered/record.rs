//! The newest observations, packed: what every hypothesis explains.

use super::observation::{OrderedObservation, WaysSeen};
use crate::map::darts::Bearing;

/// Units of ln(travel time): 2⁻¹² nats.
pub(super) const LN_UNIT: f32 = 4096.0;

/// One observation as the inference reads it: 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) steps: u16,
    /// ln of the travel time in [`LN_UNIT`]; 0 when it is unknown.
    pub(super) ln_travel: u16,
    pub(super) ways: WaysSeen,
    exit_and_start: u8,
}

impl Entry {
    pub(super) const NONE: Self = Self { steps: 0, ln_travel: 0, ways: WaysSeen::UNKNOWN, exit_and_start: 0 };

    pub(super) fn new(observation: &OrderedObservation) -> Self {
        let frames = observation.travel_frames.unwrap_or(0);
        let exit = observation.exit.map_or(0, |exit| exit.min(0x3E) + 1);
        Self {
            steps: observation.fingerprint.steps(),
            // One frame would be 0, which stands for unknown.
            ln_travel: if frames == 0 { 0 } else { (libm::logf(frames.into()) * LN_UNIT) as u16 + 1 },
            ways: observation.ways,
            exit_and_start: exit << 1 | u8::from(observation.starts_sequence),
        }
    }

    pub(super) const fn starts(&self) -> bool {
        self.exit_and_start & 1 == 1
    }

    /// By which of the ways seen at the place before the robot left it.
    pub(super) fn exit(&self) -> Option<u8> {
        (self.exit_and_start >> 1).checked_sub(1)
    }
}

/// The newest `T` observations, the oldest first.
#[derive(Clone, Debug)]
pub(super) struct Record<const T: usize> {
    entries: [Entry; T],
    len: usize,
}

impl<const T: usize> Record<T> {
    pub(super) const fn new() -> Self {
        Self { entries: [Entry::NONE; T], len: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn is_full(&self) -> bool {
        self.len == T
    }

    pub(super) fn push(&mut self, entry: Entry) {
        if let Some(slot) = self.entries.get_mut(self.len) {
            *slot = entry;
            self.len += 1;
        }
    }

    /// Drops the oldest `count` observations.
    pub(super) fn drop_oldest(&mut self, count: usize) {
        let count = count.min(self.len);
        self.entries.copy_within(count.., 0);
        self.len -= count;
    }

    pub(super) fn get(&self, index: usize) -> Entry {
        self.entries.get(..self.len).and_then(|entries| entries.get(index)).copied().unwrap_or(Entry::NONE)
    }

    /// The bearing, relative to the way the robot came by, of the way by which it left for observation `index`.
    pub(super) fn exit_bearing(&self, index: usize) -> Option<Bearing> {
        let exit = self.get(index).exit()?;
        self.get(index.checked_sub(1)?).ways.bearing(exit)
    }
}
