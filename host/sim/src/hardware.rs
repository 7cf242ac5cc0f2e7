//! Descriptions of a ring and of a robot in TOML files (docs/rings.md).
//!
//! ```
//! use toposlam_sim::hardware::Ring;
//!
//! let ring = Ring::parse("sonars = 8\ncone_deg = 27\nspecular_limit_deg = 90\nrange_max_mm = 4000")?;
//! assert_eq!((ring.sonars, ring.sonar.range_max_mm), (8, 4000.0));
//! # Ok::<(), toposlam_sim::hardware::HardwareError>(())
//! ```

use std::fmt;
use std::ops::RangeInclusive;

use serde::Deserialize;
use toposlam::drive::{DriveConfig, WheelsConfig};
use toposlam::ring::RingGeometry;
use toposlam::robot::RobotConfig;

use crate::world::{BodyModel, RobotModel, SONARS_MAX, SonarModel, wrapped};

/// A description that is no ring or no robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HardwareError(String);

impl fmt::Display for HardwareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for HardwareError {}

fn check(field: &str, value: f64, range: RangeInclusive<f64>) -> Result<f64, HardwareError> {
    let (low, high) = (range.start(), range.end());
    let error = || HardwareError(format!("{field} must be {low} to {high}, not {value}"));
    if range.contains(&value) { Ok(value) } else { Err(error()) }
}

/// The file of a ring.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RingFile {
    sonars: usize,
    bearings_deg: Option<Vec<f64>>,
    first_bearing_deg: Option<f64>,
    cone_deg: Option<f64>,
    range_min_mm: Option<f64>,
    range_max_mm: Option<f64>,
    offset_mm: Option<f64>,
    range_sd_mm: Option<f64>,
    missed: Option<f64>,
    specular_limit_deg: Option<f64>,
}

/// A ring of range sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Number of sensors: one of [`Ring::SIZES`].
    pub sonars: usize,
    /// The sensors.
    pub sonar: SonarModel,
}

impl Ring {
    /// Numbers of sensors that a ring can have.
    pub const SIZES: [usize; 6] = [4, 5, 8, 12, 16, 24];

    /// The ring of the reference robot.
    pub fn reference() -> Self {
        Self { sonars: toposlam::reference::SONARS, sonar: SonarModel::default() }
    }

    /// Parses the description of a ring.
    ///
    /// # Errors
    /// The field that is missing, unknown or out of its range.
    pub fn parse(text: &str) -> Result<Self, HardwareError> {
        let file: RingFile = toml::from_str(text).map_err(|error| HardwareError(error.to_string()))?;
        let sonars = file.sonars;
        if !Self::SIZES.contains(&sonars) {
            return Err(HardwareError(format!("sonars must be 4, 5, 8, 12, 16 or 24, not {sonars}")));
        }
        let bearings_deg = match (file.bearings_deg, file.first_bearing_deg) {
            (Some(_), Some(_)) => {
                return Err(HardwareError("give either bearings_deg or first_bearing_deg".to_owned()));
            }
            (Some(bearings_deg), None) => Some(bearings_deg),
            (None, Some(first_deg)) => {
                Some((0..sonars).map(|sonar| first_deg + 360.0 * sonar as f64 / sonars as f64).collect())
            }
            (None, None) => None,
        };
        let mut bearings_rad = None;
        if let Some(bearings_deg) = bearings_deg {
            if bearings_deg.len() != sonars {
                let count = bearings_deg.len();
                return Err(HardwareError(format!("bearings_deg has {count} bearings for {sonars} sonars")));
            }
            for (number, degrees) in bearings_deg.iter().enumerate() {
                let same = |other: &&f64| ((*other - degrees + 180.0).rem_euclid(360.0) - 180.0).abs() < 1e-6;
                if let Some(other) = bearings_deg[..number].iter().find(same) {
                    return Err(HardwareError(format!(
                        "bearings_deg has two sonars in one direction, {other} and {degrees}"
                    )));
                }
            }
            let mut radians = [0.0; SONARS_MAX];
            for (radians, degrees) in radians.iter_mut().zip(bearings_deg) {
                *radians = check("bearings_deg", degrees, -360.0..=720.0)?.to_radians();
            }
            bearings_rad = Some(radians);
        }
        let default = RobotModel::for_ring(sonars).sonar;
        let degrees = |field, value: Option<f64>, default: f64, range| {
            value.map_or(Ok(default), |value| check(field, value, range).map(f64::to_radians))
        };
        let number =
            |field, value: Option<f64>, default, range| value.map_or(Ok(default), |value| check(field, value, range));
        let range_min_mm = number("range_min_mm", file.range_min_mm, default.range_min_mm, 1.0..=1000.0)?;
        let sonar = SonarModel {
            cone_half_angle_rad: degrees("cone_deg", file.cone_deg, 2.0 * default.cone_half_angle_rad, 1.0..=120.0)?
                / 2.0,
            range_min_mm,
            range_max_mm: number(
                "range_max_mm",
                file.range_max_mm,
                default.range_max_mm,
                range_min_mm + 1.0..=50_000.0,
            )?,
            range_sd_mm: number("range_sd_mm", file.range_sd_mm, default.range_sd_mm, 0.0..=1000.0)?,
            missed_share: number("missed", file.missed, default.missed_share, 0.0..=1.0)?,
            specular_limit_rad: degrees(
                "specular_limit_deg",
                file.specular_limit_deg,
                default.specular_limit_rad,
                0.0..=90.0,
            )?,
            offset_mm: number("offset_mm", file.offset_mm, 0.0, 0.0..=1000.0)?,
            dead_sonars: 0,
            bearings_rad,
        };
        Ok(Self { sonars, sonar })
    }

