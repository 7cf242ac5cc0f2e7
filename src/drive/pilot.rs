//! Driving from place to place: along an edge, up to the meet point, out by the way that was chosen.

use super::steering::{Beside, along_edge, meet_point};
use super::turning::Turning;
use super::{DriveConfig, DriveConfigError, VelocityCommand};
use crate::place::bearing::{HALF_TURN_MRAD, turn_mrad, turned};
use crate::place::scan::{Closest, DEAD, Obstacle, SILENT, Scan, Ways};
use crate::{FaultCounters, FaultKind, Turn};

/// A way is the one that was meant when its bearing has moved by less since the last frame, in milliradians.
const SAME_WAY_MRAD: i32 = 700;
/// The robot faces a way that is this near to straight ahead, in milliradians.
const FACING_MRAD: i32 = 200;
/// Where the sonars that look straight ahead are dead, those this far aside have to do, in milliradians.
const BESIDE_DEAD_MRAD: i32 = 600;
/// A robot whose sonars ahead are dead sways so far to either side, in milliradians, for so many frames, a power of two.
const SWAY_MRAD: i16 = 260;
const SWAY_FRAMES: u16 = 8;
/// So long the pilot waits at a place for a frame with as many ways as the detector counted.
const LOOK_FRAMES: u16 = 12;
/// So long after it set off the robot is still at the place: what the ring hears while an obstacle hides for a moment must not
/// pass for another place.
const SET_OFF_FRAMES: u16 = 8;
/// The pilot bends no more sharply along an edge, in milliradians: an edge has no kink, and an echo that comes and goes would
/// turn the robot round.
const BEND_MRAD: i16 = 500;
/// On the last stretch to a meet point the speed falls to this, in thousandths.
const CREEP_PERMILLE: u16 = 250;
/// At this distance from a meet point the speed begins to fall, in millimetres.
const BRAKE_MM: u16 = 400;

/// What the pilot does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum DriveState {
    /// It drives along an edge of the Voronoi graph, or looks for one.
    FollowEdge = 0,
    /// It homes in on a meet point and waits for the detector to confirm it.
    Approach = 1,
    /// It stands at a confirmed place and looks for the ways out.
    ChooseExit = 2,
    /// It turns to the way that was chosen.
    TurnToExit = 3,
    /// It leaves a place.
    Depart = 4,
    /// It stands at a place because there is nothing to do.
    Stopped = 5,
    /// It turns away from an obstacle, or from nowhere, to where there is room.
    Recover = 6,
}

/// The ways out of a place, numbered counter-clockwise from the one the robot came by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WaysOut {
    /// How many there are, at least 1.
    pub(super) count: u8,
    /// Whether number 0 is known to be the way the robot came by.
    pub(super) came_by_first: bool,
}

/// How the robot left the place that was reported last. `Option<Turn>` would not be all zero, and a `static` robot would not lie
/// in `.bss`.
#[derive(Clone, Copy, Debug)]
enum Left {
    Unknown,
    Back,
    On,
}

/// The pilot's state: some 60 bytes.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    config: DriveConfig,
    state: DriveState,
    /// Ring frames in this state.
    frames: u16,
    /// Where the way lies by which the robot came, and the one by which it leaves.
    back_mrad: i16,
    target_mrad: i16,
    turning: Turning,
    /// What the detector counted at the place.
    degree: Option<u8>,
    left: Left,
    faults: FaultCounters,
}

impl Pilot {
    pub(super) const fn new() -> Self {
        Self {
            config: DriveConfig::UNSET,
            state: DriveState::FollowEdge,
            frames: 0,
            back_mrad: 0,
            target_mrad: 0,
            turning: Turning::new(),
            degree: None,
            left: Left::Unknown,
            faults: FaultCounters::new(),
        }
    }

    pub(super) fn start(&mut self, config: DriveConfig) {
        *self = Self { config, ..Self::new() };
    }

