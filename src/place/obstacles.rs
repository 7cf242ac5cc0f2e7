//! The closest obstacles around the robot, in separate bearings, from one (smoothed) ring of ranges.

use crate::ring::RingGeometry;

/// Smoothed range of a sensor that said nothing about the world.
pub(super) const DEAD: u16 = 0;
/// Smoothed range of a sensor that heard nothing.
pub(super) const SILENT: u16 = u16::MAX;
/// At most this many obstacles are looked at: with 60° between them no more fit.
const CAPACITY: usize = 6;
const HALF_TURN_MRAD: i32 = 3142;

/// What the closest obstacles say about a meet point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Meeting {
    /// How much farther the third closest obstacle is than the closest; [`SILENT`] with fewer than three.
    pub(super) spread_mm: u16,
    /// Mean range of the obstacles that are equidistant.
    pub(super) radius_mm: u16,
    /// In how many of the gaps between the equidistant obstacles some sensor looks beyond twice the radius.
    pub(super) openings: u8,
}

/// The turn from one bearing to another the short way round, counter-clockwise positive, in milliradians.
fn turn_mrad(from_mrad: i16, to_mrad: i16) -> i32 {
    let turn_mrad = i32::from(to_mrad) - i32::from(from_mrad);
    if turn_mrad > HALF_TURN_MRAD {
        turn_mrad - 2 * HALF_TURN_MRAD
    } else if turn_mrad < -HALF_TURN_MRAD {
        turn_mrad + 2 * HALF_TURN_MRAD
    } else {
        turn_mrad
    }
}

/// The middle of the obstacle that one echo belongs to: of the live sensors within half the separation that hear it
/// about as near. Which of them hears it nearest is chance.
fn middle_mrad<const SONARS: usize>(
    (range_mm, bearing_mrad): (u16, i16),
    ranges_mm: &[u16; SONARS],
    geometry: &RingGeometry<SONARS>,
    separation_mrad: u16,
    equidistance_mm: u16,
) -> i16 {
    let limit_mm = range_mm.saturating_add(equidistance_mm);
    let mut count = 0i32;
    let mut sum_mrad = 0i32;
    for (&other_mm, &other_mrad) in ranges_mm.iter().zip(&geometry.bearings_mrad) {
        let turn_mrad = turn_mrad(bearing_mrad, other_mrad);
        let near = turn_mrad.abs().saturating_mul(2) <= i32::from(separation_mrad);
        if near && other_mm != DEAD && other_mm != SILENT && other_mm <= limit_mm {
            count = count.saturating_add(1);
            sum_mrad = sum_mrad.saturating_add(turn_mrad);
        }
    }
    let middle_mrad = i32::from(bearing_mrad).saturating_add(sum_mrad.checked_div(count).unwrap_or(0));
    turn_mrad(0, middle_mrad as i16) as i16
}

/// Finds the closest obstacles: the nearest range first, then the nearest at least `separation_mrad` from all before.
///
/// Time O(SONARS) for each of at most six obstacles.
pub(super) fn meeting<const SONARS: usize>(
    ranges_mm: &[u16; SONARS],
    geometry: &RingGeometry<SONARS>,
    separation_mrad: u16,
    equidistance_mm: u16,
) -> Meeting {
    let bearings = &geometry.bearings_mrad;
    let mut candidate = ranges_mm.map(|range_mm| range_mm != DEAD && range_mm != SILENT);
    let mut equidistant_mrad = [0i16; CAPACITY];
    let mut equidistant_count = 0u32;
    let mut sum_mm = 0u32;
    let mut nearest_mm = None;
    let mut third_mm = SILENT;
    for (number, slot) in equidistant_mrad.iter_mut().enumerate() {
        let live = ranges_mm.iter().zip(bearings).zip(&candidate).filter(|(_, candidate)| **candidate);
        let Some((&range_mm, &bearing_mrad)) = live.map(|(sensor, _)| sensor).min_by_key(|(range_mm, _)| **range_mm)
        else {
            break;
        };
        let nearest_mm = *nearest_mm.get_or_insert(range_mm);
        if number == 2 {
            third_mm = range_mm;
        }
        let echo = (range_mm, bearing_mrad);
        let bearing_mrad = middle_mrad(echo, ranges_mm, geometry, separation_mrad, equidistance_mm);
        if range_mm.saturating_sub(nearest_mm) <= equidistance_mm {
            *slot = bearing_mrad;
            equidistant_count = equidistant_count.saturating_add(1);
            sum_mm = sum_mm.saturating_add(u32::from(range_mm));
        } else if number >= 2 {
            break;
        }
        for (candidate, &other_mrad) in candidate.iter_mut().zip(bearings) {
            *candidate &= turn_mrad(bearing_mrad, other_mrad).abs() >= i32::from(separation_mrad);
        }
    }
    let radius_mm = sum_mm.checked_div(equidistant_count).unwrap_or(0) as u16;
    let spread_mm = if third_mm == SILENT { SILENT } else { third_mm.saturating_sub(nearest_mm.unwrap_or(0)) };
    let openings = openings(ranges_mm, geometry, equidistant_mrad.iter().take(equidistant_count as usize), radius_mm);
    Meeting { spread_mm, radius_mm, openings }
}

