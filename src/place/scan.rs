//! One ring of smoothed ranges, and the closest obstacles in it, in separate bearings.

use crate::place::bearing::{HALF_TURN_MRAD, turn_mrad, turned};
use crate::ring::RingGeometry;

/// Smoothed range of a sensor that said nothing about the world.
pub(crate) const DEAD: u16 = 0;
/// Smoothed range of a sensor that heard nothing.
pub(crate) const SILENT: u16 = u16::MAX;
/// At most this many obstacles are looked at: with 60° between them no more fit.
pub(crate) const OBSTACLES: usize = 6;
/// A way leads on where a sensor looks beyond this share of the radius, in percent.
const OPEN_PERCENT: u32 = 160;

/// Beside an echo from along a wall the wall is this share of it away, in percent: nearer by more than noise, and by less than what
/// stands before something else.
const SLOPE_PERCENT: core::ops::Range<u32> = 67..92;

/// What the ring hears, as the place detector and the drive read it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scan<'a, const SONARS: usize> {
    pub(crate) ranges_mm: &'a [u16; SONARS],
    pub(crate) geometry: &'a RingGeometry<SONARS>,
    /// Echoes closer in bearing than this are one obstacle.
    pub(crate) separation_mrad: u16,
    /// Obstacles whose ranges differ by no more than this are equidistant.
    pub(crate) equidistance_mm: u16,
}

/// An obstacle: the range of its nearest echo, and the middle of the sensors that hear it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Obstacle {
    pub(crate) range_mm: u16,
    pub(crate) bearing_mrad: i16,
}

/// The closest obstacles in separate bearings, the nearest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Closest {
    obstacles: [Obstacle; OBSTACLES],
    len: usize,
    equidistant: usize,
}

/// What the closest obstacles say about a meet point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Meeting {
    /// How much farther the third closest obstacle is than the closest; [`SILENT`] with fewer than three.
    pub(super) spread_mm: u16,
    /// Mean range of the obstacles that are equidistant.
    pub(super) radius_mm: u16,
    /// In how many of the gaps between the equidistant obstacles a way leads on.
    pub(super) openings: u8,
}

impl Closest {
    /// All of them: the equidistant ones, and the next one.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles.iter().take(self.len)
    }

    /// Those about as near as the nearest.
    pub(crate) fn equidistant(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles.iter().take(self.equidistant)
    }

    /// How much farther the third is than the first; [`SILENT`] with fewer than three.
    pub(crate) fn spread_mm(&self) -> u16 {
        match (self.iter().next(), self.iter().nth(2)) {
            (Some(first), Some(third)) => third.range_mm.saturating_sub(first.range_mm),
            _ => SILENT,
        }
    }

    /// The mean range of the equidistant ones.
    pub(crate) fn radius_mm(&self) -> u16 {
        let sum_mm: u32 = self.equidistant().map(|obstacle| u32::from(obstacle.range_mm)).sum();
        sum_mm.checked_div(self.equidistant as u32).unwrap_or(0) as u16
    }
}

