//! Smooths the ranges of each sensor over time, and fills in dead sensors between two that measure about the same range.

use super::PlaceConfig;
use crate::bearing::turn_mrad;
use crate::ring::RingGeometry;

/// Range of a sensor without a valid measurement.
pub(super) const DEAD_MM: u16 = 0;
/// Two ranges from one obstacle differ by at most this, in millimetres: the travel of some frames and noise.
const AGREE_MM: u16 = 200;
/// Range of a sensor that received no echo.
pub(super) const SILENT_MM: u16 = u16::MAX;

/// Each echo between two that agree moves the share of the missed ones by one part in this many.
const MISSED_WEIGHT: i32 = 1 << 10;

/// The earlier frames that a range is smoothed with.
const EARLIER: usize = 5;
/// Sonars that miss more than this share of the echoes, in thousandths, are smoothed over six frames instead of four.
const MANY_MISSED_PERMILLE: u16 = 80;

/// The ranges of the frames before the newest one, and the share of the echoes that the sonars miss; all zero at the start.
#[derive(Clone, Debug)]
pub(super) struct RangeSmoother<const SONARS: usize> {
    earlier_mm: [[u16; SONARS]; EARLIER],
    /// The share of the echoes between two that agree which are missed or do not agree with them, in parts of 2²⁴.
    missed: i32,
}

impl<const SONARS: usize> RangeSmoother<SONARS> {
    pub(super) const fn new() -> Self {
        Self { earlier_mm: [[DEAD_MM; SONARS]; EARLIER], missed: 0 }
    }

    pub(super) fn clear(&mut self) {
        *self = Self::new();
    }

    /// The share of the echoes that the sonars miss, in thousandths: silence, or another range, between two ranges that agree.
    pub(super) const fn missed_permille(&self) -> u16 {
        (((self.missed >> 14) * 1000) >> 10) as u16
    }

    /// Takes the ranges of the next frame and returns them smoothed. Time `O(SONARS)`.
    #[inline(never)]
    pub(super) fn update(&mut self, now_mm: [u16; SONARS]) -> [u16; SONARS] {
        let earlier_mm = self.earlier_mm;
        let [before_mm, long_before_mm, third_mm, fourth_mm, fifth_mm] = earlier_mm;
        self.earlier_mm = [now_mm, before_mm, long_before_mm, third_mm, fourth_mm];
        let misses_many = self.missed_permille() > MANY_MISSED_PERMILLE;
        let mut smooth_mm = now_mm;
        let earlier_mm = before_mm.into_iter().zip(long_before_mm).zip(third_mm);
        let oldest_mm = fourth_mm.into_iter().zip(fifth_mm);
        let earlier_mm = earlier_mm.zip(oldest_mm);
        for (smooth_mm, (((before_mm, long_before_mm), third_mm), (fourth_mm, fifth_mm))) in
            smooth_mm.iter_mut().zip(earlier_mm)
        {
            let now_mm = *smooth_mm;
            if agree(now_mm, long_before_mm) && before_mm != DEAD_MM {
                let is_missed = !agree(now_mm, before_mm);
                self.missed += (if is_missed { (1 << 24) - self.missed } else { -self.missed }) / MISSED_WEIGHT;
            }
            *smooth_mm = smoothed([now_mm, before_mm, long_before_mm, third_mm]);
            if misses_many && *smooth_mm == SILENT_MM {
                *smooth_mm = repeated([now_mm, before_mm, long_before_mm, third_mm, fourth_mm, fifth_mm]);
            }
        }
        smooth_mm
    }
}

/// Whether a range is that of an echo.
pub(super) const fn is_echo(range_mm: u16) -> bool {
    range_mm != DEAD_MM && range_mm != SILENT_MM
}

/// Whether two ranges are echoes from about the same distance.
const fn agree(one_mm: u16, other_mm: u16) -> bool {
    is_echo(one_mm) && is_echo(other_mm) && one_mm.abs_diff(other_mm) <= AGREE_MM
}

