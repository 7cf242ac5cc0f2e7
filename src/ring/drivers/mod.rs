//! Drivers that read a ring of sonars over `embedded-hal` traits.
//!
//! | Sensor | Ring | Bus |
//! |---|---|---|
//! | Devantech SRF08, SRF10 | [`Srf08Ring`] | any I2C bus |
//! | MaxBotix I2CXL-MaxSonar | [`MaxBotixRing`] | any I2C bus |
//! | HC-SR04 | [`HcSr04Ring`] | two pins each, and a clock of microseconds |
//!
//! [`Sc18im700`] makes an I2C bus out of a UART. Another sensor on I2C needs an [`I2cRanger`] for an [`I2cRing`]; any other
//! one needs a [`SonarRing`]. `docs/wiring.md` shows how the rings are wired.
//!
//! A ring fires in the groups of its [`FiringPlan`], blocks until its frame is whole, and always gives a frame in bounded
//! time, however many of its sensors are dead. Sensors come from the factory with one address for all;
//! [`change_srf08_address`] and [`change_maxbotix_address`] set them apart.
//!
//! Whatever gives a frame is a ring; here one that hears the same again and again:
//!
//! ```
//! use toposlam::FaultCounters;
//! use toposlam::ring::{Echo, RingFrame};
//! use toposlam::ring::drivers::{SonarError, SonarRing};
//!
//! struct Constant(u16);
//!
//! impl SonarRing<8> for Constant {
//!     fn read(&mut self, _faults: &mut FaultCounters) -> RingFrame<8> {
//!         RingFrame { echoes: [Echo::Range { range_mm: self.0 }; 8] }
//!     }
//!
//!     fn last_error(&self) -> Option<SonarError> {
//!         None
//!     }
//! }
//!
//! let mut faults = FaultCounters::new();
//! assert_eq!(Constant(1200).read(&mut faults).dead_sensors().count(), 0);
//! ```
//!
//! # VL53L1X
//!
//! There is no driver for this time-of-flight sensor, because no crate fits. Of those on crates.io, `vl53l1x` 1.2.0 needs
//! `std` and compiles C code for Linux; `vl53l1x-uld` 2.0.1 and `vl53l1` 0.1.2 are made for `embedded-hal` 0.2.
//! `vl53l1x-simple` 0.2.0 is for `embedded-hal` 1.0 without `std`, but it divides by a number that it reads from the sensor,
//! so that a sensor or a bus that answers 0 makes it panic, and it withholds the status of a range, so that "nothing in
//! sight" comes as a range. A ring of such sensors can still be a [`SonarRing`] of its own.

use core::fmt;

use crate::{FaultCounters, FaultKind, ring::RingFrame};

mod address;
mod hcsr04;
mod i2c_ring;
mod maxbotix;
mod plan;
mod round;
mod sc18im700;
mod sound;
mod srf08;

pub use address::{AddressError, change_maxbotix_address, change_srf08_address};
pub use hcsr04::{HcSr04Config, HcSr04ConfigError, HcSr04Ring, Microseconds};
pub use i2c_ring::{I2cRanger, I2cRing, RangingTiming};
pub use maxbotix::{MaxBotixConfig, MaxBotixConfigError, MaxBotixRing};
pub use plan::FiringPlan;
pub use round::Reading;
pub use sc18im700::{BridgeError, Sc18im700};
pub use srf08::{Srf08Config, Srf08ConfigError, Srf08Ring};

/// A ring of `SONARS` sonars that can be read, one frame after the other.
pub trait SonarRing<const SONARS: usize> {
    /// Reads every sensor once. There is always a frame: a sensor in trouble is [`Echo::Dead`](crate::ring::Echo::Dead)
    /// in it and counted in `faults`, and the others go on. [`RingFrame::dead_sensors`] says which they are.
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS>;

    /// The last trouble of the latest frame, for a log; `None` after a frame without any.
    fn last_error(&self) -> Option<SonarError>;
}

/// What went wrong with one sensor of a ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SonarError {
    /// The sensor's index in the frame.
    pub sensor: u8,
    /// What it did.
    pub fault: SonarFault,
}

/// How a sensor can fail to say anything about the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SonarFault {
    /// It did not acknowledge its address, or was still ranging when the time was up.
    Silent,
    /// It answered with a range that its data sheet does not allow.
    OutOfRange,
    /// The bus, or the pin, failed while the sensor was addressed.
    Bus,
    /// Its line was up before it was asked: it hangs, or the wire has a fault.
    Stuck,
    /// The clock that times its echo stands still.
    Clock,
}

impl SonarFault {
    /// The kind under which the fault is counted.
    pub const fn kind(self) -> FaultKind {
        match self {
            Self::Silent | Self::Stuck => FaultKind::SonarSilent,
            Self::OutOfRange => FaultKind::SonarOutOfRange,
            Self::Bus | Self::Clock => FaultKind::BusError,
        }
    }
}

impl fmt::Display for SonarError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.fault {
            SonarFault::Silent => "did not answer in time",
            SonarFault::OutOfRange => "answered with an impossible range",
            SonarFault::Bus => "could not be reached: bus or pin error",
            SonarFault::Stuck => "holds its line high before it is asked",
            SonarFault::Clock => "could not be timed: the clock stands still",
        };
        write!(f, "sonar {} {what}", self.sensor)
    }
}

impl core::error::Error for SonarError {}
