//! Drives from one place to the next: along an edge, to the meet point, and out by the chosen exit.

use super::body::{Body, widest_room_mrad};
use super::departure::Departure;
use super::frame::{FACING_MRAD, Frame};
use super::hall::Hall;
use super::steering::{heading_mrad, look_round_mrad, speed_beside_permille, speed_permille_at, sway_mrad};
use super::voronoi::{Sector, meet_point_offset_mm};
use super::way_back::{Gap, WayBack};
use super::{DriveConfig, VelocityCommand};
use crate::bearing::{HALF_TURN_MRAD, counter_clockwise_mrad, rotated, turn_mrad};
use crate::config_error::ConfigError;
use crate::fault::{FaultCounters, FaultKind};
use crate::filter::Passage;
use crate::place::{Obstacles, Openings, SPACING_MRAD};
use crate::ring::Echo;
use crate::top_k::TopK;

/// An opening is matched to the one of the frame before when its bearing changed by at most this, in milliradians.
const SAME_OPENING_MRAD: u16 = 700;
/// The same in a frame that shows another number of openings.
const DOUBTFUL_OPENING_MRAD: u16 = 350;
/// Limit of the heading of a turn in place, in milliradians: with the default wheels the ring turns by 72 mrad per frame, so that the
/// smoothed ranges of a sensor are from one direction.
const TURN_MRAD: i16 = 300;
/// An exit whose bearing relative to the way by which the robot came differs by more than this after the turn is unknown, in milliradians.
const SAME_EXIT_MRAD: i32 = 500;
/// On the way out an exit is searched within this angle of where it was, in milliradians.
const EXIT_MRAD: u16 = 500;
/// At a place the planner waits at most this many frames for as many openings as the detector counted.
const CHOOSE_FRAMES: u16 = 12;
/// After as many returns to a place the robot is lost: no exit leads on.
const MAX_RETURNS: u8 = 4;
/// Back is the exit within this angle of the way by which the robot came, in milliradians.
const BACK_MRAD: i32 = 400;
/// After this many frames it drives out where the exit must be. A robot that follows the wall of a hall leaves a meet point that the detector
/// has not confirmed in this time, and approaches none for the same time.
const SEARCH_FRAMES: u16 = 24;
/// A robot gives up a meet point that the detector does not see after this many frames, and follows the edge.
const MOST_APPROACH_FRAMES: u16 = 60;
/// For this many frames after departing the robot still counts as at the place: an obstacle that is hidden for a moment
/// must not make another place.
const DEPART_FRAMES: u16 = 8;
/// An edge may take as many times the time of a manoeuvre.
const EDGE_TIMEOUTS: u16 = 20;

/// What the drive is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum DriveState {
    /// It drives along an edge of the Voronoi graph, or searches for one.
    FollowEdge = 0,
    /// It approaches a meet point and waits for the detector to confirm it.
    Approach = 1,
    /// It stands at a confirmed place and finds its exits.
    ChooseExit = 2,
    /// It turns in place to the chosen exit.
    TurnToExit = 3,
    /// It drives out of a place.
    Depart = 4,
    /// It stands at a place because it has no goal.
    Stopped = 5,
    /// It turns in place, away from an obstacle or after it lost the graph, to the direction with the most room.
    Recover = 6,
}

/// The exits of the place where the robot stands: their bearings relative to the way by which it entered, in milliradians
/// counter-clockwise, 0 to 6282, ascending.
pub(super) type Exits = TopK<u16, { Obstacles::MAX }>;

/// The exit to take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    /// Its bearing relative to the way by which the robot entered, as in [`Exits`].
    pub(super) exit_mrad: u16,
    /// Whether no sonar shows it: the map has it.
    pub(super) is_hidden: bool,
    /// The door on this way, relative to the exit, where one is known.
    pub(super) door: Option<Gap>,
}

/// The largest bearing relative to another, in milliradians.
const MAX_RELATIVE_MRAD: i32 = 6282;

/// The tolerance of a bearing, which is at least the angle between two sensors: an obstacle may move by one of them between two frames.
fn tolerance_mrad<const SONARS: usize>(frame: &Frame<'_, SONARS>, least_mrad: u16) -> u16 {
    least_mrad.max((frame.scan.spacing_mrad() / 8).saturating_mul(7))
}

/// Whether an obstacle may be in front of a dead sensor. With those ahead dead the robot sways, which shows it.
fn has_dead_sensors<const SONARS: usize>(frame: &Frame<'_, SONARS>) -> bool {
    !frame.is_blind_ahead() && frame.scan.echoes().any(|(echo, _)| echo == Echo::Dead)
}

