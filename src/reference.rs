//! The reference robot: the capacities and settings that its firmware, the bench and a host's repetition of a run share.
//!
//! A host that feeds the same frames into the same stages gets the same map, bit for bit.
//!
//! ```
//! use toposlam::place::PlaceDetector;
//! use toposlam::reference::{self, SONARS};
//! use toposlam::ring::{Echo, RingFrame, RingGeometry};
//!
//! let mut detector: reference::Detector = PlaceDetector::new();
//! detector.start(reference::PLACE, RingGeometry::even())?;
//! // Silence all around is no place.
//! assert!(detector.observe(&RingFrame { echoes: [Echo::Silence; SONARS] }).is_none());
//! # Ok::<(), toposlam::ConfigError>(())
//! ```

#[cfg(feature = "wire")]
use crate::robot::{Robot, RobotConfig};
use crate::{
    Config, Direction, Mapper, MapperConfig, PaperFilter, RobustConfig, RobustFilter, place::PlaceConfig,
    place::PlaceDetector, ring::RingGeometry,
};

/// Sonars in the ring.
pub const SONARS: usize = 16;
/// The most hypotheses.
pub const HYPOTHESES: usize = 10;
/// The most vertices of a map.
pub const VERTICES: usize = 16;
/// The most observations in the history.
pub const HISTORY: usize = 400;
/// The seed of the filter's draws.
pub const SEED: u64 = 1;

/// Sixteen sonars 22.5° apart, counter-clockwise, the first straight ahead.
pub const RING: RingGeometry<SONARS> = RingGeometry::even();
/// The detector's settings.
///
/// A robot that drives itself stands at a meet point until the place is reported; it need not stand so long as one that
/// somebody else has parked.
pub const PLACE: PlaceConfig = PlaceConfig { settle_frames: 15, ..PlaceConfig::DEFAULT };
/// The filter's settings.
pub const FILTER: RobustConfig = RobustConfig::DEFAULT;

/// The buffer for a snapshot, in bytes.
#[cfg(feature = "snapshot")]
pub const SNAPSHOT_BYTES: usize = 8 * 1024;

/// Where its flash keeps snapshots: the last two sectors of 128 KiB of 1 MiB, as offsets.
#[cfg(feature = "store")]
pub const STORE: core::ops::Range<u32> = 0xC_0000..0x10_0000;

/// The detector of the reference robot.
pub type Detector = PlaceDetector<SONARS>;
/// The filter of the reference robot.
pub type Filter = RobustFilter<HYPOTHESES, VERTICES, HISTORY>;
/// All stages of the reference robot in one.
pub type RobotMapper = Mapper<SONARS, VERTICES, Filter>;
/// The settings of all stages of the reference robot.
pub const MAPPER: MapperConfig<SONARS, RobustConfig> =
    MapperConfig { geometry: RING, place: PLACE, filter: FILTER, seed: SEED };

/// The whole robot: all stages, the drive and its commands.
#[cfg(feature = "wire")]
pub type ReferenceRobot<'buffer> = Robot<'buffer, SONARS, HYPOTHESES, VERTICES, HISTORY>;
/// The settings of the whole robot.
#[cfg(feature = "wire")]
pub const ROBOT: RobotConfig<SONARS> = RobotConfig::for_ring(RING);

/// The most particles of the paper's filter, where it stands in for the reference robot's.
pub const PAPER_PARTICLES: usize = 10;
/// Words of its history: 32 observations each, so 256.
pub const PAPER_HISTORY_WORDS: usize = 8;
/// The settings of the paper's filter: the defaults, with the half of Eq. 2 that asks whether the map explains what was
/// observed. On line the other half blames the map for what the robot has not driven yet, and costs several times as much
/// (`docs/costs.md`).
pub const PAPER_FILTER: Config = Config { direction: Direction::HistoryToMap, ..Config::DEFAULT };
/// The paper's filter in the place of the reference robot's.
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
