//! The robot's settings: those of its stages, and how its main loop runs.

use crate::drive::DriveConfig;
use crate::persist::snapshot::SnapshotPolicy;
use crate::wire::{Capacities, Hello, ResetCause};
use crate::{Filter, MapperConfig, RobustConfig};

/// The settings of every stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotConfig<const SONARS: usize> {
    /// From the ring frame to the map.
    pub mapper: MapperConfig<SONARS, RobustConfig>,
    /// From the map to the wheels.
    pub drive: DriveConfig,
    /// When snapshots are kept.
    pub snapshot: SnapshotPolicy,
    /// A turn of the main loop that takes longer is counted as a fault, in milliseconds.
    pub turn_bound_ms: u16,
    /// A number that differs from one start of the robot to the next; 0 if there is none.
    pub boot: u32,
    /// Why the robot started.
    pub reset_cause: ResetCause,
}

impl<const SONARS: usize> RobotConfig<SONARS> {
    pub(super) const UNSET: Self = Self {
        mapper: MapperConfig::UNSET,
        drive: DriveConfig::UNSET,
        snapshot: SnapshotPolicy { every_places: 0 },
        turn_bound_ms: 0,
        boot: 0,
        reset_cause: ResetCause::Unknown,
    };

    /// The introduction of a robot with these settings and a filter `F`.
    pub(super) fn hello<const V: usize, F: Filter<V, Config = RobustConfig>>(&self) -> Hello {
        let capacities = Capacities::of_mapper::<SONARS, V, F>(&self.mapper);
        Hello::new(self.boot, self.reset_cause, self.mapper.seed, capacities)
    }
}
