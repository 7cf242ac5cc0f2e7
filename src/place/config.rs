//! Settings of the place detector, checked once at the start.

use crate::config_error::ConfigError;
use crate::ring::RingGeometry;
use crate::setters::setters;

/// Settings of the place detector: when a frame shows a meet point, and when the robot has left it.
///
/// The defaults are for a ring of 16 or 24 sonars on a robot that drives some 30 mm between two frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PlaceConfig {
    /// Largest difference of range between equidistant obstacles, in millimetres, at least 1. Default 150.
    ///
    /// It must exceed the range noise (the spread of three ranges is about twice their standard deviation) plus the travel of
    /// a few frames plus twice the deviation from the edge.
    pub equidistance_mm: u16,
    /// Spread above which the robot has left the meet point, in millimetres, at least `equidistance_mm`. Default 300.
    pub leave_mm: u16,
    /// Minimum angle between two obstacles, in milliradians, 1 to 2094. Default 1047 (60°). Echoes closer in bearing are one
    /// obstacle, unless a sensor looks through between them.
    ///
    /// It must exceed the beam width plus the spacing of the sensors. Two corners of a junction must be farther apart.
    pub separation_mrad: u16,
    /// Number of frames that confirm a meet point, 1 to 255. Default 3.
    pub confirm_frames: u8,
    /// Number of frames without the meet point, minus frames with it, after which it is over, 1 to 255. Default 3.
    pub leave_frames: u8,
    /// Number of frames after which a place is reported although the robot is still at it, `confirm_frames` to 255.
    /// Default 25.
    pub settle_frames: u8,
    /// Minimum valid range, in millimetres, at least 1. Default 30 (SRF08 data sheet: 3 cm). A shorter one is a fault.
    pub range_min_mm: u16,
    /// Maximum valid range, in millimetres, above `range_min_mm`. Default 6000 (SRF08 data sheet: 6 m). A longer one is silence.
    pub range_max_mm: u16,
    /// Minimum number of live sensors, 3 to the size of the ring. Default 6. A frame with fewer is blind.
    pub live_sensors_min: u8,
}

impl PlaceConfig {
    setters! {
        with_equidistance_mm, equidistance_mm: u16;
        with_leave_mm, leave_mm: u16;
        with_separation_mrad, separation_mrad: u16;
        with_confirm_frames, confirm_frames: u8;
        with_leave_frames, leave_frames: u8;
        with_settle_frames, settle_frames: u8;
        with_range_min_mm, range_min_mm: u16;
        with_range_max_mm, range_max_mm: u16;
        with_live_sensors_min, live_sensors_min: u8;
    }

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

    /// The settings for a ring of 4 to 128 sensors.
    ///
    /// `live_sensors_min` is three eighths of the sensors, at least 3: 6 of 16. `separation_mrad` is the default, or 1.6 times the mean
    /// gap between neighbouring bearings without the largest gap if that is more: up to three sensors side by side measure one wall, and
    /// noise decides which of them measure about the same. All other settings are the defaults.
    /// Cost: O(SONARS²).
    ///
    /// ```
    /// use toposlam::place::PlaceConfig;
    /// use toposlam::ring::RingGeometry;
    ///
    /// assert_eq!(PlaceConfig::for_ring(&RingGeometry::<16>::even()), PlaceConfig::DEFAULT);
    /// let eight = PlaceConfig::for_ring(&RingGeometry::<8>::even());
    /// assert_eq!((eight.live_sensors_min, eight.separation_mrad), (3, 1256));
    /// ```
    #[must_use]
    pub const fn for_ring<const SONARS: usize>(geometry: &RingGeometry<SONARS>) -> Self {
        let live = SONARS * 3 / 8;
        let gaps = if SONARS > 1 { SONARS as i32 - 1 } else { 1 };
        let separation_mrad = (6283 - geometry.largest_gap_mrad()) / gaps * 8 / 5;
        let separation_mrad = if separation_mrad > 2094 { 2094 } else { separation_mrad as u16 };
        let default = Self::DEFAULT;
        Self {
            live_sensors_min: if live < 3 { 3 } else { live as u8 },
            separation_mrad: if separation_mrad > default.separation_mrad {
                separation_mrad
            } else {
                default.separation_mrad
            },
            ..default
        }
    }

    /// The settings of a detector before its start: all zero.
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
    pub(crate) fn check(&self, sonars: usize) -> Result<(), ConfigError> {
        let most = u16::MAX.into();
        ConfigError::check("equidistance_mm", self.equidistance_mm.into(), 1, most)?;
        ConfigError::check("leave_mm", self.leave_mm.into(), self.equidistance_mm.into(), most)?;
        ConfigError::check("separation_mrad", self.separation_mrad.into(), 1, 2094)?;
        ConfigError::check("confirm_frames", self.confirm_frames.into(), 1, 255)?;
        ConfigError::check("leave_frames", self.leave_frames.into(), 1, 255)?;
        ConfigError::check("settle_frames", self.settle_frames.into(), self.confirm_frames.into(), 255)?;
        ConfigError::check("range_min_mm", self.range_min_mm.into(), 1, most)?;
        ConfigError::check("range_max_mm", self.range_max_mm.into(), i32::from(self.range_min_mm) + 1, most - 1)?;
        ConfigError::check("live_sensors_min", self.live_sensors_min.into(), 3, sonars as i32)
    }
}

impl Default for PlaceConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_pass_and_each_field_out_of_range_is_named() {
        let good = PlaceConfig::DEFAULT;
        assert_eq!(good.check(16), Ok(()));
        let bad = [
            (PlaceConfig { equidistance_mm: 0, ..good }, "equidistance_mm"),
            (PlaceConfig { leave_mm: 149, ..good }, "leave_mm"),
            (PlaceConfig { separation_mrad: 2095, ..good }, "separation_mrad"),
            (PlaceConfig { confirm_frames: 0, ..good }, "confirm_frames"),
            (PlaceConfig { leave_frames: 0, ..good }, "leave_frames"),
            (PlaceConfig { settle_frames: 2, ..good }, "settle_frames"),
            (PlaceConfig { range_min_mm: 0, ..good }, "range_min_mm"),
            (PlaceConfig { range_max_mm: 30, ..good }, "range_max_mm"),
            (PlaceConfig { live_sensors_min: 17, ..good }, "live_sensors_min"),
        ];
        for (config, field) in bad {
            assert_eq!(config.check(16).unwrap_err().field(), field);
        }
    }
}
