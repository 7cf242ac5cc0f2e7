//! Heading and speed of a robot that drives along an edge, or looks for one.

use super::DriveConfig;
use super::frame::Frame;
use super::voronoi::{AHEAD_MRAD, Sector, edge_heading_mrad};

/// On the way out the robot does not steer off the bearing of the exit by more than this, in milliradians.
const ASIDE_MRAD: i16 = 200;
/// With the sensors ahead dead the robot sways by this angle to either side, in milliradians,
const SWAY_MRAD: i16 = 260;
/// for this number of frames each; a power of two.
const SWAY_FRAMES: u16 = 8;
/// A robot that looks for a narrow gap turns towards a bearing on either side, this percentage of the angle between two sensors,
const LOOK_ROUND_PERCENT: u16 = 46;
/// for this number of frames each; a power of two.
const LOOK_ROUND_FRAMES: u16 = 8;
/// Limit of the heading along an edge, in milliradians: an edge is smooth, and an intermittent echo must not turn the robot
/// round.
const MAX_HEADING_MRAD: i16 = 500;
/// Minimum speed near a meet point, in thousandths.
const APPROACH_PERMILLE: u16 = 250;
/// Distance from a meet point at which the speed begins to fall, in millimetres.
const BRAKE_MM: u16 = 400;

/// The heading along the edge between the obstacles in a sector; where the exit is known, within [`ASIDE_MRAD`] of it.
pub(super) fn heading_mrad<const SONARS: usize>(
    config: &DriveConfig,
    frame: &Frame<'_, SONARS>,
    sector: Sector,
    exit_mrad: Option<i16>,
) -> i16 {
    let mut heading_mrad = edge_heading_mrad(&frame.scan, sector, config.look_ahead_mm).or(exit_mrad).unwrap_or(0);
    if let Some(exit_mrad) = exit_mrad {
        let (least_mrad, most_mrad) = (exit_mrad.saturating_sub(ASIDE_MRAD), exit_mrad.saturating_add(ASIDE_MRAD));
        heading_mrad = heading_mrad.max(least_mrad).min(most_mrad);
    }
    heading_mrad.clamp(-MAX_HEADING_MRAD, MAX_HEADING_MRAD)
}

/// The speed that the room on both sides allows: it falls as a wall comes nearer than twice the body.
pub(super) fn speed_beside_permille<const SONARS: usize>(config: &DriveConfig, frame: &Frame<'_, SONARS>) -> u16 {
    let body_mm = config.body_radius_mm;
    let nearest_mm = frame.scan.nearest_between(-AHEAD_MRAD, AHEAD_MRAD).map_or(u16::MAX, |nearest| nearest.range_mm);
    let room_mm = nearest_mm.saturating_sub(body_mm).min(body_mm);
    let share = u32::from(config.speed_permille) * u32::from(room_mm);
    let share = share.checked_div(body_mm.into()).map_or(u16::MAX, |share| share as u16);
    share.max(APPROACH_PERMILLE.min(config.speed_permille))
}

/// The speed at this distance from a meet point.
pub(super) fn speed_permille_at(config: &DriveConfig, distance_mm: u16) -> u16 {
    let full = config.speed_permille;
    let share = u32::from(distance_mm.min(BRAKE_MM)) * u32::from(full) / u32::from(BRAKE_MM);
    (share as u16).max(APPROACH_PERMILLE.min(full))
}

/// Turns to either side by half the angle between two sensors, so that one of them looks through a narrow gap.
pub(super) fn look_round_mrad<const SONARS: usize>(frame: &Frame<'_, SONARS>, frames: u16) -> i16 {
    let aside_mrad = (frame.scan.spacing_mrad().saturating_mul(LOOK_ROUND_PERCENT) / 100) as i16;
    if (frames + LOOK_ROUND_FRAMES / 2) & LOOK_ROUND_FRAMES == 0 { aside_mrad } else { -aside_mrad }
}

/// With the sensors ahead dead, a swaying robot measures the range ahead with those beside them.
pub(super) const fn sway_mrad<const SONARS: usize>(frame: &Frame<'_, SONARS>, frames: u16) -> i16 {
    match (frame.is_blind_ahead(), frames & SWAY_FRAMES == 0) {
        (false, _) => 0,
        (true, true) => SWAY_MRAD,
        (true, false) => -SWAY_MRAD,
    }
}