/// The range of a sensor from its last four frames, newest first: the median of the three newest valid ranges.
///
/// Where the median is silence, or no two of the three are echoes that agree, two echoes among four that agree decide: a sonar misses an
/// obstacle more often than it reports one that does not exist. Where none agree either, the longest range: a false echo must not stop the
/// robot. A sensor is dead when it did not answer in three frames.
fn smoothed(frames_mm: [u16; 4]) -> u16 {
    if frames_mm.iter().take(3).all(|range_mm| *range_mm == DEAD_MM) {
        return DEAD_MM;
    }
    let mut valid_mm = frames_mm.into_iter().filter(|range_mm| *range_mm != DEAD_MM);
    let (now_mm, before_mm, long_before_mm) = (valid_mm.next(), valid_mm.next(), valid_mm.next());
    match (now_mm, before_mm, long_before_mm) {
        (None, ..) => DEAD_MM,
        (Some(now_mm), None, _) => now_mm,
        (Some(now_mm), Some(before_mm), None) if agree(now_mm, before_mm) => now_mm.min(before_mm),
        (Some(now_mm), Some(before_mm), None) => now_mm.max(before_mm),
        (Some(now_mm), Some(before_mm), Some(long_before_mm)) => {
            let (nearer_mm, farther_mm) = (now_mm.min(before_mm), now_mm.max(before_mm));
            let median_mm = nearer_mm.max(farther_mm.min(long_before_mm));
            let do_agree =
                agree(now_mm, before_mm) || agree(now_mm, long_before_mm) || agree(before_mm, long_before_mm);
            if do_agree {
                return median_mm;
            }
            let first_mm = valid_mm.next().unwrap_or(DEAD_MM);
            let confirmed_mm =
                [now_mm, before_mm, long_before_mm].into_iter().find(|range_mm| agree(*range_mm, first_mm));
            match confirmed_mm {
                Some(range_mm) => range_mm,
                None if median_mm == SILENT_MM => SILENT_MM,
                None => farther_mm.max(long_before_mm),
            }
        }
    }
}

/// The newest of two echoes that agree, or silence.
fn repeated(frames_mm: [u16; 6]) -> u16 {
    let mut rest = frames_mm.as_slice();
    while let [newest_mm, older_mm @ ..] = rest {
        if older_mm.iter().any(|range_mm| agree(*newest_mm, *range_mm)) {
            return *newest_mm;
        }
        rest = older_mm;
    }
    SILENT_MM
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

    fn smooth([first_mm, long_before_mm, before_mm, now_mm]: [u16; 4]) -> u16 {
        smoothed([now_mm, before_mm, long_before_mm, first_mm])
    }

    #[test]
    fn two_echoes_among_four_ranges_count_as_an_echo_and_one_does_not() {
        assert_eq!(smooth([900, 910, 920, 930]), 920);
        assert_eq!(smooth([900, SILENT_MM, 920, 930]), 930);
        assert_eq!(smooth([900, SILENT_MM, SILENT_MM, 930]), 930);
        assert_eq!(smooth([900, SILENT_MM, 920, SILENT_MM]), 920);
        assert_eq!(smooth([SILENT_MM, SILENT_MM, 920, SILENT_MM]), SILENT_MM);
        assert_eq!(smooth([900, SILENT_MM, SILENT_MM, SILENT_MM]), SILENT_MM);
    }

    #[test]
    fn echoes_that_do_not_agree_are_no_obstacle() {
        assert_eq!(smooth([3100, SILENT_MM, 920, SILENT_MM]), SILENT_MM);
        assert_eq!(smooth([SILENT_MM, SILENT_MM, 300, 2500]), SILENT_MM);
        assert_eq!(smooth([2480, SILENT_MM, 300, 2500]), 2500);
        assert_eq!(smooth([900, 910, 300, 2500]), 910);
    }

    #[test]
    fn a_sensor_keeps_its_range_for_two_frames_without_an_answer() {
        assert_eq!(smooth([900, 910, 920, DEAD_MM]), 910);
        assert_eq!(smooth([900, 910, DEAD_MM, DEAD_MM]), 900);
        assert_eq!(smooth([900, DEAD_MM, DEAD_MM, DEAD_MM]), DEAD_MM);
        assert_eq!(smooth([900, DEAD_MM, DEAD_MM, SILENT_MM]), SILENT_MM);
        assert_eq!(smooth([DEAD_MM, DEAD_MM, DEAD_MM, 900]), 900);
    }

    /// Updates a smoother of one sensor with the same range, missed in some frames; returns the smoothed ranges.
    fn update(smoother: &mut RangeSmoother<1>, frames: usize, is_missed: impl Fn(usize) -> bool) -> Vec<u16> {
        (0..frames).map(|frame| smoother.update([if is_missed(frame) { SILENT_MM } else { 900 }])[0]).collect()
    }

    #[test]
    fn the_share_of_missed_echoes_is_measured() {
        let mut smoother = RangeSmoother::new();
        update(&mut smoother, 9000, |_| false);
        assert_eq!(smoother.missed_permille(), 0);
        update(&mut smoother, 9000, |frame| frame % 5 == 0);
        // Of five frames, three are between two echoes, and one of these is missed.
        assert!((300..=340).contains(&smoother.missed_permille()), "{}", smoother.missed_permille());
        update(&mut smoother, 9000, |_| true);
        assert!((300..=340).contains(&smoother.missed_permille()), "silence alone is no missed echo");
    }

    #[test]
    fn sonars_that_miss_many_echoes_keep_a_range_for_longer() {
        let mut smoother = RangeSmoother::new();
        // Four successive frames are missed.
        let is_missed = |frame| [4, 5, 6, 7].contains(&frame);
        assert!(update(&mut smoother, 9, is_missed).contains(&SILENT_MM));
        update(&mut smoother, 2000, |frame| frame % 5 == 0);
        assert!(!update(&mut smoother, 9, is_missed).contains(&SILENT_MM));
    }
}
