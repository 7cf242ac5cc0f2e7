//! Behavioural models of the sensors, of the chips between them and the controller, and of its flash, for the emulator and for
//! tests.
//!
//! [`Sc18im700`] takes the bytes that the firmware sends and gives back the bytes that the real chip would; behind it, or on
//! an [`I2cBus`] of the controller's own, [`Srf08Bank`] and [`MaxBotixBank`] answer for rangers. [`HcSr04Bank`] moves the
//! pins of its rangers. All of them stand in a world of ring frames; [`SimulatedTime`] is the time of those that need one.
//! [`FlashModel`] is a NOR flash whose power can be cut at any operation.

mod bus;
mod flash;
mod hcsr04;
mod maxbotix;
mod sc18im700;
mod srf08;
mod surroundings;
mod time;

pub use bus::{BusAnswer, I2cBus, I2cDevices};
pub use flash::{Cut, FlashFault, FlashModel, Tear};
pub use hcsr04::{EchoPin, HcSr04Bank, HcSr04Fault, PinBroken, TriggerPin};
pub use maxbotix::MaxBotixBank;
pub use sc18im700::Sc18im700;
pub use srf08::Srf08Bank;
pub use time::SimulatedTime;

/// A defect that a test gives a sensor on an I2C bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorFault {
    /// It does not acknowledge its address.
    Absent,
    /// It acknowledges and ranges for ever.
    NeverDone,
    /// It answers 0, whatever is there.
    Zeros,
    /// It answers 65,535.
    OutOfRange,
    /// It refuses the data that is written to it.
    RefusesData,
    /// It blocks the bus whenever it is read.
    BlocksBus,
}
