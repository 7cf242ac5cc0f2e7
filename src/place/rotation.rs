//! Estimates the rotation of the ring from frame to frame by the bearings at which it measures near obstacles: the robot has no odometry.

use super::smoothing::{DEAD_MM, SILENT_MM};
use crate::ring::RingGeometry;

/// The bearings at which frames are compared; a power of two.
const BINS: usize = 32;
/// The binary angle of one of them: 2¹⁶ is a full turn.
const BIN: i32 = 1 << 16 >> BINS.trailing_zeros();
/// A frame is compared with the reference at the expected rotation and at as many bins to either side of it.
const SEARCHED: i32 = 3;
/// A frame that differs from the reference by more than one part in this many becomes the reference.
const DIFFERENT: u32 = 4;
/// The price of a bin off the expected rotation, as a part of the sum of both profiles.
const UNEXPECTED: u32 = 256;
/// Between two frames the ring turns by at most this, as a binary angle: 0.2 rad.
const FASTEST: i16 = 2086;
/// The same in a ring with at most [`FEW_SONARS`], which shows a rotation late and at once, or one that is none: 0.1 rad. The drive turns by 0.07 rad.
const FASTEST_OF_FEW: i16 = 1043;
/// The sensors of a ring with wide gaps between them.
const FEW_SONARS: usize = 10;
/// The nearest range that is distinguished, in millimetres.
const NEAREST_MM: u16 = 200;
/// The proximity of an obstacle is this divided by its range in millimetres.
const PROXIMITY: i32 = 1 << 20;

/// The proximity of the obstacles at evenly spaced bearings.
type Profile = [u16; BINS];

/// The rotation since a reference frame, by the best agreement of the proximity profiles of both frames.
///
/// A frame is compared with the reference, not with the frame before, so the errors of a turn in place do not add up. The robot drives
/// away from a reference; a frame that no rotation explains is the next one.
#[derive(Clone, Debug)]
pub(super) struct RotationEstimate {
    reference: Profile,
    has_reference: bool,
    /// The rotation of all bearings since the reference, as a binary angle.
    turned: i16,
    /// The part of it that has been reported.
    reported: i16,
    /// That of the newest frame.
    step: i16,
    /// That of the last frames, smoothed, which is expected of the next one.
    rate: i16,
}

impl RotationEstimate {
    pub(super) const fn new() -> Self {
        Self { reference: [0; BINS], has_reference: false, turned: 0, reported: 0, step: 0, rate: 0 }
    }

    /// Change of all bearings between the last two frames, counter-clockwise positive: the negative of the robot's rotation.
    pub(super) fn rotation_mrad(&self) -> i32 {
        (i32::from(self.step) * 6283 + (1 << 15)) >> 16
    }

    /// Updates the estimate with the next frame. A frame without echoes continues the rotation.
    ///
    /// Time O(SONARS): nine comparisons of profiles of 32 bearings.
    #[inline(never)]
    pub(super) fn update<const SONARS: usize>(&mut self, ranges_mm: &[u16; SONARS], geometry: &RingGeometry<SONARS>) {
        let now = proximity_profile(ranges_mm, geometry);
        if now.iter().all(|&proximity| proximity == 0) {
            self.turned = self.turned.wrapping_add(self.rate);
            self.report(SONARS);
            return;
        }
        if !self.has_reference {
            self.refer_to(&now);
            return;
        }
        let expected = self.turned.wrapping_add(self.rate);
        let centre = (i32::from(expected) + BIN / 2).div_euclid(BIN);
        let sum: u32 = now.iter().chain(&self.reference).map(|&proximity| u32::from(proximity)).sum();
        let here = (i32::from(self.turned) + BIN / 2).div_euclid(BIN);
        let (mut best, mut least) = (here, u32::MAX);
        for bins in here - SEARCHED..=here + SEARCHED {
            let price = sum / UNEXPECTED * bins.abs_diff(centre);
            let price = price + difference(&self.reference, &now, bins);
            if price < least {
                (best, least) = (bins, price);
            }
        }
        let [before, at, after] = [best - 1, best, best + 1].map(|bins| difference(&self.reference, &now, bins));
        // The difference grows linearly to both sides of its minimum.
        let part = BIN / 2 * (before as i32 - after as i32);
        let part = part.checked_div(before.max(after) as i32 - at as i32).unwrap_or(0).clamp(-BIN / 2, BIN / 2);
        let turned = (best * BIN + part) as i16;
        self.rate = self.rate / 2 + turned.wrapping_sub(self.turned) / 2;
        self.turned = turned;
        self.report(SONARS);
        if at > sum / DIFFERENT {
            self.refer_to(&now);
        }
    }

    fn refer_to(&mut self, now: &Profile) {
        self.reference = *now;
        self.has_reference = true;
        self.reported = self.reported.wrapping_sub(self.turned);
        self.turned = 0;
    }

    /// Reports as much of the rotation as is possible between two frames, and the rest with the next ones.
    fn report(&mut self, sonars: usize) {
        let fastest = if sonars <= FEW_SONARS { FASTEST_OF_FEW } else { FASTEST };
        self.step = self.turned.wrapping_sub(self.reported).clamp(-fastest, fastest);
        self.reported = self.reported.wrapping_add(self.step);
    }
}

/// By how much a profile differs from another one that is rotated by `bins`.
#[inline(never)]
fn difference(reference: &Profile, now: &Profile, bins: i32) -> u32 {
    let (first, last) = now.split_at(bins as usize % BINS);
    let (before_last, before_first) = reference.split_at(last.len());
    difference_of_part(before_last, last) + difference_of_part(before_first, first)
}

