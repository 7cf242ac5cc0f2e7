//! What the robot reports of the places of a walk.

use super::Building;
use crate::walk::{PathRng, observe};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use toposlam::{Exit, Observation, Ways};

/// Bearings are at least this far from the way that the robot came by, in radians.
const LEAST_RAD: f64 = 0.03;

/// How reliable the reports are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayHints {
    /// The probability that a way is not seen at a visit; the way the robot came by and the one it leaves by always are.
    pub missed: f64,
    /// The probability that the exit is one off, to either side.
    pub wrong: f64,
    /// The probability that the exit is not reported.
    pub missing: f64,
    /// The standard deviation of a bearing in radians.
    pub bearing_rad: f64,
    /// The standard deviation of a travel time as a share of it; `None` when it is not reported.
    pub travel: Option<f64>,
}

impl Default for WayHints {
    fn default() -> Self {
        Self { missed: 0.05, wrong: 0.04, missing: 0.05, bearing_rad: 0.1, travel: None }
    }
}

impl WayHints {
    /// Draws the reports of a walk. Readings come from `rng`, everything else from `hint_rng`, with as many draws whatever the
    /// hints are, so that settings are compared on the same readings.
    pub fn draw(
        &self,
        building: &Building,
        walk: &[usize],
        rng: &mut PathRng,
        hint_rng: &mut PathRng,
    ) -> Vec<Observation> {
        let mut exit_before = None;
        let mut reports = Vec::with_capacity(walk.len());
        for (step, &at) in walk.iter().enumerate() {
            let place = building.place(at);
            let mut report = Observation::new(observe(&building.environment().places()[place], rng));
            report.starts_sequence = step == 0;
            report.exit = exit_before;
            let travel: f64 = StandardNormal.sample(hint_rng);
            if let Some(share) = self.travel.filter(|_| step > 0) {
                report.travel_frames = Some((building.frames(at) * (1.0 + share * travel).max(0.3)).round() as u16);
            }
            let exit = walk.get(step + 1).map(|&next| building.partner(next));
            let mut seen: Vec<(f64, usize)> = Vec::new();
            for &way in building.ways(place).iter().filter(|&&way| way != at) {
                let (draw, noise): (f64, f64) = (hint_rng.random(), StandardNormal.sample(hint_rng));
                let relative = (building.bearing_rad(way) - building.bearing_rad(at)).rem_euclid(TAU);
                if draw >= self.missed || exit == Some(way) {
                    let bearing = relative + self.bearing_rad * noise;
                    seen.push((bearing.clamp(LEAST_RAD, TAU - LEAST_RAD), way));
                }
            }
            seen.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut last = 0;
            let ascending = |&(bearing, _): &(f64, usize)| {
                last = ((1000.0 * bearing) as u16).max(last + 1);
                last
            };
            let bearings_mrad: Vec<u16> = seen.iter().map(ascending).collect();
            report.ways = Ways::from_bearings_mrad(&bearings_mrad).ok();
            let (wrong, missing): (f64, f64) = (hint_rng.random(), hint_rng.random());
            exit_before = exit.filter(|_| missing >= self.missing).map(|exit| {
                let slot = seen.iter().position(|&(_, way)| way == exit).map_or(0, |slot| slot as i64 + 1);
                let off = if wrong < self.wrong / 2.0 { -1 } else { i64::from(wrong < self.wrong) };
                let reported = (slot + off).rem_euclid(seen.len() as i64 + 1) as usize;
                let other = reported.checked_sub(1).and_then(|other| bearings_mrad.get(other));
                other.and_then(|&bearing| Exit::from_bearing_mrad(bearing).ok()).unwrap_or(Exit::Back)
            });
            reports.push(report);
        }
        reports
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        family::Family,
        ordered::{Bearings, WalkKind},
        walk::path_rng,
    };

    fn drawn(hints: WayHints) -> (Building, Vec<usize>, Vec<Observation>) {
        let family: Family = "2,1,10,10,2.6,5,0.03,general".parse().unwrap();
        let building = Building::of_family(&family, 0, Bearings::Spread(0.5), true).unwrap();
        let mut rng = path_rng(1, 0);
        let walk = building.draw_walk(5000, WalkKind::Uniform, &mut rng);
        let reports = hints.draw(&building, &walk, &mut rng, &mut path_rng(1, 1));
        (building, walk, reports)
    }

    #[test]
    fn without_noise_the_exit_is_the_way_by_which_the_robot_leaves() {
        let exact = WayHints { missed: 0.0, wrong: 0.0, missing: 0.0, bearing_rad: 0.0, travel: Some(0.0) };
        let (building, walk, reports) = drawn(exact);
        for (step, pair) in walk.windows(2).enumerate() {
            let exit = building.partner(pair[1]);
            let ways = building.ways(building.place(exit));
            let slot = |dart| ways.iter().position(|&way| way == dart).unwrap();
            let position = (slot(exit) + ways.len() - slot(pair[0])) % ways.len();
            let others = reports[step].ways.unwrap();
            let bearing = position.checked_sub(1).map(|other| others.others().unwrap()[other]);
            assert_eq!(reports[step + 1].exit, Some(bearing.map_or(Exit::Back, Exit::Bearing)));
            assert_eq!(usize::from(reports[step].ways.unwrap().count()), ways.len());
            assert_eq!(reports[step + 1].travel_frames, Some(building.frames(exit).round() as u16));
        }
    }

    #[test]
    fn hints_are_missed_missing_and_wrong_as_often_as_they_should() {
        let (building, walk, reports) = drawn(WayHints::default());
        let share = |hits: usize, all: usize| hits as f64 / all as f64;
        assert!(
            (share(reports.iter().filter(|report| report.exit.is_none()).count(), reports.len()) - 0.05).abs() < 0.01
        );
        let exact = WayHints { wrong: 0.0, ..WayHints::default() };
        let (_, _, right) = drawn(exact);
        let wrong = reports.iter().zip(&right).filter(|(report, right)| report.exit != right.exit).count();
        assert!((share(wrong, reports.len()) - 0.04).abs() < 0.02, "{wrong}");
        let ways: usize = walk.iter().map(|&at| building.ways(building.place(at)).len() - 1).sum();
        let seen: usize = reports.iter().map(|report| usize::from(report.ways.unwrap().count()) - 1).sum();
        // A way by which the robot leaves is always seen.
        assert!((0.02..0.05).contains(&share(ways - seen, ways)), "{}", share(ways - seen, ways));
    }
}