impl<const SONARS: usize> Scan<'_, SONARS> {
    /// Every sensor's range and bearing.
    pub(crate) fn echoes(&self) -> impl Iterator<Item = (u16, i16)> {
        self.ranges_mm.iter().copied().zip(self.geometry.bearings_mrad.iter().copied())
    }

    /// The obstacle of the nearest echo among some; `None` when none of them is one.
    pub(crate) fn nearest(&self, among: impl Fn(i16) -> bool) -> Option<Obstacle> {
        let heard = self.echoes().filter(|&(range_mm, bearing_mrad)| is_echo(range_mm) && among(bearing_mrad));
        heard.min_by_key(|(range_mm, _)| *range_mm).map(|echo| self.obstacle(echo))
    }

    /// The obstacle of the nearest echo that is apart from those found before, and no part of them.
    fn nearest_apart(&self, is_apart: impl Fn(i16) -> bool) -> Option<Obstacle> {
        let mut nearest = None;
        for (index, (range_mm, bearing_mrad)) in self.echoes().enumerate() {
            let goes_on = |step| self.goes_on(index, range_mm, step, &is_apart);
            // What decides most costs least.
            let is_nearer = is_echo(range_mm) && nearest.is_none_or(|(nearest_mm, _)| range_mm < nearest_mm);
            if is_nearer && is_apart(bearing_mrad) && !goes_on(1) && !goes_on(SONARS - 1) {
                nearest = Some((range_mm, bearing_mrad));
            }
        }
        nearest.map(|echo| self.obstacle(echo))
    }

    /// Whether an echo is a part of an obstacle that was found before: a wall is heard from along it as well, and that echo is
    /// farther than the one beside it, in steps of `step` sensors round the ring. What is dead in between says nothing.
    fn goes_on(&self, index: usize, range_mm: u16, step: usize, is_apart: impl Fn(i16) -> bool) -> bool {
        let beside = (1..SONARS).map(|steps| (index + steps * step) % SONARS);
        let mut beside =
            beside.filter_map(|index| self.echoes().nth(index)).filter(|&(beside_mm, _)| beside_mm != DEAD);
        beside.next().is_some_and(|(beside_mm, bearing_mrad)| {
            let share_percent = (u32::from(beside_mm) * 100).checked_div(range_mm.into()).unwrap_or(0);
            !is_apart(bearing_mrad) && SLOPE_PERCENT.contains(&share_percent)
        })
    }

    /// The obstacle that an echo belongs to, its bearing the middle of the live sensors within half the separation that
    /// hear it about as near. Which of them hears it nearest is chance.
    fn obstacle(&self, (range_mm, bearing_mrad): (u16, i16)) -> Obstacle {
        let limit_mm = range_mm.saturating_add(self.equidistance_mm);
        let mut count = 0i32;
        let mut sum_mrad = 0i32;
        for (other_mm, other_mrad) in self.echoes() {
            let turn_mrad = turn_mrad(bearing_mrad, other_mrad);
            let near = turn_mrad.abs().saturating_mul(2) <= i32::from(self.separation_mrad);
            if near && is_echo(other_mm) && other_mm <= limit_mm {
                count = count.saturating_add(1);
                sum_mrad = sum_mrad.saturating_add(turn_mrad);
            }
        }
        let aside_mrad = sum_mrad.checked_div(count).unwrap_or(0);
        Obstacle { range_mm, bearing_mrad: turned(bearing_mrad, aside_mrad) }
    }

    /// Finds the closest obstacles: the nearest echo first, then the nearest at least the separation from all before.
    ///
    /// Time O(SONARS) for each of at most six obstacles, and up to O(SONARS²) where most sensors are dead.
    pub(crate) fn closest(&self) -> Closest {
        let mut closest = Closest { obstacles: [Obstacle::default(); OBSTACLES], len: 0, equidistant: 0 };
        let mut nearest_mm = None;
        for number in 0..OBSTACLES {
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

    /// The ways that lead on between equidistant obstacles, counter-clockwise: in each gap the middle of the sensors that look
    /// so much farther than the radius that they cannot hear a corner.
    pub(crate) fn ways(&self, closest: &Closest) -> Ways {
        // Empty slots sort behind every bearing.
        let mut ways = Ways { bearings_mrad: [i16::MAX; OBSTACLES], len: 0 };
        let radius_mm = closest.radius_mm();
        let bearings = closest.equidistant().map(|obstacle| obstacle.bearing_mrad);
        for from_mrad in bearings.clone() {
            let gap_mrad = bearings.clone().filter_map(|to_mrad| {
                let gap_mrad = counter_clockwise_mrad(from_mrad, to_mrad);
                (gap_mrad > 0).then_some(gap_mrad)
            });
            let gap_mrad = gap_mrad.min().unwrap_or(2 * i32::from(HALF_TURN_MRAD));
            let open = self.echoes().filter_map(|(range_mm, bearing_mrad)| {
                let within_mrad = counter_clockwise_mrad(from_mrad, bearing_mrad);
                let is_within = within_mrad > 0 && within_mrad < gap_mrad;
                (range_mm != DEAD && is_within && is_beyond(range_mm, radius_mm)).then_some(within_mrad)
            });
            let (count, sum_mrad) =
                open.fold((0i32, 0i32), |(count, sum), within_mrad| (count + 1, sum.saturating_add(within_mrad)));
            if let Some(middle_mrad) = sum_mrad.checked_div(count) {
                insert_ascending(&mut ways.bearings_mrad, turned(from_mrad, middle_mrad));
                ways.len += 1;
            }
        }
        ways
    }

    /// What the closest obstacles say about a meet point.
    pub(super) fn meeting(&self) -> Meeting {
        let closest = self.closest();
        let openings = self.ways(&closest).len as u8;
        Meeting { spread_mm: closest.spread_mm(), radius_mm: closest.radius_mm(), openings }
    }
}

/// The ways out of a meet point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ways {
    bearings_mrad: [i16; OBSTACLES],
    len: usize,
}

impl Ways {
    /// Their bearings, counter-clockwise from right behind.
    pub(crate) fn bearings_mrad(&self) -> &[i16] {
        self.bearings_mrad.get(..self.len).unwrap_or(&self.bearings_mrad)
    }

    /// The way whose bearing is nearest to this one, if one is within `within_mrad`: its number in the list, and its bearing.
    pub(crate) fn nearest(&self, bearing_mrad: i16, within_mrad: i32) -> Option<(usize, i16)> {
        let off_mrad = |way_mrad: i16| turn_mrad(bearing_mrad, way_mrad).abs();
        let nearest = self.bearings_mrad().iter().copied().enumerate().min_by_key(|&(_, way_mrad)| off_mrad(way_mrad));
        nearest.filter(|&(_, way_mrad)| off_mrad(way_mrad) <= within_mrad)
    }
}

