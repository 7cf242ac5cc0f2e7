//! Settings of the drive, checked once at the start.

use core::fmt;

/// Settings of the motion along the Voronoi graph.
///
/// The defaults are for a robot that drives some 30 mm between two ring frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// Maximum duration of a manoeuvre in ring frames, at least 1. Default 100. After it the drive is lost and searches for
    /// the graph.
    pub timeout_frames: u16,
}

impl DriveConfig {
    /// The documented defaults.
    pub const DEFAULT: Self = Self {
        speed_permille: 1000,
        look_ahead_mm: 400,
        arrival_tolerance_mm: 40,
        clearance_mm: 250,
        timeout_frames: 100,
    };

    pub(crate) const UNSET: Self =
        Self { speed_permille: 0, look_ahead_mm: 0, arrival_tolerance_mm: 0, clearance_mm: 0, timeout_frames: 0 };

    /// Whether every field is in its range.
    pub(super) const fn check(&self) -> Result<(), DriveConfigError> {
        if self.speed_permille == 0 || self.speed_permille > 1000 {
            return Err(DriveConfigError::SpeedPermille);
        }
        if self.look_ahead_mm == 0 {
            return Err(DriveConfigError::LookAheadMm);
        }
        if self.timeout_frames == 0 {
            return Err(DriveConfigError::TimeoutFrames);
        }
        Ok(())
    }
}

impl Default for DriveConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Which field of a [`DriveConfig`] cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DriveConfigError {
    /// `speed_permille`: 0, or above 1000.
    SpeedPermille,
    /// `look_ahead_mm`: 0.
    LookAheadMm,
    /// `timeout_frames`: 0.
    TimeoutFrames,
}

impl fmt::Display for DriveConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SpeedPermille => "speed_permille: must be from 1 to 1000",
            Self::LookAheadMm => "look_ahead_mm: must not be 0",
            Self::TimeoutFrames => "timeout_frames: must not be 0",
        })
    }
}

impl core::error::Error for DriveConfigError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_configuration_names_the_field_that_cannot_be() {
        let good = DriveConfig::DEFAULT;
        assert_eq!(good.check(), Ok(()));
        let wrong = [
            (DriveConfig { speed_permille: 0, ..good }, DriveConfigError::SpeedPermille),
            (DriveConfig { speed_permille: 1001, ..good }, DriveConfigError::SpeedPermille),
            (DriveConfig { look_ahead_mm: 0, ..good }, DriveConfigError::LookAheadMm),
            (DriveConfig { timeout_frames: 0, ..good }, DriveConfigError::TimeoutFrames),
        ];
        for (config, error) in wrong {
            assert_eq!(config.check(), Err(error));
        }
    }
}
