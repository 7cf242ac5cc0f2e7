//! The small robot: capacities for a microcontroller with 16 KiB of RAM, and a ring of eight sensors.
//!
//! With its buffer for snapshots empty, the whole robot takes less than 12 KiB, which leaves 4 KiB for the stack. The same
//! capacities serve larger rings.
//!
//! ```
//! use toposlam::Filter;
//! use toposlam::reference::small;
//!
//! let mut filter = small::Filter::new();
//! filter.start(small::FILTER, 1)?;
//! assert!(size_of_val(&filter) < 10 * 1024);
//! # Ok::<(), toposlam::ConfigError>(())
//! ```

use crate::filter::{OrderedConfig, OrderedFilter};
#[cfg(feature = "wire")]
use crate::persist::snapshot::SnapshotPolicy;
#[cfg(feature = "wire")]
use crate::ring::RingGeometry;
#[cfg(feature = "wire")]
use crate::robot::{Robot, RobotConfig};

/// The number of sensors in the ring, 45° apart, counter-clockwise from straight ahead.
pub const SONARS: usize = 8;
/// The most hypotheses.
pub const HYPOTHESES: usize = 4;
/// The most vertices of a map.
pub const VERTICES: usize = 16;
/// The most darts of a map: three ways for each vertex, and four more.
pub const DARTS: usize = 52;
/// The most observations in the history.
pub const HISTORY: usize = 100;

/// The filter.
pub type Filter = OrderedFilter<HYPOTHESES, VERTICES, DARTS, HISTORY>;
/// The settings of the filter.
pub const FILTER: OrderedConfig = OrderedConfig::DEFAULT;

/// The robot, with a ring of eight sensors or another number.
#[cfg(feature = "wire")]
pub type SmallRobot<'buffer, const S: usize = SONARS> = Robot<'buffer, S, VERTICES, Filter>;

/// The settings of the robot with an even ring: no snapshots, and turns of the main loop of up to ten seconds, for a processor
/// without a floating-point unit.
#[cfg(feature = "wire")]
#[must_use]
pub const fn robot<const S: usize>() -> RobotConfig<S, OrderedConfig> {
    let snapshot = SnapshotPolicy { every_places: 0 };
    RobotConfig::new(RingGeometry::even(), FILTER).with_snapshot(snapshot).with_turn_bound_ms(10_000)
}

const _: () = assert!(size_of::<Filter>() <= 10 * 1024, "the budget of the filter");
#[cfg(feature = "wire")]
const _: () = assert!(size_of::<SmallRobot<'static, 16>>() <= 12 * 1024 + 640, "the budget of the robot");
