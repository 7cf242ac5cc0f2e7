//! The reference robot with the ordered filter.

use super::{RING, SEED, SONARS};
use crate::filter::{OrderedConfig, OrderedFilter};
use crate::mapper::{Mapper, MapperConfig};
#[cfg(feature = "wire")]
use crate::robot::{Robot, RobotConfig};

/// The most hypotheses.
pub const HYPOTHESES: usize = 9;
/// The most vertices of a map.
pub const VERTICES: usize = 64;
/// The most darts of a map: three ways for each vertex.
pub const DARTS: usize = 192;
/// The most observations in the history.
pub const HISTORY: usize = 272;

/// The filter.
pub type Filter = OrderedFilter<HYPOTHESES, VERTICES, DARTS, HISTORY>;
/// The settings of the filter. The travel times of a robot with this drive deviate by 1 to 3 %.
pub const FILTER: OrderedConfig = OrderedConfig::DEFAULT.with_travel_noise_permille(40);

/// The mapper.
pub type RobotMapper = Mapper<SONARS, VERTICES, Filter>;
/// The settings of the mapper.
pub const MAPPER: MapperConfig<SONARS, OrderedConfig> =
    MapperConfig { geometry: RING, place: super::PLACE, filter: FILTER, seed: SEED };

/// The size of the buffer for snapshots in bytes. It has room for every hypothesis of a map of some 20 vertices with a full
/// history, and for the best ones of larger maps.
#[cfg(feature = "snapshot")]
pub const SNAPSHOT_BYTES: usize = 14 * 1024;

/// The robot.
#[cfg(feature = "wire")]
pub type ReferenceRobot<'buffer> = Robot<'buffer, SONARS, VERTICES, Filter>;
/// The settings of the robot.
#[cfg(feature = "wire")]
pub const ROBOT: RobotConfig<SONARS, OrderedConfig> = RobotConfig::new(RING, FILTER);

const _: () = assert!(size_of::<Filter>() <= 48 * 1024, "the budget of the filter");
