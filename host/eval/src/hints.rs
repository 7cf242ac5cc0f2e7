//! The hints that accompany the fingerprint of a place: how the robot turned, and the degree of the place.

use super::{environment::Environment, walk::PathRng};
use rand::RngExt;
use std::{fmt, str::FromStr};
use toposlam::Exit;

/// Probability that a reported degree is right. Otherwise it is one too small or one too large, equally often.
const RIGHT_DEGREE: f64 = 0.9;
/// Largest degree of an observation.
const MAX_DEGREE: usize = 7;

/// Which hints accompany a fingerprint, and how reliable they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// Whether the robot reports how it left the previous place.
    pub turn: bool,
    /// Whether the robot reports the degree of a place: the true degree in 90 % of the visits, one less (but at least
    /// 1) and one more in 5 % each.
    pub degree: bool,
    /// Probability that a hint is missing, 0 to 1; independent for each hint of each place.
    pub missing: f64,
    /// Probability that a turn is reversed, 0 to 1.
    pub wrong: f64,
}

/// The hints of one visit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hint {
    /// How the robot left the previous place.
    pub turn: Option<Exit>,
    /// Degree of the place, 1 to 7.
    pub degree: Option<u8>,
}

/// Why a text does not describe hints.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HintsError {
    /// Unknown kind of hints.
    Kind(String),
    /// Unknown setting.
    Unknown(String),
    /// A probability is not a number from 0 to 1.
    Probability(String),
}

impl fmt::Display for HintsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kind(kind) => write!(f, "hints are none, turn, degree or both, not {kind}"),
            Self::Unknown(setting) => write!(f, "hints have missing=P and wrong=P, not {setting}"),
            Self::Probability(setting) => write!(f, "{setting}: a probability is a number from 0 to 1"),
        }
    }
}

impl std::error::Error for HintsError {}

impl FromStr for Hints {
    type Err = HintsError;

    fn from_str(text: &str) -> Result<Self, HintsError> {
        let mut parts = text.split(',');
        let (turn, degree) = match parts.next().unwrap_or_default() {
            "none" => (false, false),
            "turn" => (true, false),
            "degree" => (false, true),
            "both" => (true, true),
            kind => return Err(HintsError::Kind(kind.into())),
        };
        let mut hints = Self { turn, degree, missing: 0.0, wrong: 0.0 };
        for setting in parts {
            let Some((name, value)) = setting.split_once('=') else {
                return Err(HintsError::Unknown(setting.into()));
            };
            let probability = value.parse().ok().filter(|probability| (0.0..=1.0).contains(probability));
            let probability = probability.ok_or_else(|| HintsError::Probability(setting.into()))?;
            match name {
                "missing" => hints.missing = probability,
                "wrong" => hints.wrong = probability,
                _ => return Err(HintsError::Unknown(setting.into())),
            }
        }
        Ok(hints)
    }
}

impl fmt::Display for Hints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match (self.turn, self.degree) {
            (false, false) => return f.write_str("none"),
            (true, false) => "turn",
            (false, true) => "degree",
            (true, true) => "both",
        })?;
        for (name, probability) in [("missing", self.missing), ("wrong", self.wrong)] {
            if probability > 0.0 {
                write!(f, ",{name}={probability}")?;
            }
        }
        Ok(())
    }
}

impl Hints {
    /// Draws the hints for every place of a walk. The number of draws does not depend on the settings, so the same
    /// generator gives the same hints wherever they are given.
    pub fn draw(&self, environment: &Environment, walk: &[usize], rng: &mut PathRng) -> Vec<Hint> {
        let visit = |step: usize| {
            let [turn_missing, turn_wrong, degree_missing, degree_noise]: [f64; 4] = rng.random();
            let turn = step.checked_sub(2).filter(|_| self.turn && turn_missing >= self.missing);
            let degree = environment.neighbours()[walk[step]].len();
            Hint {
                turn: turn.map(|before| {
                    let back = (walk[before] == walk[step]) != (turn_wrong < self.wrong);
                    if back { Exit::Back } else { Exit::On }
                }),
                degree: (self.degree && degree_missing >= self.missing).then(|| told_degree(degree, degree_noise)),
            }
        };
        (0..walk.len()).map(visit).collect()
    }
}

