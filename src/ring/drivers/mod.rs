//! Drivers for rings of range sensors, over the traits of `embedded-hal`.
//!
//! | Sensor | Ring | Bus | File |
//! |---|---|---|---|
//! | Devantech SRF02, SRF08, SRF10 | [`Srf08Ring`] | any I2C bus | `srf08.rs` |
//! | MaxBotix I2CXL-MaxSonar | [`MaxBotixRing`] | any I2C bus | `maxbotix.rs` |
//! | HC-SR04 | [`HcSr04Ring`] | two pins for each sensor, and a microsecond clock | `hcsr04.rs` |
//! | ST VL53L1X | [`Vl53l1xRing`] | any I2C bus, and a pin for each sensor | `vl53l1x.rs` |
//! | any lidar | [`RingFrame::from_points`] | | |
//! | any other ring | [`RingFrame::from_ranges`] | | |
//!
//! [`Sc18im700`] is an I2C bus behind a UART. `docs/wiring.md` shows how to wire each ring.
//!
//! The sensors of a ring fire in the groups of its [`FiringPlan`]. [`SonarRing::read`] blocks until the frame is complete.
//! Every wait has a timeout, so it returns in bounded time, however many sensors are dead. I2C sensors have the same address
//! when new; [`change_srf08_address`] and [`change_maxbotix_address`] change it. [`Vl53l1xRing::start`] does it after each
//! power-on.
//!
//! # How to add a sensor
//!
//! One sensor is one file.
//!
//! - **A sensor on I2C**: copy `maxbotix.rs`, the shortest driver. Write a config struct with `DEFAULT` values from the data
//!   sheet, and implement [`I2cRanger`] for it: the messages that start a measurement and read it, and the times between
//!   them. [`I2cRing`] does the rest: firing groups, polling, timeouts and fault counting.
//! - **Any other sensor**: implement [`SonarRing`], here or in another crate. `hcsr04.rs` is an example.
//!
//! Then:
//!
//! 1. State the data sheet in the first lines of the file. An echo outside its limits is [`SonarFault::OutOfRange`]; the
//!    code for "no echo" is [`Echo::Silence`](crate::ring::Echo::Silence).
//! 2. Declare the file in this module and add a line to the table above.
//! 3. Write a model of the sensor in `host/sim/src/chip`, and test the driver against it in `host-tests/tests/sonar`: valid
//!    ranges, each fault, and the bound of the waiting time.
//! 4. Add the driver to the fuzz target `ring_drivers` and to the no-panic proof (`src/bin/no_panic/ring.rs`).
//! 5. Document the wiring and the duration of a frame in `docs/wiring.md`.
//!
//! A ring that returns constant ranges:
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

use core::fmt;

use crate::fault::{FaultCounters, FaultKind};
use crate::ring::RingFrame;

mod address;
mod firing;
mod hcsr04;
mod i2c_ring;
mod maxbotix;
mod reading;
mod sc18im700;
mod sound;
mod srf08;
mod vl53l1x;
mod vl53l1x_settings;

pub use address::{AddressError, change_maxbotix_address, change_srf08_address};
pub use firing::FiringPlan;
pub use hcsr04::{HcSr04Config, HcSr04Ring, MicrosecondClock};
pub use i2c_ring::{I2cRanger, I2cRing, RangingTiming};
pub use maxbotix::{MaxBotixConfig, MaxBotixRing};
pub use reading::Reading;
pub use sc18im700::{BridgeError, Sc18im700};
pub use srf08::{Srf08Config, Srf08Ring};
pub use vl53l1x::{Vl53l1xBudget, Vl53l1xConfig, Vl53l1xRing};

/// A ring of `SONARS` range sensors.
pub trait SonarRing<const SONARS: usize> {
    /// Measures with every sensor once, and returns the frame. Blocks for a bounded time.
    ///
    /// A sensor that fails is [`Echo::Dead`](crate::ring::Echo::Dead) in the frame and recorded in `faults`; the others are
    /// read all the same. [`RingFrame::dead_sensors`] lists those that failed.
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS>;

    /// Returns the last fault of the newest frame, for a log; `None` when all sensors worked.
    fn last_error(&self) -> Option<SonarError>;
}

/// A fault of one sensor of a ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SonarError {
    /// Index of the sensor in the frame.
    pub sensor: u8,
    /// What failed.
    pub fault: SonarFault,
}

/// Why a sensor gave no valid measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SonarFault {
    /// It did not acknowledge its address, or did not complete the measurement before the timeout.
    Silent,
    /// Its range is outside the limits of the data sheet.
    OutOfRange,
    /// The bus or the pin failed.
    Bus,
    /// Its echo line was high before the trigger: the sensor hangs, or the wire is faulty.
    Stuck,
    /// The clock that times the echo does not advance.
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
            SonarFault::Silent => "timed out",
            SonarFault::OutOfRange => "returned a range outside its limits",
            SonarFault::Bus => "is not reachable: bus or pin error",
            SonarFault::Stuck => "holds its echo line high before the trigger",
            SonarFault::Clock => "cannot be timed: the clock does not advance",
        };
        write!(f, "sonar {} {what}", self.sensor)
    }
}

impl core::error::Error for SonarError {}
