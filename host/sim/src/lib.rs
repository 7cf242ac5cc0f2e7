//! A robot with a sonar ring in a simulated building: a test double for every layer of toposlam.
//!
//! [`world`] is a building on a floor plan and the ring frames that a robot measures in it. [`exploration`] runs the
//! code of the firmware in that building. [`hardware`] reads descriptions of other rings and robots. [`chip`] models the chips on the sensor bus and the flash, and [`injector`]
//! adds faults to frames, bytes and bus transactions.

pub mod chip;
pub mod exploration;
pub mod hardware;
pub mod injector;
mod step;
pub mod world;

pub use step::Step;
