//! The way by which the robot came: a room keeps it, although no sonar looks through its door.

use super::obstacles::{Obstacle, Obstacles};
use super::openings::is_open;
use super::scan::RingScan;
use crate::bearing::{HALF_TURN_MRAD, rotated, turn_mrad};

/// After this many frames between obstacles on both sides, with none behind, the way by which the robot came is known.
const CAME_BY_FRAMES: u8 = 4;
/// Along an edge the robot turns by at most this between two frames, in milliradians.
const STRAIGHT_MRAD: i32 = 80;
/// The obstacles beside an edge are within these angles of straight ahead, in milliradians.
const BESIDE_MRAD: core::ops::RangeInclusive<i32> = 785..=2356;
/// Sensors within this angle of straight behind measure the range behind, in milliradians.
const BEHIND_MRAD: i32 = 350;

/// The way by which the robot came. All zero while it is unknown.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameBy {
    bearing_mrad: i16,
    /// The number of frames that showed it, up to [`CAME_BY_FRAMES`], when it is known.
    frames: u8,
}

impl CameBy {
    /// The way of a robot that has just left a place: straight behind.
    pub(super) const DEPARTED: Self = Self { bearing_mrad: HALF_TURN_MRAD, frames: CAME_BY_FRAMES };

    pub(super) const fn new() -> Self {
        Self { bearing_mrad: 0, frames: 0 }
    }

    /// Its bearing, where it is known.
    pub(super) const fn bearing_mrad(&self) -> Option<i16> {
        if self.frames >= CAME_BY_FRAMES { Some(self.bearing_mrad) } else { None }
    }

    /// The robot may be elsewhere.
    pub(super) const fn forget(&mut self) {
        self.frames = 0;
    }

    /// Follows the way by which the robot came. Along an edge it is straight behind. Near a meet point it is
    /// the opening near the bearing to which the rotation of the ring brings it, because the errors of the rotation add up, or that
    /// bearing where the sonars show no opening, as in front of a door.
    pub(super) fn track<const SONARS: usize>(
        &mut self,
        scan: &RingScan<'_, SONARS>,
        obstacles: &Obstacles,
        rotation_mrad: i32,
        is_on_edge: bool,
    ) {
        let came_by_mrad = rotated(self.bearing_mrad, rotation_mrad);
        self.bearing_mrad = scan.measured_way(came_by_mrad, obstacles).unwrap_or(came_by_mrad);
        if !is_on_edge {
            return;
        }
        let mut nearest = obstacles.iter();
        let (Some(one), Some(other)) = (nearest.next(), nearest.next()) else { return };
        let is_beside = |obstacle: &Obstacle| BESIDE_MRAD.contains(&i32::from(obstacle.bearing_mrad).abs());
        let is_between = is_beside(one) && is_beside(other) && (one.bearing_mrad < 0) != (other.bearing_mrad < 0);
        let is_behind = |bearing_mrad: i16| turn_mrad(HALF_TURN_MRAD, bearing_mrad).abs() <= BEHIND_MRAD;
        let is_open = || scan.nearest(is_behind).is_none_or(|behind| is_open(behind.range_mm, other.range_mm));
        let is_edge = other.range_mm.saturating_sub(one.range_mm) <= scan.equidistance_mm;
        let is_straight = rotation_mrad.abs() <= STRAIGHT_MRAD;
        let is_known = self.frames >= CAME_BY_FRAMES;
        if is_between && is_edge && is_straight && (is_known || is_open()) {
            if !is_known {
                self.frames += 1;
            }
            self.bearing_mrad = HALF_TURN_MRAD;
        } else if turn_mrad(HALF_TURN_MRAD, self.bearing_mrad).abs() > 1571 {
            self.frames = 0;
        }
    }
}
