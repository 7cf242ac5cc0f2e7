//! Finds sonars whose ranges cannot be true: stuck at one range, or short where their neighbours measure more.
//!
//! While the ring turns, each sonar looks where its neighbours looked before. A sonar that always measures the same range then, although the
//! ranges of the others change, or that is nearly always much nearer than both neighbours, does not measure the room.

use super::smoothing::{DEAD_MM, SILENT_MM};

/// Angle by which the ring turns in a test, in milliradians: three sonars of 16.
const TURN_MRAD: i32 = 1200;
/// Frames after which a test without that turn starts again.
const MOST_FRAMES: u8 = 60;
/// A stuck sonar measures the same range up to this, in millimetres: four standard deviations of its noise.
const STUCK_MM: u16 = 60;
/// The ranges of at least half of the other sonars change by more than this, in millimetres.
const CHANGED_MM: u16 = 400;
/// A range is short when both neighbours measure more than three times as much.
const SHORT_FACTOR: u16 = 3;
/// Tests that a sonar fails before it is left out; as many that it passes bring it back.
const TESTS: u8 = 3;

/// The test of each sonar. All zero at the start. Memory: `7 · SONARS + 8` bytes.
#[derive(Clone, Debug)]
pub(super) struct Plausibility<const SONARS: usize> {
    turned_mrad: i32,
    frames: u8,
    /// The shortest and the longest range of each sonar in the test; 0 and 0 of a dead one.
    spans_mm: [(u16, u16); SONARS],
    /// Frames of the test with a short range.
    short_frames: [u8; SONARS],
    /// Failed tests minus passed ones, 0 to [`TESTS`]; from [`LEFT_OUT`] on the sonar is left out.
    failures: [u8; SONARS],
}

/// Added to the failures of a sonar that is left out.
const LEFT_OUT: u8 = 128;

impl<const SONARS: usize> Plausibility<SONARS> {
    pub(super) const fn new() -> Self {
        Self { turned_mrad: 0, frames: 0, spans_mm: [(0, 0); SONARS], short_frames: [0; SONARS], failures: [0; SONARS] }
    }

    pub(super) fn clear(&mut self) {
        *self = Self::new();
    }

    /// Takes the ranges of a frame, in ascending order of bearing, and the rotation of the ring, and marks the sonars that are left out as
    /// dead. Returns how many more are left out than before. Time `O(SONARS)`, at the end of a test `O(SONARS²)`.
    #[inline(never)]
    pub(super) fn check(&mut self, ranges_mm: &mut [u16; SONARS], rotation_mrad: i32) -> u8 {
        let measured_mm = *ranges_mm;
        // Beside a dead sonar, or one that is left out, a range cannot be compared.
        let failures = self.failures;
        let neighbour_mm = |index: usize| {
            let index = index % SONARS;
            let is_left_out = failures.get(index).is_some_and(|failures| *failures >= LEFT_OUT);
            measured_mm.get(index).copied().filter(|_| !is_left_out).unwrap_or(DEAD_MM)
        };
        let sonars = self.spans_mm.iter_mut().zip(&mut self.short_frames).zip(measured_mm).enumerate();
        for (index, (((least_mm, most_mm), short_frames), range_mm)) in sonars {
            if range_mm == DEAD_MM {
                continue;
            }
            *least_mm = if *least_mm == 0 { range_mm } else { range_mm.min(*least_mm) };
            *most_mm = range_mm.max(*most_mm);
            let nearer_mm = neighbour_mm(index + 1).min(neighbour_mm(index + SONARS - 1));
            *short_frames = short_frames.saturating_add(u8::from(range_mm < nearer_mm / SHORT_FACTOR));
        }
        self.frames = self.frames.saturating_add(1);
        self.turned_mrad = self.turned_mrad.saturating_add(rotation_mrad);
        let mut more = 0;
        if self.turned_mrad.abs() >= TURN_MRAD {
            more = self.judge();
        }
        if self.turned_mrad.abs() >= TURN_MRAD || self.frames >= MOST_FRAMES {
            (self.turned_mrad, self.frames) = (0, 0);
            self.spans_mm = [(0, 0); SONARS];
            self.short_frames = [0; SONARS];
        }
        for (range_mm, failures) in ranges_mm.iter_mut().zip(self.failures) {
            if failures >= LEFT_OUT {
                *range_mm = DEAD_MM;
            }
        }
        more
    }

