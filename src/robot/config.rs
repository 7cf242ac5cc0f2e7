//! The settings of a robot: those of its stages and of its main loop.

use crate::drive::DriveConfig;
use crate::filter::{Filter, OrderedConfig};
use crate::mapper::MapperConfig;
use crate::persist::snapshot::SnapshotPolicy;
use crate::ring::RingGeometry;
use crate::setters::setters;
use crate::wire::{Capacities, FilterSettings, Hello, ResetCause};

/// The settings of a robot; `C` are those of its filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct RobotConfig<const SONARS: usize, C> {
    /// The stages from the ring frame to the map.
    pub mapper: MapperConfig<SONARS, C>,
    /// The drive.
    pub drive: DriveConfig,
    /// When snapshots are stored.
    pub snapshot: SnapshotPolicy,
    /// The longest regular turn of the main loop in milliseconds; a longer one is counted as a fault. Default 1000.
    pub turn_bound_ms: u16,
    /// The number of the start; 0 if the robot does not count them.
    pub boot: u32,
    /// The session id: a random number, different at each start. The default 0 derives one from the first ring frame, whose
    /// noise differs, and from `boot`, `reset_cause`, the seed and the time.
    pub session: u32,
    /// Why the robot started.
    pub reset_cause: ResetCause,
}

impl<const SONARS: usize, C: Copy> RobotConfig<SONARS, C> {
    setters! {
        with_mapper, mapper: MapperConfig<SONARS, C>;
        with_drive, drive: DriveConfig;
        with_snapshot, snapshot: SnapshotPolicy;
        with_turn_bound_ms, turn_bound_ms: u16;
        with_boot, boot: u32;
        with_session, session: u32;
        with_reset_cause, reset_cause: ResetCause;
    }

    /// The settings for a ring of 4 to 128 sensors and a filter.
    ///
    /// A robot that drives itself stands at a meet point until the place is reported. So `settle_frames` is 15, shorter than
    /// the default. All other settings follow from the ring, or are the defaults.
    #[must_use]
    pub const fn new(geometry: RingGeometry<SONARS>, filter: C) -> Self {
        let mut mapper = MapperConfig::new(geometry, filter);
        mapper.place.settle_frames = 15;
        Self {
            mapper,
            drive: DriveConfig::DEFAULT,
            snapshot: SnapshotPolicy::DEFAULT,
            turn_bound_ms: 1000,
            boot: 0,
            session: 0,
            reset_cause: ResetCause::Unknown,
        }
    }
}

impl<const SONARS: usize> RobotConfig<SONARS, OrderedConfig> {
    /// As [`RobotConfig::new`], for the ordered filter with its defaults.
    ///
    /// ```
    /// use toposlam::OrderedFilter;
    /// use toposlam::ring::RingGeometry;
    /// use toposlam::robot::{Robot, RobotConfig};
    ///
    /// let mut robot = Box::new(Robot::<12, 32, OrderedFilter<10, 32, 96, 200>>::new());
    /// robot.start(&RobotConfig::for_ring(RingGeometry::even()), &mut [])?;
    /// # Ok::<(), toposlam::ConfigError>(())
    /// ```
    #[must_use]
    pub const fn for_ring(geometry: RingGeometry<SONARS>) -> Self {
        Self::new(geometry, OrderedConfig::DEFAULT)
    }
}

impl<const SONARS: usize, C: FilterSettings> RobotConfig<SONARS, C> {
    pub(super) const UNSET: Self = Self {
        mapper: MapperConfig::UNSET,
        drive: DriveConfig::UNSET,
        snapshot: SnapshotPolicy { every_places: 0 },
        turn_bound_ms: 0,
        boot: 0,
        session: 0,
        reset_cause: ResetCause::Unknown,
    };

    /// The introduction of a robot with these settings and a filter `F`.
    pub(super) fn hello<const V: usize, F: Filter<V, Config = C>>(&self) -> Hello {
        let capacities = Capacities::of_mapper::<SONARS, V, F>(&self.mapper);
        Hello { session: self.session, ..Hello::new(self.boot, self.reset_cause, self.mapper.seed, capacities) }
    }
}
