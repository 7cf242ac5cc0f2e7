//! The fingerprint of a place: the quantised radius of the largest obstacle-free disc around a meet point (Eq. 1).

use core::fmt;

/// The radius of a place in steps of 2 mm: 0 to 8.188 m in 12 bits, so that five of them fit into a `u64`.
///
/// It is the label `l` of Eq. 1. Distances between fingerprints are integers in the same unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fingerprint(u16);

impl Fingerprint {
    /// Width of one step, in millimetres.
    pub const STEP_MM: u16 = 2;
    /// Number of bits of a fingerprint.
    pub const BITS: u32 = 12;
    /// The smallest fingerprint: a radius of 0.
    pub const ZERO: Self = Self(0);
    /// The largest fingerprint: 4094 steps, 8188 mm.
    pub const MAX: Self = Self(4094);

    /// Quantises a radius in millimetres, rounded to the nearest step, halves up.
    ///
    /// # Errors
    /// [`FingerprintError::TooLarge`] above 8188 mm.
    ///
    /// ```
    /// use toposlam::Fingerprint;
    /// assert_eq!(Fingerprint::from_radius_mm(1171)?.radius_mm(), 1172);
    /// assert!(Fingerprint::from_radius_mm(9000).is_err());
    /// # Ok::<(), toposlam::FingerprintError>(())
    /// ```
    pub const fn from_radius_mm(radius_mm: u16) -> Result<Self, FingerprintError> {
        if radius_mm > Self::MAX.radius_mm() {
            return Err(FingerprintError::TooLarge { radius_mm });
        }
        Ok(Self(radius_mm.div_ceil(Self::STEP_MM)))
    }

    /// Creates a fingerprint from a number of steps; `None` above 4094.
    pub const fn from_steps(steps: u16) -> Option<Self> {
        if steps > Self::MAX.0 { None } else { Some(Self(steps)) }
    }

    /// Radius in steps of 2 mm, 0 to 4094.
    pub const fn steps(self) -> u16 {
        self.0
    }

    /// Radius in millimetres, 0 to 8188.
    pub const fn radius_mm(self) -> u16 {
        self.0 * Self::STEP_MM
    }

    /// Absolute difference of two radii, in steps of 2 mm.
    pub const fn distance_steps(self, other: Self) -> u16 {
        self.0.abs_diff(other.0)
    }
}

/// Why a radius has no fingerprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FingerprintError {
    /// The radius is above 8188 mm.
    TooLarge {
        /// The radius, in millimetres.
        radius_mm: u16,
    },
}

impl fmt::Display for FingerprintError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLarge { radius_mm } => write!(f, "radius of {radius_mm} mm is above 8188 mm"),
        }
    }
}

impl core::error::Error for FingerprintError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantisation_changes_a_radius_by_at_most_half_a_step() {
        for radius_mm in 0..=8188 {
            let fingerprint = Fingerprint::from_radius_mm(radius_mm).unwrap();
            assert!(fingerprint.radius_mm().abs_diff(radius_mm) * 2 <= Fingerprint::STEP_MM);
        }
    }

    #[test]
    fn a_radius_above_the_range_is_rejected() {
        let refused = Err(FingerprintError::TooLarge { radius_mm: 8189 });
        assert_eq!(Fingerprint::from_radius_mm(8189), refused);
        assert_eq!(Fingerprint::from_steps(4095), None);
    }
}
