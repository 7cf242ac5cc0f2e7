//! The drive: ring frames in, a heading and a speed out, along the generalised Voronoi graph and from place to place.
//!
//! ```text
//! PlaceDetector ─ smoothed ring ─▶ Pilot ─ VelocityCommand ─▶ wheels
//! Filter ─ best map, belief ─▶ Navigator ─ which way ─▶ Pilot
//!                                  ▲ turn hint, back to the filter
//! ```
//!
//! The `Pilot` keeps the robot equidistant from the two closest obstacles, homes in on the point where a third is as
//! close, stands there until the detector reports the place, and leaves by the way that the navigator names. It tells ways
//! apart by their order in bearing, beginning with the one it came by; nothing is metric and there is no odometry. The
//! navigator knows what it did at each place of the history; with the filter's best path that tells which way of a place leads to
//! which vertex, and each revision of the path revises it all.

mod config;
mod departures;
mod navigator;
mod pilot;
mod steering;
mod turning;
mod wheels;

pub use config::{DriveConfig, DriveConfigError};
pub use navigator::{Goal, GoalStatus};
pub use pilot::DriveState;
pub use wheels::{DifferentialDrive, MotorError, Wheel, WheelSpeeds, WheelsConfig, WheelsConfigError};

#[cfg(feature = "snapshot")]
use crate::persist::snapshot::{Reader, Resume, SnapshotError, Writer};
use crate::place::{Place, PlaceDetector};
use crate::{FaultCounters, Filter, Turn, Update, VertexId};
use navigator::Navigator;
use pilot::Pilot;

/// Where to go until the next ring frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VelocityCommand {
    /// The direction to drive in, in milliradians, counter-clockwise from where the first bearing of the ring's geometry is 0.
    pub heading_mrad: i16,
    /// How fast, in thousandths of the robot's full speed; 0 to turn on the spot, or to stand when the heading is 0 as well.
    pub speed_permille: u16,
}

impl VelocityCommand {
    /// Stand still.
    pub const STOP: Self = Self { heading_mrad: 0, speed_permille: 0 };
}

/// The drive of a robot whose maps have at most `V` vertices and whose filter remembers `HISTORY` places.
///
/// Const-constructed to zero. Memory: about `HISTORY + 160` bytes. Time for a ring frame: O(SONARS); at a place O(V · HISTORY).
#[derive(Clone, Debug)]
pub struct Drive<const V: usize, const HISTORY: usize> {
    pilot: Pilot,
    navigator: Navigator<V, HISTORY>,
}

impl<const V: usize, const HISTORY: usize> Drive<V, HISTORY> {
    /// A drive that waits for [`Drive::start`].
    pub const fn new() -> Self {
        Self { pilot: Pilot::new(), navigator: Navigator::new() }
    }

    /// Forgets everything and starts anew: looks for the Voronoi graph, and explores. `seed` decides between equals.
    ///
    /// # Errors
    /// Names the first setting that is out of its range; the drive is then as it was.
    pub fn start(&mut self, config: DriveConfig, seed: u64) -> Result<(), DriveConfigError> {
        config.check()?;
        self.pilot.start(config);
        self.navigator.start(seed);
        Ok(())
    }

    /// Takes what the detector and the filter made of a ring frame, and says where to go. With too few live sensors the robot
    /// stands until it hears again.
    ///
    /// `seen` is what the mapper said of the frame.
    #[inline(never)]
    pub fn advance<const SONARS: usize, F: Filter<V>>(
        &mut self,
        detector: &PlaceDetector<SONARS>,
        filter: &F,
        seen: Option<(&Place, &Update)>,
    ) -> VelocityCommand {
        if let Some((place, update)) = seen {
            self.navigator.arrive(filter, update);
            self.pilot.arrive(place.degree);
        }
        if detector.is_blind() {
            return VelocityCommand::STOP;
        }
        let navigator = &mut self.navigator;
        self.pilot.advance(&detector.scan(), detector.is_at_place(), |ways| navigator.choose(filter, ways))
    }

    /// How the robot left the place before the one it may be at, if it knows: the hint for the filter.
    pub const fn turn(&self) -> Option<Turn> {
        self.pilot.turn()
    }

    /// Explore, go to a vertex, or stand at the next place.
    pub fn set_goal(&mut self, goal: Goal) {
        self.navigator.set_goal(goal);
        self.pilot.reconsider();
    }

    /// Drives at another speed from now on.
    ///
    /// # Errors
    /// [`DriveConfigError::SpeedPermille`]; the drive goes on as it did.
    pub fn set_speed(&mut self, speed_permille: u16) -> Result<(), DriveConfigError> {
        self.pilot.set_speed(speed_permille)
    }

    /// Whether the best map has a way from where the robot is to a vertex.
    pub fn leads_to(&self, filter: &impl Filter<V>, vertex: VertexId) -> bool {
        navigator::leads_to(filter, vertex)
    }

    /// What the drive is asked to do.
    pub const fn goal(&self) -> Goal {
        self.navigator.goal()
    }

    /// How the way to the last goal went.
    pub const fn goal_status(&self) -> GoalStatus {
        self.navigator.goal_status()
    }

    /// What the pilot does.
    pub const fn state(&self) -> DriveState {
        self.pilot.state()
    }

    /// Whether the robot has not left the place that was reported last: [`PlaceDetector::hold_place`] is for it.
    pub const fn holds_place(&self) -> bool {
        self.pilot.holds_place()
    }

    /// The robot was, or may have been, carried: what it did at the newest place led nowhere.
    pub fn kidnapped(&mut self) {
        self.navigator.forget_departure();
        self.pilot.lose_way();
    }

    /// Writes the drive's section of a snapshot: what it did at the places that the filter remembers.
    ///
    /// # Errors
    /// [`SnapshotError::Full`].
    #[cfg(feature = "snapshot")]
    pub fn save(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        self.navigator.save(writer)
    }

    /// Whether a section of a snapshot can be restored.
    ///
    /// # Errors
    /// [`SnapshotError`] says what is wrong with it.
    #[cfg(feature = "snapshot")]
    pub fn check(section: Reader<'_>) -> Result<(), SnapshotError> {
        Navigator::<V, HISTORY>::check(section)
    }

    /// Goes on with a section of a snapshot, or with nothing known, exploring.
    ///
    /// # Errors
    /// As [`Drive::check`].
    #[cfg(feature = "snapshot")]
    pub fn restore(&mut self, section: Option<Reader<'_>>, resume: Resume) -> Result<(), SnapshotError> {
        self.navigator.restore(section)?;
        match resume {
            Resume::InPlace => self.pilot.lose_way(),
            Resume::Elsewhere => self.kidnapped(),
        }
        Ok(())
    }

    /// How often the drive lost its way.
    pub const fn faults(&self) -> &FaultCounters {
        self.pilot.faults()
    }
}

impl<const V: usize, const HISTORY: usize> Default for Drive<V, HISTORY> {
    fn default() -> Self {
        Self::new()
    }
}
