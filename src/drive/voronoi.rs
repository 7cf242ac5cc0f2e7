//! Where the generalised Voronoi graph is, from one scan: the heading along an edge, and the position of a meet point.
//!
//! An edge is the set of points where the two closest obstacles are equidistant (Choset and Nagatani; section IV.A of the
//! paper). With unit vectors u and v towards obstacles at ranges r and s, a displacement δ of the robot changes r − s by
//! −(u − v) · δ. The edge is therefore perpendicular to u − v, and a meet point is the δ that makes both differences 0.

use crate::bearing::{UNIT, Vector, rotated, turn_mrad, unit};
use crate::place::{Obstacle, Obstacles, RingScan, is_open};
use crate::ring::Echo;

/// Obstacles at a larger angle from straight ahead have been passed, in milliradians: 100°.
pub(super) const AHEAD_MRAD: i16 = 1745;
/// The wall with a gap is searched within this angle of straight ahead, in milliradians.
const WALL_AHEAD_MRAD: i16 = 1047;
/// A wall is measured this far off its normal, in milliradians: silence nearer to the normal is a gap.
const GAP_MRAD: i32 = 720;

/// The sector in which the obstacle on the left is searched, counter-clockwise from the heading; mirrored on the right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sector {
    from_mrad: i16,
    to_mrad: i16,
}

impl Sector {
    /// 20° to 160°: the obstacles beside an edge.
    pub(super) const EDGE: Self = Self { from_mrad: 350, to_mrad: 2790 };
    /// 20° to 115°: the two obstacles beside an exit of a meet point, without those behind.
    pub(super) const EXIT: Self = Self { from_mrad: 350, to_mrad: 2010 };
    /// 20° to 75°: the two obstacles beside a door, without the walls beside the robot.
    pub(super) const DOOR: Self = Self { from_mrad: 350, to_mrad: 1310 };
    /// No obstacle.
    pub(super) const NONE: Self = Self { from_mrad: 1, to_mrad: 0 };
    /// 45° to 135°: the two obstacles between which the robot is.
    pub(super) const BESIDE: Self = Self { from_mrad: 785, to_mrad: 2356 };
    /// 20° to 100°: the two obstacles of a gap ahead.
    pub(super) const AHEAD: Self = Self { from_mrad: 350, to_mrad: AHEAD_MRAD };

    /// The nearest obstacles on the left and on the right.
    pub(super) fn sides<const SONARS: usize>(
        self,
        scan: &RingScan<'_, SONARS>,
    ) -> (Option<Obstacle>, Option<Obstacle>) {
        let left = scan.nearest_between(self.from_mrad, self.to_mrad);
        let right = scan.nearest_between(-self.to_mrad, -self.from_mrad);
        (left, right)
    }
}

/// Heading to the point of the edge that is `look_ahead_mm` ahead, between the closest obstacles on the left and on the
/// right. With an obstacle on one side only, the heading parallel to it; `None` without any.
pub(super) fn edge_heading_mrad<const SONARS: usize>(
    scan: &RingScan<'_, SONARS>,
    sector: Sector,
    look_ahead_mm: u16,
) -> Option<i16> {
    match sector.sides(scan) {
        (None, _) | (_, None) if sector == Sector::DOOR => None,
        (Some(left), Some(right)) => Some(heading_between_mrad(left, right, look_ahead_mm)),
        (Some(left), None) => Some(left.bearing_mrad.saturating_sub(1571)),
        (None, Some(right)) => Some(right.bearing_mrad.saturating_add(1571)),
        (None, None) => None,
    }
}

/// Mean range of the nearest obstacles on the left and on the right; `None` without an obstacle on one side.
pub(super) fn beside_mm<const SONARS: usize>(scan: &RingScan<'_, SONARS>, sector: Sector) -> Option<u16> {
    let (Some(left), Some(right)) = sector.sides(scan) else { return None };
    Some(left.range_mm / 2 + right.range_mm / 2)
}

/// The gap in the wall ahead that is nearest to a bearing, and the range of the wall: the mean bearing of the sensors within 45° of
/// the nearest echo ahead that measure more than 1.6 times its range, or silence, on the side of that bearing.
pub(super) fn gap_ahead_mrad<const SONARS: usize>(
    scan: &RingScan<'_, SONARS>,
    towards_mrad: i16,
) -> Option<(i16, u16)> {
    let wall = scan.nearest_between(1 - WALL_AHEAD_MRAD, WALL_AHEAD_MRAD - 1)?;
    let is_left = turn_mrad(wall.bearing_mrad, towards_mrad) > 0;
    let (mut count, mut sum_mrad) = (0i32, 0i32);
    for (echo, bearing_mrad) in scan.echoes() {
        let aside_mrad = turn_mrad(wall.bearing_mrad, bearing_mrad);
        let is_open = match echo {
            Echo::Dead => false,
            Echo::Silence => true,
            Echo::Range { range_mm } => is_open(range_mm, wall.range_mm),
        };
        if is_open && (aside_mrad > 0) == is_left && aside_mrad.abs() < GAP_MRAD {
            (count, sum_mrad) = (count + 1, sum_mrad + aside_mrad);
        }
    }
    Some((rotated(wall.bearing_mrad, sum_mrad.checked_div(count)?), wall.range_mm))
}

