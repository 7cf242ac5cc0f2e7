//! Laptop side of toposlam: the simulated world, recordings, pictures of maps, and the emulator.
//!
//! [`world`] stands in for a building and a robot with a ring of sonars, [`recording`] for a real one; both yield the
//! ring frames that the core's place detector reads. [`picture`] draws a map over its floor plan. [`emulator`] runs the
//! firmware with such frames, [`chip`] answers for the chips on its sensor bus.

pub mod chip;
pub mod emulator;
pub mod picture;
pub mod recording;
pub mod world;
