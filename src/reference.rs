//! The reference robot: the capacities and settings of its firmware, of the bench, and of repetitions of a run on a host.
//!
//! The same frames give the same map on a host and on the robot, bit for bit.
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

use crate::filter::{Direction, PaperConfig, PaperFilter, RobustConfig, RobustFilter};
use crate::mapper::{Mapper, MapperConfig};
use crate::place::PlaceConfig;
use crate::place::PlaceDetector;
use crate::ring::RingGeometry;
#[cfg(feature = "wire")]
use crate::robot::{Robot, RobotConfig};

/// The number of sensors in the ring.
pub const SONARS: usize = 16;
/// The most hypotheses.
pub const HYPOTHESES: usize = 10;
/// The most vertices of a map.
pub const VERTICES: usize = 16;
/// The most observations in the history.
pub const HISTORY: usize = 400;
/// The seed of the filter's draws.
pub const SEED: u64 = 1;

/// Sixteen sensors 22.5° apart, counter-clockwise from straight ahead.
pub const RING: RingGeometry<SONARS> = RingGeometry::even();
/// The settings of the place detector.
///
/// A robot that drives itself stands at a meet point until the place is reported. So `settle_frames` is shorter than the
/// default, which suits a robot that is driven by hand.
pub const PLACE: PlaceConfig = PlaceConfig { settle_frames: 15, ..PlaceConfig::DEFAULT };
/// The settings of the filter.
pub const FILTER: RobustConfig = RobustConfig::DEFAULT;

/// The size of the buffer for snapshots in bytes.
#[cfg(feature = "snapshot")]
pub const SNAPSHOT_BYTES: usize = 8 * 1024;

/// The range of flash for snapshots: the last two sectors of 128 KiB of 1 MiB, as offsets.
#[cfg(feature = "store")]
pub const STORE: core::ops::Range<u32> = 0xC_0000..0x10_0000;

/// The detector of the reference robot.
pub type Detector = PlaceDetector<SONARS>;
/// The filter of the reference robot.
pub type Filter = RobustFilter<HYPOTHESES, VERTICES, HISTORY>;
/// The mapper of the reference robot.
pub type RobotMapper = Mapper<SONARS, VERTICES, Filter>;
/// The settings of the mapper.
pub const MAPPER: MapperConfig<SONARS, RobustConfig> =
    MapperConfig { geometry: RING, place: PLACE, filter: FILTER, seed: SEED };

/// The reference robot.
#[cfg(feature = "wire")]
pub type ReferenceRobot<'buffer> = Robot<'buffer, SONARS, HYPOTHESES, VERTICES, HISTORY>;
/// The settings of the reference robot.
#[cfg(feature = "wire")]
pub const ROBOT: RobotConfig<SONARS> = RobotConfig::for_ring(RING);

/// The most particles of the paper's filter in place of the robust one.
pub const PAPER_PARTICLES: usize = 10;
/// Words of its history, 32 observations each: 256 observations.
pub const PAPER_HISTORY_WORDS: usize = 8;
/// The settings of the paper's filter: the defaults, with the half of Eq. 2 from the history to the map. While the robot
/// explores, the other half penalises the map for corridors that were not driven yet; it also costs several times as much
/// (`docs/costs.md`).
pub const PAPER_FILTER: PaperConfig = PaperConfig { direction: Direction::HistoryToMap, ..PaperConfig::DEFAULT };
/// The paper's filter in place of the robust one.
pub type PaperReference = PaperFilter<PAPER_PARTICLES, VERTICES, PAPER_HISTORY_WORDS>;

#[cfg(feature = "snapshot")]
const _: () =
    assert!(Filter::SNAPSHOT_BYTES + HISTORY + 16 <= SNAPSHOT_BYTES, "the buffer has room for every hypothesis");

#[cfg(all(test, feature = "wire"))]
mod tests {
    use super::*;
    use crate::drive::DriveConfig;
    use crate::persist::snapshot::SnapshotPolicy;
    use crate::wire::ResetCause;

    #[test]
    fn the_settings_for_a_ring_of_sixteen_are_those_of_the_reference_robot() {
        let expected = RobotConfig {
            mapper: MAPPER,
            drive: DriveConfig::DEFAULT,
            snapshot: SnapshotPolicy::DEFAULT,
            turn_bound_ms: 1000,
            boot: 0,
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
