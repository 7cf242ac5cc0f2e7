//! Drivers that read a ring of sonars over `embedded-hal` traits.
//!
//! [`Srf08Ring`] reads SRF08 rangers on any I2C bus; [`Sc18im700`] makes such a bus out of a UART.

use core::fmt;

use crate::{FaultCounters, FaultKind, ring::RingFrame};

mod sc18im700;
mod srf08;

pub use sc18im700::{BridgeError, Sc18im700};
pub use srf08::{Srf08Config, Srf08ConfigError, Srf08Ring};

/// A ring of `SONARS` sonars that can be read, one frame after the other.
pub trait SonarRing<const SONARS: usize> {
    /// Reads every sensor once. There is always a frame: a sensor in trouble is [`Echo::Dead`](crate::ring::Echo::Dead)
    /// in it and counted in `faults`, and the others go on.
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
    Nonsense,
    /// The bus failed while the sensor was addressed.
    Bus,
}

impl SonarFault {
    /// The kind under which the fault is counted.
    pub const fn kind(self) -> FaultKind {
        match self {
            Self::Silent => FaultKind::SonarSilent,
            Self::Nonsense => FaultKind::SonarNonsense,
            Self::Bus => FaultKind::BusError,
        }
    }
}

impl fmt::Display for SonarError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.fault {
            SonarFault::Silent => "did not answer in time",
            SonarFault::Nonsense => "answered with an impossible range",
            SonarFault::Bus => "could not be reached: bus error",
        };
        write!(f, "sonar {} {what}", self.sensor)
    }
}

impl core::error::Error for SonarError {}