    /// Counts the failed tests, and returns how many sonars are left out from now on.
    fn judge(&mut self) -> u8 {
        let changed =
            self.spans_mm.iter().filter(|(least_mm, most_mm)| most_mm.saturating_sub(*least_mm) > CHANGED_MM).count();
        if changed * 2 < SONARS {
            return 0;
        }
        let mut more = 0;
        for ((&(least_mm, most_mm), &short_frames), failures) in
            self.spans_mm.iter().zip(&self.short_frames).zip(&mut self.failures)
        {
            let is_stuck = least_mm > 0 && least_mm != SILENT_MM && most_mm.saturating_sub(least_mm) <= STUCK_MM;
            // A narrow object is seen by one sonar after the other.
            let is_short = u16::from(short_frames) * 10 >= u16::from(self.frames) * 9;
            let (count, is_left_out) = (*failures % LEFT_OUT, *failures >= LEFT_OUT);
            let count = if is_stuck || is_short { (count + 1).min(TESTS) } else { count.saturating_sub(1) };
            let leaves_out = if is_left_out { count > 0 } else { count >= TESTS };
            more += u8::from(leaves_out && !is_left_out);
            *failures = if leaves_out { count + LEFT_OUT } else { count };
        }
        more
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns a ring of 16 by a sixteenth per frame in a room, in which one sonar measures what `lie` returns for each frame. Returns the
    /// number of sonars that are left out, and whether it is that one alone.
    fn turn(frames: usize, lie: impl Fn(usize) -> Option<u16>) -> (u8, bool) {
        const ROOM_MM: [u16; 16] =
            [800, 820, SILENT_MM, SILENT_MM, 900, 850, 2400, 2300, 950, 1000, SILENT_MM, 3000, 700, 720, 1900, 1800];
        let mut test = Plausibility::<16>::new();
        let mut left_out = 0;
        let mut ranges_mm = ROOM_MM;
        for frame in 0..frames {
            ranges_mm = core::array::from_fn(|sonar| ROOM_MM[(sonar + frame) % 16]);
            if let Some(range_mm) = lie(frame) {
                ranges_mm[5] = range_mm;
            }
            left_out += test.check(&mut ranges_mm, -393);
        }
        (left_out, ranges_mm.iter().filter(|range_mm| **range_mm == DEAD_MM).count() == 1 && ranges_mm[5] == DEAD_MM)
    }

    #[test]
    fn a_sonar_stuck_at_one_range_is_left_out_and_an_honest_one_is_not() {
        assert_eq!(turn(30, |_| None), (0, false));
        assert_eq!(turn(30, |frame| Some(600 + 15 * (frame as u16 % 3))), (1, true));
        assert_eq!(turn(30, |_| Some(2900)), (1, true), "stuck at a long range");
    }

    #[test]
    fn a_sonar_with_short_ranges_where_its_neighbours_measure_more_is_left_out() {
        assert_eq!(turn(30, |frame| Some(80 + 70 * (frame as u16 % 3))), (1, true));
    }

    #[test]
    fn a_sonar_that_measures_the_room_again_is_brought_back() {
        assert_eq!(turn(60, |frame| (frame < 30).then_some(600)), (1, false));
    }

    #[test]
    fn without_a_turn_no_sonar_is_left_out() {
        let mut test = Plausibility::<16>::new();
        for _ in 0..300 {
            assert_eq!(test.check(&mut [700; 16], 10), 0);
        }
    }
}
