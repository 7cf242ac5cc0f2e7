//! The parameters of the robust filter.

use crate::config_error::ConfigError;
use crate::place::Fingerprint;
use crate::setters::setters;

/// The parameters of the robust filter. The defaults were chosen on random families of environments (docs/evaluation.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct RobustConfig {
    /// How many distinct hypotheses are kept, 1 to the filter's capacity. Default 10.
    pub hypotheses: u8,
    /// The first guess of the standard deviation of a fingerprint in millimetres, 1 to 1000. Default 30. From the tenth place on
    /// the filter estimates it from its best map.
    pub noise_mm: u16,
    /// The resolution of the fingerprints in millimetres, 1 to 1000: the estimate of the noise is at least 0.7 of it. Default 2.
    pub resolution_mm: u16,
    /// The number of refinement proposals at each place, 0 to 255. Default 1. [`Filter::refine`](crate::Filter::refine) makes more
    /// between two places.
    pub moves: u8,
    /// How often a turn hint is wrong, in thousandths, 1 to 500. Default 20.
    pub wrong_turn_permille: u16,
    /// How often a degree is wrong, in thousandths, 1 to 500. Default 100.
    pub wrong_degree_permille: u16,
}

impl RobustConfig {
    setters! {
        with_hypotheses, hypotheses: u8;
        with_noise_mm, noise_mm: u16;
        with_resolution_mm, resolution_mm: u16;
        with_moves, moves: u8;
        with_wrong_turn_permille, wrong_turn_permille: u16;
        with_wrong_degree_permille, wrong_degree_permille: u16;
    }

    /// The defaults.
    pub const DEFAULT: Self = Self {
        hypotheses: 10,
        noise_mm: 30,
        resolution_mm: 2,
        moves: 1,
        wrong_turn_permille: 20,
        wrong_degree_permille: 100,
    };

    /// What a filter holds before it is started: all zero.
    pub(crate) const UNSET: Self = Self {
        hypotheses: 0,
        noise_mm: 0,
        resolution_mm: 0,
        moves: 0,
        wrong_turn_permille: 0,
        wrong_degree_permille: 0,
    };

    /// The resolution of the fingerprints in steps.
    pub(super) fn resolution_steps(&self) -> f32 {
        f32::from(self.resolution_mm) / f32::from(Fingerprint::STEP_MM)
    }

    /// Checks every field for a filter with room for `capacity` hypotheses.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range.
    pub fn check(&self, capacity: usize) -> Result<(), ConfigError> {
        ConfigError::check("hypotheses", self.hypotheses.into(), 1, capacity as i32)?;
        ConfigError::check("noise_mm", self.noise_mm.into(), 1, 1000)?;
        ConfigError::check("resolution_mm", self.resolution_mm.into(), 1, 1000)?;
        ConfigError::check("wrong_turn_permille", self.wrong_turn_permille.into(), 1, 500)?;
        ConfigError::check("wrong_degree_permille", self.wrong_degree_permille.into(), 1, 500)
    }
}

impl Default for RobustConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
