//! Motion planning: ring frames in, a velocity command out, along the generalised Voronoi graph and from place to place.
//!
//! ```text
//! PlaceDetector ─ RingScan ─▶ local planner ─ VelocityCommand ─▶ wheels
//! Filter ─ best map, path ─▶ route planner ─ exit ─▶ local planner
//! Passage ◀── exit, travel time, way it came by ── local planner
//! ```
//!
//! | Step | File |
//! |---|---|
//! | Heading along an edge, position of a meet point | `voronoi.rs` |
//! | Gaps that the body does not fit through, walls that hold it | `body.rs` |
//! | The newest frame, and the range ahead | `frame.rs` |
//! | The way back through a door that no sonar looks through | `way_back.rs` |
//! | The doors of the ways of the map | `doors.rs` |
//! | Walls of halls wider than the sonars reach | `hall.rs` |
//! | Heading and speed along an edge | `steering.rs` |
//! | The hints of the next observation | `departure.rs` |
//! | State machine from place to place ([`DriveState`]) | `local_planner.rs` |
//! | Choice of an exit: explore, or drive to a vertex ([`Goal`]) | `route_planner.rs` |
//! | Travel times over the ways of the map | `routes.rs` |
//! | Velocity command to PWM ([`DifferentialDrive`]) | `wheels.rs` |
//!
//! The local planner keeps the robot equidistant from the two closest obstacles. It stops where a third is equidistant,
//! until the detector reports the place, and leaves by the exit that the route planner chooses. The exits of a place are known
//! by their bearings relative to the way by which the robot entered. There is no metric position and no odometry. The route
//! planner matches the exits to the ways of the filter's best map by these bearings, and stores nothing of them: every revision
//! of the map applies at once.

mod body;
mod config;
mod departure;
mod doors;
mod frame;
mod hall;
mod local_planner;
mod route_planner;
mod routes;
mod steering;
#[cfg(test)]
mod test_ring;
mod voronoi;
mod way_back;
mod wheels;

pub use config::DriveConfig;
pub use local_planner::DriveState;
pub use route_planner::{Goal, GoalStatus};
pub use wheels::{DifferentialDrive, MotorError, Wheel, WheelSpeeds, WheelsConfig};

use crate::config_error::ConfigError;
use crate::fault::FaultCounters;
use crate::filter::{Filter, Passage};
use crate::map::VertexId;
use crate::place::{Place, PlaceDetector};
use frame::Frame;
use local_planner::LocalPlanner;
use route_planner::RoutePlanner;

/// Heading and speed to drive with until the next ring frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VelocityCommand {
    /// Direction in milliradians, −3142 to 3142: counter-clockwise from bearing 0 of the ring's geometry.
    pub heading_mrad: i16,
    /// Speed in thousandths of the robot's full speed, 0 to 1000. With 0 the robot turns in place, or stops when the heading
    /// is 0 as well.
    pub speed_permille: u16,
}

impl VelocityCommand {
    /// Stops the robot.
    pub const STOP: Self = Self { heading_mrad: 0, speed_permille: 0 };
}

/// The motion planner of a robot whose maps have at most `V` vertices.
///
/// It explores and drives to vertices with a filter that knows the ways of its map ([`Filter::darts`]). With another filter it
/// leaves each place by an exit at random, and no vertex can be its goal.
///
/// A `static` of it is in `.bss`. Memory: about 120 bytes. Time for a ring frame: O(SONARS); at a place O(V² + D) for a map of D
/// darts.
#[derive(Clone, Debug)]
pub struct Drive<const V: usize> {
    local_planner: LocalPlanner,
    route_planner: RoutePlanner<V>,
}

impl<const V: usize> Drive<V> {
    /// Creates a drive that is not started.
    pub const fn new() -> Self {
        Self { local_planner: LocalPlanner::new(), route_planner: RoutePlanner::new() }
    }

    /// Resets the drive and starts it: it searches for the Voronoi graph and explores. `seed` decides between equal exits.
    ///
    /// # Errors
    /// The first setting that is out of its range; the drive does not change then.
    pub fn start(&mut self, config: DriveConfig, seed: u64) -> Result<(), ConfigError> {
        config.check()?;
        self.local_planner.start(config);
        self.route_planner.start(seed);
        Ok(())
    }