/// Counts the gaps between the obstacles (in bearing) in which a sensor looks beyond twice the radius.
fn openings<'a, const SONARS: usize>(
    ranges_mm: &[u16; SONARS],
    geometry: &RingGeometry<SONARS>,
    obstacles_mrad: impl Iterator<Item = &'a i16> + Clone,
    radius_mm: u16,
) -> u8 {
    let mut open_gaps = 0u8;
    let count = obstacles_mrad.clone().count();
    for (&range_mm, bearing_mrad) in ranges_mm.iter().zip(&geometry.bearings_mrad) {
        if range_mm != DEAD && range_mm > radius_mm.saturating_mul(2) {
            // A gap is named by how many obstacles lie clockwise of it; before the first and after the last is one gap.
            let gap = obstacles_mrad.clone().filter(|obstacle_mrad| *obstacle_mrad <= bearing_mrad).count();
            let gap = if gap == count { 0 } else { gap };
            open_gaps |= 1u8.checked_shl(gap as u32).unwrap_or(0);
        }
    }
    open_gaps.count_ones() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even_ring() -> RingGeometry<8> {
        RingGeometry { bearings_mrad: [0, 785, 1571, 2356, 3142, -2356, -1571, -785] }
    }

    #[test]
    fn the_turn_between_bearings_goes_the_short_way_round() {
        assert_eq!(turn_mrad(3142, -3142), 0);
        assert_eq!(turn_mrad(3000, -3000), 284);
        assert_eq!(turn_mrad(-3000, 3000), -284);
        assert_eq!(turn_mrad(-785, 785), 1570);
    }

    #[test]
    fn an_obstacle_lies_in_the_middle_of_the_sensors_that_hear_it() {
        let ranges = [SILENT, SILENT, SILENT, 1020, 1000, 1020, SILENT, SILENT];
        assert_eq!(middle_mrad((1000, 3142), &ranges, &even_ring(), 1600, 100), 3142);
        let one_sided = [SILENT, SILENT, SILENT, SILENT, 1010, 1000, SILENT, SILENT];
        assert_eq!(middle_mrad((1000, -2356), &one_sided, &even_ring(), 1600, 100), -2749);
    }

    #[test]
    fn a_corridor_has_two_obstacles_and_a_third_that_is_far() {
        let ranges = [4000, 1400, 1000, 1400, SILENT, 1400, 1010, 1400];
        let meeting = meeting(&ranges, &even_ring(), 1047, 100);
        assert_eq!((meeting.spread_mm, meeting.radius_mm, meeting.openings), (3000, 1005, 2));
    }

    #[test]
    fn a_dead_end_has_three_obstacles_and_one_opening() {
        let ranges = [1020, 1400, 1000, 1400, SILENT, 1400, 1010, 1400];
        let meeting = meeting(&ranges, &even_ring(), 1047, 100);
        assert_eq!((meeting.spread_mm, meeting.radius_mm, meeting.openings), (20, 1010, 1));
    }

    #[test]
    fn a_crossing_has_four_obstacles_and_four_openings() {
        let ranges = [5000, 1400, SILENT, 1400, SILENT, 1410, 4000, 1420];
        let meeting = meeting(&ranges, &even_ring(), 1047, 100);
        assert_eq!((meeting.spread_mm, meeting.radius_mm, meeting.openings), (10, 1407, 4));
    }
}
