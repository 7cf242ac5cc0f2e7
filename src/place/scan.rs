//! One smoothed reading of the ring, and the search of the closest obstacles in it, in separate bearings.

use super::obstacles::{Obstacle, Obstacles};
use super::openings::is_open;
use super::smoothing::{DEAD_MM, SILENT_MM, is_echo};
use crate::bearing::{rotated, turn_mrad};
use crate::ring::{Echo, RingGeometry};

/// Where the neighbour of an echo measures this percentage of its range, both echoes come from one wall, seen at an angle:
/// nearer by more than noise, and by less than a separate object in front of a wall.
const SLANTED_WALL_PERCENT: core::ops::Range<u32> = 67..92;
/// With a wider mean angle than this between two sensors a ring has wide gaps, in milliradians.
const WIDE_GAP_MRAD: u16 = 600;

/// A full turn, in milliradians.
const FULL_TURN_MRAD: usize = 6283;

/// Bearings are rounded to full milliradians.
const BEARING_TOLERANCE_MRAD: u16 = 4;

/// An opening within this angle of where a way must be is that way, in milliradians. In a ring with wider gaps than one of 16 sensors,
/// the additional gap is added.
const SAME_WAY_MRAD: u16 = 700;
/// The angle between two sensors of a ring of 16, in milliradians.
pub(crate) const SPACING_MRAD: u16 = 392;
/// An obstacle more than this angle from a way is opposite to it, in milliradians.
const OPPOSITE_MRAD: i32 = 2094;

/// A smoothed reading of the whole ring, in ascending order of bearing. [`PlaceDetector::scan`] returns it.
///
/// Ranges are in millimetres, bearings in milliradians, −3142 to 3142, counter-clockwise from straight ahead.
///
/// ```
/// use toposlam::place::{PlaceConfig, PlaceDetector};
/// use toposlam::ring::{Echo, RingFrame, RingGeometry};
///
/// let mut detector = PlaceDetector::<8>::new();
/// detector.start(PlaceConfig::DEFAULT, RingGeometry::even())?;
/// let mut frame = RingFrame { echoes: [Echo::Silence; 8] };
/// for (sensor, range_mm) in [(2, 800), (6, 820)] {
///     frame.echoes[sensor] = Echo::Range { range_mm };
/// }
/// detector.observe(&frame);
/// let obstacles = detector.scan().obstacles();
/// assert_eq!(obstacles.equidistant().count(), 2);
/// assert_eq!(detector.scan().openings(&obstacles).bearings_mrad().len(), 2);
/// # Ok::<(), toposlam::ConfigError>(())
/// ```
///
/// [`PlaceDetector::scan`]: super::PlaceDetector::scan
#[derive(Clone, Copy, Debug)]
pub struct RingScan<'a, const SONARS: usize> {
    /// Range of each sensor, [`DEAD_MM`] or [`SILENT_MM`].
    pub(super) ranges_mm: &'a [u16; SONARS],
    pub(super) geometry: &'a RingGeometry<SONARS>,
    pub(super) separation_mrad: u16,
    pub(super) equidistance_mm: u16,
    /// The bearing of the way by which the robot came, where it is known.
    pub(super) came_by_mrad: Option<i16>,
}