    /// Returns the velocity command for a ring frame that the detector and the filter have processed.
    ///
    /// `place` is the place that the frame completed, if any; the filter has observed it. With too few live sensors the robot
    /// stops until there are enough again.
    #[inline(never)]
    pub fn advance<const SONARS: usize, F: Filter<V>>(
        &mut self,
        detector: &PlaceDetector<SONARS>,
        filter: &F,
        place: Option<&Place>,
    ) -> VelocityCommand {
        if let Some(place) = place {
            self.route_planner.arrive(filter);
            self.local_planner.arrive(place.ways);
        } else if self.local_planner.has_returned(detector.is_at_place()) {
            self.route_planner.refuse(filter);
            self.local_planner.arrive_again();
        }
        if detector.is_blind() {
            return VelocityCommand::STOP;
        }
        let route_planner = &mut self.route_planner;
        self.local_planner.advance(&Frame::of(detector), |exits, door| route_planner.choose(filter, exits, door))
    }

    /// How the robot drives from the place that was reported last: the hints of the next observation.
    ///
    /// The exit and the bearing of the way by which the robot came are measured at each place. The travel time is the number of
    /// ring frames, each weighted by the speed of its velocity command: the time of the same way at full speed, without that for
    /// turns in place.
    pub fn passage(&self) -> Passage {
        self.local_planner.passage()
    }

    /// Sets the goal. A robot that stopped at a place chooses an exit again.
    pub fn set_goal(&mut self, goal: Goal) {
        self.route_planner.set_goal(goal);
        self.local_planner.reconsider();
    }

    /// Sets the speed along edges, in thousandths of full speed, 1 to 1000.
    ///
    /// # Errors
    /// [`ConfigError`]; the speed does not change then.
    pub fn set_speed(&mut self, speed_permille: u16) -> Result<(), ConfigError> {
        self.local_planner.set_speed(speed_permille)
    }

    /// Whether the map is complete: each way that the robot could reach was driven, and each edge twice. It patrols the edges with
    /// the fewest passages, so that mistakes of the map are found.
    ///
    /// A way that at most a third of the visits to its vertex have shown does not count. The map must be more likely than not, and
    /// all must hold at two more successive places than the map has edges; three successive places with a way to drive end it.
    pub const fn is_complete(&self) -> bool {
        self.route_planner.is_complete()
    }

    /// Whether the best map has a path from the robot's vertex to another one. Time O(V² + D).
    pub fn leads_to(&self, filter: &impl Filter<V>, vertex: VertexId) -> bool {
        route_planner::leads_to(filter, vertex)
    }

    /// The current goal.
    pub const fn goal(&self) -> Goal {
        self.route_planner.goal()
    }

    /// The status of the current goal, if it is a vertex.
    pub const fn goal_status(&self) -> GoalStatus {
        self.route_planner.goal_status()
    }

    /// What the drive is doing.
    pub const fn state(&self) -> DriveState {
        self.local_planner.state()
    }

    /// Whether the robot has not left the place that was reported last. If so, call [`PlaceDetector::hold_place`].
    pub const fn holds_place(&self) -> bool {
        self.local_planner.holds_place()
    }

    /// Whether the robot turns away from a wall, or stands in a gap that is too narrow for it. What it measures there is no place:
    /// call [`PlaceDetector::forget_sightings`].
    pub const fn is_stuck(&self) -> bool {
        self.local_planner.is_stuck()
    }

    /// Announces that the robot may have been moved to another place. What it knows of its way is void.
    pub fn kidnapped(&mut self) {
        self.local_planner.forget_edge();
    }

    /// Starts to explore with a restored map.
    #[cfg(feature = "wire")]
    pub(crate) fn resume(&mut self) {
        self.route_planner.set_goal(Goal::Explore);
        self.local_planner.forget_edge();
    }

    /// Faults since the start: how often the drive lost the graph ([`FaultKind::DriveLost`](crate::FaultKind::DriveLost)).
    pub const fn faults(&self) -> &FaultCounters {
        self.local_planner.faults()
    }
}

impl<const V: usize> Default for Drive<V> {
    fn default() -> Self {
        Self::new()
    }
}
