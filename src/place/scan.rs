//! One smoothed reading of the ring, and the closest obstacles in it, in separate bearings.

use super::smoothing::{DEAD_MM, SILENT_MM, is_echo};
use crate::bearing::{rotated, turn_mrad};
use crate::ring::{Echo, RingGeometry};

/// Where the neighbour of an echo measures this percentage of its range, both echoes come from one wall, seen at an angle:
/// nearer by more than noise, and by less than a separate object in front of a wall.
const SLANTED_WALL_PERCENT: core::ops::Range<u32> = 67..92;

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
}

/// An obstacle of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Obstacle {
    /// Range of its nearest echo, in millimetres.
    pub range_mm: u16,
    /// Mean bearing of the sensors that receive an echo from it, in milliradians.
    pub bearing_mrad: i16,
}

/// The closest obstacles of a scan, nearest first: all equidistant ones, and the next one, at least three in all if there
/// are as many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Obstacles {
    obstacles: [Obstacle; Self::MAX],
    len: usize,
    equidistant: usize,
}

impl Obstacles {
    /// Maximum number of obstacles in a scan: with 60° between them no more fit.
    pub const MAX: usize = 6;

    /// Iterates over the obstacles, nearest first.
    pub fn iter(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles.iter().take(self.len)
    }

    /// Iterates over the obstacles that are at most `equidistance_mm` farther than the nearest, nearest first.
    pub fn equidistant(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles.iter().take(self.equidistant)
    }

    /// Range of the third closest obstacle minus the range of the closest, in millimetres; `None` with fewer than three.
    pub fn spread_mm(&self) -> Option<u16> {
        match (self.iter().next(), self.iter().nth(2)) {
            (Some(first), Some(third)) => Some(third.range_mm.saturating_sub(first.range_mm)),
            _ => None,
        }
    }

    /// Mean range of the equidistant obstacles, in millimetres; 0 without any.
    pub fn radius_mm(&self) -> u16 {
        let sum_mm: u32 = self.equidistant().map(|obstacle| u32::from(obstacle.range_mm)).sum();
        sum_mm.checked_div(self.equidistant as u32).unwrap_or(0) as u16
    }
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

    /// Finds the closest obstacles: first the nearest echo, then repeatedly the nearest echo at least `separation_mrad`
    /// from all obstacles before.
    ///
    /// Time `O(SONARS)` for each of at most six obstacles; up to `O(SONARS²)` where most sensors are dead.
    pub fn obstacles(&self) -> Obstacles {
        let mut closest = Obstacles { obstacles: [Obstacle::default(); Obstacles::MAX], len: 0, equidistant: 0 };
        let mut nearest_mm = None;
        for number in 0..Obstacles::MAX {
            let found = closest.obstacles.iter().take(number);
            let apart = |bearing_mrad: i16| {
                found.clone().all(|obstacle| {
                    turn_mrad(obstacle.bearing_mrad, bearing_mrad).abs() >= i32::from(self.separation_mrad)
                })
            };
            let Some(next) = self.nearest_apart(apart) else { break };
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
        closest
    }

    /// Range and bearing of each sensor.
    pub(super) fn ranges(&self) -> impl Iterator<Item = (u16, i16)> {
        self.ranges_mm.iter().copied().zip(self.geometry.bearings_mrad.iter().copied())
    }

    /// The obstacle of the nearest echo that `is_apart` accepts and that does not belong to a wall found before.
    fn nearest_apart(&self, is_apart: impl Fn(i16) -> bool) -> Option<Obstacle> {
        let mut nearest = None;
        for (index, (range_mm, bearing_mrad)) in self.ranges().enumerate() {
            let extends = |step| self.extends_wall(index, range_mm, step, &is_apart);
            // The cheapest condition that rejects most echoes comes first.
            let is_nearer = is_echo(range_mm) && nearest.is_none_or(|(nearest_mm, _)| range_mm < nearest_mm);
            if is_nearer && is_apart(bearing_mrad) && !extends(1) && !extends(SONARS - 1) {
                nearest = Some((range_mm, bearing_mrad));
            }
        }
        nearest.map(|echo| self.obstacle(echo))
    }

    /// Whether an echo belongs to a wall that was found before and is seen at an angle: the next live sensor, in steps of
    /// `step` sensors round the ring, belongs to that wall and measures a shorter range.
    fn extends_wall(&self, index: usize, range_mm: u16, step: usize, is_apart: impl Fn(i16) -> bool) -> bool {
        let neighbours = (1..SONARS).map(|steps| (index + steps * step) % SONARS);
        let mut live =
            neighbours.filter_map(|index| self.ranges().nth(index)).filter(|&(other_mm, _)| other_mm != DEAD_MM);
        live.next().is_some_and(|(other_mm, bearing_mrad)| {
            let share_percent = (u32::from(other_mm) * 100).checked_div(range_mm.into()).unwrap_or(0);
            !is_apart(bearing_mrad) && SLANTED_WALL_PERCENT.contains(&share_percent)
        })
    }

    /// The obstacle that an echo comes from. Its bearing is the mean over the sensors within half the separation that
    /// measure about the same range, because noise decides which of them measures the shortest.
    fn obstacle(&self, (range_mm, bearing_mrad): (u16, i16)) -> Obstacle {
        let limit_mm = range_mm.saturating_add(self.equidistance_mm);
        let mut count = 0i32;
        let mut sum_mrad = 0i32;
        for (other_mm, other_mrad) in self.ranges() {
            let turn_mrad = turn_mrad(bearing_mrad, other_mrad);
            let near = turn_mrad.abs().saturating_mul(2) <= i32::from(self.separation_mrad);
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
        RingScan { ranges_mm, geometry: &EIGHT, separation_mrad, equidistance_mm: 100 }
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
        let scan = RingScan { ranges_mm: &ranges_mm, geometry: &ring, separation_mrad: 1047, equidistance_mm: 150 };
        assert_eq!(scan.obstacles().iter().count(), 2, "{:?}", scan.obstacles());
        // The same echo without an echo beside it is a separate obstacle.
        ranges_mm[3] = SILENT_MM;
        let scan = RingScan { ranges_mm: &ranges_mm, geometry: &ring, separation_mrad: 1047, equidistance_mm: 150 };
        assert_eq!(scan.obstacles().iter().count(), 3, "{:?}", scan.obstacles());
    }
}
