//! What the body of the robot allows: gaps that are too narrow for it, corners that lead nowhere, and walls that hold it.

use super::voronoi::Sector;
use crate::bearing::turn_mrad;
use crate::place::{Obstacle, RingScan};
use crate::ring::Echo;

/// The gap beside the body that the robot leaves on each side, in millimetres.
const PLAY_MM: u16 = 20;
/// Two walls of a corner ahead are within this angle of straight ahead, in milliradians: 70°,
const CORNER_MRAD: i16 = 1222;
/// and the corner is nearer than this percentage of their range.
const CORNER_PERCENT: u32 = 160;
/// This many frames with a blocked way, more than without, turn the robot back.
const BLOCKED_FRAMES: u8 = 4;
/// A range that changes by less is unchanged, in millimetres: four standard deviations of a smoothed range.
const UNCHANGED_MM: u16 = 45;
/// A range that changes by more between two frames is that of another obstacle, in millimetres.
const OTHER_MM: u16 = 250;
/// A wall nearer than the body and this may hold the robot, in millimetres.
const HELD_MM: u16 = 60;
/// A robot that has driven for this long at full speed and measures the same ranges does not move, in thousandths of frames.
const STALLED_PERMILLE: u32 = 20_000;

/// Whether the body can go on. All zero at the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// Frames that show a blocked way minus frames that show a free one.
    blocked_frames: u8,
    /// The nearest range ahead, and that behind, since when the speeds are summed.
    ahead_mm: u16,
    behind_mm: u16,
    driven_permille: u32,
}

impl Body {
    pub(super) const fn new() -> Self {
        Self { blocked_frames: 0, ahead_mm: 0, behind_mm: 0, driven_permille: 0 }
    }

    /// The robot has turned, or is at a place: the sum of the speeds starts at 0.
    pub(super) fn forget_motion(&mut self) {
        self.driven_permille = 0;
    }

    /// Notes whether the way ahead is too narrow for the body, or a corner.
    pub(super) fn look<const SONARS: usize>(
        &mut self,
        scan: &RingScan<'_, SONARS>,
        ahead: Option<Obstacle>,
        body_radius_mm: u16,
    ) {
        if is_narrow(scan, ahead, body_radius_mm) {
            self.blocked_frames = self.blocked_frames.saturating_add(1).min(BLOCKED_FRAMES);
        } else {
            self.blocked_frames = self.blocked_frames.saturating_sub(1);
        }
    }

    /// Whether the way ahead has been blocked for some frames.
    pub(super) const fn is_blocked(&self) -> bool {
        self.blocked_frames >= BLOCKED_FRAMES
    }

    /// Whether the way ahead is free.
    pub(super) const fn is_free(&self) -> bool {
        self.blocked_frames == 0
    }

    /// Whether a wall holds the robot: it drives, a wall is as near as the body allows, and the ranges ahead and behind do not change.
    /// `speed_permille` is that of the last velocity command.
    ///
    /// In a long or round corridor the ranges do not change either, so that they alone are no sign.
    pub(super) fn is_held<const SONARS: usize>(
        &mut self,
        scan: &RingScan<'_, SONARS>,
        speed_permille: u16,
        body_radius_mm: u16,
    ) -> bool {
        let nearest = scan.nearest_between(i16::MIN, i16::MAX);
        if nearest.is_none_or(|nearest| nearest.range_mm > body_radius_mm.saturating_add(HELD_MM)) {
            // The next frame at a wall is the first one.
            (self.ahead_mm, self.behind_mm, self.driven_permille) = (0, 0, speed_permille.into());
            return false;
        }
        let range_mm = |towards_mrad: i16| {
            let obstacle = scan.nearest(|bearing_mrad| turn_mrad(towards_mrad, bearing_mrad).abs() < 300);
            obstacle.map_or(u16::MAX, |obstacle| obstacle.range_mm)
        };
        let (ahead_mm, behind_mm) = (range_mm(0), range_mm(3142));
        let changes_mm = [ahead_mm.abs_diff(self.ahead_mm), behind_mm.abs_diff(self.behind_mm)];
        let has_moved = changes_mm.iter().any(|change_mm| (UNCHANGED_MM..OTHER_MM).contains(change_mm));
        let is_other = changes_mm.iter().any(|change_mm| *change_mm >= OTHER_MM);
        if has_moved || is_other {
            (self.ahead_mm, self.behind_mm) = (ahead_mm, behind_mm);
        }
        if has_moved {
            self.driven_permille = 0;
        }
        self.driven_permille = self.driven_permille.saturating_add(speed_permille.into());
        self.driven_permille >= STALLED_PERMILLE
    }
}

