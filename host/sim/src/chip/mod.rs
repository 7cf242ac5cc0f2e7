//! Behavioural models of the sensors, of the bridge between them and the controller, and of the flash, for the emulator
//! and for tests.
//!
//! [`Sc18im700`] takes the bytes that the firmware sends and returns the bytes that the real chip would return.
//! [`Srf08Bank`], [`MaxBotixBank`] and [`Vl53l1xBank`] are rangers behind the bridge, or on an [`I2cBus`] of the controller's own.
//! [`HcSr04Bank`] drives the pins of its rangers. All rangers measure a world of ring frames; [`SimulatedTime`] is the
//! clock of those that need one. [`FlashModel`] is a NOR flash whose power can be cut at any operation.

mod bus;
mod flash;
mod hcsr04;
mod maxbotix;
mod sc18im700;
mod srf08;
mod surroundings;
mod time;
mod vl53l1x;

pub use bus::{BusAnswer, I2cBus, I2cDevices};
pub use flash::{Cut, FlashFault, FlashModel, Tear};
pub use hcsr04::{EchoPin, HcSr04Bank, HcSr04Fault, PinBroken, TriggerPin};
pub use maxbotix::MaxBotixBank;
pub use sc18im700::Sc18im700;
pub use srf08::Srf08Bank;
pub use time::SimulatedTime;
pub use vl53l1x::{Vl53l1xBank, Xshut};

/// A fault that a test injects into a sensor on an I2C bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorFault {
    /// It does not acknowledge its address.
    Absent,
    /// It acknowledges its address and never finishes ranging.
    NeverDone,
    /// It always reports 0.
    Zeros,
    /// It always reports 65,535.
    OutOfRange,
    /// It does not acknowledge the data of a write.
    RefusesData,
    /// It blocks the bus on every read.
    BlocksBus,
}
