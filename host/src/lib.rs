//! Laptop side of toposlam: the simulated world, recordings, and pictures of maps.
//!
//! [`world`] stands in for a building and a robot with a ring of sonars, [`recording`] for a real one; both yield the
//! ring frames that the core's place detector reads. [`picture`] draws a map over its floor plan.

pub mod picture;
pub mod recording;
pub mod world;