/// Whether the gap between the obstacles on both sides is narrower than the body, or these are the walls of a corner.
fn is_narrow<const SONARS: usize>(scan: &RingScan<'_, SONARS>, ahead: Option<Obstacle>, body_radius_mm: u16) -> bool {
    let (Some(left), Some(right)) = Sector::AHEAD.sides(scan) else { return false };
    let mean_mm = left.range_mm / 2 + right.range_mm / 2;
    if mean_mm < body_radius_mm.saturating_add(PLAY_MM) {
        return true;
    }
    let is_corner = left.bearing_mrad < CORNER_MRAD
        && right.bearing_mrad > -CORNER_MRAD
        && ahead.is_some_and(|ahead| u32::from(ahead.range_mm) * 100 < u32::from(mean_mm) * CORNER_PERCENT);
    is_corner && mean_mm < body_radius_mm.saturating_mul(2)
}

/// The direction with the most room: the middle of the widest sector in which all ranges are beyond `room_mm`.
pub(super) fn widest_room_mrad<const SONARS: usize>(scan: &RingScan<'_, SONARS>, room_mm: u16) -> Option<i16> {
    let is_open = |echo: Echo| match echo {
        Echo::Range { range_mm } => range_mm > room_mm,
        Echo::Silence | Echo::Dead => true,
    };
    let echo = |index: usize| scan.echoes().nth(index % SONARS.max(1));
    let (mut best, mut run) = ((0, 0), 0);
    for index in 0..SONARS * 2 {
        let open = echo(index).is_some_and(|(echo, _)| is_open(echo));
        run = if open { run + 1 } else { 0 };
        if run > best.0 && run <= SONARS {
            best = (run, index);
        }
    }
    let (length, last) = best;
    if length == 0 {
        return None;
    }
    echo((last + 2 * SONARS - (length - 1) / 2) % SONARS.max(1)).map(|(_, bearing_mrad)| bearing_mrad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::test_ring::detector;

    const BODY_MM: u16 = 150;

    fn is_blocked(ranges_mm: &[(usize, u16)]) -> bool {
        let detector = detector(ranges_mm);
        let mut body = Body::new();
        for _ in 0..BLOCKED_FRAMES {
            let ahead = detector.scan().nearest(|bearing_mrad| bearing_mrad.abs() < 200);
            body.look(&detector.scan(), ahead, BODY_MM);
        }
        body.is_blocked()
    }

    #[test]
    fn a_gap_narrower_than_the_body_and_a_corner_block_the_way() {
        assert!(is_blocked(&[(3, 160), (13, 160)]));
        assert!(!is_blocked(&[(4, 200), (12, 200)]), "a gap of 400 mm is wide enough");
        assert!(!is_blocked(&[(6, 160), (10, 160)]), "the gap is behind");
        assert!(!is_blocked(&[(4, 160)]), "a single wall is no gap");
        assert!(is_blocked(&[(2, 250), (14, 250), (0, 354)]));
        assert!(!is_blocked(&[(2, 250), (14, 250)]), "between two posts the way is free");
    }

    #[test]
    fn one_frame_with_a_narrow_gap_does_not_block_the_way() {
        let mut body = Body::new();
        body.look(&detector(&[(4, 160), (12, 160)]).scan(), None, BODY_MM);
        assert!(!body.is_blocked() && !body.is_free());
        body.look(&detector(&[]).scan(), None, BODY_MM);
        assert!(body.is_free());
    }

    #[test]
    fn a_robot_at_a_wall_whose_ranges_do_not_change_while_it_drives_is_held() {
        let frames_held = |ranges_mm: &dyn Fn(u16) -> [(usize, u16); 3]| {
            let mut body = Body::new();
            (0..60).position(|frame| body.is_held(&detector(&ranges_mm(frame)).scan(), 1000, BODY_MM))
        };
        assert_eq!(frames_held(&|frame| [(0, 900), (4, 170), (8, 2000 + frame % 2 * 20)]), Some(19));
        assert_eq!(frames_held(&|frame| [(0, 3000 - 30 * frame), (4, 170), (12, 700)]), None);
        assert_eq!(frames_held(&|_| [(0, 900), (4, 700), (12, 700)]), None, "a round corridor");
        // The echo ahead jumps between two obstacles.
        assert_eq!(frames_held(&|frame| [(0, 900 + frame % 2 * 900), (4, 170), (12, 170)]), Some(19));
    }

    #[test]
    fn the_most_room_is_the_middle_of_the_widest_free_sector() {
        let walls = |blocked: core::ops::Range<usize>| {
            let ranges_mm: Vec<(usize, u16)> = blocked.map(|sensor| (sensor % 16, 200)).collect();
            widest_room_mrad(&detector(&ranges_mm).scan(), 500)
        };
        assert_eq!(walls(4..13), Some(0), "the free sector is ahead");
        assert_eq!(walls(13..20).map(|mrad| turn_mrad(3142, mrad).abs() <= 400), Some(true));
        assert_eq!(walls(0..16), None);
    }
}