fn difference_of_part(before: &[u16], now: &[u16]) -> u32 {
    before.iter().zip(now).fold(0, |sum, (&before, &now)| sum + u32::from(before.abs_diff(now)))
}

/// The proximity at 32 bearings from straight behind, interpolated between the live sensors beside each. Ranges and bearings are in
/// ascending order of bearing.
#[inline(never)]
fn proximity_profile<const SONARS: usize>(ranges_mm: &[u16; SONARS], geometry: &RingGeometry<SONARS>) -> Profile {
    let mut profile = [0; BINS];
    let live = ranges_mm.iter().zip(&geometry.bearings_mrad).filter(|&(&range_mm, _)| range_mm != DEAD_MM);
    let live = live.map(|(&range_mm, &bearing_mrad)| {
        let proximity = if range_mm == SILENT_MM { 0 } else { PROXIMITY / i32::from(range_mm.max(NEAREST_MM)) };
        ((i32::from(bearing_mrad) + 3142) * 65_536 / 6283, proximity)
    });
    let Some((last, last_proximity)) = live.clone().next_back() else { return profile };
    let (mut from, mut from_proximity) = (last - 65_536, last_proximity);
    for (to, to_proximity) in live {
        let mut bin = (from + BIN - 1).div_euclid(BIN);
        while bin * BIN < to {
            let step = (to_proximity - from_proximity) * (bin * BIN - from) / (to - from).max(1);
            if let Some(slot) = profile.get_mut(bin as usize % BINS) {
                *slot = (from_proximity + step) as u16;
            }
            bin += 1;
        }
        (from, from_proximity) = (to, to_proximity);
    }
    profile
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Updates the estimate with a frame of a ring of 16 in which these sensors measure 800 mm, and returns it.
    fn update(estimate: &mut RotationEstimate, sensors: &[usize]) -> i32 {
        let mut ranges_mm = [SILENT_MM; 16];
        sensors.iter().for_each(|&sensor| ranges_mm[sensor] = 800);
        let mut geometry = RingGeometry::even();
        geometry.bearings_mrad.sort_unstable();
        estimate.update(&ranges_mm, &geometry);
        estimate.rotation_mrad()
    }

    /// Updates the estimate with the same frame twice, and returns the rotation that it reports in both.
    fn turned_mrad(estimate: &mut RotationEstimate, sensors: &[usize]) -> i32 {
        update(estimate, sensors) + update(estimate, sensors)
    }

    #[test]
    fn a_rotation_is_estimated_although_some_sensors_measure_the_same_and_reported_no_faster_than_a_ring_turns() {
        let mut estimate = RotationEstimate::new();
        update(&mut estimate, &[0, 4, 8]);
        let mut turned_mrad = 0;
        for frame in 1..=80 {
            // By one sensor in every third frame.
            let rotation_mrad = update(&mut estimate, &[0, 4, 8].map(|sensor| (sensor + 48 - frame.min(78) / 3) % 16));
            assert!(rotation_mrad.abs() <= 200, "frame {frame}: {rotation_mrad}");
            turned_mrad += rotation_mrad;
        }
        assert!((turned_mrad + 26 * 393).abs() <= 20, "{turned_mrad}");
    }

    #[test]
    fn the_errors_of_a_turn_in_place_do_not_add_up() {
        // Three turns by a third of a sensor in each frame: the frames show only whole sensors.
        let mut estimate = RotationEstimate::new();
        let mut turned_mrad = 0;
        for frame in 0..145 {
            turned_mrad += update(&mut estimate, &[0, 3, 4, 9].map(|sensor| (sensor + (frame + 1) / 3) % 16));
        }
        assert!((turned_mrad - 3 * 6283).abs() < 20, "{turned_mrad}");
    }

    #[test]
    fn an_obstacle_that_disappears_or_appears_does_not_change_the_estimate() {
        let mut estimate = RotationEstimate::new();
        update(&mut estimate, &[0, 4, 8]);
        assert!((turned_mrad(&mut estimate, &[7, 15]) + 393).abs() <= 40);
        assert!((turned_mrad(&mut estimate, &[2, 6, 14]) + 393).abs() <= 40);
    }

    #[test]
    fn where_no_rotation_explains_a_frame_the_next_ones_are_compared_with_it() {
        let mut estimate = RotationEstimate::new();
        update(&mut estimate, &[0, 4, 8]);
        for _ in 0..8 {
            update(&mut estimate, &[1, 2, 6, 7, 11, 12]);
        }
        assert!((turned_mrad(&mut estimate, &[2, 3, 7, 8, 12, 13]) - 393).abs() <= 40);
        for _ in 0..4 {
            update(&mut estimate, &[2, 3, 7, 8, 12, 13]);
        }
        assert_eq!(estimate.rotation_mrad(), 0, "the rotation stops when the obstacles do");
    }

    #[test]
    fn without_obstacles_the_rotation_continues() {
        let mut estimate = RotationEstimate::new();
        // By a fifth of a sensor in each frame.
        for frame in 0..31 {
            update(&mut estimate, &[0, 4, 8].map(|sensor| (sensor + frame / 5) % 16));
        }
        let rotations = [(); 3].map(|()| update(&mut estimate, &[]));
        assert!(rotations.into_iter().all(|rotation_mrad| (20..=200).contains(&rotation_mrad)), "{rotations:?}");
        turned_mrad(&mut estimate, &[7, 11, 15]);
        assert!(update(&mut estimate, &[7, 11, 15]).abs() <= 2, "the rotation stops when the obstacles do");
    }
}