impl<const SONARS: usize> RingScan<'_, SONARS> {
    /// Iterates over the echo and the bearing of each sensor, in ascending order of bearing.
    pub fn echoes(&self) -> impl Iterator<Item = (Echo, i16)> {
        self.ranges().map(|(range_mm, bearing_mrad)| {
            let echo = match range_mm {
                DEAD_MM => Echo::Dead,
                SILENT_MM => Echo::Silence,
                range_mm => Echo::Range { range_mm },
            };
            (echo, bearing_mrad)
        })
    }

    /// Whether the gaps between the sensors are so wide that a sensor looks into an opening only in some directions of the ring.
    pub(super) const fn has_wide_gaps(&self) -> bool {
        self.spacing_mrad() > WIDE_GAP_MRAD
    }

    /// Mean angle between two neighbouring sensors, in milliradians.
    pub(crate) const fn spacing_mrad(&self) -> u16 {
        (FULL_TURN_MRAD / SONARS) as u16
    }

    /// Largest difference of range between equidistant obstacles, in millimetres.
    pub const fn equidistance_mm(&self) -> u16 {
        self.equidistance_mm
    }

    /// Finds the nearest obstacle among the sensors whose bearing `among` accepts; `None` when they receive no echo.
    ///
    /// Time `O(SONARS)`.
    pub fn nearest(&self, among: impl Fn(i16) -> bool) -> Option<Obstacle> {
        let echoes = self.ranges().filter(|&(range_mm, bearing_mrad)| is_echo(range_mm) && among(bearing_mrad));
        echoes.min_by_key(|(range_mm, _)| *range_mm).map(|echo| self.obstacle(echo))
    }

    /// Finds the nearest obstacle among the sensors with bearings from `from_mrad` to `to_mrad`.
    ///
    /// Time `O(SONARS)`.
    #[inline(never)]
    pub fn nearest_between(&self, from_mrad: i16, to_mrad: i16) -> Option<Obstacle> {
        self.nearest(|bearing_mrad| (from_mrad..=to_mrad).contains(&bearing_mrad))
    }

    /// Finds the closest obstacles: first the nearest echo, then repeatedly the nearest echo apart from all obstacles before: at
    /// least `separation_mrad` from them, or beyond a sensor that looks through between them, as through a door.
    ///
    /// An obstacle straight behind, in the way by which the robot came, is counted as the two obstacles beside that way.
    ///
    /// Time `O(SONARS)` for each of at most six obstacles; up to `O(SONARS²)` where most sensors are dead.
    pub fn obstacles(&self) -> Obstacles {
        self.beside_way(self.measured_obstacles())
    }

    /// Counts an obstacle in the way by which the robot came as the two obstacles beside it.
    #[inline(never)]
    pub(super) fn beside_way(&self, measured: Obstacles) -> Obstacles {
        let Some(came_by_mrad) = self.came_by_mrad else { return measured };
        let mut obstacles = measured;
        obstacles.split(came_by_mrad);
        if obstacles.equidistant == measured.equidistant || self.measured_way(came_by_mrad, &measured).is_some() {
            return measured;
        }
        if self.is_joined(came_by_mrad, &obstacles) {
            obstacles.spread_mm = obstacles.third_spread_mm();
        }
        obstacles
    }

    /// The opening that the sonars show where a way must be. The obstacle beside it is then none that hides the way.
    pub(super) fn measured_way(&self, way_mrad: i16, measured: &Obstacles) -> Option<i16> {
        let openings = Self { came_by_mrad: None, ..*self }.openings(measured);
        let within_mrad = SAME_WAY_MRAD.saturating_add(self.spacing_mrad().saturating_sub(SPACING_MRAD));
        openings.nearest(way_mrad, within_mrad).map(|(_, opening_mrad)| opening_mrad)
    }

    /// Whether a narrow way is at a meet point: it joins others, or an obstacle is opposite to it. Otherwise the robot passes it.
    #[inline(never)]
    fn is_joined(&self, way_mrad: i16, obstacles: &Obstacles) -> bool {
        let is_opposite = |obstacle: &Obstacle| turn_mrad(way_mrad, obstacle.bearing_mrad).abs() > OPPOSITE_MRAD;
        obstacles.equidistant().any(is_opposite) || self.openings(obstacles).count() > 2
    }

    /// The closest obstacles as the sonars measure them.
    #[inline(never)]
    pub(super) fn measured_obstacles(&self) -> Obstacles {
        let mut obstacles = self.closest(|index, bearing_mrad, found| self.is_apart(index, bearing_mrad, found));
        let gap = |one: &Obstacle| {
            let turns = obstacles.equidistant().map(|other| turn_mrad(one.bearing_mrad, other.bearing_mrad));
            turns.filter(|&turn_mrad| turn_mrad > 0 && !self.separates(turn_mrad)).min()
        };
        let first = obstacles.equidistant().find_map(|one| Some(rotated(one.bearing_mrad, gap(one)? / 2)));
        if let Some(gap_mrad) = first {
            let apart = self.closest(|_, bearing_mrad, found| self.is_separate(bearing_mrad, found));
            obstacles.is_at_door = apart.equidistant < 3;
            if !self.is_joined(gap_mrad, &obstacles) {
                obstacles.spread_mm = apart.spread_mm;
            }
        }
        obstacles
    }

    /// The closest obstacles that are apart from each other, up to the first that is not equidistant.
    fn closest(&self, is_apart: impl Fn(usize, i16, &[Obstacle]) -> bool) -> Obstacles {
        let mut closest = Obstacles::NONE;
        let mut nearest_mm = None;
        for number in 0..Obstacles::MAX {
            let found = closest.obstacles.get(..number).unwrap_or(&[]);
            let Some(next) = self.nearest_apart(found, &is_apart) else { break };
            let nearest_mm = *nearest_mm.get_or_insert(next.range_mm);
            if let Some(slot) = closest.obstacles.get_mut(number) {
                *slot = next;
            }
            closest.len = number + 1;
            if next.range_mm.saturating_sub(nearest_mm) <= self.equidistance_mm {
                closest.equidistant = number + 1;
            } else if number >= 2 {
                break;
            }
        }
        closest.spread_mm = closest.third_spread_mm();
        closest
    }

    /// Range and bearing of each sensor.
    pub(super) fn ranges(&self) -> impl Iterator<Item = (u16, i16)> {
        self.ranges_mm.iter().copied().zip(self.geometry.bearings_mrad.iter().copied())
    }

    /// The obstacle of the nearest echo that is apart from those found before and does not belong to a wall among them.
    fn nearest_apart(
        &self,
        found: &[Obstacle],
        is_apart: impl Fn(usize, i16, &[Obstacle]) -> bool,
    ) -> Option<Obstacle> {
        let mut nearest = None;
        for (index, (range_mm, bearing_mrad)) in self.ranges().enumerate() {
            let extends = |step| self.extends_wall(index, range_mm, step, found);
            // The cheapest condition that rejects most echoes comes first.
            let is_nearer = is_echo(range_mm) && nearest.is_none_or(|(nearest_mm, _)| range_mm < nearest_mm);
            if is_nearer && is_apart(index, bearing_mrad, found) && !extends(1) && !extends(SONARS - 1) {
                nearest = Some((range_mm, bearing_mrad));
            }
        }
        nearest.map(|echo| self.obstacle(echo))
    }

    /// Whether a bearing is at least `separation_mrad` from all obstacles.
    fn is_separate(&self, bearing_mrad: i16, found: &[Obstacle]) -> bool {
        found.iter().all(|obstacle| self.separates(turn_mrad(obstacle.bearing_mrad, bearing_mrad)))
    }

    pub(super) const fn separates(&self, turn_mrad: i32) -> bool {
        turn_mrad.abs() >= self.separation_mrad as i32
    }

    /// Whether an echo comes from none of the obstacles.
    fn is_apart(&self, index: usize, bearing_mrad: i16, found: &[Obstacle]) -> bool {
        found.iter().all(|obstacle| {
            let turn_mrad = turn_mrad(obstacle.bearing_mrad, bearing_mrad);
            self.separates(turn_mrad) || self.is_beyond_gap(index, turn_mrad, *obstacle)
        })
    }

    /// Whether the next live sensor towards the obstacle, `turn_mrad` away, looks past it: it measures more than 1.6 times the
    /// obstacle's range, or silence.
    fn is_beyond_gap(&self, index: usize, turn_to_mrad: i32, obstacle: Obstacle) -> bool {
        let step = if turn_to_mrad > 0 { SONARS - 1 } else { 1 };
        self.next_live(index, step).is_some_and(|(other_mm, other_mrad)| {
            let turn_other_mrad = turn_mrad(obstacle.bearing_mrad, other_mrad);
            let is_between = turn_other_mrad != 0
                && turn_other_mrad.signum() == turn_to_mrad.signum()
                && turn_other_mrad.abs() < turn_to_mrad.abs();
            is_between && is_open(other_mm, obstacle.range_mm)
        })
    }

    /// The next live sensor in steps of `step` sensors round the ring.
    fn next_live(&self, index: usize, step: usize) -> Option<(u16, i16)> {
        let neighbours = (1..SONARS).map(|steps| (index + steps * step) % SONARS);
        let mut ranges = neighbours
            .filter_map(|index| Some((*self.ranges_mm.get(index)?, *self.geometry.bearings_mrad.get(index)?)));
        ranges.find(|&(other_mm, _)| other_mm != DEAD_MM)
    }

    /// Whether an echo belongs to a wall that was found before and is seen at an angle: the next live sensor, in steps of
    /// `step` sensors round the ring, belongs to that wall and measures a shorter range.
    fn extends_wall(&self, index: usize, range_mm: u16, step: usize, found: &[Obstacle]) -> bool {
        self.next_live(index, step).is_some_and(|(other_mm, bearing_mrad)| {
            let share_percent = (u32::from(other_mm) * 100).checked_div(range_mm.into()).unwrap_or(0);
            !self.is_separate(bearing_mrad, found) && SLANTED_WALL_PERCENT.contains(&share_percent)
        })
    }

    /// The obstacle that an echo comes from. Its bearing is the mean over the sensors within half the separation, or beside this one,
    /// that measure about the same range, because noise decides which of them measures the shortest.
    #[inline(never)]
    fn obstacle(&self, (range_mm, bearing_mrad): (u16, i16)) -> Obstacle {
        let limit_mm = range_mm.saturating_add(self.equidistance_mm);
        // A sensor as far as the separation may measure another obstacle.
        let next_mrad = (self.spacing_mrad() + BEARING_TOLERANCE_MRAD).min(self.separation_mrad.saturating_sub(1));
        let beside_mrad = (self.separation_mrad / 2).max(next_mrad);
        let mut count = 0i32;
        let mut sum_mrad = 0i32;
        for (other_mm, other_mrad) in self.ranges() {
            let turn_mrad = turn_mrad(bearing_mrad, other_mrad);
            let near = turn_mrad.abs() <= i32::from(beside_mrad);
            if near && is_echo(other_mm) && other_mm <= limit_mm {
                count = count.saturating_add(1);
                sum_mrad = sum_mrad.saturating_add(turn_mrad);
            }
        }
        let aside_mrad = sum_mrad.checked_div(count).unwrap_or(0);
        Obstacle { range_mm, bearing_mrad: rotated(bearing_mrad, aside_mrad) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EIGHT: RingGeometry<8> = RingGeometry::even();

    fn scan(ranges_mm: &[u16; 8], separation_mrad: u16) -> RingScan<'_, 8> {
        RingScan { ranges_mm, geometry: &EIGHT, separation_mrad, equidistance_mm: 100, came_by_mrad: None }
    }

    #[test]
    fn the_bearing_of_an_obstacle_is_the_mean_of_the_sensors_that_detect_it() {
        let ranges = [SILENT_MM, SILENT_MM, SILENT_MM, 1020, 1000, 1020, SILENT_MM, SILENT_MM];
        assert!(scan(&ranges, 1600).nearest(|_| true).unwrap().bearing_mrad.abs() > 3139);
        let one_sided = [SILENT_MM, SILENT_MM, SILENT_MM, SILENT_MM, 1010, 1000, SILENT_MM, SILENT_MM];
        let obstacle = scan(&one_sided, 1600).nearest(|_| true).unwrap();
        assert!((obstacle.bearing_mrad + 2749).abs() <= 2, "{obstacle:?}");
        assert_eq!(obstacle.range_mm, 1000);
    }

    #[test]
    fn a_corridor_has_two_equidistant_obstacles_and_a_distant_third() {
        let ranges = [4000, 1400, 1000, 1400, SILENT_MM, 1400, 1010, 1400];
        let scan = scan(&ranges, 1047);
        let meet_point = scan.meet_point(&scan.obstacles());
        assert_eq!((meet_point.spread_mm, meet_point.radius_mm, meet_point.openings.count()), (3000, 1005, 2));
    }

    #[test]
    fn a_dead_end_has_three_equidistant_obstacles_and_one_opening_behind() {
        let ranges = [1020, 1400, 1000, 1400, SILENT_MM, 1400, 1010, 1400];
        let scan = scan(&ranges, 1047);
        let meet_point = scan.meet_point(&scan.obstacles());
        assert_eq!((meet_point.spread_mm, meet_point.radius_mm, meet_point.openings.count()), (20, 1010, 1));
        let openings = scan.openings(&scan.obstacles());
        assert!(matches!(openings.bearings_mrad(), [opening] if turn_mrad(*opening, 3142).abs() <= 4), "{openings:?}");
        assert_eq!(openings.nearest(0, 1000), None);
    }

    #[test]
    fn a_crossing_has_four_equidistant_obstacles_and_four_openings() {
        let ranges = [5000, 1400, SILENT_MM, 1400, SILENT_MM, 1410, 4000, 1420];
        let scan = scan(&ranges, 1047);
        let meet_point = scan.meet_point(&scan.obstacles());
        assert_eq!((meet_point.spread_mm, meet_point.radius_mm, meet_point.openings.count()), (10, 1407, 4));
        let openings = scan.openings(&scan.obstacles());
        for expected_mrad in [-1571, 0, 1571, 3142] {
            assert!(openings.nearest(expected_mrad, 4).is_some(), "{expected_mrad} in {openings:?}");
        }
        assert!(openings.bearings_mrad().is_sorted());
    }

    #[test]
    fn a_wall_that_several_sensors_detect_at_an_angle_is_one_obstacle() {
        // Two walls at 600 mm, detected up to 35° off their normal. The robot's heading is 5° off the corridor's axis, and the shortest
        // range to the left wall is 12.5° off the normal.
        let ring = RingGeometry::<16>::even();
        let mut ranges_mm = [SILENT_MM; 16];
        for (index, range_mm) in
            [(2, 732), (3, 614), (4, 600), (5, 595), (6, 662), (11, 662), (12, 600), (13, 601), (14, 614)]
        {
            ranges_mm[index] = range_mm;
        }
        let scan = scan_of_16(&ranges_mm, &ring, None);
        assert_eq!(scan.obstacles().iter().count(), 2, "{:?}", scan.obstacles());
        // The same echo without an echo beside it is a separate obstacle.
        ranges_mm[3] = SILENT_MM;
        let scan = scan_of_16(&ranges_mm, &ring, None);
        assert_eq!(scan.obstacles().iter().count(), 3, "{:?}", scan.obstacles());
    }

    #[test]
    fn the_bearing_of_a_wall_is_the_mean_of_two_sensors_side_by_side_in_a_ring_of_12() {
        let ring = RingGeometry::<12>::even();
        let mut ranges_mm = [SILENT_MM; 12];
        (ranges_mm[3], ranges_mm[4]) = (1000, 1020);
        let scan = RingScan {
            ranges_mm: &ranges_mm,
            geometry: &ring,
            separation_mrad: 1047,
            equidistance_mm: 150,
            came_by_mrad: None,
        };
        let wall = scan.nearest(|_| true).unwrap();
        assert!((wall.bearing_mrad - 1833).abs() <= 2, "{wall:?}");
    }

    #[test]
    fn a_single_sensor_of_a_dense_ring_that_misses_a_wall_and_its_corner_is_no_opening() {
        // At a dead end: walls ahead and on both sides, and corners at 45°. Behind is the way.
        let ring = RingGeometry::<24>::even();
        let mut ranges_mm = [SILENT_MM; 24];
        for (sensor, range_mm) in [(0, 1000), (1, 1003), (2, 1015), (3, 1414), (4, 1015), (5, 1003), (6, 1000)] {
            ranges_mm[sensor] = range_mm;
            ranges_mm[(24 - sensor) % 24] = range_mm;
        }
        for (sensor, range_mm) in [(7, 1003), (8, 1015), (16, 1015), (17, 1003)] {
            ranges_mm[sensor] = range_mm;
        }
        ranges_mm[3] = SILENT_MM;
        let scan = |ranges_mm: &[u16; 24]| {
            let scan = RingScan {
                ranges_mm,
                geometry: &ring,
                separation_mrad: 1047,
                equidistance_mm: 150,
                came_by_mrad: None,
            };
            scan.openings(&scan.obstacles()).count()
        };
        assert_eq!(scan(&ranges_mm), 1);
        ranges_mm[2] = SILENT_MM;
        assert_eq!(scan(&ranges_mm), 2, "two sensors side by side are an opening");
    }

    fn scan_of_16<'a>(
        ranges_mm: &'a [u16; 16],
        ring: &'a RingGeometry<16>,
        came_by_mrad: Option<i16>,
    ) -> RingScan<'a, 16> {
        RingScan { ranges_mm, geometry: ring, separation_mrad: 1047, equidistance_mm: 150, came_by_mrad }
    }

    /// The ranges of a ring of 16 by sensor, counter-clockwise from straight ahead; the others are silent.
    fn ranges(measured_mm: &[(usize, u16)]) -> [u16; 16] {
        let mut ranges_mm = [SILENT_MM; 16];
        measured_mm.iter().for_each(|&(sensor, range_mm)| ranges_mm[sensor] = range_mm);
        ranges_mm
    }

    #[test]
    fn a_door_closer_than_the_separation_is_a_junction_where_a_sensor_looks_through() {
        // In a corridor 2 m wide, in front of a door of 0.8 m on the left.
        let ring = RingGeometry::even();
        let mut ranges_mm = ranges(&[(3, 1045), (4, 4500), (5, 1040), (11, 975), (12, 960), (13, 970)]);
        let scan = scan_of_16(&ranges_mm, &ring, None);
        let meet_point = scan.meet_point(&scan.obstacles());
        assert!(meet_point.spread_mm <= 100, "{meet_point:?}");
        assert_eq!(meet_point.openings.count(), 3);
        assert_eq!(scan.narrow_openings(&scan.obstacles()).bearings_mrad(), [1571]);
        // A niche of 0.4 m.
        ranges_mm[4] = 1400;
        let scan = scan_of_16(&ranges_mm, &ring, None);
        assert_eq!(scan.obstacles().spread_mm(), None);
    }

    #[test]
    fn an_obstacle_in_the_way_by_which_the_robot_came_is_the_two_beside_it() {
        // Out of a door, 1 m in front of the opposite wall of a corridor: one sonar measures both jambs.
        let ring = RingGeometry::even();
        let ranges_mm = ranges(&[(0, 1000), (1, 1010), (15, 1015), (8, 1040), (7, 1060), (9, 1065)]);
        let scan = scan_of_16(&ranges_mm, &ring, None);
        assert_eq!(scan.obstacles().spread_mm(), None);
        let scan = scan_of_16(&ranges_mm, &ring, Some(3100));
        assert_eq!(scan.obstacles().spread_mm(), Some(40));
        assert_eq!(scan.openings(&scan.obstacles()).count(), 3);
        assert_eq!(
            scan.openings(&scan.obstacles()).nearest(3100, 10).map(|(_, bearing_mrad)| bearing_mrad),
            Some(3100)
        );
    }

    #[test]
    fn an_obstacle_beside_a_way_that_the_sonars_show_is_one_obstacle() {
        // Where a corridor ends in a room: the corners behind, and a bearing of the way that is wrong by 0.5 rad.
        let ring = RingGeometry::even();
        let ranges_mm = ranges(&[(3, 1640), (4, 1620), (5, 710), (6, 780), (7, 2140), (9, 2090), (10, 860), (11, 750)]);
        for came_by_mrad in [2640, 3142, -2640] {
            let scan = scan_of_16(&ranges_mm, &ring, Some(came_by_mrad));
            assert_eq!(scan.obstacles().equidistant().count(), 2, "{came_by_mrad}");
            assert!(scan.obstacles().spread_mm().is_none_or(|spread_mm| spread_mm > 600), "{came_by_mrad}");
        }
    }

    #[test]
    fn an_edge_that_bends_beside_the_way_by_which_the_robot_came_is_no_meet_point() {
        // In a room, between the wall with the door and the wall on the right.
        let ring = RingGeometry::even();
        let walls = [(8, 1340), (7, 1345), (9, 1350), (12, 1330), (11, 1340), (13, 1345)];
        let room = [(10, 1890), (0, 2900), (1, 3000), (15, 2900), (2, 3300), (3, 2800), (4, 2700), (5, 2800)];
        let ranges_mm = ranges(&[walls.as_slice(), &room].concat());
        let scan = scan_of_16(&ranges_mm, &ring, Some(3142));
        assert!(scan.obstacles().spread_mm().is_none_or(|spread_mm| spread_mm > 1000), "{:?}", scan.obstacles());
    }

    #[test]
    fn a_closed_room_has_the_way_by_which_the_robot_came() {
        let ring = RingGeometry::even();
        let ranges_mm = core::array::from_fn(|sensor| [2000, 2050, 2800, 2050][sensor % 4]);
        let scan = scan_of_16(&ranges_mm, &ring, None);
        assert_eq!(scan.openings(&scan.obstacles()).count(), 0);
        let scan = scan_of_16(&ranges_mm, &ring, Some(-3000));
        assert_eq!(scan.openings(&scan.obstacles()).bearings_mrad(), [-3000]);
        assert_eq!(scan.obstacles().spread_mm(), Some(0));
    }

    #[test]
    fn a_wall_between_two_corners_is_no_opening() {
        // A room of 2.9 m by 3.5 m; the wall on the left is the far one.
        let ring = RingGeometry::even();
        let near =
            [(0, 1450), (1, 1500), (15, 1500), (8, 1450), (7, 1500), (9, 1500), (12, 1450), (11, 1500), (13, 1500)];
        let far = [(2, 2480), (3, 2080), (4, 2030), (5, 2080), (6, 2480), (10, 2050), (14, 2050)];
        let mut ranges_mm = ranges(&[near.as_slice(), &far].concat());
        let scan = scan_of_16(&ranges_mm, &ring, None);
        assert_eq!(scan.openings(&scan.obstacles()).count(), 0, "{:?}", scan.openings(&scan.obstacles()));
        ranges_mm[2] = 3300;
        let scan = scan_of_16(&ranges_mm, &ring, None);
        assert_eq!(scan.openings(&scan.obstacles()).count(), 1);
    }
}