/// The spread at which an approach begins: the wider the gaps between live sensors, the farther is the robot from the edge, and the fewer
/// frames show the third obstacle.
fn approach_mm<const SONARS: usize>(frame: &Frame<'_, SONARS>) -> u16 {
    let spacing_mrad = (frame.scan.spacing_mrad() << u16::from(has_dead_sensors(frame))).max(SPACING_MRAD);
    let share = u32::from(frame.scan.equidistance_mm()) * u32::from(spacing_mrad) / u32::from(SPACING_MRAD);
    share.min(u16::MAX.into()) as u16
}

/// Straight aside, in milliradians.
const QUARTER_MRAD: i32 = 1571;

/// A state machine with one step for each ring frame. Memory: some 60 bytes.
#[derive(Clone, Debug)]
pub(super) struct LocalPlanner {
    config: DriveConfig,
    state: DriveState,
    /// Ring frames in this state.
    frames: u16,
    /// Bearing of the exit by which the robot entered the place.
    entry_mrad: i16,
    /// Bearing of the chosen exit, or of the direction to recover to.
    target_mrad: i16,
    /// The ways of the place by the detector, in the newest frame.
    ways: Openings,
    /// Its exits.
    exits: Exits,
    /// How often the robot has returned to it.
    returns: u8,
    /// Frames in which the robot faced its exit and did not see it.
    search_frames: u16,
    way_back: WayBack,
    /// Whether no sonar shows the chosen exit.
    is_hidden: bool,
    departure: Departure,
    /// Whether the robot turned back on its way to the next place.
    is_returning: bool,
    body: Body,
    hall: Hall,
    /// The speed of the last velocity command.
    speed_permille: u16,
    faults: FaultCounters,
}

impl LocalPlanner {
    pub(super) const fn new() -> Self {
        Self {
            config: DriveConfig::UNSET,
            state: DriveState::FollowEdge,
            frames: 0,
            entry_mrad: 0,
            target_mrad: 0,
            ways: Openings::NONE,
            exits: Exits::new(0),
            returns: 0,
            search_frames: 0,
            way_back: WayBack::new(),
            is_hidden: false,
            departure: Departure::UNKNOWN,
            is_returning: false,
            body: Body::new(),
            hall: Hall::new(),
            speed_permille: 0,
            faults: FaultCounters::new(),
        }
    }

    pub(super) fn start(&mut self, config: DriveConfig) {
        *self = Self { config, ..Self::new() };
    }

    pub(super) fn set_speed(&mut self, speed_permille: u16) -> Result<(), ConfigError> {
        let config = DriveConfig { speed_permille, ..self.config };
        config.check()?;
        self.config = config;
        Ok(())
    }

    pub(super) const fn state(&self) -> DriveState {
        self.state
    }

    /// Whether the robot has not left the place that was reported last.
    pub(super) const fn holds_place(&self) -> bool {
        match self.state {
            DriveState::ChooseExit | DriveState::TurnToExit | DriveState::Stopped => true,
            DriveState::Depart => self.frames < DEPART_FRAMES,
            DriveState::FollowEdge | DriveState::Approach | DriveState::Recover => false,
        }
    }

    /// What is known of the way from the place that was reported last.
    pub(super) fn passage(&self) -> Passage {
        let entry_mrad = (self.state == DriveState::Approach).then_some(self.entry_mrad);
        if self.is_returning {
            Passage { returns: true, entry_mrad, ..Passage::UNKNOWN }
        } else {
            self.departure.passage(entry_mrad)
        }
    }

    /// Whether the robot is not on its way along the graph: it turns away from a wall, or stands in a gap that is too narrow for it.
    pub(super) const fn is_stuck(&self) -> bool {
        matches!(self.state, DriveState::Recover) || !self.body.is_free()
    }

    pub(super) const fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    /// The detector has reported a place with these ways.
    pub(super) fn arrive(&mut self, ways: Openings) {
        if self.state != DriveState::Approach {
            self.entry_mrad = HALF_TURN_MRAD;
        }
        self.ways = ways;
        self.exits.clear();
        self.returns = 0;
        self.departure = Departure::UNKNOWN;
        self.is_returning = false;
        self.enter(DriveState::ChooseExit);
    }

