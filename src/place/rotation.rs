//! Estimates the rotation of the ring from frame to frame by the bearings of its obstacles: the robot has no odometry.

use super::Obstacles;
use crate::bearing::{rotated, turn_mrad};
use crate::top_k::TopK;

/// Bound of the rotation in one frame, and of the distance between the expected and the measured bearing of an obstacle, in
/// milliradians.
const MAX_ROTATION_MRAD: i16 = 700;

/// The bearings of the obstacles in the newest frame, and the rotation since the frame before.
#[derive(Clone, Debug)]
pub(super) struct RotationEstimate {
    obstacles_mrad: [i16; Obstacles::MAX],
    len: u8,
    rotation_mrad: i16,
}

impl RotationEstimate {
    pub(super) const fn new() -> Self {
        Self { obstacles_mrad: [0; Obstacles::MAX], len: 0, rotation_mrad: 0 }
    }

    /// Change of all bearings between the last two frames, counter-clockwise positive: the negative of the robot's rotation.
    pub(super) fn rotation_mrad(&self) -> i32 {
        self.rotation_mrad.into()
    }

    /// Updates the estimate with the obstacles of the next frame.
    ///
    /// Each obstacle of the frame before is matched to the nearest one of this frame, under the previous rotation. The
    /// median of the residuals corrects the rotation. Without a match the rotation stays as it is.
    ///
    /// Time O(1): at most six obstacles against six.
    pub(super) fn update(&mut self, obstacles: &Obstacles) {
        let mut residuals_mrad = TopK::<i16, { Obstacles::MAX }>::new(0);
        for &before_mrad in self.obstacles_mrad.iter().take(self.len.into()) {
            let expected_mrad = rotated(before_mrad, self.rotation_mrad());
            let all_mrad = obstacles.iter().map(|obstacle| turn_mrad(expected_mrad, obstacle.bearing_mrad));
            let nearest_mrad = all_mrad.min_by_key(|residual_mrad| residual_mrad.abs());
            let nearest_mrad = nearest_mrad.filter(|residual_mrad| residual_mrad.abs() < MAX_ROTATION_MRAD.into());
            if let Some(residual_mrad) = nearest_mrad {
                residuals_mrad.insert(residual_mrad as i16, |one, other| one <= other);
            }
        }
        let sorted_mrad = residuals_mrad.as_slice();
        let last = sorted_mrad.len().saturating_sub(1);
        let median_mrad = sorted_mrad.get(last / 2).copied().unwrap_or(0);
        self.rotation_mrad =
            self.rotation_mrad.saturating_add(median_mrad).clamp(-MAX_ROTATION_MRAD, MAX_ROTATION_MRAD);
        self.len = 0;
        for (slot, obstacle) in self.obstacles_mrad.iter_mut().zip(obstacles.iter()) {
            *slot = obstacle.bearing_mrad;
            self.len += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::{PlaceConfig, PlaceDetector};
    use crate::ring::{Echo, RingFrame, RingGeometry};

    /// Updates the estimate with a frame of a ring of 16 in which these sensors measure 800 mm, and returns it.
    fn update(estimate: &mut RotationEstimate, sensors: &[usize]) -> i32 {
        let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
        for &sensor in sensors {
            frame.echoes[sensor] = Echo::Range { range_mm: 800 };
        }
        let mut detector = PlaceDetector::new();
        detector.start(PlaceConfig::DEFAULT, RingGeometry::even()).unwrap();
        detector.observe(&frame);
        estimate.update(&detector.scan().obstacles());
        estimate.rotation_mrad()
    }

    #[test]
    fn a_rotation_by_one_sensor_a_frame_is_estimated_although_some_sensors_measure_the_same() {
        let mut estimate = RotationEstimate::new();
        update(&mut estimate, &[0, 4, 8]);
        for frame in 1..8 {
            let sensors = [0, 4, 8].map(|sensor| (sensor + 16 - frame) % 16);
            assert!((update(&mut estimate, &sensors) + 393).abs() <= 2, "frame {frame}");
        }
    }

    #[test]
    fn an_obstacle_that_disappears_or_appears_does_not_change_the_estimate() {
        let mut estimate = RotationEstimate::new();
        update(&mut estimate, &[0, 4, 8]);
        assert!((update(&mut estimate, &[7, 15]) + 393).abs() <= 2);
        assert!((update(&mut estimate, &[2, 6, 14]) + 393).abs() <= 2);
    }

    #[test]
    fn without_obstacles_the_rotation_continues() {
        let mut estimate = RotationEstimate::new();
        update(&mut estimate, &[0, 4, 8]);
        update(&mut estimate, &[1, 5, 9]);
        assert!((update(&mut estimate, &[]) - 393).abs() <= 2);
        assert!((update(&mut estimate, &[3, 7, 11]) - 393).abs() <= 2);
        assert!(update(&mut estimate, &[3, 7, 11]).abs() <= 2, "the rotation stops when the obstacles do");
    }
}
