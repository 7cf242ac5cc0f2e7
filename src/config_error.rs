//! The one error of every configuration.

use core::fmt;

/// A setting is invalid.
///
/// ```
/// use toposlam::{ConfigError, Filter, RobustConfig, RobustFilter};
///
/// let mut config = RobustConfig::DEFAULT;
/// config.noise_mm = 2000;
/// let error = RobustFilter::<10, 16, 400>::new().start(config, 1).unwrap_err();
/// assert_eq!(error, ConfigError::OutOfRange { field: "noise_mm", value: 2000, min: 1, max: 1000 });
/// assert_eq!(error.to_string(), "noise_mm is 2000, but must be from 1 to 1000");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConfigError {
    /// A field is outside its range. Limits can depend on other fields and on capacities.
    OutOfRange {
        /// The name of the field.
        field: &'static str,
        /// Its value.
        value: i32,
        /// The least valid value.
        min: i32,
        /// The largest valid value.
        max: i32,
    },
    /// The addresses that begin at a field include one that a device cannot have.
    ReservedAddress {
        /// The name of the field.
        field: &'static str,
        /// The reserved address.
        address: u8,
    },
}

impl ConfigError {
    /// Checks one field.
    pub(crate) const fn check(field: &'static str, value: i32, min: i32, max: i32) -> Result<(), Self> {
        if min <= value && value <= max { Ok(()) } else { Err(Self::OutOfRange { field, value, min, max }) }
    }

    /// The name of the invalid field.
    #[must_use]
    pub const fn field(&self) -> &'static str {
        match self {
            Self::OutOfRange { field, .. } | Self::ReservedAddress { field, .. } => field,
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { field, value, min, max } => {
                write!(f, "{field} is {value}, but must be from {min} to {max}")
            }
            Self::ReservedAddress { field, address } => {
                write!(f, "{field}: a sensor would have the reserved address {address:#04x}")
            }
        }
    }
}

impl core::error::Error for ConfigError {}
