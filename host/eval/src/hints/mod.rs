//! The hints that accompany the fingerprint of a place: how the robot turned and the degree of the place, or the ways of the
//! place, the exit it took and the travel time.

mod draw;

use std::{fmt, str::FromStr};
use toposlam::{Exit, Ways};

/// Largest noise of a bearing, in milliradians, and of a travel time, as a share.
const MAX_BEARING_MRAD: f64 = 1000.0;
const MAX_TRAVEL_NOISE: f64 = 1.0;

/// Which hints accompany a fingerprint, and how reliable they are. Hints of turns and degrees exclude hints of ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// Whether the robot reports if it turned back at the previous place.
    pub turn: bool,
    /// Whether the robot reports the degree of a place: the true degree in 90 % of the visits, one less (but at least
    /// 1) and one more in 5 % each.
    pub degree: bool,
    /// Whether the robot reports the bearings of the ways of a place and of the exit that it took at the previous place.
    pub ways: bool,
    /// Whether the robot reports the travel time from the previous place, together with the ways.
    pub travel: bool,
    /// Probability that a turn, a degree or an exit is missing, 0 to 1; independent for each hint of each place.
    pub missing: f64,
    /// Probability that a turn is reversed, or that an exit is off by one way, to each side equally often; 0 to 1.
    pub wrong: f64,
    /// Probability that a way is not seen at a visit, 0 to 1. The way by which the robot came and the one by which it leaves are always
    /// seen.
    pub missed: f64,
    /// Standard deviation of a bearing in milliradians, 0 to 1000.
    pub bearing_mrad: f64,
    /// Standard deviation of a travel time as a share of it, 0 to 1.
    pub travel_noise: f64,
}

/// The hints of one visit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hint {
    /// How the robot left the previous place.
    pub exit: Option<Exit>,
    /// The ways of the place, or their number.
    pub ways: Option<Ways>,
    /// Ring frames from the previous place.
    pub travel_frames: Option<u16>,
}

/// Why a text does not describe hints.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HintsError {
    /// Unknown kind of hints.
    Kind(String),
    /// Unknown setting.
    Unknown(String),
    /// A setting of the ways without the ways.
    NeedsWays(String),
    /// A value is out of its range.
    Value {
        /// The setting with its value.
        setting: String,
        /// The allowed values.
        allowed: &'static str,
    },
}

impl fmt::Display for HintsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kind(kind) => write!(f, "hints are none, turn, degree, both or ways, not {kind}"),
            Self::Unknown(setting) => write!(
                f,
                "the settings of hints are missing=P and wrong=P, and of ways also travel, travel=SHARE, missed=P and \
                 bearing_mrad=B, not {setting}"
            ),
            Self::NeedsWays(setting) => write!(f, "{setting} is a setting of the hints ways"),
            Self::Value { setting, allowed } => write!(f, "{setting}: {allowed}"),
        }
    }
}

impl std::error::Error for HintsError {}

impl FromStr for Hints {
    type Err = HintsError;

    fn from_str(text: &str) -> Result<Self, HintsError> {
        let mut parts = text.split(',');
        let (turn, degree, ways) = match parts.next().unwrap_or_default() {
            "none" => (false, false, false),
            "turn" => (true, false, false),
            "degree" => (false, true, false),
            "both" => (true, true, false),
            "ways" => (false, false, true),
            kind => return Err(HintsError::Kind(kind.into())),
        };
        let mut hints = Self { turn, degree, ways, ..Self::default() };
        for setting in parts {
            let (name, value) = setting.split_once('=').unwrap_or((setting, ""));
            if ["travel", "missed", "bearing_mrad"].contains(&name) && !ways {
                return Err(HintsError::NeedsWays(setting.into()));
            }
            hints.travel |= name == "travel";
            let probability = "a probability is a number from 0 to 1";
            let (field, most, allowed) = match name {
                "travel" if setting == name => continue,
                "missing" => (&mut hints.missing, 1.0, probability),
                "wrong" => (&mut hints.wrong, 1.0, probability),
                "missed" => (&mut hints.missed, 1.0, probability),
                "bearing_mrad" => (&mut hints.bearing_mrad, MAX_BEARING_MRAD, "milliradians are from 0 to 1000"),
                "travel" => (&mut hints.travel_noise, MAX_TRAVEL_NOISE, "the share is a number from 0 to 1"),
                _ => return Err(HintsError::Unknown(setting.into())),
            };
            let value = value.parse().ok().filter(|value| (0.0..=most).contains(value));
            *field = value.ok_or_else(|| HintsError::Value { setting: setting.into(), allowed })?;
        }
        Ok(hints)
    }
}

impl fmt::Display for Hints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match (self.ways, self.turn, self.degree) {
            (true, ..) => "ways",
            (false, true, false) => "turn",
            (false, false, true) => "degree",
            (false, true, true) => "both",
            (false, false, false) => return f.write_str("none"),
        })?;
        if self.travel && self.travel_noise == 0.0 {
            f.write_str(",travel")?;
        }
        let settings = [
            ("travel", self.travel_noise),
            ("missing", self.missing),
            ("wrong", self.wrong),
            ("missed", self.missed),
            ("bearing_mrad", self.bearing_mrad),
        ];
        settings.iter().filter(|(_, value)| *value > 0.0).try_for_each(|(name, value)| write!(f, ",{name}={value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hints_round_trip_through_text() {
        for text in [
            "none",
            "turn",
            "degree,missing=0.3",
            "both,missing=0.25,wrong=0.05",
            "ways",
            "ways,travel",
            "ways,travel=0.1,missing=0.05,wrong=0.04,missed=0.05,bearing_mrad=100",
        ] {
            assert_eq!(text.parse::<Hints>().unwrap().to_string(), text);
        }
        let twice = "ways,travel,missing=0.1,travel=0.2".parse::<Hints>().unwrap();
        assert_eq!(twice.to_string(), "ways,travel=0.2,missing=0.1");
    }

    #[test]
    fn invalid_hints_are_refused_with_the_reason() {
        let refusal = |text: &str| text.parse::<Hints>().unwrap_err().to_string();
        assert_eq!(refusal("left"), "hints are none, turn, degree, both or ways, not left");
        assert!(refusal("turn,lost=1").ends_with("and bearing_mrad=B, not lost=1"));
        assert!(refusal("ways,missing").ends_with("missing: a probability is a number from 0 to 1"));
        assert_eq!(refusal("turn,wrong=2"), "wrong=2: a probability is a number from 0 to 1");
        assert_eq!(refusal("ways,missed=-1"), "missed=-1: a probability is a number from 0 to 1");
        assert_eq!(refusal("ways,bearing_mrad=2000"), "bearing_mrad=2000: milliradians are from 0 to 1000");
        assert_eq!(refusal("ways,travel=nan"), "travel=nan: the share is a number from 0 to 1");
        assert_eq!(refusal("both,travel"), "travel is a setting of the hints ways");
        assert_eq!(refusal("turn,missed=0.1"), "missed=0.1 is a setting of the hints ways");
    }
}
