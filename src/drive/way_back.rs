//! The way back through a door: from the middle of a room no sonar looks through the door by which the robot came, so the drive remembers
//! where the narrowest point of the edge is.

use super::VelocityCommand;
use super::frame::Frame;
use super::voronoi::{AHEAD_MRAD, Sector, beside_mm, gap_ahead_mrad};
use crate::bearing::{Vector, turn_mrad};

/// A door is hidden when a sonar within this angle of it measures its jambs, in milliradians.
const HIDDEN_MRAD: i32 = 200;
/// An opening within this angle of a door is that door, in milliradians.
const SAME_GAP_MRAD: u16 = 500;
/// The position of a gap is known to about this distance, in thousandths of the way of a frame at full speed.
const HOME_PERMILLE: i32 = 10_000;
/// A door is at most this long with its jambs, in thousandths of the way of a frame at full speed: a corridor is longer.
const DOOR_PERMILLE: u16 = 50_000;
/// The time to drive to a gap: the frames of the distance at full speed times `TIMES_LONGER`, plus `FRAMES_MORE`.
const TIMES_LONGER: i32 = 3;
const FRAMES_MORE: u16 = 60;
/// With a command beyond this bearing the robot turns in place, in milliradians.
const IN_PLACE_MRAD: u16 = 600;

/// A narrow point of an edge, as a door.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    /// Where it is, in thousandths of the way of a ring frame at full speed.
    pub(super) at: Vector,
    /// The range of the obstacles beside it.
    pub(super) range_mm: u16,
    /// Whether it is as short as a door. Otherwise it is a corridor.
    pub(super) is_door: bool,
}

impl Gap {
    /// The gap after a rotation of the frame of reference.
    pub(super) fn rotated(self, by_mrad: i32) -> Self {
        Self { at: self.at.rotated(by_mrad), ..self }
    }
}

/// The narrowest point of the edge by which the robot came, and whether it drives back to it. All zero at the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct WayBack {
    /// Where the point is, in thousandths of the way of a ring frame at full speed,
    gap: Vector,
    /// and the range of the obstacles beside it; 0 when the point is unknown.
    gap_mm: u16,
    /// The range beside the robot where the narrow part began, and its length so far, in thousandths of the way of a frame.
    start_mm: u16,
    length_permille: u16,
    /// The radius of the place that the robot left last.
    radius_mm: u16,
    /// Whether the robot drives back to that point, without regard to the obstacles beside it.
    is_taken: bool,
    /// For how many frames more it does so.
    frames_left: u16,
    /// The distance of the last frame, in thousandths of the way of a frame at full speed.
    forward_permille: u16,
}

impl WayBack {
    pub(super) const fn new() -> Self {
        Self {
            gap: Vector { x: 0, y: 0 },
            gap_mm: 0,
            start_mm: 0,
            length_permille: 0,
            radius_mm: 0,
            is_taken: false,
            frames_left: 0,
            forward_permille: 0,
        }
    }

    /// Whether the robot drives back to the point.
    pub(super) const fn is_taken(&self) -> bool {
        self.is_taken
    }

    /// The bearing of the point.
    pub(super) fn bearing_mrad(&self) -> i16 {
        self.gap.bearing_mrad()
    }

