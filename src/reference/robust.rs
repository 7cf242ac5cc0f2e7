//! The reference robot with the robust filter.

use super::{RING, SEED, SONARS};
use crate::filter::{RobustConfig, RobustFilter};
use crate::mapper::{Mapper, MapperConfig};
#[cfg(feature = "wire")]
use crate::robot::{Robot, RobotConfig};

/// The most hypotheses.
pub const HYPOTHESES: usize = 10;
/// The most vertices of a map.
pub const VERTICES: usize = 16;
/// The most observations in the history.
pub const HISTORY: usize = 400;

/// The filter.
pub type Filter = RobustFilter<HYPOTHESES, VERTICES, HISTORY>;
/// The settings of the filter.
pub const FILTER: RobustConfig = RobustConfig::DEFAULT;

/// The mapper.
pub type RobotMapper = Mapper<SONARS, VERTICES, Filter>;
/// The settings of the mapper.
pub const MAPPER: MapperConfig<SONARS, RobustConfig> =
    MapperConfig { geometry: RING, place: super::PLACE, filter: FILTER, seed: SEED };

/// The size of the buffer for snapshots in bytes.
#[cfg(feature = "snapshot")]
pub const SNAPSHOT_BYTES: usize = 8 * 1024;

/// The robot.
#[cfg(feature = "wire")]
pub type ReferenceRobot<'buffer> = Robot<'buffer, SONARS, VERTICES, Filter>;
/// The settings of the robot.
#[cfg(feature = "wire")]
pub const ROBOT: RobotConfig<SONARS, RobustConfig> = RobotConfig::new(RING, FILTER);

#[cfg(feature = "snapshot")]
const _: () = assert!(Filter::SNAPSHOT_BYTES <= SNAPSHOT_BYTES, "the buffer has room for every hypothesis");
