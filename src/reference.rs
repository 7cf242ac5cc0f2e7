//! The reference robot: the capacities and settings that its firmware, the bench and a host's repetition of a run share.
//!
//! A host that feeds the same frames into the same stages gets the same map, bit for bit.

use crate::{Config, Direction, PaperFilter, place::PlaceConfig, place::PlaceDetector, ring::RingGeometry};
#[cfg(feature = "wire")]
use crate::{Mapper, MapperConfig};

/// Sonars in the ring.
pub const SONARS: usize = 16;
/// The most particles.
pub const PARTICLES: usize = 10;
/// The most vertices of a map.
pub const VERTICES: usize = 16;
/// Words of the history: 32 observations each, so 256.
pub const HISTORY_WORDS: usize = 8;
/// The seed of the filter's draws.
pub const SEED: u64 = 1;

/// Sixteen sonars 22.5° apart, counter-clockwise, the first straight ahead.
pub const RING: RingGeometry<SONARS> = RingGeometry::even();
/// The detector's settings.
pub const PLACE: PlaceConfig = PlaceConfig::DEFAULT;
/// The filter's settings: the defaults, with the half of Eq. 2 that asks whether the map explains what was observed. On line
/// the other half blames the map for what the robot has not driven yet, and costs several times as much (`docs/costs.md`).
pub const FILTER: Config = Config { direction: Direction::HistoryToMap, ..Config::DEFAULT };

/// The detector of the reference robot.
pub type Detector = PlaceDetector<SONARS>;
/// The filter of the reference robot.
pub type Filter = PaperFilter<PARTICLES, VERTICES, HISTORY_WORDS>;
/// All stages of the reference robot in one.
#[cfg(feature = "wire")]
pub type RobotMapper = Mapper<SONARS, PARTICLES, VERTICES, HISTORY_WORDS>;
/// The settings of all stages of the reference robot.
#[cfg(feature = "wire")]
pub const MAPPER: MapperConfig<SONARS> =
    MapperConfig { geometry: RING, place: PLACE, filter: FILTER, seed: SEED, boot: 0 };