    /// Whether a frame in which the detector reports a place, or still is at it, ends the way back to the place before.
    pub(super) fn has_returned(&self, is_at_place: bool) -> bool {
        self.is_returning && is_at_place && matches!(self.state, DriveState::FollowEdge | DriveState::Approach)
    }

    /// The robot is back at the place that was reported last. Bearings are relative to the way by which it first came.
    pub(super) fn arrive_again(&mut self) {
        self.returns = self.returns.saturating_add(1);
        let came_mrad = if self.state == DriveState::Approach { self.entry_mrad } else { HALF_TURN_MRAD };
        self.entry_mrad = rotated(came_mrad, -i32::from(self.departure.exit_mrad));
        self.departure = Departure::UNKNOWN;
        self.is_returning = false;
        self.enter(DriveState::ChooseExit);
    }

    /// The goal has changed: a stopped robot chooses an exit again.
    pub(super) fn reconsider(&mut self) {
        if self.state == DriveState::Stopped {
            self.enter(DriveState::ChooseExit);
        }
    }

    /// Discards what is known of the present place and edge.
    pub(super) fn forget_edge(&mut self) {
        self.departure = Departure::UNKNOWN;
        self.is_returning = false;
        self.enter(DriveState::FollowEdge);
    }

    /// Processes the newest frame; `choose` is given the exits of a place and the door by which the robot came, relative to that way. It
    /// returns the exit to take, `None` to stop.
    pub(super) fn advance<const SONARS: usize>(
        &mut self,
        frame: &Frame<'_, SONARS>,
        choose: impl FnOnce(&Exits, Option<Gap>) -> Option<Choice>,
    ) -> VelocityCommand {
        self.frames = self.frames.saturating_add(1);
        self.way_back.track(frame);
        if self.state == DriveState::FollowEdge {
            self.way_back.follow_edge(frame, self.is_returning);
        }
        self.body.look(&frame.scan, frame.ahead, self.config.body_radius_mm);
        let is_held = self.body.is_held(&frame.scan, self.speed_permille, self.config.body_radius_mm);
        let velocity = match self.state {
            _ if is_held => self.give_up(frame),
            DriveState::FollowEdge | DriveState::Approach | DriveState::Depart if self.body.is_blocked() => {
                self.turn_back(frame)
            }
            DriveState::FollowEdge => self.follow_edge(frame, frame.is_at_place),
            DriveState::Approach => self.approach(frame),
            DriveState::ChooseExit => self.choose_exit(frame, choose),
            DriveState::TurnToExit => self.turn_to_exit(frame),
            DriveState::Depart => self.depart(frame, frame.is_at_place),
            DriveState::Recover => self.recover(frame),
            DriveState::Stopped => VelocityCommand::STOP,
        };
        self.way_back.drive(velocity);
        self.departure.drive(velocity.speed_permille);
        self.speed_permille = velocity.speed_permille;
        velocity
    }

    fn enter(&mut self, state: DriveState) {
        self.state = state;
        self.frames = 0;
        if !matches!(state, DriveState::FollowEdge | DriveState::Depart | DriveState::Approach) {
            self.hall.leave();
            self.body.forget_motion();
        }
    }

    fn is_timed_out(&self) -> bool {
        self.frames > self.config.timeout_frames
    }

