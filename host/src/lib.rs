//! Laptop side of toposlam: the simulated world, recordings, the emulated robot, pictures of maps, and their evaluation.
//!
//! [`world`] stands in for a building and a robot with a ring of sonars, [`recording`] for a real one; both yield the
//! ring frames that the core's mapper reads. [`chip`] plays the sensors of that world to the firmware in the
//! [`emulator`]. [`picture`] draws a map over its floor plan, and [`evaluation`] measures how often maps are right.

pub mod chip;
pub mod emulator;
pub mod evaluation;
pub mod picture;
pub mod recording;
pub mod world;
