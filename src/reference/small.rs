//! The small robot: a ring of eight sensors, and capacities for a microcontroller with 16 KiB of RAM.

use crate::filter::{OrderedConfig, OrderedFilter};
use crate::ring::RingGeometry;
#[cfg(feature = "wire")]
use crate::robot::{Robot, RobotConfig};

/// The number of sensors in the ring.
pub const SONARS: usize = 8;
/// The most hypotheses.
pub const HYPOTHESES: usize = 4;
/// The most vertices of a map.
pub const VERTICES: usize = 16;
/// The most ways of all vertices of a map.
pub const WAYS: usize = 52;
/// The most observations in the history.
pub const HISTORY: usize = 100;

/// Eight sensors 45° apart, counter-clockwise from straight ahead.
pub const RING: RingGeometry<SONARS> = RingGeometry::even();

/// The filter.
pub type Filter = OrderedFilter<HYPOTHESES, VERTICES, WAYS, HISTORY>;
/// The settings of the filter.
pub const FILTER: OrderedConfig = OrderedConfig::DEFAULT;

/// The robot. Its buffer for snapshots may be empty.
#[cfg(feature = "wire")]
pub type SmallRobot<'buffer> = Robot<'buffer, SONARS, VERTICES, Filter>;
/// The settings of the robot. Without a floating-point unit a place takes seconds.
#[cfg(feature = "wire")]
pub const ROBOT: RobotConfig<SONARS, OrderedConfig> = RobotConfig::new(RING, FILTER).with_turn_bound_ms(10_000);
