//! The parameters of the ordered filter.

use crate::config_error::ConfigError;
use crate::setters::setters;

/// The parameters of the ordered filter. The defaults were chosen on random families of environments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct OrderedConfig {
    /// The first guess of the standard deviation of a fingerprint in millimetres, 1 to 1000. Default 30. From the tenth place on
    /// the filter estimates it from its best map.
    pub noise_mm: u16,
    /// How often the exit is wrong, in thousandths, 1 to 500. Default 40.
    pub wrong_exit_permille: u16,
    /// How often a way is not seen, in thousandths, 1 to 500. Default 50.
    pub missed_way_permille: u16,
    /// How often something is seen that is no way, in thousandths, 1 to 500. Default 20.
    pub false_way_permille: u16,
    /// The standard deviation of a bearing in milliradians, 10 to 500. Default 100.
    pub bearing_noise_mrad: u16,
    /// The standard deviation of a travel time, in thousandths of it, 10 to 500. Default 100.
    pub travel_noise_permille: u16,
}

impl OrderedConfig {
    setters! {
        with_noise_mm, noise_mm: u16;
        with_wrong_exit_permille, wrong_exit_permille: u16;
        with_missed_way_permille, missed_way_permille: u16;
        with_false_way_permille, false_way_permille: u16;
        with_bearing_noise_mrad, bearing_noise_mrad: u16;
        with_travel_noise_permille, travel_noise_permille: u16;
    }

    /// The defaults.
    pub const DEFAULT: Self = Self {
        noise_mm: 30,
        wrong_exit_permille: 40,
        missed_way_permille: 50,
        false_way_permille: 20,
        bearing_noise_mrad: 100,
        travel_noise_permille: 100,
    };

    /// What a filter holds before it is started: all zero.
    pub(crate) const UNSET: Self = Self {
        noise_mm: 0,
        wrong_exit_permille: 0,
        missed_way_permille: 0,
        false_way_permille: 0,
        bearing_noise_mrad: 0,
        travel_noise_permille: 0,
    };

    /// Checks every field.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        ConfigError::check("noise_mm", self.noise_mm.into(), 1, 1000)?;
        ConfigError::check("wrong_exit_permille", self.wrong_exit_permille.into(), 1, 500)?;
        ConfigError::check("missed_way_permille", self.missed_way_permille.into(), 1, 500)?;
        ConfigError::check("false_way_permille", self.false_way_permille.into(), 1, 500)?;
        ConfigError::check("bearing_noise_mrad", self.bearing_noise_mrad.into(), 10, 500)?;
        ConfigError::check("travel_noise_permille", self.travel_noise_permille.into(), 10, 500)
    }
}

impl Default for OrderedConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
