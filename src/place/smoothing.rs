//! Smooths the ranges of each sensor over time, and fills in dead sensors between two that measure about the same range.

use super::PlaceConfig;
use crate::bearing::turn_mrad;
use crate::ring::RingGeometry;

/// Range of a sensor without a valid measurement.
pub(super) const DEAD_MM: u16 = 0;
/// Range of a sensor that received no echo.
pub(super) const SILENT_MM: u16 = u16::MAX;

/// The ranges of the three frames before the newest one; all zero at the start.
#[derive(Clone, Debug)]
pub(super) struct RangeSmoother<const SONARS: usize> {
    earlier_mm: [[u16; SONARS]; 3],
}

impl<const SONARS: usize> RangeSmoother<SONARS> {
    pub(super) const fn new() -> Self {
        Self { earlier_mm: [[DEAD_MM; SONARS]; 3] }
    }

    pub(super) fn clear(&mut self) {
        self.earlier_mm = [[DEAD_MM; SONARS]; 3];
    }

    /// Takes the ranges of the next frame and returns them smoothed. Time `O(SONARS)`.
    pub(super) fn update(&mut self, now_mm: [u16; SONARS]) -> [u16; SONARS] {
        let [before_mm, long_before_mm, first_mm] = self.earlier_mm;
        self.earlier_mm = [now_mm, before_mm, long_before_mm];
        let mut smooth_mm = now_mm;
        let earlier_mm = before_mm.into_iter().zip(long_before_mm).zip(first_mm);
        for (smooth_mm, ((before_mm, long_before_mm), first_mm)) in smooth_mm.iter_mut().zip(earlier_mm) {
            *smooth_mm = smoothed(*smooth_mm, before_mm, long_before_mm, first_mm);
        }
        smooth_mm
    }
}

/// Whether a range is that of an echo.
pub(super) const fn is_echo(range_mm: u16) -> bool {
    range_mm != DEAD_MM && range_mm != SILENT_MM
}

/// Median of a sensor's last three ranges, newest first. Where the median is silence but two of the last four ranges are
/// echoes, the shortest of the three: a sonar misses an obstacle more often than it reports one that does not exist.
fn smoothed(now_mm: u16, before_mm: u16, long_before_mm: u16, first_mm: u16) -> u16 {
    match (now_mm, before_mm, long_before_mm) {
        (DEAD_MM, _, _) => DEAD_MM,
        (_, DEAD_MM, DEAD_MM) => now_mm,
        (_, DEAD_MM, other_mm) | (_, other_mm, DEAD_MM) => now_mm.min(other_mm),
        _ => {
            let median_mm = now_mm.min(before_mm).max(now_mm.max(before_mm).min(long_before_mm));
            let is_missed = median_mm == SILENT_MM && is_echo(first_mm);
            if is_missed { now_mm.min(before_mm).min(long_before_mm) } else { median_mm }
        }
    }
}

/// Gives each dead sensor the mean range of its two neighbours, where both receive echoes from about the same range: a wall
/// must not split into two obstacles where a sensor is missing.
///
/// `ranges_mm` and `geometry` are in ascending order of bearing. Time `O(SONARS)`.
pub(super) fn bridge_dead_sensors<const SONARS: usize>(
    ranges_mm: &mut [u16; SONARS],
    geometry: &RingGeometry<SONARS>,
    config: &PlaceConfig,
) {
    let measured_mm = *ranges_mm;
    let neighbour = |index: usize| Some((*measured_mm.get(index)?, *geometry.bearings_mrad.get(index)?));
    for (index, range_mm) in ranges_mm.iter_mut().enumerate() {
        if *range_mm != DEAD_MM {
            continue;
        }
        let (before, after) = ((index + SONARS - 1) % SONARS, (index + 1) % SONARS);
        let (Some((before_mm, from_mrad)), Some((after_mm, to_mrad))) = (neighbour(before), neighbour(after)) else {
            continue;
        };
        let is_gap_narrow = turn_mrad(from_mrad, to_mrad).abs() <= i32::from(config.separation_mrad);
        let is_same_range =
            is_echo(before_mm) && is_echo(after_mm) && before_mm.abs_diff(after_mm) <= config.equidistance_mm;
        if is_gap_narrow && is_same_range {
            *range_mm = before_mm / 2 + after_mm / 2;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_echoes_among_four_ranges_count_as_an_echo_and_one_does_not() {
        let smooth = |ranges_mm: [u16; 4]| {
            let [first_mm, long_before_mm, before_mm, now_mm] = ranges_mm;
            smoothed(now_mm, before_mm, long_before_mm, first_mm)
        };
        assert_eq!(smooth([900, 910, 920, 930]), 920);
        assert_eq!(smooth([900, SILENT_MM, 920, 930]), 930);
        assert_eq!(smooth([900, SILENT_MM, SILENT_MM, 930]), 930);
        assert_eq!(smooth([900, SILENT_MM, 920, SILENT_MM]), 920);
        assert_eq!(smooth([SILENT_MM, SILENT_MM, 920, SILENT_MM]), SILENT_MM);
        assert_eq!(smooth([900, SILENT_MM, SILENT_MM, SILENT_MM]), SILENT_MM);
        assert_eq!(smooth([900, DEAD_MM, DEAD_MM, SILENT_MM]), SILENT_MM);
        assert_eq!(smooth([900, 910, DEAD_MM, SILENT_MM]), 910);
        assert_eq!(smooth([900, 910, 920, DEAD_MM]), DEAD_MM);
    }
}
