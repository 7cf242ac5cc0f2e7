//! One frame as the drive uses it: what the detector has made of it, and the range ahead.

use crate::place::{Obstacle, Obstacles, PlaceDetector, RingScan};
use crate::ring::Echo;

/// The robot faces an exit within this angle of straight ahead, in milliradians. Sensors within it look ahead.
pub(super) const FACING_MRAD: i32 = 200;
/// Where all sensors within [`FACING_MRAD`] are dead, sensors within this angle replace them, in milliradians.
const FACING_BESIDE_DEAD_MRAD: i32 = 600;

/// The newest frame of a detector.
pub(super) struct Frame<'a, const SONARS: usize> {
    pub(super) scan: RingScan<'a, SONARS>,
    pub(super) obstacles: Obstacles,
    /// Change of all bearings since the frame before.
    pub(super) rotation_mrad: i32,
    /// Whether the robot is still at the place that was reported last.
    pub(super) is_at_place: bool,
    /// Half-width of the sector whose sensors measure the range ahead: wider where all of those straight ahead are dead.
    pub(super) facing_mrad: i32,
    /// The nearest obstacle ahead.
    pub(super) ahead: Option<Obstacle>,
}

impl<'a, const SONARS: usize> Frame<'a, SONARS> {
    /// The newest frame. Cost: three passes over the ring.
    pub(super) fn of(detector: &'a PlaceDetector<SONARS>) -> Self {
        let scan = detector.scan();
        let facing_mrad = facing_mrad(&scan);
        let within_mrad = facing_mrad as i16;
        Self {
            obstacles: detector.obstacles(),
            rotation_mrad: detector.rotation_mrad(),
            is_at_place: detector.is_at_place(),
            facing_mrad,
            ahead: scan.nearest_between(1 - within_mrad, within_mrad - 1),
            scan,
        }
    }

    /// Whether all sensors straight ahead are dead.
    pub(super) const fn is_blind_ahead(&self) -> bool {
        self.facing_mrad > FACING_MRAD
    }
}

fn facing_mrad<const SONARS: usize>(scan: &RingScan<'_, SONARS>) -> i32 {
    let faces = |bearing_mrad: i16| i32::from(bearing_mrad).abs() < FACING_MRAD;
    let is_live = scan.echoes().any(|(echo, bearing_mrad)| echo != Echo::Dead && faces(bearing_mrad));
    if is_live { FACING_MRAD } else { FACING_BESIDE_DEAD_MRAD }
}
