//! Behavioural models of the chips on the robot's sensor bus and of its flash, for the emulator and for tests.
//!
//! [`Sc18im700`] takes the bytes that the firmware sends and gives back the bytes that the real chip would; behind it,
//! [`Srf08Bank`] answers for sixteen rangers that stand in a world of ring frames. [`FlashModel`] is a NOR flash whose power can
//! be cut at any operation.

mod flash;
mod sc18im700;
mod srf08;

pub use flash::{Cut, FlashFault, FlashModel, Tear};
pub use sc18im700::{BusAnswer, I2cDevices, Sc18im700};
pub use srf08::{SensorFault, Srf08Bank};
