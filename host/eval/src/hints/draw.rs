//! Draws the hints of a walk.

use super::{Hint, Hints};
use crate::{
    corridors::Corridors,
    environment::Environment,
    rotation::partner,
    walk::{PathRng, Walk},
};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use toposlam::{Exit, WAYS_MAX, Ways};

/// Probability that a reported degree is right. Otherwise it is one too small or one too large, equally often.
const RIGHT_DEGREE: f64 = 0.9;
/// A way that is seen at a noisy bearing is at least this far from the way by which the robot came, in radians.
const LEAST_RAD: f64 = 0.03;
/// A noisy travel time is at least this share of the mean.
const LEAST_TRAVEL: f64 = 0.3;

impl Hints {
    /// Draws the hints for every place of a walk. The number of draws does not depend on the probabilities and the noise, so
    /// that they are compared on the same hints. Hints of ways need the corridors.
    pub fn draw(
        &self,
        environment: &Environment,
        corridors: Option<&Corridors>,
        walk: &Walk,
        rng: &mut PathRng,
    ) -> Vec<Hint> {
        match corridors.filter(|_| self.ways) {
            Some(corridors) => self.draw_ways(corridors, walk, rng),
            None => self.draw_turns_and_degrees(environment, walk, rng),
        }
    }

    fn draw_turns_and_degrees(&self, environment: &Environment, walk: &Walk, rng: &mut PathRng) -> Vec<Hint> {
        let visit = |step: usize| {
            let [turn_missing, turn_wrong, degree_missing, degree_noise]: [f64; 4] = rng.random();
            let turn = step.checked_sub(2).filter(|_| self.turn && turn_missing >= self.missing);
            let degree = environment.exits()[walk.places[step]].len();
            let told_degree =
                Some(told_degree(degree, degree_noise)).filter(|_| self.degree && degree_missing >= self.missing);
            Hint {
                exit: turn.map(|before| {
                    let is_back = walk.exits[before + 1] == partner(walk.exits[before]);
                    if is_back == (turn_wrong < self.wrong) { Exit::On } else { Exit::Back }
                }),
                ways: told_degree.and_then(|degree| Ways::from_count(degree).ok()),
                travel_frames: None,
            }
        };
        (0..walk.places.len()).map(visit).collect()
    }

    fn draw_ways(&self, corridors: &Corridors, walk: &Walk, rng: &mut PathRng) -> Vec<Hint> {
        let mut exit = None;
        let mut hints = Vec::with_capacity(walk.places.len());
        for (step, &place) in walk.places.iter().enumerate() {
            let came_by = walk.arrival(step);
            let deviation: f64 = StandardNormal.sample(rng);
            let factor = (1.0 + self.travel_noise * deviation).max(LEAST_TRAVEL);
            let travel_frames = (corridors.travel_frames(came_by) * factor).round().max(1.0) as u16;
            let left_by = walk.exits.get(step).copied();
            let mut seen: Vec<(f64, usize)> = Vec::new();
            for &way in corridors.rotation().ways(place) {
                let (missed, deviation): (f64, f64) = (rng.random(), StandardNormal.sample(rng));
                if way != came_by && (missed >= self.missed || Some(way) == left_by) {
                    let bearing_rad = corridors.bearing_rad(way, came_by) + self.bearing_mrad / 1000.0 * deviation;
                    seen.push((bearing_rad.clamp(LEAST_RAD, TAU - LEAST_RAD), way));
                }
            }
            seen.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut last = 0;
            let ascending = |&(bearing_rad, _): &(f64, usize)| {
                last = ((1000.0 * bearing_rad) as u16).max(last + 1);
                last
            };
            let bearings_mrad: Vec<u16> = seen.iter().map(ascending).collect();
            let travel_frames = Some(travel_frames).filter(|_| self.travel && step > 0);
            hints.push(Hint { ways: Ways::from_bearings_mrad(&bearings_mrad).ok(), exit, travel_frames });
            exit = self.told_exit(left_by, &seen, &bearings_mrad, rng);
        }
        hints
    }