    /// The bearings of its first `S` sensors.
    pub fn geometry<const S: usize>(&self) -> RingGeometry<S> {
        let Some(bearings_rad) = self.sonar.bearings_rad else { return RingGeometry::even() };
        let milliradians = |sonar: usize| {
            let bearing_rad = bearings_rad.get(sonar).copied().unwrap_or(0.0);
            (1000.0 * wrapped(bearing_rad)).round() as i16
        };
        RingGeometry { bearings_mrad: std::array::from_fn(milliradians) }
    }
}

/// The file of a robot.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotFile {
    width_mm: Option<f64>,
    track_mm: Option<f64>,
    speed_mm_per_s: Option<f64>,
    frames_per_s: Option<f64>,
    slip: Option<f64>,
}

/// The body and the wheels of a robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// The body and the errors of the wheels.
    pub body: BodyModel,
    /// Speed and rate of frames. Its sonars are the default ones.
    pub model: RobotModel,
}

impl Body {
    /// Parses the description of a robot. The gains of its wheels are such that it turns, per frame, as fast as the reference robot.
    ///
    /// # Errors
    /// The field that is unknown or out of its range.
    pub fn parse(text: &str) -> Result<Self, HardwareError> {
        let file: RobotFile = toml::from_str(text).map_err(|error| HardwareError(error.to_string()))?;
        let (body, model) = (BodyModel::default(), RobotModel::default());
        let number =
            |field, value: Option<f64>, default, range| value.map_or(Ok(default), |value| check(field, value, range));
        let width_mm = number("width_mm", file.width_mm, 2.0 * body.radius_mm, 20.0..=2000.0)?;
        let track_mm =
            number("track_mm", file.track_mm, width_mm * body.track_mm / (2.0 * body.radius_mm), 10.0..=2000.0)?;
        if track_mm > width_mm {
            return Err(HardwareError(format!("track_mm must be at most width_mm, {width_mm}, not {track_mm}")));
        }
        let speed_mm_per_s = number("speed_mm_per_s", file.speed_mm_per_s, model.speed_mm_per_s, 1.0..=5000.0)?;
        let frames_per_s = number("frames_per_s", file.frames_per_s, model.frames_per_s, 1.0..=100.0)?;
        let gain = track_mm / body.track_mm * model.speed_mm_per_s / speed_mm_per_s * frames_per_s / model.frames_per_s;
        let scaled = |permille: u16, most: f64| (f64::from(permille) * gain).round().clamp(1.0, most) as u16;
        let wheels = WheelsConfig::DEFAULT;
        let wheels = wheels
            .with_steer_permille_per_rad(scaled(wheels.steer_permille_per_rad, 2000.0))
            .with_spin_permille(scaled(wheels.spin_permille, 1000.0));
        let slip_share = number("slip", file.slip, body.slip_share, 0.0..=1.0)?;
        Ok(Self {
            body: BodyModel { radius_mm: width_mm / 2.0, track_mm, wheels, slip_share },
            model: RobotModel { speed_mm_per_s, frames_per_s, ..model },
        })
    }
}

