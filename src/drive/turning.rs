//! How far the ring turns from frame to frame, felt by where its obstacles are: the robot has no odometry.

use crate::place::bearing::{turn_mrad, turned};
use crate::place::scan::{Closest, OBSTACLES, insert_ascending};

/// The ring turns by less in a frame, and an obstacle is known again within so much of where it is expected, in milliradians.
const TURN_MAX_MRAD: i16 = 700;

/// The bearings of the obstacles of a frame, and the turn since the one before.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    obstacles_mrad: [i16; OBSTACLES],
    len: u8,
    by_mrad: i16,
}

impl Turning {
    pub(super) const fn new() -> Self {
        Self { obstacles_mrad: [0; OBSTACLES], len: 0, by_mrad: 0 }
    }

    /// By how much bearings changed in the last frame, counter-clockwise positive.
    pub(super) fn by_mrad(&self) -> i32 {
        self.by_mrad.into()
    }

    /// Takes the closest obstacles of the next frame. Each of the frame before is looked for where the last turn would bring it;
    /// the middle one of what they turned more than that corrects the turn. Where none is known again the turn goes on as before.
    ///
    /// Time O(1): at most six obstacles against six.
    pub(super) fn feel(&mut self, closest: &Closest) {
        // In ascending order; empty slots sort behind every turn.
        let mut more_mrad = [i16::MAX; OBSTACLES];
        let mut known = 0_usize;
        for &before_mrad in self.obstacles_mrad.iter().take(self.len.into()) {
            let expected_mrad = turned(before_mrad, self.by_mrad());
            let turns_mrad = closest.iter().map(|now| turn_mrad(expected_mrad, now.bearing_mrad));
            let nearest_mrad = turns_mrad.min_by_key(|turn_mrad| turn_mrad.abs());
            let nearest_mrad = nearest_mrad.filter(|turn_mrad| turn_mrad.abs() < TURN_MAX_MRAD.into());
            if let Some(turn_mrad) = nearest_mrad {
                insert_ascending(&mut more_mrad, turn_mrad as i16);
                known += 1;
            }
        }
        let middle_mrad = known.checked_sub(1).and_then(|last| more_mrad.get(last / 2)).copied().unwrap_or(0);
        self.by_mrad = self.by_mrad.saturating_add(middle_mrad).clamp(-TURN_MAX_MRAD, TURN_MAX_MRAD);
        self.len = 0;
        for (slot, obstacle) in self.obstacles_mrad.iter_mut().zip(closest.iter()) {
            *slot = obstacle.bearing_mrad;
            self.len += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::scan::{SILENT, Scan};
    use crate::ring::RingGeometry;

    /// What is felt in a ring of 16 when these sonars hear something 800 mm away.
    fn feel(turning: &mut Turning, heard: &[usize]) -> i32 {
        let mut ranges_mm = [SILENT; 16];
        for &sonar in heard {
            ranges_mm[sonar] = 800;
        }
        let geometry = RingGeometry::even();
        let scan = Scan { ranges_mm: &ranges_mm, geometry: &geometry, separation_mrad: 1047, equidistance_mm: 150 };
        turning.feel(&scan.closest());
        turning.by_mrad()
    }

    #[test]
    fn a_turn_of_one_sonar_a_frame_is_felt_although_the_same_sonars_hear_something() {
        let mut turning = Turning::new();
        feel(&mut turning, &[0, 4, 8]);
        for frame in 1..8 {
            let heard = [0, 4, 8].map(|sonar| (sonar + 16 - frame) % 16);
            assert!((feel(&mut turning, &heard) + 393).abs() <= 2, "frame {frame}");
        }
    }

    #[test]
    fn an_obstacle_that_is_not_heard_or_comes_up_does_not_count() {
        let mut turning = Turning::new();
        feel(&mut turning, &[0, 4, 8]);
        assert!((feel(&mut turning, &[7, 15]) + 393).abs() <= 2);
        assert!((feel(&mut turning, &[2, 6, 14]) + 393).abs() <= 2);
    }

    #[test]
    fn where_nothing_is_heard_the_turn_goes_on() {
        let mut turning = Turning::new();
        feel(&mut turning, &[0, 4, 8]);
        feel(&mut turning, &[1, 5, 9]);
        assert!((feel(&mut turning, &[]) - 393).abs() <= 2);
        assert!((feel(&mut turning, &[3, 7, 11]) - 393).abs() <= 2);
        assert!(feel(&mut turning, &[3, 7, 11]).abs() <= 2, "and stops when the obstacles do");
    }
}
