//! Halls wider than the sonars reach: the robot follows the wall on its right.
//!
//! In a hall no two obstacles are in range on both sides, and the Voronoi graph cannot be followed. The robot keeps one wall at a fixed distance
//! instead, which is the boundary of the graph of a robot whose sonars reach that far. It always has the wall on its right. So the way
//! out of one corridor ends at the next one, counter-clockwise, and in a hall with two corridors it is the same way from both.

use crate::bearing::turn_mrad;
use crate::place::{Obstacle, RingScan};

/// The distance to the wall, in millimetres.
const DISTANCE_MM: i32 = 900;
/// Frames without an obstacle ahead or beside after which a corridor has ended in a hall.
const EMPTY_FRAMES: u16 = 6;
/// An obstacle beside at more than this is no wall to follow before the one ahead is reached, in millimetres.
const BESIDE_MM: u16 = 2500;
/// For this many frames the corridor that the robot comes from is on its right.
const START_FRAMES: u16 = 40;
/// Frames without any wall after which the robot follows none.
const LOST_FRAMES: u16 = 60;
/// An obstacle this far from the wall in bearing is on the other side of an edge, in milliradians: a wall at a right angle is detected up to 40°
/// off its normal.
const OPPOSITE_MRAD: i32 = 2300;
/// The wall of a corner that the robot has passed is at a larger angle, in milliradians: 115°.
const PASSED_MRAD: i16 = 2010;
/// The two walls of a corner ahead are within this angle of straight ahead, in milliradians: 70°.
const CORNER_MRAD: u16 = 1222;
/// A wall ahead counts when it is at most this much farther than the one beside, in millimetres.
const CORNER_MM: u16 = 200;
/// The heading in milliradians to a wall that is 1 mm farther than it should be.
const GAIN_MRAD: i32 = 1;
/// The heading round the end of a wall that is not in range, in milliradians.
const ROUND_MRAD: i16 = -400;
/// Limit of this heading, in milliradians.
const MAX_CORRECTION_MRAD: i32 = 450;
/// A quarter of a turn, in milliradians.
const QUARTER_MRAD: i32 = 1571;

/// Whether the robot follows a wall. All zero at the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hall {
    /// Frames along the wall, 0 if it follows none.
    frames: u16,
    /// Successive frames without an obstacle ahead or beside, or without a wall.
    empty_frames: u16,
}

impl Hall {
    pub(super) const fn new() -> Self {
        Self { frames: 0, empty_frames: 0 }
    }

    /// The heading along the wall of a hall, in milliradians; `None` if the robot is not in a hall. Above the limit of the wheels it turns
    /// in place.
    pub(super) fn heading_mrad<const SONARS: usize>(&mut self, scan: &RingScan<'_, SONARS>) -> Option<i16> {
        let within = |from_mrad, to_mrad| scan.nearest_between(from_mrad, to_mrad);
        let ahead = within(-700, 700);
        if self.frames == 0 {
            return self.enter(within);
        }
        self.frames = self.frames.saturating_add(1);
        let has_started = self.frames > START_FRAMES;
        let right = within(if has_started { -2790 } else { -1900 }, -350);
        let Some(wall) = right.or(ahead) else {
            self.empty_frames = self.empty_frames.saturating_add(1);
            if self.empty_frames > LOST_FRAMES {
                *self = Self::new();
                return None;
            }
            // Round the end of the wall.
            return Some(ROUND_MRAD);
        };
        self.empty_frames = 0;
        let is_opposite = |bearing_mrad: i16| {
            (0..=PASSED_MRAD).contains(&bearing_mrad)
                && turn_mrad(wall.bearing_mrad, bearing_mrad).abs() >= OPPOSITE_MRAD
        };
        // A wall ahead is also detected far aside, at no shorter range.
        let limit_mm = ahead.map_or(BESIDE_MM, |ahead| ahead.range_mm.min(BESIDE_MM));
        if has_started && scan.nearest(is_opposite).is_some_and(|opposite| opposite.range_mm < limit_mm) {
            *self = Self::new();
            return None;
        }
        // A wall ahead that is nearer than the one beside is followed next.
        let wall = match ahead {
            Some(ahead)
                if i32::from(ahead.range_mm) < DISTANCE_MM
                    && ahead.range_mm <= wall.range_mm.saturating_add(CORNER_MM) =>
            {
                ahead
            }
            _ => wall,
        };
        let far_mm = i32::from(wall.range_mm) - DISTANCE_MM;
        let correction_mrad = (far_mm * GAIN_MRAD).clamp(-MAX_CORRECTION_MRAD, MAX_CORRECTION_MRAD);
        let heading_mrad = i32::from(wall.bearing_mrad) + QUARTER_MRAD - correction_mrad;
        Some(heading_mrad.clamp(-QUARTER_MRAD, QUARTER_MRAD) as i16)
    }

