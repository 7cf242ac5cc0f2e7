//! Faults at run time: their kinds, and a counter for each.
//!
//! ```
//! use toposlam::{FaultCounters, FaultKind};
//!
//! let (mut ring, mut filter) = (FaultCounters::new(), FaultCounters::new());
//! ring.record(FaultKind::SonarSilent);
//! filter.record(FaultKind::VerticesFull);
//! ring.add(&filter);
//! assert_eq!((ring.count(FaultKind::VerticesFull), ring.count(FaultKind::BusError)), (1, 0));
//! ```

/// A kind of fault. Faults are counted and reported; none of them stops the mapping or discards a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum FaultKind {
    /// A sonar did not answer before its timeout.
    SonarSilent = 0,
    /// A sonar returned a range outside the limits of its data sheet.
    SonarOutOfRange = 1,
    /// The sensor bus, a pin or the clock of the sonars failed.
    BusError = 2,
    /// A ring frame had too few live sensors to detect a place.
    RingBlind = 3,
    /// The radius of a place is above the largest fingerprint.
    RadiusOutOfRange = 4,
    /// A place needed a new vertex and the map is full.
    VerticesFull = 5,
    /// A new n-gram was not stored because the n-gram table is full.
    NgramsFull = 6,
    /// The history is full: the oldest place was dropped.
    HistoryFull = 7,
    /// The transmit queue was full: a message was dropped. The repeated map makes up for it.
    WireFull = 8,
    /// A frame on the serial line was corrupt, cut or foreign.
    WireCorrupt = 9,
    /// The flash could not be written or erased: a snapshot was not stored.
    StoreFailed = 10,
    /// A snapshot was not restored: it is corrupt, of another version, or inconsistent.
    SnapshotRejected = 11,
    /// A request was valid and refused.
    CommandRefused = 12,
    /// A request was dropped because requests arrived faster than the main loop executes them.
    CommandFlood = 13,
    /// The drive lost the Voronoi graph and searched for it again.
    DriveLost = 14,
    /// A step of the main loop took longer than its limit.
    LoopLate = 15,
    /// A hint of an observation is invalid, or contradicts the ways seen at the place before; it was ignored.
    InvalidHint = 16,
    /// The ranges of a sonar cannot be true while the ring turns: it is stuck at one range, or measures a short one where its neighbours do
    /// not. It is left out until its ranges are plausible again.
    SonarImplausible = 17,
}

impl FaultKind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Self; 18] = [
        Self::SonarSilent,
        Self::SonarOutOfRange,
        Self::BusError,
        Self::RingBlind,
        Self::RadiusOutOfRange,
        Self::VerticesFull,
        Self::NgramsFull,
        Self::HistoryFull,
        Self::WireFull,
        Self::WireCorrupt,
        Self::StoreFailed,
        Self::SnapshotRejected,
        Self::CommandRefused,
        Self::CommandFlood,
        Self::DriveLost,
        Self::LoopLate,
        Self::InvalidHint,
        Self::SonarImplausible,
    ];
}

/// A saturating counter for each kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultCounters {
    counts: [u32; FaultKind::ALL.len()],
}

impl FaultCounters {
    /// Creates the counters, all zero.
    pub const fn new() -> Self {
        Self { counts: [0; FaultKind::ALL.len()] }
    }

    /// Records one fault of this kind.
    pub fn record(&mut self, kind: FaultKind) {
        if let Some(count) = self.counts.get_mut(kind as usize) {
            *count = count.saturating_add(1);
        }
    }

    /// Returns how many faults of this kind were recorded since the start; saturates at `u32::MAX`.
    pub fn count(&self, kind: FaultKind) -> u32 {
        self.counts.get(kind as usize).copied().unwrap_or(0)
    }

    /// Adds the counts of another stage, saturating.
    pub fn add(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(other.counts) {
            *count = count.saturating_add(more);
        }
    }
}

impl Default for FaultCounters {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_numbered_without_gaps() {
        for (number, kind) in FaultKind::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, number);
        }
    }

    #[test]
    fn counts_saturate_and_add_up() {
        let mut counters = FaultCounters::new();
        counters.record(FaultKind::BusError);
        let mut sum = FaultCounters { counts: [u32::MAX; FaultKind::ALL.len()] };
        sum.add(&counters);
        assert_eq!(sum.count(FaultKind::BusError), u32::MAX);
        assert_eq!(counters.count(FaultKind::BusError), 1);
        assert_eq!(counters.count(FaultKind::WireFull), 0);
    }
}