/// A robot: a ring on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// The ring.
    pub ring: Ring,
    /// The body.
    pub body: Body,
}

impl Hardware {
    /// The reference robot.
    pub fn reference() -> Self {
        Self { ring: Ring::reference(), body: Body::default() }
    }

    /// The model of its motion and its sonars, without a noise factor.
    pub fn model(&self) -> RobotModel {
        RobotModel { sonar: self.ring.sonar, ..self.body.model }
    }

    /// Settings of the robot's firmware: those of the ring and the body over `config`. The settings of the reference robot stay as
    /// they are.
    pub fn configured<const S: usize, C: Copy>(&self, filter: C) -> RobotConfig<S, C> {
        let config = RobotConfig::new(self.ring.geometry(), filter);
        let sonar = &self.ring.sonar;
        let most_mm = (sonar.range_max_mm + sonar.offset_mm).min(60_000.0) as u16;
        let least_mm = (sonar.range_min_mm + sonar.offset_mm).round() as u16;
        let place = config.mapper.place.with_range_min_mm(least_mm).with_range_max_mm(most_mm);
        let radius_mm = self.body.body.radius_mm.ceil() as u16;
        let room_mm = DriveConfig::DEFAULT.clearance_mm - DriveConfig::DEFAULT.body_radius_mm;
        let drive = config.drive.with_body_radius_mm(radius_mm).with_clearance_mm(radius_mm.saturating_add(room_mm));
        let mut mapper = config.mapper;
        mapper.place = place;
        config.with_mapper(mapper).with_drive(drive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::reference::ordered;

    #[test]
    fn a_ring_without_more_than_its_size_is_even_with_the_default_sonars() {
        assert_eq!(Ring::parse("sonars = 16").unwrap(), Ring::reference());
        assert_eq!(Hardware::reference().configured(ordered::FILTER), ordered::ROBOT);
        assert_eq!(Body::parse("").unwrap(), Body::default());
    }

    #[test]
    fn each_field_out_of_its_range_is_named() {
        let error = |text: &str| Ring::parse(text).unwrap_err().to_string();
        assert_eq!(error("sonars = 7"), "sonars must be 4, 5, 8, 12, 16 or 24, not 7");
        assert_eq!(error("sonars = 4\nbearings_deg = [0, 90]"), "bearings_deg has 2 bearings for 4 sonars");
        assert_eq!(error("sonars = 8\ncone_deg = 0"), "cone_deg must be 1 to 120, not 0");
        assert!(error("sonars = 8\ncolour = 1").contains("colour"));
        assert!(error("cone_deg = 30").contains("sonars"));
        assert!(Body::parse("width_mm = -3").unwrap_err().to_string().contains("width_mm"));
        let track = Body::parse("width_mm = 300\ntrack_mm = 301").unwrap_err().to_string();
        assert_eq!(track, "track_mm must be at most width_mm, 300, not 301");
        assert!(Body::parse("width_mm = 300\ntrack_mm = 300").is_ok());
    }

    #[test]
    fn two_sonars_in_one_direction_are_refused() {
        for bearings in ["0, 90, 180, 0", "0, 90, 180, 360", "-90, 0, 90, 270"] {
            let error = Ring::parse(&format!("sonars = 4\nbearings_deg = [{bearings}]")).unwrap_err().to_string();
            assert!(error.contains("two sonars in one direction"), "{error}");
        }
        assert!(Ring::parse("sonars = 4\nbearings_deg = [0, 1, 180, 359]").is_ok());
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_a_file() {
        assert_eq!(Ring::parse("\u{feff}sonars = 16").unwrap(), Ring::reference());
        assert_eq!(Body::parse("\u{feff}").unwrap(), Body::default());
    }

    #[test]
    fn the_firmware_gets_the_bearings_the_range_and_the_width() {
        let ring = "sonars = 4\nbearings_deg = [0, 90, 180, 270]\nrange_max_mm = 4000\noffset_mm = 100";
        let hardware = Hardware { ring: Ring::parse(ring).unwrap(), body: Body::parse("width_mm = 400").unwrap() };
        let config = hardware.configured::<4, _>(ordered::FILTER);
        assert_eq!(config.mapper.geometry.bearings_mrad.map(|mrad| i32::from(mrad).abs()), [0, 1571, 3142, 1571]);
        assert_eq!((config.mapper.place.range_max_mm, config.drive.body_radius_mm), (4100, 200));
    }
}