    /// Decides whether the robot is in a hall: it is not between two walls after a corridor has ended, or it comes to a wall
    /// without others beside it.
    fn enter(&mut self, within: impl Fn(i16, i16) -> Option<Obstacle>) -> Option<i16> {
        // Between two walls in range there is an edge, however far they are.
        let is_outside =
            !is_beside(within(-1745, 1745)) && (within(350, 1745).is_none() || within(-1745, -350).is_none());
        self.empty_frames = if is_outside { self.empty_frames.saturating_add(1) } else { 0 };
        let is_empty = self.empty_frames >= EMPTY_FRAMES;
        let ahead = within(-200, 200);
        // In most frames of a corridor the walls beside the robot need not be searched.
        if !is_empty && ahead.is_none_or(|ahead| i32::from(ahead.range_mm) * 2 >= DISTANCE_MM * 3) {
            return None;
        }
        let (left, right) = (within(350, 2790), within(-2790, -350));
        let is_near = ahead.is_some_and(|ahead| i32::from(ahead.range_mm) < DISTANCE_MM);
        let is_ahead = |obstacle: Option<Obstacle>| {
            obstacle.is_some_and(|obstacle| {
                i32::from(obstacle.range_mm) < DISTANCE_MM && obstacle.bearing_mrad.unsigned_abs() < CORNER_MRAD
            })
        };
        let is_in_corner = is_ahead(left)
            && is_ahead(right)
            && ahead.is_some_and(|ahead| i32::from(ahead.range_mm) * 2 < DISTANCE_MM * 3);
        let is_at_wall = is_in_corner || is_near && !is_beside(left) && !is_beside(right);
        let has_left_corridor = is_empty && (is_beside(left) || is_beside(right));
        if has_left_corridor || is_at_wall {
            *self = Self { frames: if is_at_wall { START_FRAMES } else { 1 }, empty_frames: 0 };
            return Some(if is_at_wall { 1571 } else { ROUND_MRAD });
        }
        None
    }

    /// Whether the robot follows a wall.
    pub(super) const fn is_followed(&self) -> bool {
        self.frames > 0
    }

    /// The robot has come to a place, or is lost.
    pub(super) fn leave(&mut self) {
        *self = Self::new();
    }
}

/// Whether an obstacle is near enough for a wall beside the robot.
fn is_beside(obstacle: Option<Obstacle>) -> bool {
    obstacle.is_some_and(|obstacle| obstacle.range_mm < BESIDE_MM)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::test_ring::detector;

    /// The heading after some frames with these ranges, by sensor of an even ring; the other sensors receive no echo.
    fn heading_mrad(hall: &mut Hall, frames: u16, ranges_mm: &[(usize, u16)]) -> Option<i16> {
        let detector = detector(ranges_mm);
        (0..frames).map(|_| hall.heading_mrad(&detector.scan())).last().flatten()
    }

    #[test]
    fn in_a_corridor_and_at_a_dead_end_no_wall_is_followed() {
        let mut hall = Hall::new();
        assert_eq!(heading_mrad(&mut hall, 50, &[(4, 1000), (12, 1000)]), None);
        assert_eq!(heading_mrad(&mut hall, 50, &[(0, 700), (4, 1000), (12, 1000)]), None);
        assert_eq!(heading_mrad(&mut hall, 50, &[]), None, "nothing is in range");
    }

    #[test]
    fn at_the_end_of_a_corridor_the_robot_turns_right_and_keeps_the_wall_on_its_right() {
        let mut hall = Hall::new();
        assert_eq!(heading_mrad(&mut hall, 5, &[(6, 1200), (10, 1200)]), None);
        assert_eq!(heading_mrad(&mut hall, 1, &[(6, 1200), (10, 1200)]), Some(ROUND_MRAD));
        let mut hall = Hall::new();
        let at_mouth = heading_mrad(&mut hall, 6, &[(6, 1200), (10, 1200), (12, 3000)]);
        assert_eq!(at_mouth, Some(ROUND_MRAD), "one wall of the hall is in range");
        let mut between_walls = Hall::new();
        assert_eq!(heading_mrad(&mut between_walls, 9, &[(6, 1200), (10, 1200), (12, 3000), (4, 3000)]), None);
        let at_distance = heading_mrad(&mut hall, 50, &[(12, 900)]).unwrap();
        assert!(at_distance.abs() <= 2, "{at_distance}");
        let too_far = heading_mrad(&mut hall, 1, &[(12, 1200)]).unwrap();
        assert!(too_far < -250, "{too_far}");
        let too_near = heading_mrad(&mut hall, 1, &[(12, 600)]).unwrap();
        assert!(too_near > 250, "{too_near}");
    }

    #[test]
    fn a_wall_ahead_is_followed_next_and_a_corridor_ends_the_hall() {
        let mut hall = Hall::new();
        let heading = heading_mrad(&mut hall, 1, &[(0, 850)]);
        assert_eq!(heading, Some(1571), "the wall comes to the right of the robot");
        heading_mrad(&mut hall, 5, &[(12, 900)]);
        let corner = heading_mrad(&mut hall, 1, &[(12, 900), (0, 850)]).unwrap();
        assert!(corner > 1400, "{corner}");
        let passed = heading_mrad(&mut hall, 1, &[(12, 900), (8, 950)]).unwrap();
        assert!(passed.abs() <= 2, "the other wall of the corner is behind: {passed}");
        assert_eq!(heading_mrad(&mut hall, 1, &[(12, 1000), (4, 1000)]), None);
        assert_eq!(heading_mrad(&mut hall, 1, &[(12, 900)]), None, "it follows the edge again");
    }
}