/// The reported degree of a place, with `noise` uniform from 0 to 1.
fn told_degree(degree: usize, noise: f64) -> u8 {
    let one_sided = (1.0 - RIGHT_DEGREE) / 2.0;
    let told = match noise {
        noise if noise < one_sided => degree.saturating_sub(1),
        noise if noise < 2.0 * one_sided => degree + 1,
        _ => degree,
    };
    told.clamp(1, MAX_DEGREE) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        environment::Place,
        walk::{draw_walk, path_rng},
    };

    /// A star of three arms: the middle has degree 3, the ends have 1.
    fn star() -> Environment {
        let places = (0..4).map(|id| Place { id, mean_mm: 900.0, sd_mm: 20.0 }).collect();
        Environment::new("star".into(), places, &[[0, 1], [0, 2], [0, 3]]).unwrap()
    }

    fn draw(hints: &str, seed: u64) -> (Vec<usize>, Vec<Hint>) {
        let walk = draw_walk(&star(), 20_000, &mut path_rng(seed, 0)).places;
        let hints = hints.parse::<Hints>().unwrap().draw(&star(), &walk, &mut path_rng(seed, 1));
        (walk, hints)
    }

    fn share(hits: impl Iterator<Item = bool>) -> f64 {
        let hits: Vec<bool> = hits.collect();
        hits.iter().filter(|&&hit| hit).count() as f64 / hits.len() as f64
    }

    #[test]
    fn a_turn_hint_states_whether_the_robot_turned_back() {
        let (walk, hints) = draw("turn", 1);
        assert_eq!([hints[0], hints[1]], [Hint::default(); 2]);
        for (places, hint) in walk.windows(3).zip(&hints[2..]) {
            let turn = if places[0] == places[2] { Exit::Back } else { Exit::On };
            assert_eq!(*hint, Hint { turn: Some(turn), degree: None });
        }
    }

    #[test]
    fn missing_and_wrong_hints_occur_at_their_configured_rates() {
        let (_, truth) = draw("both", 2);
        let (walk, hints) = draw("both,missing=0.3,wrong=0.1", 2);
        assert!((share(hints[2..].iter().map(|hint| hint.turn.is_none())) - 0.3).abs() < 0.02);
        assert!((share(hints.iter().map(|hint| hint.degree.is_none())) - 0.3).abs() < 0.02);
        let given = || hints.iter().zip(&truth).filter(|(hint, _)| hint.turn.is_some());
        assert!((share(given().map(|(hint, truth)| hint.turn != truth.turn)) - 0.1).abs() < 0.01);
        let told = |degree, place: fn(usize) -> bool| {
            let visits = truth.iter().zip(&walk).filter(move |&(_, &at)| place(at));
            share(visits.map(move |(hint, _)| hint.degree == Some(degree)))
        };
        assert!((told(3, |place| place == 0) - 0.9).abs() < 0.01);
        assert!((told(2, |place| place == 0) - 0.05).abs() < 0.01);
        assert!((told(4, |place| place == 0) - 0.05).abs() < 0.01);
        assert!((told(1, |place| place > 0) - 0.95).abs() < 0.01, "there is no degree 0");
    }

    #[test]
    fn hints_round_trip_through_text() {
        for text in ["none", "turn", "degree,missing=0.3", "both,missing=0.25,wrong=0.05"] {
            assert_eq!(text.parse::<Hints>().unwrap().to_string(), text);
        }
        let refusal = |text: &str| text.parse::<Hints>().unwrap_err().to_string();
        assert_eq!(refusal("left"), "hints are none, turn, degree or both, not left");
        assert_eq!(refusal("turn,lost=1"), "hints have missing=P and wrong=P, not lost=1");
        assert_eq!(refusal("turn,wrong=2"), "wrong=2: a probability is a number from 0 to 1");
    }
}
