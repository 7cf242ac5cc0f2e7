//! Where the Voronoi graph lies, from one smoothed ring: the edge ahead, and the meet point near by.
//!
//! An edge of the generalised Voronoi graph is where the two closest obstacles are equidistant; it runs along the bisector of
//! the directions to them (Choset and Nagatani, the paper's section IV.A). With unit vectors u, v to obstacles at ranges r, s,
//! the difference r − s changes by −(u − v) · δ when the robot moves by δ.

use crate::place::bearing::{UNIT, Vector, unit};
use crate::place::scan::{Closest, Obstacle, Scan};

/// In which bearings the obstacle beside the robot is looked for, counter-clockwise from the heading, on the left; mirrored on
/// the right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Beside {
    from_mrad: i16,
    to_mrad: i16,
}

impl Beside {
    /// 20° to 160°: whatever is beside an edge.
    pub(super) const EDGE: Self = Self { from_mrad: 350, to_mrad: 2790 };
    /// 20° to 115°: the two obstacles between which a way leads out of a meet point, and not those behind.
    pub(super) const WAY_OUT: Self = Self { from_mrad: 350, to_mrad: 2010 };
}

/// The direction along the edge between the closest obstacles on the left and on the right, and towards it. With an obstacle on
/// one side only: along that. `None` with none.
pub(super) fn along_edge<const SONARS: usize>(
    scan: &Scan<'_, SONARS>,
    beside: Beside,
    look_ahead_mm: u16,
) -> Option<i16> {
    let within = |bearing_mrad: i16| (beside.from_mrad..=beside.to_mrad).contains(&bearing_mrad);
    let left = scan.nearest(within);
    let right = scan.nearest(|bearing_mrad| within(bearing_mrad.saturating_neg()));
    match (left, right) {
        (Some(left), Some(right)) => Some(between(left, right, look_ahead_mm)),
        (Some(left), None) => Some(left.bearing_mrad.saturating_sub(1571)),
        (None, Some(right)) => Some(right.bearing_mrad.saturating_add(1571)),
        (None, None) => None,
    }
}

/// The direction to the point of the edge between two obstacles that lies so far ahead.
fn between(left: Obstacle, right: Obstacle, look_ahead_mm: u16) -> i16 {
    let (to_left, to_right) = (unit(left.bearing_mrad), unit(right.bearing_mrad));
    let apart = Vector { x: to_left.x - to_right.x, y: to_left.y - to_right.y };
    let length = apart.length();
    // The edge is square to the difference; of its two directions, the one ahead: left is to the left.
    let along = Vector { x: apart.y, y: -apart.x };
    let nearer_right_mm = i32::from(left.range_mm) - i32::from(right.range_mm);
    // Moving by δ towards the left evens out |u − v| · δ.
    let aside_mm = nearer_right_mm.saturating_mul(UNIT).checked_div(length).unwrap_or(0);
    let look_ahead_mm = i32::from(look_ahead_mm);
    let aside_mm = aside_mm.clamp(-look_ahead_mm, look_ahead_mm);
    let point = |along: i32, aside: i32| (along * look_ahead_mm + aside * aside_mm) / 64;
    Vector { x: point(along.x, apart.x), y: point(along.y, apart.y) }.bearing_mrad()
}

/// Where the point lies that is as far from each of the three closest obstacles, in millimetres from the robot: one step of
/// Newton's method. `None` with fewer than three, or when their bearings do not tell.
pub(super) fn meet_point(closest: &Closest) -> Option<Vector> {
    let mut obstacles = closest.iter();
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
    use crate::place::scan::SILENT;
    use crate::ring::RingGeometry;

    const RING: RingGeometry<16> = RingGeometry::even();

    fn scan(ranges_mm: &[u16; 16]) -> Scan<'_, 16> {
        Scan { ranges_mm, geometry: &RING, separation_mrad: 1047, equidistance_mm: 150 }
    }

    fn ring(heard: &[(usize, u16)]) -> [u16; 16] {
        let mut ranges_mm = [SILENT; 16];
        for &(sonar, range_mm) in heard {
            ranges_mm[sonar] = range_mm;
        }
        ranges_mm
    }

    #[test]
    fn in_the_middle_of_a_corridor_the_edge_is_straight_ahead() {
        let ranges = ring(&[(4, 800), (12, 800)]);
        let heading_mrad = along_edge(&scan(&ranges), Beside::EDGE, 400).unwrap();
        assert!(heading_mrad.abs() <= 5, "{heading_mrad}");
    }

    #[test]
    fn off_the_middle_it_lies_towards_the_farther_wall() {
        // 100 mm to the right of the middle: 100 mm to the left and 400 mm ahead is 245 mrad.
        let ranges = ring(&[(4, 900), (12, 700)]);
        let heading_mrad = along_edge(&scan(&ranges), Beside::EDGE, 400).unwrap();
        assert!((heading_mrad - 245).abs() <= 8, "{heading_mrad}");
    }

    #[test]
    fn askew_in_a_corridor_it_is_parallel_to_the_walls() {
        let ranges = ring(&[(5, 800), (13, 800)]);
        let heading_mrad = along_edge(&scan(&ranges), Beside::EDGE, 400).unwrap();
        assert!((heading_mrad - 393).abs() <= 8, "{heading_mrad}");
        let one_wall = ring(&[(13, 800)]);
        let heading_mrad = along_edge(&scan(&one_wall), Beside::EDGE, 400).unwrap();
        assert!((heading_mrad - 393).abs() <= 8, "{heading_mrad}");
        assert_eq!(along_edge(&scan(&[SILENT; 16]), Beside::EDGE, 400), None);
    }

    #[test]
    fn the_meet_point_of_a_dead_end_lies_where_the_front_wall_is_as_near_as_the_others() {
        let ranges = ring(&[(0, 900), (4, 820), (12, 780)]);
        let Vector { x, y } = meet_point(&scan(&ranges).closest()).unwrap();
        assert!((x - 100).abs() <= 3 && (y - 20).abs() <= 3, "{x} {y}");
    }

    #[test]
    fn two_obstacles_have_no_meet_point() {
        let ranges = ring(&[(4, 820), (12, 780)]);
        assert_eq!(meet_point(&scan(&ranges).closest()), None);
    }
}
