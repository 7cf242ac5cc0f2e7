//! The place detector's settings: documented defaults, checked once.

use core::fmt;

/// When a ring frame shows a meet point, and when the robot has left it.
///
/// The defaults suit a ring of 16 or 24 sonars on a robot that drives some 30 mm between two frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaceConfig {
    /// Obstacles whose ranges differ by no more than this are equidistant, in millimetres. Default 150.
    ///
    /// It must cover the range noise (the spread of three readings is about twice their standard deviation) and a
    /// few frames of travel and of straying from the middle, which counts twice.
    pub equidistance_mm: u16,
    /// The meet point has been left when the third obstacle is this much farther than the nearest, in millimetres.
    /// Default 300. At least `equidistance_mm`.
    pub leave_mm: u16,
    /// Two echoes less than this apart in bearing are the same obstacle, in milliradians, 1 to 2094. Default 1047 (60°).
    ///
    /// It must exceed the beam width plus one spacing of the sensors, and it bounds how close in bearing two corners
    /// of a junction may lie.
    pub separation_mrad: u16,
    /// How many frames must show the meet point before it counts, 1 to 255. Default 3.
    pub confirm_frames: u8,
    /// How many frames more with than without must show that the meet point is over, 1 to 255. Default 3.
    pub leave_frames: u8,
    /// A robot that stands still gets its place after this many frames at the latest, 1 to 255 and at least
    /// `confirm_frames`. Default 25.
    pub settle_frames: u8,
    /// Ranges below this are nonsense, in millimetres, at least 1. Default 30 (SRF08 data sheet: 3 cm).
    pub range_min_mm: u16,
    /// Ranges above this count as silence, in millimetres. Default 6000 (SRF08 data sheet: 6 m).
    pub range_max_mm: u16,
    /// A frame with fewer live sensors is blind, 3 to the size of the ring. Default 6.
    pub live_sensors_min: u8,
}

impl PlaceConfig {
    /// The documented defaults.
    pub const DEFAULT: Self = Self {
        equidistance_mm: 150,
        leave_mm: 300,
        separation_mrad: 1047,
        confirm_frames: 3,
        leave_frames: 3,
        settle_frames: 25,
        range_min_mm: 30,
        range_max_mm: 6000,
        live_sensors_min: 6,
    };

    /// What a detector holds before it is started: all zero.
    pub(crate) const UNSET: Self = Self {
        equidistance_mm: 0,
        leave_mm: 0,
        separation_mrad: 0,
        confirm_frames: 0,
        leave_frames: 0,
        settle_frames: 0,
        range_min_mm: 0,
        range_max_mm: 0,
        live_sensors_min: 0,
    };

    /// Whether every field is in its range for a ring of this many sensors.
    ///
    /// # Errors
    /// The first field that is not.
    pub(crate) const fn check(&self, sonars: usize) -> Result<(), PlaceConfigError> {
        if self.equidistance_mm == 0 {
            return Err(PlaceConfigError::EquidistanceMm);
        }
        if self.leave_mm < self.equidistance_mm {
            return Err(PlaceConfigError::LeaveMm);
        }
        if self.separation_mrad == 0 || self.separation_mrad > 2094 {
            return Err(PlaceConfigError::SeparationMrad);
        }
        if self.confirm_frames == 0 {
            return Err(PlaceConfigError::ConfirmFrames);
        }
        if self.leave_frames == 0 {
            return Err(PlaceConfigError::LeaveFrames);
        }
        if self.settle_frames < self.confirm_frames {
            return Err(PlaceConfigError::SettleFrames);
        }
        if self.range_min_mm == 0 {
            return Err(PlaceConfigError::RangeMinMm);
        }
        if self.range_max_mm <= self.range_min_mm || self.range_max_mm == u16::MAX {
            return Err(PlaceConfigError::RangeMaxMm);
        }
        if self.live_sensors_min < 3 || self.live_sensors_min as usize > sonars {
            return Err(PlaceConfigError::LiveSensorsMin);
        }
        Ok(())
    }
}

impl Default for PlaceConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Which setting of the place detector is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlaceConfigError {
    /// `equidistance_mm` is 0.
    EquidistanceMm,
    /// `leave_mm` is below `equidistance_mm`.
    LeaveMm,
    /// `separation_mrad` is 0 or above 2094 (a third of a turn, so that three obstacles fit).
    SeparationMrad,
    /// `confirm_frames` is 0.
    ConfirmFrames,
    /// `leave_frames` is 0.
    LeaveFrames,
    /// `settle_frames` is below `confirm_frames`.
    SettleFrames,
    /// `range_min_mm` is 0.
    RangeMinMm,
    /// `range_max_mm` is not above `range_min_mm`, or 65535.
    RangeMaxMm,
    /// `live_sensors_min` is below 3 or above the size of the ring.
    LiveSensorsMin,
    /// A bearing of the ring's geometry is beyond −3142 to 3142 mrad.
    Bearing,
}

impl fmt::Display for PlaceConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::EquidistanceMm => "equidistance_mm must be above 0",
            Self::LeaveMm => "leave_mm must not be below equidistance_mm",
            Self::SeparationMrad => "separation_mrad must be 1 to 2094",
            Self::ConfirmFrames => "confirm_frames must be above 0",
            Self::LeaveFrames => "leave_frames must be above 0",
            Self::SettleFrames => "settle_frames must not be below confirm_frames",
            Self::RangeMinMm => "range_min_mm must be above 0",
            Self::RangeMaxMm => "range_max_mm must be above range_min_mm and below 65535",
            Self::LiveSensorsMin => "live_sensors_min must be 3 to the size of the ring",
            Self::Bearing => "bearings_mrad must be -3142 to 3142",
        })
    }
}

impl core::error::Error for PlaceConfigError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_pass_and_each_field_out_of_range_is_named() {
        let good = PlaceConfig::DEFAULT;
        assert_eq!(good.check(16), Ok(()));
        let bad = [
            (PlaceConfig { equidistance_mm: 0, ..good }, PlaceConfigError::EquidistanceMm),
            (PlaceConfig { leave_mm: 149, ..good }, PlaceConfigError::LeaveMm),
            (PlaceConfig { separation_mrad: 2095, ..good }, PlaceConfigError::SeparationMrad),
            (PlaceConfig { confirm_frames: 0, ..good }, PlaceConfigError::ConfirmFrames),
            (PlaceConfig { leave_frames: 0, ..good }, PlaceConfigError::LeaveFrames),
            (PlaceConfig { settle_frames: 2, ..good }, PlaceConfigError::SettleFrames),
            (PlaceConfig { range_min_mm: 0, ..good }, PlaceConfigError::RangeMinMm),
            (PlaceConfig { range_max_mm: 30, ..good }, PlaceConfigError::RangeMaxMm),
            (PlaceConfig { live_sensors_min: 17, ..good }, PlaceConfigError::LiveSensorsMin),
        ];
        for (config, error) in bad {
            assert_eq!(config.check(16), Err(error));
        }
    }
}
