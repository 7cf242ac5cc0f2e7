//! The ring of range sensors: its frames, its geometry, and drivers that read it.
//!
//! A ring has 3 to 128 sensors in one plane around the robot. A [`RingFrame`] holds one [`Echo`] for each of them, and a
//! [`RingGeometry`] the direction of each. A type that returns frames is a [`SonarRing`](drivers::SonarRing).

pub mod drivers;
mod frame;
mod geometry;

pub use frame::{Echo, RingFrame, ScanPoint};
pub(crate) use geometry::MAX_SONARS;
pub use geometry::RingGeometry;
