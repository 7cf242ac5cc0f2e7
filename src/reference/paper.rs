//! The reference robot with the paper's particle filter.

use super::{RING, SEED, SONARS};
use crate::filter::{Direction, PaperConfig, PaperFilter};
use crate::mapper::{Mapper, MapperConfig};
#[cfg(feature = "wire")]
use crate::robot::{Robot, RobotConfig};

/// The most particles.
pub const PARTICLES: usize = 10;
/// The most vertices of a map.
pub const VERTICES: usize = 16;
/// Words of the history, 32 observations each: 256 observations.
pub const HISTORY_WORDS: usize = 8;

/// The filter.
pub type Filter = PaperFilter<PARTICLES, VERTICES, HISTORY_WORDS>;
/// The settings of the filter: the defaults, with the half of Eq. 2 from the history to the map. While the robot explores, the
/// other half penalises the map for corridors that were not driven yet; it also costs several times as much (`docs/costs.md`).
pub const FILTER: PaperConfig = PaperConfig { direction: Direction::HistoryToMap, ..PaperConfig::DEFAULT };

/// The mapper.
pub type RobotMapper = Mapper<SONARS, VERTICES, Filter>;
/// The settings of the mapper.
pub const MAPPER: MapperConfig<SONARS, PaperConfig> =
    MapperConfig { geometry: RING, place: super::PLACE, filter: FILTER, seed: SEED };

/// The size of the buffer for snapshots in bytes.
#[cfg(feature = "snapshot")]
pub const SNAPSHOT_BYTES: usize = 4 * 1024;

/// The robot.
#[cfg(feature = "wire")]
pub type ReferenceRobot<'buffer> = Robot<'buffer, SONARS, VERTICES, Filter>;
/// The settings of the robot.
#[cfg(feature = "wire")]
pub const ROBOT: RobotConfig<SONARS, PaperConfig> = RobotConfig::new(RING, FILTER);

#[cfg(feature = "snapshot")]
const _: () = assert!(Filter::SNAPSHOT_BYTES <= SNAPSHOT_BYTES, "the buffer has room for every particle");
