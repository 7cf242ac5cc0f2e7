//! The parameters of the paper's filter.

use crate::config_error::ConfigError;
use crate::filter::{Direction, NgramLength};
use crate::setters::setters;

/// The parameters of the paper's filter. The defaults are the paper's where it gives them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PaperConfig {
    /// `n`: how many labels an n-gram has, 2 to 7. Default 5 (Section IV).
    pub ngram_length: u8,
    /// `N`: how many particles represent the posterior, 1 to the filter's capacity. Default 10 (Section IV).
    pub particles: u8,
    /// φ of Eq. 9 in thousandths, 0 to 999: the penalty for similar vertices. Default 100 (Section IV).
    pub penalty_permille: u16,
    /// σ_l of Eq. 7 and 9 in millimetres, 1 to 8188. Default 50; the paper does not give it.
    pub sigma_label_mm: u16,
    /// σ_c of Eq. 8 in millimetres, 1 to 8188. Default 30; the paper does not give it. Eq. 8 saturates at 64 σ_c, which
    /// is e⁻⁴⁰⁹⁶: with 30 mm, distances beyond 1920 mm, the infinite one included, all weigh the same.
    pub sigma_consistency_mm: u16,
    /// Which half of Eq. 2 counts. Default [`Direction::TwoSided`], as printed.
    pub direction: Direction,
}

impl Default for PaperConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl PaperConfig {
    setters! {
        with_ngram_length, ngram_length: u8;
        with_particles, particles: u8;
        with_penalty_permille, penalty_permille: u16;
        with_sigma_label_mm, sigma_label_mm: u16;
        with_sigma_consistency_mm, sigma_consistency_mm: u16;
        with_direction, direction: Direction;
    }

    /// The defaults.
    pub const DEFAULT: Self = Self {
        ngram_length: 5,
        particles: 10,
        penalty_permille: 100,
        sigma_label_mm: 50,
        sigma_consistency_mm: 30,
        direction: Direction::TwoSided,
    };

    /// What a filter holds before it is started: all zero.
    pub(crate) const UNSET: Self = Self {
        ngram_length: 0,
        particles: 0,
        penalty_permille: 0,
        sigma_label_mm: 0,
        sigma_consistency_mm: 0,
        direction: Direction::TwoSided,
    };

    /// Checks every field for a filter with room for `capacity` particles; returns the length of the n-grams.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range.
    pub fn check(&self, capacity: usize) -> Result<NgramLength, ConfigError> {
        let value = self.ngram_length.into();
        let length = NgramLength::new(self.ngram_length).map_err(|_| ConfigError::OutOfRange {
            field: "ngram_length",
            value,
            min: 2,
            max: 7,
        })?;
        ConfigError::check("particles", self.particles.into(), 1, capacity as i32)?;
        ConfigError::check("penalty_permille", self.penalty_permille.into(), 0, 999)?;
        ConfigError::check("sigma_label_mm", self.sigma_label_mm.into(), 1, 8188)?;
        ConfigError::check("sigma_consistency_mm", self.sigma_consistency_mm.into(), 1, 8188)?;
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid() {
        assert_eq!(PaperConfig::default().check(10).map(NgramLength::get), Ok(5));
    }

    #[test]
    fn every_field_out_of_its_range_is_named() {
        let default = PaperConfig::default();
        for (config, field) in [
            (PaperConfig { ngram_length: 1, ..default }, "ngram_length"),
            (PaperConfig { ngram_length: 8, ..default }, "ngram_length"),
            (PaperConfig { particles: 0, ..default }, "particles"),
            (PaperConfig { particles: 11, ..default }, "particles"),
            (PaperConfig { penalty_permille: 1000, ..default }, "penalty_permille"),
            (PaperConfig { sigma_label_mm: 0, ..default }, "sigma_label_mm"),
            (PaperConfig { sigma_consistency_mm: 8189, ..default }, "sigma_consistency_mm"),
        ] {
            assert_eq!(config.check(10).unwrap_err().field(), field);
        }
    }
}
