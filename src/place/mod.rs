//! Place detection: ring frames in, meet points of the generalised Voronoi graph out.
//!
//! On an edge of the generalised Voronoi graph (Choset and Nagatani; section IV.A of the paper) the two closest obstacles
//! are equidistant. Where a third obstacle is at the same range, the robot is at a *meet point*: a junction, a bend, or the
//! end of a corridor. The common range is the fingerprint of the place.
//!
//! | Step | File |
//! |---|---|
//! | Smooth the ranges of each sensor; fill in dead sensors | `smoothing.rs` |
//! | Find the closest obstacles in separate bearings | `scan.rs` ([`RingScan`]), `obstacles.rs` ([`Obstacles`]) |
//! | Find the openings between them | `openings.rs` ([`Openings`]) |
//! | Estimate the rotation from frame to frame, and while the robot stands | `rotation.rs` |
//! | Follow the way by which the robot came | `came_by.rs` |
//! | Confirm a meet point over several frames and report it once | `detector.rs` ([`PlaceDetector`]) |
//! | Quantise its radius (Eq. 1) | `fingerprint.rs` ([`Fingerprint`]) |
//!
//! The *spread* is the range of the third closest obstacle minus the range of the closest. It falls to the noise at a meet
//! point and rises again behind it. A frame whose spread is at most `equidistance_mm` shows a meet point. After
//! `confirm_frames` of them the meet point is confirmed. When the following frames no longer show it, or after
//! `settle_frames`, the place is reported. The next meet point is searched after the spread has risen above `leave_mm`.
//!
//! A door is a junction although it is narrower than the cone of a sonar: a sensor looks through between its jambs, or the robot came by it
//! (`scan.rs`).
//!
//! The radius and the bearings of the ways are averaged over up to eight frames with the smallest spread. While the robot approaches the third obstacle
//! it moves away from the first two, so the mean range changes little near the meet point and averaging adds little bias.
//!
//! ```
//! use toposlam::place::{PlaceConfig, PlaceDetector};
//! use toposlam::ring::{Echo, RingFrame, RingGeometry};
//!
//! let mut detector = PlaceDetector::<4>::new();
//! detector.start(PlaceConfig::DEFAULT.with_live_sensors_min(4), RingGeometry::even())?;
//! // Along a corridor 1.6 m wide to the wall at its end, and back; the sensor behind receives no echo.
//! let mut places = Vec::new();
//! for step in -50_i32..=50 {
//!     let [ahead, beside] = [800 + 30 * step.unsigned_abs() as u16, 800].map(|range_mm| Echo::Range { range_mm });
//!     places.extend(detector.observe(&RingFrame { echoes: [ahead, beside, Echo::Silence, beside] }));
//! }
//! assert_eq!(places.len(), 1);
//! assert!((800..=820).contains(&places[0].fingerprint.radius_mm()));
//! # Ok::<(), toposlam::ConfigError>(())
//! ```

mod came_by;
mod config;
mod detector;
mod fingerprint;
mod implausible;
mod meet_point;
mod obstacles;
mod openings;
mod rotation;
mod scan;
mod smoothing;

pub use config::PlaceConfig;
pub use detector::{Place, PlaceDetector};
pub use fingerprint::{Fingerprint, FingerprintError};
pub use obstacles::{Obstacle, Obstacles};
pub use openings::Openings;
pub(crate) use openings::is_open;
pub use scan::RingScan;
pub(crate) use scan::SPACING_MRAD;

#[cfg(test)]
mod tests;
