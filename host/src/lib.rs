//! Laptop side of toposlam: the simulated world, recordings, pictures of maps, and the evaluation.
//!
//! [`world`] stands in for a building and a robot with a ring of sonars, [`recording`] for a real one; both yield the
//! ring frames that the core's place detector reads. [`picture`] draws a map over its floor plan. [`evaluation`] skips
//! sonars and places: it draws fingerprints and measures how often the maps made of them are right.

pub mod evaluation;
pub mod picture;
pub mod recording;
pub mod world;