/// Inserts an angle in ascending order; the last one falls out.
pub(crate) fn insert_ascending(angles_mrad: &mut [i16], mut angle_mrad: i16) {
    for slot in angles_mrad {
        if angle_mrad < *slot {
            core::mem::swap(slot, &mut angle_mrad);
        }
    }
}

/// Whether a smoothed range is that of an echo.
pub(crate) fn is_echo(range_mm: u16) -> bool {
    range_mm != DEAD && range_mm != SILENT
}

/// Whether a range is too long for a corner between two walls: the corner of a square lies at 1.41 times the radius of the disc
/// in it, and the obstacles may differ a little.
fn is_beyond(range_mm: u16, radius_mm: u16) -> bool {
    u32::from(range_mm) * 100 > u32::from(radius_mm) * OPEN_PERCENT
}

/// The turn from one bearing to another counter-clockwise, 0 to a whole turn.
fn counter_clockwise_mrad(from_mrad: i16, to_mrad: i16) -> i32 {
    let turn_mrad = turn_mrad(from_mrad, to_mrad);
    if turn_mrad < 0 { turn_mrad + 2 * i32::from(HALF_TURN_MRAD) } else { turn_mrad }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EIGHT: RingGeometry<8> = RingGeometry::even();

    fn scan(ranges_mm: &[u16; 8], separation_mrad: u16) -> Scan<'_, 8> {
        Scan { ranges_mm, geometry: &EIGHT, separation_mrad, equidistance_mm: 100 }
    }

    #[test]
    fn an_obstacle_lies_in_the_middle_of_the_sensors_that_hear_it() {
        let ranges = [SILENT, SILENT, SILENT, 1020, 1000, 1020, SILENT, SILENT];
        assert!(scan(&ranges, 1600).nearest(|_| true).unwrap().bearing_mrad.abs() > 3139);
        let one_sided = [SILENT, SILENT, SILENT, SILENT, 1010, 1000, SILENT, SILENT];
        let obstacle = scan(&one_sided, 1600).nearest(|_| true).unwrap();
        assert!((obstacle.bearing_mrad + 2749).abs() <= 2, "{obstacle:?}");
        assert_eq!(obstacle.range_mm, 1000);
    }

    #[test]
    fn a_corridor_has_two_obstacles_and_a_third_that_is_far() {
        let ranges = [4000, 1400, 1000, 1400, SILENT, 1400, 1010, 1400];
        let meeting = scan(&ranges, 1047).meeting();
        assert_eq!((meeting.spread_mm, meeting.radius_mm, meeting.openings), (3000, 1005, 2));
    }

    #[test]
    fn a_dead_end_has_three_obstacles_and_one_way_behind() {
        let ranges = [1020, 1400, 1000, 1400, SILENT, 1400, 1010, 1400];
        let scan = scan(&ranges, 1047);
        let meeting = scan.meeting();
        assert_eq!((meeting.spread_mm, meeting.radius_mm, meeting.openings), (20, 1010, 1));
        let ways = scan.ways(&scan.closest());
        assert!(matches!(ways.bearings_mrad(), [way] if turn_mrad(*way, 3142).abs() <= 4), "{ways:?}");
        assert_eq!(ways.nearest(0, 1000), None);
    }

    #[test]
    fn a_crossing_has_four_obstacles_and_four_ways_between_them() {
        let ranges = [5000, 1400, SILENT, 1400, SILENT, 1410, 4000, 1420];
        let scan = scan(&ranges, 1047);
        let meeting = scan.meeting();
        assert_eq!((meeting.spread_mm, meeting.radius_mm, meeting.openings), (10, 1407, 4));
        let ways = scan.ways(&scan.closest());
        for expected_mrad in [-1571, 0, 1571, 3142] {
            assert!(ways.nearest(expected_mrad, 4).is_some(), "{expected_mrad} in {ways:?}");
        }
        assert!(ways.bearings_mrad().is_sorted());
    }

    #[test]
    fn a_wall_that_is_heard_from_along_it_is_one_obstacle() {
        // Two walls 600 mm aside, heard up to 35° off their normal; the robot looks 5° aside and hears the left wall nearest where it
        // lies 12.5° off the normal.
        let ring = RingGeometry::<16>::even();
        let mut ranges_mm = [SILENT; 16];
        for (index, range_mm) in
            [(2, 732), (3, 614), (4, 600), (5, 595), (6, 662), (11, 662), (12, 600), (13, 601), (14, 614)]
        {
            ranges_mm[index] = range_mm;
        }
        let scan = Scan { ranges_mm: &ranges_mm, geometry: &ring, separation_mrad: 1047, equidistance_mm: 150 };
        assert_eq!(scan.closest().iter().count(), 2, "{:?}", scan.closest());
        // The same echo with nothing heard beside it is an obstacle of its own.
        ranges_mm[3] = SILENT;
        let scan = Scan { ranges_mm: &ranges_mm, geometry: &ring, separation_mrad: 1047, equidistance_mm: 150 };
        assert_eq!(scan.closest().iter().count(), 3, "{:?}", scan.closest());
    }
}