/// Heading to the point of the edge between two obstacles that is `look_ahead_mm` ahead.
fn heading_between_mrad(left: Obstacle, right: Obstacle, look_ahead_mm: u16) -> i16 {
    let (to_left, to_right) = (unit(left.bearing_mrad), unit(right.bearing_mrad));
    let apart = Vector { x: to_left.x - to_right.x, y: to_left.y - to_right.y };
    let length = apart.length();
    // Perpendicular to the difference; of the two directions, the one with the left obstacle on the left.
    let along = Vector { x: apart.y, y: -apart.x };
    let nearer_right_mm = i32::from(left.range_mm) - i32::from(right.range_mm);
    // A displacement of 1 mm to the left reduces the difference by |u − v|.
    let aside_mm = nearer_right_mm.saturating_mul(UNIT).checked_div(length).unwrap_or(0);
    let look_ahead_mm = i32::from(look_ahead_mm);
    let aside_mm = aside_mm.clamp(-look_ahead_mm, look_ahead_mm);
    let point = |along: i32, aside: i32| (along * look_ahead_mm + aside * aside_mm) / 64;
    Vector { x: point(along.x, apart.x), y: point(along.y, apart.y) }.bearing_mrad()
}

/// Displacement in millimetres to the point that is equidistant from the three closest obstacles: one step of Newton's
/// method. `None` with fewer than three obstacles, or when their bearings do not determine the point.
pub(super) fn meet_point_offset_mm(obstacles: &Obstacles) -> Option<Vector> {
    let mut obstacles = obstacles.iter();
    let (first, second, third) = (obstacles.next()?, obstacles.next()?, obstacles.next()?);
    let difference = |other: &Obstacle| {
        let (u, v) = (unit(first.bearing_mrad), unit(other.bearing_mrad));
        (u.x - v.x, u.y - v.y, i32::from(first.range_mm) - i32::from(other.range_mm))
    };
    // Two equations (u − v) · δ = r − s, solved by Cramer's rule.
    let ((a, b, p), (c, d, q)) = (difference(second), difference(third));
    let determinant = i64::from(a) * i64::from(d) - i64::from(b) * i64::from(c);
    if determinant.abs() < i64::from(UNIT * UNIT / 8) {
        return None;
    }
    let solve = |numerator: i64| {
        let mm = (numerator * i64::from(UNIT)).checked_div(determinant).unwrap_or(0);
        mm.clamp(-10_000, 10_000) as i32
    };
    let x = i64::from(p) * i64::from(d) - i64::from(b) * i64::from(q);
    let y = i64::from(a) * i64::from(q) - i64::from(p) * i64::from(c);
    Some(Vector { x: solve(x), y: solve(y) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::test_ring::detector;

    fn edge(ranges_mm: &[(usize, u16)]) -> Option<i16> {
        edge_heading_mrad(&detector(ranges_mm).scan(), Sector::EDGE, 400)
    }

    #[test]
    fn on_the_axis_of_a_corridor_the_edge_is_straight_ahead() {
        let heading_mrad = edge(&[(4, 800), (12, 800)]).unwrap();
        assert!(heading_mrad.abs() <= 5, "{heading_mrad}");
    }

    #[test]
    fn off_the_axis_the_edge_is_towards_the_farther_wall() {
        // 100 mm right of the axis: the point 100 mm to the left and 400 mm ahead has a bearing of 245 mrad.
        let heading_mrad = edge(&[(4, 900), (12, 700)]).unwrap();
        assert!((heading_mrad - 245).abs() <= 8, "{heading_mrad}");
    }

    #[test]
    fn with_a_heading_off_the_axis_the_edge_is_parallel_to_the_walls() {
        let heading_mrad = edge(&[(5, 800), (13, 800)]).unwrap();
        assert!((heading_mrad - 393).abs() <= 8, "{heading_mrad}");
        let heading_mrad = edge(&[(13, 800)]).unwrap();
        assert!((heading_mrad - 393).abs() <= 8, "{heading_mrad}");
        assert_eq!(edge(&[]), None);
    }

    #[test]
    fn the_meet_point_of_a_dead_end_is_equidistant_from_its_three_walls() {
        let obstacles = detector(&[(0, 900), (4, 820), (12, 780)]).scan().obstacles();
        let Vector { x, y } = meet_point_offset_mm(&obstacles).unwrap();
        assert!((x - 100).abs() <= 3 && (y - 20).abs() <= 3, "{x} {y}");
    }

    #[test]
    fn two_obstacles_have_no_meet_point() {
        let obstacles = detector(&[(4, 820), (12, 780)]).scan().obstacles();
        assert_eq!(meet_point_offset_mm(&obstacles), None);
    }

    #[test]
    fn a_door_in_the_wall_ahead_is_on_the_side_where_sensors_look_through() {
        let wall = [(15, 720), (0, 700), (1, 1900), (2, 1050), (3, 1000), (13, 900)];
        let (gap_mrad, wall_mm) = gap_ahead_mrad(&detector(&wall).scan(), 200).unwrap();
        assert!((200..600).contains(&gap_mrad), "{gap_mrad}");
        assert_eq!(wall_mm, 700);
        assert_eq!(gap_ahead_mrad(&detector(&[(14, 760), (15, 720), (0, 700), (1, 720), (2, 760)]).scan(), 200), None);
    }

    #[test]
    fn the_obstacles_beside_the_robot_are_measured_on_both_sides() {
        assert_eq!(beside_mm(&detector(&[(4, 800), (12, 900)]).scan(), Sector::BESIDE), Some(850));
        assert_eq!(beside_mm(&detector(&[(4, 800)]).scan(), Sector::BESIDE), None);
    }
}
