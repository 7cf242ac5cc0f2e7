//! The reference robot: the capacities and settings of its firmware, of the bench, and of repetitions of a run on a host.
//!
//! The same frames give the same map on a host and on the robot, bit for bit. The reference robot has the ordered
//! filter ([`ordered`]); [`robust`] and [`paper`] have the same robot with the other filters.
//!
//! ```
//! use toposlam::place::PlaceDetector;
//! use toposlam::reference::{self, SONARS};
//! use toposlam::ring::{Echo, RingFrame, RingGeometry};
//!
//! let mut detector: reference::Detector = PlaceDetector::new();
//! detector.start(reference::PLACE, RingGeometry::even())?;
//! // A frame without echoes is not a place.
//! assert!(detector.observe(&RingFrame { echoes: [Echo::Silence; SONARS] }).is_none());
//! # Ok::<(), toposlam::ConfigError>(())
//! ```

pub mod ordered;
pub mod paper;
pub mod robust;
pub mod small;

#[cfg(feature = "snapshot")]
pub use ordered::SNAPSHOT_BYTES;
pub use ordered::{DARTS, FILTER, Filter, HISTORY, HYPOTHESES, MAPPER, RobotMapper, VERTICES};
#[cfg(feature = "wire")]
pub use ordered::{ROBOT, ReferenceRobot};

use crate::place::{PlaceConfig, PlaceDetector};
use crate::ring::RingGeometry;

/// The number of sensors in the ring.
pub const SONARS: usize = 16;
/// The seed of the filter's draws.
pub const SEED: u64 = 1;

/// Sixteen sensors 22.5° apart, counter-clockwise from straight ahead.
pub const RING: RingGeometry<SONARS> = RingGeometry::even();
/// The settings of the place detector.
///
/// A robot that drives itself stands at a meet point until the place is reported. So `settle_frames` is shorter than the
/// default, which suits a robot that is driven by hand.
pub const PLACE: PlaceConfig = PlaceConfig { settle_frames: 15, ..PlaceConfig::DEFAULT };

/// The range of flash for snapshots: the last two sectors of 128 KiB of 1 MiB, as offsets.
#[cfg(feature = "store")]
pub const STORE: core::ops::Range<u32> = 0xC_0000..0x10_0000;

/// The detector of the reference robot.
pub type Detector = PlaceDetector<SONARS>;

#[cfg(all(test, feature = "wire"))]
mod tests {
    use super::*;
    use crate::drive::DriveConfig;
    use crate::persist::snapshot::SnapshotPolicy;
    use crate::robot::RobotConfig;
    use crate::wire::ResetCause;

    #[test]
    fn the_settings_for_a_ring_of_sixteen_are_those_of_the_reference_robot() {
        let expected = RobotConfig {
            mapper: MAPPER,
            drive: DriveConfig::DEFAULT,
            snapshot: SnapshotPolicy::DEFAULT,
            turn_bound_ms: 1000,
            boot: 0,
            session: 0,
            reset_cause: ResetCause::Unknown,
        };
        assert_eq!(ROBOT, expected);
    }

    #[test]
    fn a_ring_of_any_size_has_valid_settings() {
        fn check<const SONARS: usize>() {
            let place = PlaceConfig::for_ring(&RingGeometry::<SONARS>::even());
            assert_eq!(place.check(SONARS), Ok(()), "{SONARS}");
        }
        check::<4>();
        check::<5>();
        check::<8>();
        check::<12>();
        check::<24>();
        check::<128>();
    }
}
