//! The limits of a robot: what it can drive through and distinguish.

use super::{BodyModel, SonarModel};
use toposlam::place::PlaceConfig;

/// What a robot can drive through and distinguish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Half the robot's width, in millimetres.
    pub body_radius_mm: f64,
    /// Nothing farther is measured, in millimetres.
    pub range_max_mm: f64,
    /// Obstacles at least this far apart in bearing are two, in radians.
    pub separation_rad: f64,
    /// Obstacles closer by up to this are two where the range between them rises, in radians: half the cone of a sonar, because an
    /// obstacle is measured up to that far aside.
    pub cone_half_angle_rad: f64,
    /// A place is left when the third obstacle is this much farther than the nearest, in millimetres.
    pub leave_mm: f64,
}

impl Limits {
    /// The limits of a robot that detects places by the default settings.
    pub fn of(body: &BodyModel, sonar: &SonarModel) -> Self {
        Self {
            body_radius_mm: body.radius_mm,
            range_max_mm: sonar.range_max_mm,
            separation_rad: f64::from(PlaceConfig::DEFAULT.separation_mrad) / 1000.0,
            cone_half_angle_rad: sonar.cone_half_angle_rad,
            leave_mm: PlaceConfig::DEFAULT.leave_mm.into(),
        }
    }

    /// What a branch must reach beyond the disc of its junction, and how far apart two places are, in millimetres.
    pub(super) fn width_mm(&self) -> f64 {
        2.0 * self.body_radius_mm
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::of(&BodyModel::default(), &SonarModel::default())
    }
}
