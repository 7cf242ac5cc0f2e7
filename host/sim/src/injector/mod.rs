//! Fault injection between a robot and its world: on its ring of sonars, on its serial line, and on the bus behind the
//! bridge. The same rates and seed give the same faults.
//!
//! [`RingInjector`] changes ring frames and [`LineInjector`] changes bytes, for a robot on the host. [`FaultyBridge`]
//! connects the firmware in the emulator to its sensors. `docs/faults.md` describes the effect of each fault.
//!
//! ```
//! use toposlam::FaultCounters;
//! use toposlam::ring::{Echo, RingFrame};
//! use toposlam_sim::injector::{FaultRates, RingInjector};
//!
//! let frame = RingFrame { echoes: [Echo::Range { range_mm: 1000 }; 16] };
//! let mut counters = FaultCounters::new();
//! let mut sound = RingInjector::new(FaultRates::NONE, 1);
//! assert_eq!(sound.disturb(frame, &mut counters), frame);
//! let mut deaf = RingInjector::new(FaultRates { answer_lost: 1.0, ..FaultRates::NONE }, 1);
//! assert_eq!(deaf.disturb(frame, &mut counters).dead_sensors().count(), 16);
//! ```

mod bridge;
mod line;
mod ring;

pub use bridge::{BridgeCounts, FaultyBridge};
pub use line::{LineCounts, LineInjector};
pub use ring::{RingCounts, RingInjector};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Probability of each fault, 0 to 1, for each event that the field names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultRates {
    /// A sonar's answer is lost; for each sonar and frame.
    pub answer_lost: f64,
    /// A sonar returns any range from 0 to 6000 mm; for each sonar and frame.
    pub range_corrupted: f64,
    /// The previous frame repeats in place of the current one; for each frame.
    pub frame_delayed: f64,
    /// The bus of the sonars gets stuck, for 1 to [`FaultRates::STUCK_FRAMES`] frames; for each frame.
    pub bus_stuck: f64,
    /// A byte of the serial line is lost; for each byte.
    pub byte_dropped: f64,
    /// A bit of a byte of the serial line is flipped; for each byte.
    pub bit_flipped: f64,
    /// A burst of 1 to [`LineInjector::BURST_BYTES`] random bytes arrives on the serial line; for each frame.
    pub burst: f64,
    /// 2 to [`LineInjector::FLOOD_REQUESTS`] valid requests arrive at once on the serial line; for each frame.
    pub flood: f64,
    /// A byte between the controller and the bridge is lost, either way; for each byte.
    pub bridge_byte_dropped: f64,
    /// A bit of a byte between the controller and the bridge is flipped, either way; for each byte.
    pub bridge_bit_flipped: f64,
    /// A sensor does not acknowledge; for each transfer on the bus.
    pub transfer_refused: f64,
    /// A sensor is still ranging for 1 to [`FaultRates::LATE_POLLS`] more polls; for each transfer on the bus.
    pub answer_late: f64,
    /// The bus is stuck for 1 to [`FaultRates::STUCK_TRANSFERS`] transfers; for each transfer.
    pub transfers_stuck: f64,
}

impl FaultRates {
    /// Largest number of frames for which the bus of the sonars is stuck.
    pub const STUCK_FRAMES: u32 = 20;
    /// Largest number of polls for which a late sensor is late; the driver polls some fifty times.
    pub const LATE_POLLS: u32 = 8;
    /// Largest number of transfers for which the bus behind the bridge is stuck: those of three frames.
    pub const STUCK_TRANSFERS: u32 = 100;

    /// No faults.
    pub const NONE: Self = Self {
        answer_lost: 0.0,
        range_corrupted: 0.0,
        frame_delayed: 0.0,
        bus_stuck: 0.0,
        byte_dropped: 0.0,
        bit_flipped: 0.0,
        burst: 0.0,
        flood: 0.0,
        bridge_byte_dropped: 0.0,
        bridge_bit_flipped: 0.0,
        transfer_refused: 0.0,
        answer_late: 0.0,
        transfers_stuck: 0.0,
    };

    /// Scales all faults by one number, 0 to 1. It is the probability of the faults that affect one answer or one
    /// frame. Lasting faults are a tenth to a hundredth as frequent. A byte to or from the bridge is affected a
    /// thousandth as often, because a frame takes some 300 of them.
    pub const fn scaled(rate: f64) -> Self {
        Self {
            answer_lost: rate,
            range_corrupted: rate / 4.0,
            frame_delayed: rate,
            bus_stuck: rate / 100.0,
            byte_dropped: rate / 10.0,
            bit_flipped: rate / 10.0,
            burst: rate / 10.0,
            flood: rate / 100.0,
            bridge_byte_dropped: rate / 1000.0,
            bridge_bit_flipped: rate / 1000.0,
            transfer_refused: rate,
            answer_late: rate,
            transfers_stuck: rate / 1000.0,
        }
    }
}

/// The random numbers of one injector.
#[derive(Clone, Debug)]
struct Chance(Xoshiro256PlusPlus);

impl Chance {
    /// `which` separates injectors with the same seed.
    fn new(seed: u64, which: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(8).wrapping_add(which)))
    }

    fn happens(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.0.random_bool(probability.min(1.0))
    }

    /// A number in a range, the end included.
    fn within(&mut self, from: u32, to: u32) -> u32 {
        self.0.random_range(from..=to)
    }

    /// Drops a byte, flips one of its bits or leaves it, and counts the fault.
    fn hurt(&mut self, byte: u8, dropped: f64, flipped: f64, counts: (&mut u64, &mut u64)) -> Option<u8> {
        if self.happens(dropped) {
            *counts.0 += 1;
            return None;
        }
        if self.happens(flipped) {
            *counts.1 += 1;
            return Some(byte ^ 1 << self.within(0, 7));
        }
        Some(byte)
    }
}