    /// Moves the point by the motion since the frame before.
    pub(super) fn track<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>) {
        self.gap.x = self.gap.x.saturating_sub(self.forward_permille.into());
        self.gap = self.gap.rotated(frame.rotation_mrad);
    }

    /// On an edge: takes the present point if it is narrower, and ends the way back at its end. A robot that `is_returning` takes none.
    pub(super) fn follow_edge<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>, is_returning: bool) {
        // Nearer than the gap's own sides there is another wall: the robot is not where it is estimated to be.
        self.frames_left = self.frames_left.saturating_sub(1);
        self.is_taken = self.is_taken
            && self.frames_left > 0
            && frame
                .scan
                .nearest_between(-AHEAD_MRAD, AHEAD_MRAD)
                .is_none_or(|nearest| u32::from(nearest.range_mm) * 3 >= u32::from(self.gap_mm) * 2);
        let Some(beside_mm) = beside_mm(&frame.scan, Sector::BESIDE) else { return };
        let is_open = frame.ahead.is_none_or(|ahead| ahead.range_mm > beside_mm.saturating_add(beside_mm / 2));
        let is_narrow = u32::from(beside_mm) * 4 <= u32::from(self.gap_mm) * 5;
        if is_narrow && is_open && !is_returning {
            let is_new = u32::from(beside_mm) * 5 <= u32::from(self.start_mm) * 4 || self.gap.length() > HOME_PERMILLE;
            if is_new {
                (self.start_mm, self.length_permille) = (beside_mm, 0);
            }
            self.length_permille = self.length_permille.saturating_add(self.forward_permille);
            (self.gap, self.gap_mm) = (Vector { x: 0, y: 0 }, beside_mm.min(self.gap_mm));
        }
        let is_there = is_narrow || self.gap.x < -2 * HOME_PERMILLE;
        self.is_taken &= !is_there;
    }

    /// The robot drives with this command until the next frame.
    pub(super) fn drive(&mut self, velocity: VelocityCommand) {
        let aside_mrad = velocity.heading_mrad.unsigned_abs();
        // The faster wheel is at most at full speed, so an arc is slower.
        let on_arc_permille = 1000u16.saturating_sub(aside_mrad / 5 * 4);
        self.forward_permille =
            if aside_mrad > IN_PLACE_MRAD { 0 } else { velocity.speed_permille.min(on_arc_permille) };
    }

    /// The narrowest point of the edge by which the robot came to a place of this radius, if it is narrower than two thirds of the radius.
    pub(super) fn narrowest(&self, radius_mm: u16) -> Option<Gap> {
        let is_narrow = self.gap_mm > 0 && u32::from(self.gap_mm) * 3 < u32::from(radius_mm) * 2;
        let is_door = self.length_permille <= DOOR_PERMILLE;
        is_narrow.then_some(Gap { at: self.gap, range_mm: self.gap_mm, is_door })
    }

    /// The robot leaves a place by a way with this gap: it drives to the gap if no sonar looks through it, or to a door that one looks through.
    pub(super) fn choose<const SONARS: usize>(&mut self, frame: &Frame<'_, SONARS>, gap: Option<Gap>) {
        self.radius_mm = frame.obstacles.radius_mm();
        let Some(gap) = gap else {
            self.is_taken = false;
            return;
        };
        (self.gap, self.gap_mm) = (gap.at, gap.range_mm);
        (self.start_mm, self.length_permille) = (gap.range_mm, 0);
        let gap_mrad = self.gap.bearing_mrad();
        let wall = frame.scan.nearest(|bearing_mrad| turn_mrad(gap_mrad, bearing_mrad).abs() < HIDDEN_MRAD);
        let is_hidden = wall.is_some_and(|wall| u32::from(wall.range_mm) * 5 < u32::from(self.radius_mm) * 8);
        let openings = frame.scan.narrow_openings(&frame.obstacles);
        let is_narrow = gap.is_door && openings.nearest(gap_mrad, SAME_GAP_MRAD).is_some();
        let length_permille = self.gap.length();
        self.is_taken = (is_hidden || is_narrow) && length_permille > HOME_PERMILLE;
        self.frames_left =
            FRAMES_MORE.saturating_add((length_permille / 1000 * TIMES_LONGER).try_into().unwrap_or(u16::MAX));
    }

    /// The robot has left a place: the point of the new edge is searched.
    pub(super) fn start_edge(&mut self) {
        if !self.is_taken {
            (self.gap_mm, self.start_mm, self.length_permille) = (u16::MAX, u16::MAX, 0);
        }
    }

    /// The robot turns back on its way.
    pub(super) fn cancel(&mut self) {
        self.is_taken = false;
    }

    /// The robot is lost.
    pub(super) fn forget(&mut self) {
        (self.is_taken, self.gap_mm) = (false, 0);
    }

    /// The sector of the obstacles to drive between, and the bearing to the point: between the obstacles beside the gap once they are
    /// nearer than those of the place.
    pub(super) fn course<const SONARS: usize>(&self, frame: &Frame<'_, SONARS>) -> (Sector, i16) {
        // Near the estimated point its bearing is as uncertain as the point.
        let home_mrad = if self.gap.length() < HOME_PERMILLE { 0 } else { self.gap.bearing_mrad() };
        let is_near = |range_mm: u16| u32::from(range_mm) * 4 < u32::from(self.radius_mm) * 3;
        let gap = gap_ahead_mrad(&frame.scan, home_mrad).filter(|&(_, range_mm)| is_near(range_mm));
        let sector =
            if beside_mm(&frame.scan, Sector::DOOR).is_some_and(is_near) { Sector::DOOR } else { Sector::NONE };
        (sector, gap.map_or(home_mrad, |(gap_mrad, _)| gap_mrad))
    }
}
