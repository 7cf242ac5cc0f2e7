//! Everything that can go wrong while the robot runs, by kind, and how often it did.
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

/// A kind of fault. Faults are counted and reported; none of them ends the mapping or loses a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum FaultKind {
    /// A sonar did not answer in time.
    SonarSilent = 0,
    /// A sonar answered with a value outside what its data sheet allows.
    SonarOutOfRange = 1,
    /// The sensor bus reported an error in the middle of a frame.
    BusError = 2,
    /// A ring frame had too few live sensors to look for a place.
    RingBlind = 3,
    /// A place had a radius that no fingerprint holds.
    RadiusOutOfRange = 4,
    /// A new vertex was wanted and the vertex table is full.
    VerticesFull = 5,
    /// A new n-gram was wanted and the n-gram table is full.
    NgramsFull = 6,
    /// The history ring is full: the oldest observation was dropped for the newest.
    HistoryFull = 7,
    /// The transmit queue was full: a message was dropped (the rolling picture makes up for it).
    WireFull = 8,
    /// A frame on the serial line was corrupt, cut or foreign.
    WireCorrupt = 9,
    /// The flash could not be written or erased: a snapshot was not kept.
    StoreFailed = 10,
    /// A snapshot could not be restored: it was corrupt, of another version, or contradicts itself.
    SnapshotRejected = 11,
    /// A request was understood and refused.
    CommandRefused = 12,
    /// Requests came faster than the loop takes them: one was dropped.
    CommandFlood = 13,
    /// The drive lost its way along the Voronoi graph and looked for it anew.
    DriveLost = 14,
    /// A turn of the main loop took longer than its bound.
    LoopLate = 15,
}

impl FaultKind {
    /// Every kind, in the order of its number.
    pub const ALL: [Self; 16] = [
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
    ];
}

/// How often each kind of fault was seen since the start; every count saturates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultCounters {
    counts: [u32; FaultKind::ALL.len()],
}

impl FaultCounters {
    /// All counts at zero.
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

    /// Adds the counts of another stage.
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