    fn follow_edge<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>, is_at_place: bool) -> VelocityCommand {
        let is_refused = self.hall.is_followed() && self.frames < SEARCH_FRAMES;
        // It has not just left a place, or a meet point that the detector does not see.
        let is_under_way = self.frames > SEARCH_FRAMES;
        let limit_mm = if is_under_way { approach_mm(frame) } else { frame.scan.equidistance_mm() };
        if !is_refused && !is_at_place && frame.obstacles.spread_mm().is_some_and(|spread_mm| spread_mm <= limit_mm) {
            // The rotation of this frame is applied to it as to that of any other.
            self.entry_mrad = rotated(HALF_TURN_MRAD, -frame.rotation_mrad);
            self.enter(DriveState::Approach);
            return self.approach(frame);
        }
        // A robot that a wall holds measures the same ranges as one on a very long edge.
        if self.frames > self.config.timeout_frames.saturating_mul(EDGE_TIMEOUTS) {
            return self.give_up(frame);
        }
        if self.way_back.is_taken() {
            return self.drive_back(frame, frame.obstacles.spread_mm());
        }
        if let Some(heading_mrad) = self.hall.heading_mrad(&frame.scan) {
            return VelocityCommand { heading_mrad, speed_permille: self.config.speed_permille };
        }
        self.drive(frame, Sector::EDGE, frame.obstacles.spread_mm(), None)
    }

    fn approach<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>) -> VelocityCommand {
        if self.is_timed_out() {
            return self.give_up(frame);
        }
        let limit_mm = approach_mm(frame).saturating_mul(2);
        // In the corner of a hall an echo at a flat angle may look like a third wall, and so may a jamb behind a door. The detector does
        // not confirm it.
        let seen_mm = frame.scan.equidistance_mm();
        let is_far = frame.obstacles.spread_mm().is_some_and(|spread_mm| spread_mm > seen_mm);
        let is_refused = (self.hall.is_followed() || is_far) && self.frames > SEARCH_FRAMES;
        let is_hidden = frame.obstacles.spread_mm().is_some_and(|spread_mm| spread_mm > limit_mm);
        if is_hidden && !is_refused && has_dead_sensors(frame) && self.frames < SEARCH_FRAMES {
            return VelocityCommand { heading_mrad: look_round_mrad(frame, self.frames), speed_permille: 0 };
        }
        if is_refused || is_hidden {
            self.enter(DriveState::FollowEdge);
            return self.follow_edge(frame, false);
        }
        // Where an approach begins no earlier than the detector sees the meet point, it waits for the detector.
        let is_seen =
            approach_mm(frame) <= seen_mm || frame.obstacles.spread_mm().is_some_and(|spread_mm| spread_mm <= seen_mm);
        if !is_seen && self.frames > MOST_APPROACH_FRAMES {
            self.enter(DriveState::FollowEdge);
            return self.follow_edge(frame, false);
        }
        self.track_entry(&frame.scan.openings(&frame.obstacles), frame.rotation_mrad);
        match meet_point_offset_mm(&frame.obstacles) {
            Some(offset) if offset.length() > i32::from(self.config.arrival_tolerance_mm) => {
                let heading_mrad = offset.bearing_mrad();
                // A meet point behind has been passed. The detector reports it, or the robot turns back to it.
                if i32::from(heading_mrad).abs() > QUARTER_MRAD {
                    let heading_mrad = if is_seen { 0 } else { heading_mrad.clamp(-TURN_MRAD, TURN_MRAD) };
                    return VelocityCommand { heading_mrad, speed_permille: 0 };
                }
                let distance_mm = offset.length().clamp(0, u16::MAX.into()) as u16;
                VelocityCommand { heading_mrad, speed_permille: speed_permille_at(&self.config, distance_mm) }
            }
            // The third obstacle may be in front of a dead sensor, or at a flat angle: turn until another one sees it.
            None if self.frames > CHOOSE_FRAMES => {
                VelocityCommand { heading_mrad: FACING_MRAD as i16, speed_permille: 0 }
            }
            // A sensor looks through a door: it would not, turned by a few degrees.
            _ if frame.obstacles.is_at_door() => VelocityCommand::STOP,
            _ => VelocityCommand { heading_mrad: look_round_mrad(frame, self.frames), speed_permille: 0 },
        }
    }

    fn choose_exit<const SONARS: usize>(
        &mut self,
        frame: &Frame<'_, SONARS>,
        choose: impl FnOnce(&Exits, Option<Gap>) -> Option<Choice>,
    ) -> VelocityCommand {
        if self.returns > MAX_RETURNS {
            return self.give_up(frame);
        }
        let narrowest = self.way_back.narrowest(frame.obstacles.radius_mm());
        let door = narrowest.filter(|gap| gap.is_door);
        if self.exits.as_slice().is_empty() {
            let openings = if self.ways.count() > 0 { self.ways } else { frame.scan.openings(&frame.obstacles) };
            self.track_entry(&openings, frame.rotation_mrad);
            // While the robot approaches, another opening may be taken for the way by which it came. The position of a door is not.
            if openings.nearest(self.entry_mrad, SAME_OPENING_MRAD).is_none()
                && let Some(door) = door
                && let Some((_, entry_mrad)) = openings.nearest(door.at.bearing_mrad(), SAME_OPENING_MRAD)
            {
                self.entry_mrad = entry_mrad;
            }
            if openings.count() == 0 && self.frames <= CHOOSE_FRAMES {
                return VelocityCommand::STOP;
            }
            for &opening_mrad in openings.bearings_mrad() {
                let relative_mrad = counter_clockwise_mrad(self.entry_mrad, opening_mrad).min(MAX_RELATIVE_MRAD);
                self.exits.insert(relative_mrad as u16, |one, other| one <= other);
            }
        }
        let Some(choice) = choose(&self.exits, door.map(|door| door.rotated(-i32::from(self.entry_mrad)))) else {
            if self.exits.as_slice().is_empty() {
                return self.give_up(frame);
            }
            self.enter(DriveState::Stopped);
            return VelocityCommand::STOP;
        };
        self.departure = Departure::by(choice.exit_mrad);
        self.target_mrad = rotated(self.entry_mrad, choice.exit_mrad.into());
        self.is_hidden = choice.is_hidden;
        // The edge may lead through a door that no sonar looks through from here.
        let is_back = turn_mrad(self.entry_mrad, self.target_mrad).abs() < BACK_MRAD;
        let known = choice.door.map(|door| door.rotated(self.target_mrad.into()));
        self.way_back.choose(frame, if is_back { narrowest } else { known });
        if self.way_back.is_taken() {
            self.target_mrad = self.way_back.bearing_mrad();
        }
        self.search_frames = 0;
        self.enter(DriveState::TurnToExit);
        self.turn_to_exit(frame)
    }

    fn turn_to_exit<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>) -> VelocityCommand {
        if self.is_timed_out() {
            return self.give_up(frame);
        }
        if self.way_back.is_taken() {
            self.target_mrad = self.way_back.bearing_mrad();
            if i32::from(self.target_mrad).abs() <= FACING_MRAD {
                self.enter(DriveState::Depart);
                return self.depart(frame, true);
            }
            return VelocityCommand { heading_mrad: self.target_mrad, speed_permille: 0 };
        }
        // An exit that this frame does not show is where the rotation of the ring brings it. While the robot turns, the ring misses
        // openings and merges them: a frame that shows another number of them is trusted less.
        let expected_mrad = rotated(self.target_mrad, frame.rotation_mrad);
        let openings = frame.scan.openings(&frame.obstacles);
        self.track_entry(&openings, frame.rotation_mrad);
        let count = self.exits.as_slice().len();
        // A dead end has no other opening.
        let within_mrad = match usize::from(openings.count()) {
            _ if self.is_hidden => DOUBTFUL_OPENING_MRAD,
            1 if count == 1 => HALF_TURN_MRAD as u16,
            seen if seen == count => SAME_OPENING_MRAD,
            _ => tolerance_mrad(frame, DOUBTFUL_OPENING_MRAD),
        };
        let seen = openings.nearest(expected_mrad, within_mrad);
        let target_mrad = seen.map_or(expected_mrad, |(_, target_mrad)| target_mrad);
        // Straight behind, noise must not reverse the direction of the turn.
        let is_behind = turn_mrad(HALF_TURN_MRAD, target_mrad).abs() < i32::from(SAME_OPENING_MRAD);
        let is_reversed = (target_mrad < 0) != (self.target_mrad < 0);
        if !(is_behind && is_reversed) {
            self.target_mrad = target_mrad;
        }
        if i32::from(self.target_mrad).abs() <= frame.facing_mrad {
            // With the sensors ahead dead the exit is not seen, and the estimate replaces it.
            let is_certain = seen.is_some() || frame.is_blind_ahead();
            if is_certain {
                // The way by which the robot came and the exit are tracked separately. When they do not agree, one of them is another opening.
                let exit_mrad = counter_clockwise_mrad(self.entry_mrad, self.target_mrad);
                let off_mrad = exit_mrad.abs_diff(self.departure.exit_mrad.into()) as i32;
                if off_mrad.min(2 * i32::from(HALF_TURN_MRAD) - off_mrad) > SAME_EXIT_MRAD {
                    self.departure.is_known = false;
                }
            }
            if is_certain || self.search_frames > SEARCH_FRAMES {
                self.enter(DriveState::Depart);
                return self.depart(frame, true);
            }
            self.search_frames += 1;
            return VelocityCommand { heading_mrad: look_round_mrad(frame, self.search_frames), speed_permille: 0 };
        }
        VelocityCommand { heading_mrad: self.target_mrad.clamp(-TURN_MRAD, TURN_MRAD), speed_permille: 0 }
    }

    fn depart<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>, is_at_place: bool) -> VelocityCommand {
        if self.is_timed_out() {
            return self.give_up(frame);
        }
        if !is_at_place {
            self.enter(DriveState::FollowEdge);
            self.way_back.start_edge();
            return self.follow_edge(frame, is_at_place);
        }
        if self.way_back.is_taken() {
            return self.drive_back(frame, None);
        }
        // At a crossing, a sensor that should measure the obstacle beside the exit may measure the next one.
        let expected_mrad = rotated(self.target_mrad, if self.frames > 0 { frame.rotation_mrad } else { 0 });
        let within_mrad = tolerance_mrad(frame, EXIT_MRAD);
        let seen = frame.scan.openings(&frame.obstacles).nearest(expected_mrad, within_mrad);
        self.target_mrad = seen.map_or(expected_mrad, |(_, target_mrad)| target_mrad);
        let is_wide = seen.is_some()
            && frame.scan.narrow_openings(&frame.obstacles).nearest(expected_mrad, within_mrad).is_none();
        let sector = if is_wide { Sector::EXIT } else { Sector::DOOR };
        self.drive(frame, sector, None, Some(self.target_mrad))
    }

    fn recover<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>) -> VelocityCommand {
        self.target_mrad = rotated(self.target_mrad, frame.rotation_mrad);
        let limit_mm = self.config.clearance_mm.saturating_mul(2);
        let is_free = frame.ahead.is_none_or(|ahead| ahead.range_mm > limit_mm);
        let faces = i32::from(self.target_mrad).abs() <= frame.facing_mrad;
        if is_free && faces && self.body.is_free() || self.is_timed_out() {
            self.enter(DriveState::FollowEdge);
        }
        VelocityCommand { heading_mrad: if self.target_mrad < 0 { -TURN_MRAD } else { TURN_MRAD }, speed_permille: 0 }
    }

    /// Records that the robot is lost, and turns to the direction with the most room.
    fn give_up<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>) -> VelocityCommand {
        self.faults.record(FaultKind::DriveLost);
        self.departure = Departure::UNKNOWN;
        self.way_back.forget();
        self.is_returning = false;
        let room_mm = self.config.clearance_mm.saturating_mul(2);
        self.target_mrad = widest_room_mrad(&frame.scan, room_mm).unwrap_or(HALF_TURN_MRAD);
        self.enter(DriveState::Recover);
        VelocityCommand { heading_mrad: self.target_mrad.clamp(-TURN_MRAD, TURN_MRAD), speed_permille: 0 }
    }

    /// Turns round, because the way ahead is no way for the body. The robot returns to the place before.
    fn turn_back<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>) -> VelocityCommand {
        if !self.departure.is_known || self.is_returning {
            return self.give_up(frame);
        }
        self.is_returning = true;
        self.way_back.cancel();
        self.target_mrad = HALF_TURN_MRAD;
        self.enter(DriveState::Recover);
        VelocityCommand { heading_mrad: self.target_mrad.clamp(-TURN_MRAD, TURN_MRAD), speed_permille: 0 }
    }

    /// Drives back to the gap by which the robot came.
    fn drive_back<const SONARS: usize>(
        &mut self,
        frame: &Frame<'_, SONARS>,
        spread_mm: Option<u16>,
    ) -> VelocityCommand {
        let (sector, bearing_mrad) = self.way_back.course(frame);
        self.drive(frame, sector, spread_mm, Some(bearing_mrad))
    }

    /// Drives along the edge between the obstacles in a sector, more slowly with a smaller spread, or out by an exit.
    fn drive<const SONARS: usize>(
        &mut self,
        frame: &Frame<'_, SONARS>,
        sector: Sector,
        spread_mm: Option<u16>,
        exit_mrad: Option<i16>,
    ) -> VelocityCommand {
        if frame.ahead.is_some_and(|ahead| ahead.range_mm < self.config.clearance_mm) {
            return self.turn_back(frame);
        }
        let heading_mrad =
            heading_mrad(&self.config, frame, sector, exit_mrad).saturating_add(sway_mrad(frame, self.frames));
        let speed_permille = speed_permille_at(&self.config, spread_mm.unwrap_or(u16::MAX));
        VelocityCommand { heading_mrad, speed_permille: speed_permille.min(speed_beside_permille(&self.config, frame)) }
    }

    /// Updates the bearing of the entry. In a frame that does not show the entry it is where the rotation of the ring brings it.
    fn track_entry(&mut self, openings: &Openings, rotation_mrad: i32) {
        let expected_mrad = rotated(self.entry_mrad, rotation_mrad);
        let seen = openings.nearest(expected_mrad, SAME_OPENING_MRAD);
        self.entry_mrad = seen.map_or(expected_mrad, |(_, entry_mrad)| entry_mrad);
    }
}
