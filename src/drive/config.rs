//! Settings of the drive, checked once at the start.

use crate::config_error::ConfigError;
use crate::setters::setters;

/// Settings of the motion along the Voronoi graph.
///
/// The defaults are for a robot that drives some 30 mm between two ring frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DriveConfig {
    /// Speed along an edge, in thousandths of the robot's full speed, 1 to 1000. Default 1000.
    pub speed_permille: u16,
    /// Look-ahead distance along the edge, in millimetres, at least 1. Default 400. A shorter one follows bends and noise more
    /// closely.
    pub look_ahead_mm: u16,
    /// Distance within which a meet point counts as reached, in millimetres. Default 40.
    pub arrival_tolerance_mm: u16,
    /// Minimum range ahead, in millimetres. Default 250. The robot turns away from a nearer obstacle.
    pub clearance_mm: u16,
    /// Radius of the smallest circle round the centre of the ring that contains the robot, in millimetres. Default 150. The robot does not
    /// enter a gap that is less than 60 mm wider than this circle, and turns in place wherever it can drive.
    pub body_radius_mm: u16,
    /// Maximum duration of a manoeuvre in ring frames, at least 1. Default 100. After it the drive is lost and searches for
    /// the graph. An edge may take twenty times as long.
    pub timeout_frames: u16,
}

impl DriveConfig {
    setters! {
        with_speed_permille, speed_permille: u16;
        with_look_ahead_mm, look_ahead_mm: u16;
        with_arrival_tolerance_mm, arrival_tolerance_mm: u16;
        with_clearance_mm, clearance_mm: u16;
        with_body_radius_mm, body_radius_mm: u16;
        with_timeout_frames, timeout_frames: u16;
    }

    /// The documented defaults.
    pub const DEFAULT: Self = Self {
        speed_permille: 1000,
        look_ahead_mm: 400,
        arrival_tolerance_mm: 40,
        clearance_mm: 250,
        body_radius_mm: 150,
        timeout_frames: 100,
    };

    pub(crate) const UNSET: Self = Self {
        speed_permille: 0,
        look_ahead_mm: 0,
        arrival_tolerance_mm: 0,
        clearance_mm: 0,
        body_radius_mm: 0,
        timeout_frames: 0,
    };

    /// Whether every field is in its range.
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let most = u16::MAX.into();
        ConfigError::check("speed_permille", self.speed_permille.into(), 1, 1000)?;
        ConfigError::check("look_ahead_mm", self.look_ahead_mm.into(), 1, most)?;
        ConfigError::check("timeout_frames", self.timeout_frames.into(), 1, most)
    }
}

impl Default for DriveConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_field_out_of_its_range_is_named() {
        let good = DriveConfig::DEFAULT;
        assert_eq!(good.check(), Ok(()));
        let bad = [
            (DriveConfig { speed_permille: 0, ..good }, "speed_permille"),
            (DriveConfig { speed_permille: 1001, ..good }, "speed_permille"),
            (DriveConfig { look_ahead_mm: 0, ..good }, "look_ahead_mm"),
            (DriveConfig { timeout_frames: 0, ..good }, "timeout_frames"),
        ];
        for (config, field) in bad {
            assert_eq!(config.check().unwrap_err().field(), field);
        }
    }
}