    pub(super) fn set_speed(&mut self, speed_permille: u16) -> Result<(), DriveConfigError> {
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
            DriveState::Depart => self.frames < SET_OFF_FRAMES,
            DriveState::FollowEdge | DriveState::Approach | DriveState::Recover => false,
        }
    }

    pub(super) const fn turn(&self) -> Option<Turn> {
        match self.left {
            Left::Unknown => None,
            Left::Back => Some(Turn::Back),
            Left::On => Some(Turn::On),
        }
    }

    pub(super) const fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    /// The detector has confirmed a place.
    pub(super) fn arrive(&mut self, degree: Option<u8>) {
        self.degree = degree;
        self.left = Left::Unknown;
        self.enter(DriveState::ChooseExit);
    }

    /// The goal has changed: a robot that stands looks at the ways again.
    pub(super) fn reconsider(&mut self) {
        if self.state == DriveState::Stopped {
            self.enter(DriveState::ChooseExit);
        }
    }

    /// What the pilot knew of its way holds no longer.
    pub(super) fn lose_way(&mut self) {
        self.left = Left::Unknown;
        self.enter(DriveState::FollowEdge);
    }

    /// Takes the next frame. `leaving` says whether the detector takes the robot to be still at the place it reported last;
    /// `choose` names the way out of a place, `None` to stay.
    pub(super) fn advance<const SONARS: usize>(
        &mut self,
        scan: &Scan<'_, SONARS>,
        leaving: bool,
        choose: impl FnOnce(WaysOut) -> Option<u8>,
    ) -> VelocityCommand {
        self.frames = self.frames.saturating_add(1);
        let closest = scan.closest();
        self.turning.feel(&closest);
        match self.state {
            DriveState::FollowEdge => self.follow(scan, &closest, leaving),
            DriveState::Approach => self.home(scan, &closest),
            DriveState::ChooseExit => self.look(scan, &closest, choose),
            DriveState::TurnToExit => self.face(scan, &closest),
            DriveState::Depart => self.leave(scan, &closest, leaving),
            DriveState::Recover => self.escape(scan),
            DriveState::Stopped => VelocityCommand::STOP,
        }
    }

    fn enter(&mut self, state: DriveState) {
        self.state = state;
        self.frames = 0;
    }

    fn is_timed_out(&self) -> bool {
        self.frames > self.config.timeout_frames
    }

    /// Turns to where there is most room and starts over; how the robot left the last place says nothing any more.
    fn give_up<const SONARS: usize>(&mut self, scan: &Scan<'_, SONARS>) -> VelocityCommand {
        self.faults.record(FaultKind::DriveLost);
        self.left = Left::Unknown;
        let most_room = scan.echoes().max_by_key(|(range_mm, _)| *range_mm);
        self.target_mrad = most_room.map_or(0, |(_, bearing_mrad)| bearing_mrad);
        self.enter(DriveState::Recover);
        VelocityCommand { heading_mrad: self.target_mrad, speed_permille: 0 }
    }

    fn escape<const SONARS: usize>(&mut self, scan: &Scan<'_, SONARS>) -> VelocityCommand {
        // Without odometry the robot knows that it has turned by what it hears ahead.
        let is_free = ahead(scan).is_none_or(|ahead| ahead.range_mm > self.config.clearance_mm.saturating_mul(2));
        if is_free && self.frames > 5 || self.is_timed_out() {
            self.enter(DriveState::FollowEdge);
        }
        VelocityCommand { heading_mrad: if self.target_mrad < 0 { -1571 } else { 1571 }, speed_permille: 0 }
    }

    fn follow<const SONARS: usize>(
        &mut self,
        scan: &Scan<'_, SONARS>,
        closest: &Closest,
        leaving: bool,
    ) -> VelocityCommand {
        if !leaving && closest.spread_mm() <= scan.equidistance_mm {
            self.back_mrad = HALF_TURN_MRAD;
            self.enter(DriveState::Approach);
            return self.home(scan, closest);
        }
        self.drive(scan, Beside::EDGE, closest.spread_mm())
    }

    fn drive<const SONARS: usize>(
        &mut self,
        scan: &Scan<'_, SONARS>,
        beside: Beside,
        spread_mm: u16,
    ) -> VelocityCommand {
        if ahead(scan).is_some_and(|ahead| ahead.range_mm < self.config.clearance_mm) {
            return self.give_up(scan);
        }
        let heading_mrad = along_edge(scan, beside, self.config.look_ahead_mm).unwrap_or(0);
        let heading_mrad = heading_mrad.clamp(-BEND_MRAD, BEND_MRAD).saturating_add(self.sway_mrad(scan));
        VelocityCommand { heading_mrad, speed_permille: self.slowed(spread_mm) }
    }

    /// Where the sonar ahead is dead, a robot that sways looks with those beside it at what it would not see otherwise.
    fn sway_mrad<const SONARS: usize>(&self, scan: &Scan<'_, SONARS>) -> i16 {
        match (ahead_mrad(scan) > FACING_MRAD, self.frames & SWAY_FRAMES == 0) {
            (false, _) => 0,
            (true, true) => SWAY_MRAD,
            (true, false) => -SWAY_MRAD,
        }
    }

    /// The speed so far from a meet point.
    fn slowed(&self, way_mm: u16) -> u16 {
        let full = self.config.speed_permille;
        let creep = CREEP_PERMILLE.min(full);
        let share = u32::from(way_mm.min(BRAKE_MM)) * u32::from(full) / u32::from(BRAKE_MM);
        (share as u16).max(creep)
    }

    fn home<const SONARS: usize>(&mut self, scan: &Scan<'_, SONARS>, closest: &Closest) -> VelocityCommand {
        if self.is_timed_out() {
            return self.give_up(scan);
        }
        if closest.spread_mm() > scan.equidistance_mm.saturating_mul(2) && closest.spread_mm() != SILENT {
            self.enter(DriveState::FollowEdge);
            return self.follow(scan, closest, false);
        }
        self.track_back(&scan.ways(closest));
        match meet_point(closest) {
            Some(way) if way.length() > i32::from(self.config.arrival_tolerance_mm) => {
                let heading_mrad = way.bearing_mrad();
                // What lies behind has been passed, and turning round for it would cost the bearing of the way back.
                if i32::from(heading_mrad).abs() > 1571 {
                    return VelocityCommand::STOP;
                }
                let way_mm = way.length().clamp(0, i32::from(BRAKE_MM)) as u16;
                VelocityCommand { heading_mrad, speed_permille: self.slowed(way_mm) }
            }
            // The third obstacle may hide before a dead sonar.
            None if self.frames > LOOK_FRAMES && scan.echoes().any(|(range_mm, _)| range_mm == DEAD) => {
                VelocityCommand { heading_mrad: FACING_MRAD as i16, speed_permille: 0 }
            }
            _ => VelocityCommand::STOP,
        }
    }

    /// Keeps the bearing of the way back up to date while the robot turns a little.
    fn track_back(&mut self, ways: &Ways) {
        if let Some((_, back_mrad)) = ways.nearest(self.back_mrad, SAME_WAY_MRAD) {
            self.back_mrad = back_mrad;
        }
    }

    fn look<const SONARS: usize>(
        &mut self,
        scan: &Scan<'_, SONARS>,
        closest: &Closest,
        choose: impl FnOnce(WaysOut) -> Option<u8>,
    ) -> VelocityCommand {
        let ways = scan.ways(closest);
        self.track_back(&ways);
        let bearings_mrad = ways.bearings_mrad();
        let count = bearings_mrad.len();
        let agrees = self.degree.is_none_or(|degree| usize::from(degree) == count);
        if count == 0 && self.frames > LOOK_FRAMES {
            return self.give_up(scan);
        }
        if count == 0 || !agrees && self.frames <= LOOK_FRAMES {
            return VelocityCommand::STOP;
        }
        let back = ways.nearest(self.back_mrad, SAME_WAY_MRAD).map(|(index, _)| index);
        let Some(chosen) = choose(WaysOut { count: count as u8, came_by_first: back.is_some() }) else {
            self.enter(DriveState::Stopped);
            return VelocityCommand::STOP;
        };
        self.left = match back {
            None => Left::Unknown,
            Some(_) if chosen == 0 => Left::Back,
            Some(_) => Left::On,
        };
        let index = (back.unwrap_or(0) + usize::from(chosen)).checked_rem(count).unwrap_or(0);
        self.target_mrad = bearings_mrad.get(index).copied().unwrap_or(0);
        self.enter(DriveState::TurnToExit);
        self.face(scan, closest)
    }

    fn face<const SONARS: usize>(&mut self, scan: &Scan<'_, SONARS>, closest: &Closest) -> VelocityCommand {
        if self.is_timed_out() {
            return self.give_up(scan);
        }
        // A way that is not seen in this frame is where the turn of the ring has brought it.
        let expected_mrad = turned(self.target_mrad, self.turning.by_mrad());
        let seen = scan.ways(closest).nearest(expected_mrad, SAME_WAY_MRAD);
        let target_mrad = seen.map_or(expected_mrad, |(_, target_mrad)| target_mrad);
        // Straight behind, noise must not change the sense of turning.
        let is_behind = turn_mrad(HALF_TURN_MRAD, target_mrad).abs() < SAME_WAY_MRAD;
        let turns_over = (target_mrad < 0) != (self.target_mrad < 0);
        if !(is_behind && turns_over) {
            self.target_mrad = target_mrad;
        }
        // Where the sonars ahead are dead the way cannot be seen, and those beside them have to do.
        let ahead_mrad = ahead_mrad(scan);
        let is_sure = seen.is_some() || ahead_mrad > FACING_MRAD;
        if is_sure && i32::from(self.target_mrad).abs() <= ahead_mrad {
            self.enter(DriveState::Depart);
            return self.drive(scan, Beside::WAY_OUT, SILENT);
        }
        VelocityCommand { heading_mrad: self.target_mrad, speed_permille: 0 }
    }

    fn leave<const SONARS: usize>(
        &mut self,
        scan: &Scan<'_, SONARS>,
        closest: &Closest,
        leaving: bool,
    ) -> VelocityCommand {
        if self.is_timed_out() {
            return self.give_up(scan);
        }
        if !leaving {
            self.enter(DriveState::FollowEdge);
            return self.follow(scan, closest, leaving);
        }
        self.drive(scan, Beside::WAY_OUT, SILENT)
    }
}

/// How far aside the sonars look that tell what lies ahead: where all of those straight ahead are dead, the ones beside them.
fn ahead_mrad<const SONARS: usize>(scan: &Scan<'_, SONARS>) -> i32 {
    let looks_ahead = |bearing_mrad: i16| i32::from(bearing_mrad).abs() < FACING_MRAD;
    let sees = scan.echoes().any(|(range_mm, bearing_mrad)| range_mm != DEAD && looks_ahead(bearing_mrad));
    if sees { FACING_MRAD } else { BESIDE_DEAD_MRAD }
}

/// The nearest obstacle ahead.
fn ahead<const SONARS: usize>(scan: &Scan<'_, SONARS>) -> Option<Obstacle> {
    let within_mrad = ahead_mrad(scan);
    scan.nearest(|bearing_mrad| i32::from(bearing_mrad).abs() < within_mrad)
}