    /// The reported exit: one of the seen ways, off by one if it is wrong.
    fn told_exit(
        &self,
        left_by: Option<usize>,
        seen: &[(f64, usize)],
        bearings_mrad: &[u16],
        rng: &mut impl Rng,
    ) -> Option<Exit> {
        let [wrong, missing]: [f64; 2] = rng.random();
        let left_by = left_by.filter(|_| missing >= self.missing)?;
        // Number 0 is the way by which the robot came.
        let number = seen.iter().position(|&(_, way)| way == left_by).map_or(0, |position| position as i64 + 1);
        let off = if wrong < self.wrong / 2.0 { -1 } else { i64::from(wrong < self.wrong) };
        let reported = (number + off).rem_euclid(seen.len() as i64 + 1) as usize;
        match reported.checked_sub(1) {
            None => Some(Exit::Back),
            Some(position) => Exit::from_bearing_mrad(bearings_mrad[position]).ok(),
        }
    }
}

/// The reported degree of a place, with `noise` uniform from 0 to 1.
fn told_degree(degree: usize, noise: f64) -> u8 {
    let one_sided = (1.0 - RIGHT_DEGREE) / 2.0;
    let reported = match noise {
        noise if noise < one_sided => degree.saturating_sub(1),
        noise if noise < 2.0 * one_sided => degree + 1,
        _ => degree,
    };
    reported.clamp(1, WAYS_MAX) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        corridors::Bearings,
        environment::Place,
        walk::{WalkKind, draw_walk, path_rng},
    };

    /// A star of three arms: the middle has degree 3, the ends have 1.
    fn star() -> Environment {
        let places = (0..4).map(|id| Place { id, mean_mm: 900.0, sd_mm: 20.0 }).collect();
        Environment::new("star".into(), places, &[[0, 1], [0, 2], [0, 3]]).unwrap()
    }

    fn draw(hints: &str, seed: u64) -> (Walk, Vec<Hint>) {
        let walk = draw_walk(&star(), 20_000, WalkKind::Uniform, &mut path_rng(seed, 0));
        let hints = hints.parse::<Hints>().unwrap().draw(&star(), None, &walk, &mut path_rng(seed, 1));
        (walk, hints)
    }

    fn share(hits: impl Iterator<Item = bool>) -> f64 {
        let hits: Vec<bool> = hits.collect();
        hits.iter().filter(|&&hit| hit).count() as f64 / hits.len() as f64
    }

    fn degree(hint: &Hint) -> Option<u8> {
        hint.ways.map(Ways::count)
    }

    #[test]
    fn a_turn_hint_states_whether_the_robot_turned_back() {
        let (walk, hints) = draw("turn", 1);
        assert_eq!([hints[0], hints[1]], [Hint::default(); 2]);
        for (places, hint) in walk.places.windows(3).zip(&hints[2..]) {
            let turn = if places[0] == places[2] { Exit::Back } else { Exit::On };
            assert_eq!(*hint, Hint { exit: Some(turn), ..Hint::default() });
        }
    }

    #[test]
    fn missing_and_wrong_hints_occur_at_their_configured_rates() {
        let (_, truth) = draw("both", 2);
        let (walk, hints) = draw("both,missing=0.3,wrong=0.1", 2);
        assert!((share(hints[2..].iter().map(|hint| hint.exit.is_none())) - 0.3).abs() < 0.02);
        assert!((share(hints.iter().map(|hint| hint.ways.is_none())) - 0.3).abs() < 0.02);
        let given = || hints.iter().zip(&truth).filter(|(hint, _)| hint.exit.is_some());
        assert!((share(given().map(|(hint, truth)| hint.exit != truth.exit)) - 0.1).abs() < 0.01);
        let reported = |reported, place: fn(usize) -> bool| {
            let visits = truth.iter().zip(&walk.places).filter(move |&(_, &at)| place(at));
            share(visits.map(move |(hint, _)| degree(hint) == Some(reported)))
        };
        assert!((reported(3, |place| place == 0) - 0.9).abs() < 0.01);
        assert!((reported(2, |place| place == 0) - 0.05).abs() < 0.01);
        assert!((reported(4, |place| place == 0) - 0.05).abs() < 0.01);
        assert!((reported(1, |place| place > 0) - 0.95).abs() < 0.01, "there is no degree 0");
    }

    /// Two places with parallel corridors, a loop at one, and a dead end at the other.
    fn multigraph() -> Environment {
        let places = (1..=3).map(|id| Place { id, mean_mm: 900.0, sd_mm: 20.0 }).collect();
        Environment::new("multigraph".into(), places, &[[1, 2], [2, 1], [1, 1], [2, 3]]).unwrap()
    }

    fn draw_ways(hints: &str) -> (Corridors, Walk, Vec<Hint>) {
        let environment = multigraph();
        let corridors = Corridors::draw(&environment, Bearings::Spread, &mut path_rng(1, 2)).unwrap();
        let walk = draw_walk(&environment, 20_000, WalkKind::Uniform, &mut path_rng(1, 0));
        let hints: Hints = hints.parse().unwrap();
        let hints = hints.draw(&environment, Some(&corridors), &walk, &mut path_rng(1, 1));
        (corridors, walk, hints)
    }

    /// The reported exit without errors.
    fn right_exit(corridors: &Corridors, came_by: usize, exit: usize) -> Exit {
        if came_by == exit {
            return Exit::Back;
        }
        Exit::from_bearing_mrad((1000.0 * corridors.bearing_rad(exit, came_by)) as u16).unwrap()
    }

    #[test]
    fn without_noise_the_ways_the_exit_and_the_time_are_those_of_the_corridors() {
        let (corridors, walk, hints) = draw_ways("ways,travel");
        assert_eq!((hints[0].exit, hints[0].travel_frames), (None, None));
        for (step, hint) in hints.iter().enumerate().skip(1) {
            let [came_by_before, came_by] = [walk.arrival(step - 1), walk.arrival(step)];
            assert_eq!(hint.exit, Some(right_exit(&corridors, came_by_before, partner(came_by))));
            assert_eq!(degree(hint), Some(corridors.rotation().ways(walk.places[step]).len() as u8));
            assert_eq!(hint.travel_frames, Some(corridors.travel_frames(came_by).round() as u16));
        }
    }

    #[test]
    fn ways_are_missed_exits_missing_and_wrong_and_bearings_and_times_noisy_as_stated() {
        let exact = draw_ways("ways,travel").2;
        let (corridors, walk, hints) = draw_ways("ways,travel=0.1,missing=0.2,wrong=0.1");
        let reported = || (2..walk.places.len()).filter(|&step| hints[step].exit.is_some());
        assert!((share(hints[1..].iter().map(|hint| hint.exit.is_none())) - 0.2).abs() < 0.01);
        assert!((share(reported().map(|step| hints[step].exit != exact[step].exit)) - 0.1).abs() < 0.03);
        let deviation = |step: usize| {
            let mean = corridors.travel_frames(walk.arrival(step));
            f64::from(hints[step].travel_frames.unwrap()) / mean - 1.0
        };
        let mean_square = reported().map(|step| deviation(step).powi(2)).sum::<f64>() / reported().count() as f64;
        assert!((mean_square.sqrt() - 0.1).abs() < 0.005, "{mean_square}");

        let (_, _, hints) = draw_ways("ways,missed=0.1");
        // The way by which the robot came and the one by which it leaves are always seen.
        let (mut seen, mut all) = (0, 0);
        for (step, hint) in hints.iter().enumerate().take(walk.places.len() - 1).skip(1) {
            let certain = if walk.arrival(step) == walk.exits[step] { 1 } else { 2 };
            all += corridors.rotation().ways(walk.places[step]).len() - certain;
            seen += usize::from(degree(hint).unwrap()) - certain;
        }
        assert!((1.0 - seen as f64 / all as f64 - 0.1).abs() < 0.01, "{seen} of {all}");

        let (_, _, hints) = draw_ways("ways,bearing_mrad=50");
        let turned = |step: usize| -> Option<f64> {
            let (noisy, exact) = (hints[step].ways?, exact[step].ways?);
            let off = i16::from(*noisy.others()?.first()?) - i16::from(*exact.others()?.first()?);
            Some(f64::from(off) * TAU / 256.0)
        };
        let squares: Vec<f64> = reported().filter_map(turned).map(|off| off * off).collect();
        let deviation = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((deviation - 0.05).abs() < 0.01, "{deviation}");
    }
}
