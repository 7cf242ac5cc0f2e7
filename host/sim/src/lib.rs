//! A robot with a sonar ring in a simulated building: a test double for every layer of toposlam.
//!
//! [`world`] is a building on a floor plan, and the ring frames that a robot hears in it. [`exploration`] is the whole robot, driven
//! through that building by the code of the firmware. [`chip`] answers for the chips on its sensor bus and for its flash, and
//! [`injector`] disturbs frames, bytes and bus transactions.

pub mod chip;
pub mod exploration;
pub mod injector;
mod step;
pub mod world;

pub use step::Step;
