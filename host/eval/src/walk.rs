//! Random walks through an environment and the noisy fingerprints observed on the way.

use super::{
    environment::{Environment, Place},
    rotation::partner,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_xoshiro::{SplitMix64, Xoshiro256PlusPlus};
use std::{
    collections::{BTreeSet, VecDeque},
    fmt,
    str::FromStr,
};
use toposlam::Fingerprint;

/// Walks of this many places or more are redrawn until they traverse every corridor.
pub const EXHAUSTIVE_FROM_LENGTH: usize = 100;
/// Largest number of draws of a walk; the last one is kept as it is.
pub const MAX_DRAWS: usize = 1000;

/// The random number generator of one path.
pub type PathRng = Xoshiro256PlusPlus;

/// The generator of path number `path`. It depends only on the two arguments, so that paths can be evaluated in any
/// order and on any number of threads.
pub fn path_rng(seed: u64, path: u64) -> PathRng {
    let mut mixed_seed = SplitMix64::seed_from_u64(seed);
    PathRng::seed_from_u64(mixed_seed.next_u64().wrapping_add(path))
}

/// How the robot chooses the way by which it leaves a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WalkKind {
    /// Every way is equally likely, also the one by which it came.
    #[default]
    Uniform,
    /// As `Uniform`, but it turns back at dead ends only.
    Forward,
    /// Towards the nearest way that it has not driven; `Uniform` when there is none.
    Explore,
}

impl WalkKind {
    /// All kinds, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Uniform, Self::Forward, Self::Explore];

    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Forward => "forward",
            Self::Explore => "explore",
        }
    }
}

/// A text is no kind of walk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WalkKindError(String);

impl fmt::Display for WalkKindError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a walk is uniform, forward or explore, not {}", self.0)
    }
}

impl std::error::Error for WalkKindError {}

impl FromStr for WalkKind {
    type Err = WalkKindError;

    fn from_str(text: &str) -> Result<Self, WalkKindError> {
        Self::ALL.into_iter().find(|kind| kind.name() == text).ok_or_else(|| WalkKindError(text.into()))
    }
}

/// The places that a robot visits and the ways it takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Walk {
    /// The visited places by index, in order.
    pub places: Vec<usize>,
    /// The way of the first place that stands for the one by which the robot came.
    pub origin: usize,
    /// The dart by which the robot left each place but the last.
    pub exits: Vec<usize>,
    /// Whether every corridor of the environment was traversed in one direction or the other.
    pub exhaustive: bool,
}

impl Walk {
    /// A walk along given places. Of parallel corridors a random one is taken.
    ///
    /// # Panics
    /// When there is no place, or no corridor connects two successive places.
    pub fn along(environment: &Environment, places: &[usize], rng: &mut PathRng) -> Self {
        let mut exit = |step: &[usize]| {
            let leads_there = |&&dart: &&usize| environment.place_of(partner(dart)) == step[1];
            let ways: Vec<usize> = environment.exits()[step[0]].iter().filter(leads_there).copied().collect();
            assert!(!ways.is_empty(), "no corridor connects place {} with place {}", step[0], step[1]);
            if ways.len() == 1 { ways[0] } else { ways[rng.random_range(0..ways.len())] }
        };
        let exits = places.windows(2).map(&mut exit).collect();
        Self { places: places.to_vec(), origin: environment.exits()[places[0]][0], exits, exhaustive: false }
    }

    /// The dart by which the robot came to a place; at the first place, one of its ways stands for it.
    ///
    /// # Panics
    /// When the walk has no such place.
    pub fn arrival(&self, step: usize) -> usize {
        step.checked_sub(1).map_or(self.origin, |before| partner(self.exits[before]))
    }

    /// The corridors that the first `steps` places of the walk traverse.
    pub fn traversed(&self, steps: usize) -> BTreeSet<usize> {
        self.exits.iter().take(steps.saturating_sub(1)).map(|exit| exit / 2).collect()
    }
}

/// Draws a walk of `length` places with a uniform start.
///
/// Walks of [`EXHAUSTIVE_FROM_LENGTH`] places or more that miss a corridor are redrawn, up to [`MAX_DRAWS`] walks in all.
/// The last one is then kept and marked as not exhaustive.
pub fn draw_walk(environment: &Environment, length: usize, kind: WalkKind, rng: &mut PathRng) -> Walk {
    let draws = if length >= EXHAUSTIVE_FROM_LENGTH { MAX_DRAWS } else { 1 };
    let mut walk = draw_once(environment, length, kind, rng);
    for _ in 1..draws {
        if walk.exhaustive {
            break;
        }
        walk = draw_once(environment, length, kind, rng);
    }
    walk
}

fn draw_once(environment: &Environment, length: usize, kind: WalkKind, rng: &mut PathRng) -> Walk {
    let mut places = vec![rng.random_range(0..environment.places().len())];
    let mut exits: Vec<usize> = Vec::with_capacity(length);
    let mut driven = vec![false; environment.corridors().len()];
    while places.len() < length {
        let place = places[places.len() - 1];
        let mut choices = environment.exits()[place].clone();
        let back = exits.last().map(|&exit| partner(exit));
        match kind {
            WalkKind::Uniform => {}
            WalkKind::Forward if choices.len() == 1 => {}
            WalkKind::Forward => choices.retain(|&way| Some(way) != back),
            WalkKind::Explore => {
                let ways = towards_undriven(environment, place, &driven);
                choices = if ways.is_empty() { choices } else { ways };
            }
        }
        let exit = choices[rng.random_range(0..choices.len())];
        driven[exit / 2] = true;
        exits.push(exit);
        places.push(environment.place_of(partner(exit)));
    }
    let origin = environment.exits()[places[0]][0];
    Walk { places, origin, exits, exhaustive: driven.iter().all(|&driven| driven) }
}

/// The ways from a place that are the first on a shortest path to a corridor that was not driven; shortest by the number of
/// corridors.
fn towards_undriven(environment: &Environment, from: usize, driven: &[bool]) -> Vec<usize> {
    // The distance of each place from the nearest corridor that was not driven.
    let mut distance = vec![usize::MAX; environment.places().len()];
    let has_undriven = |&place: &usize| environment.exits()[place].iter().any(|way| !driven[way / 2]);
    let mut open: VecDeque<usize> = (0..distance.len()).filter(has_undriven).collect();
    open.iter().for_each(|&place| distance[place] = 0);
    while let Some(place) = open.pop_front() {
        for &next in &environment.neighbours()[place] {
            if distance[next] == usize::MAX {
                distance[next] = distance[place] + 1;
                open.push_back(next);
            }
        }
    }
    let leads_on = |&way: &usize| match distance[from] {
        0 => !driven[way / 2],
        here => here != usize::MAX && distance[environment.place_of(partner(way))] < here,
    };
    environment.exits()[from].iter().copied().filter(leads_on).collect()
}

/// Draws one fingerprint of a place: Gaussian, clamped to the range of a fingerprint, rounded to its step.
pub fn observe(place: &Place, rng: &mut PathRng) -> Fingerprint {
    // An environment holds no deviation that the distribution refuses; the mean is then the only sensible reading.
    let radius_mm = Normal::new(place.mean_mm, place.sd_mm).map_or(place.mean_mm, |noise| noise.sample(rng));
    let steps = radius_mm / f64::from(Fingerprint::STEP_MM);
    // `as` saturates, which is the clamp at 0.
    Fingerprint::from_steps(steps.round() as u16).unwrap_or(Fingerprint::MAX)
}

/// A fingerprint with a resolution of `bits` bits: the nearest of 2^`bits` levels from 0 to 8188 mm. From 12 bits on it
/// is unchanged.
pub fn quantise(fingerprint: Fingerprint, bits: u32) -> Fingerprint {
    if bits >= Fingerprint::BITS {
        return fingerprint;
    }
    let (levels, most) = ((1_u32 << bits) - 1, u32::from(Fingerprint::MAX.steps()));
    let level = (u32::from(fingerprint.steps()) * levels + most / 2) / most;
    let steps = (level * most + levels / 2) / levels.max(1);
    Fingerprint::from_steps(steps as u16).unwrap_or(Fingerprint::MAX)
}

/// Every walk of `length` places of the environment, a walk and its reversal counted once, in ascending order.
///
/// `None` when there are more than `limit`.
pub fn all_walks(environment: &Environment, length: usize, limit: usize) -> Option<Vec<Vec<usize>>> {
    let mut found = Vec::new();
    let mut open: Vec<Vec<usize>> = (0..environment.places().len()).rev().map(|place| vec![place]).collect();
    while let Some(walk) = open.pop() {
        if walk.len() < length {
            let Some(&last) = walk.last() else { continue };
            for &next in environment.neighbours()[last].iter().rev() {
                open.push(walk.iter().copied().chain([next]).collect());
            }
        } else if walk.iter().le(walk.iter().rev()) {
            if found.len() == limit {
                return None;
            }
            found.push(walk);
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Environment {
        let places = [900.0, 1500.0, 2000.0].iter().zip(0..);
        let places = places.map(|(&mean_mm, id)| Place { id, mean_mm, sd_mm: 20.0 }).collect();
        Environment::new("line".into(), places, &[[0, 1], [1, 2]]).unwrap()
    }

    #[test]
    fn a_walk_depends_on_seed_and_path_number_only() {
        let draw = |seed, path| draw_walk(&line(), 40, WalkKind::Uniform, &mut path_rng(seed, path)).places;
        assert_eq!(draw(1, 7), draw(1, 7));
        assert_ne!(draw(1, 7), draw(1, 8));
        assert_ne!(draw(1, 7), draw(2, 7));
        // Neighbouring seeds do not share paths shifted by one.
        assert_ne!(draw(1, 8), draw(2, 7));
    }

    #[test]
    fn every_step_follows_an_edge_and_u_turns_occur() {
        let environment = line();
        let walk = draw_walk(&environment, 100, WalkKind::Uniform, &mut path_rng(1, 0));
        assert_eq!(walk.places.len(), 100);
        assert!(walk.exhaustive);
        assert!(walk.places.windows(2).all(|step| environment.neighbours()[step[0]].contains(&step[1])));
        assert!(walk.places.windows(3).any(|step| step[0] == step[2] && step[1] == 1));
    }

    #[test]
    fn a_walk_that_cannot_be_exhaustive_is_marked_as_such() {
        let ids = 0..300;
        let places = ids.clone().map(|id| Place { id, mean_mm: 900.0, sd_mm: 20.0 }).collect();
        let edges: Vec<_> = ids.skip(1).map(|id| [id - 1, id]).collect();
        let corridor = Environment::new("corridor".into(), places, &edges).unwrap();
        assert!(!draw_walk(&corridor, 100, WalkKind::Uniform, &mut path_rng(1, 0)).exhaustive);
    }

    /// Two places with parallel corridors, a loop at one, and a dead end at the other.
    fn multigraph() -> Environment {
        let places = (1..=3).map(|id| Place { id, mean_mm: 900.0, sd_mm: 20.0 }).collect();
        Environment::new("multigraph".into(), places, &[[1, 2], [2, 1], [1, 1], [2, 3]]).unwrap()
    }

    #[test]
    fn every_way_is_equally_likely_also_parallel_ones_and_both_ends_of_a_loop() {
        let walk = draw_walk(&multigraph(), 40_000, WalkKind::Uniform, &mut path_rng(2, 0));
        for (place, ways) in multigraph().exits().iter().enumerate() {
            let left: Vec<usize> =
                walk.exits.iter().zip(&walk.places).filter(|&(_, &at)| at == place).map(|(&exit, _)| exit).collect();
            for way in ways {
                let share = left.iter().filter(|&exit| exit == way).count() as f64 / left.len() as f64;
                assert!((share - 1.0 / ways.len() as f64).abs() < 0.02, "{place} {way}: {share}");
            }
        }
        assert_eq!(walk.traversed(40_000).len(), 4);
        let again = Walk::along(&multigraph(), &walk.places, &mut path_rng(2, 1));
        assert!(
            again
                .exits
                .iter()
                .zip(again.places.windows(2))
                .all(|(&exit, step)| { [multigraph().place_of(exit), multigraph().place_of(partner(exit))] == step })
        );
    }

    #[test]
    fn a_forward_walk_turns_back_at_dead_ends_only() {
        let walk = draw_walk(&multigraph(), 1000, WalkKind::Forward, &mut path_rng(2, 0));
        assert!(walk.exhaustive);
        let turned_back = |step: &usize| walk.arrival(*step) == walk.exits[*step];
        assert!((1..999).filter(turned_back).all(|step| walk.places[step] == 2));
        assert!((1..999).any(|step| turned_back(&step)));
    }

    #[test]
    fn an_exploring_walk_drives_every_corridor_with_few_repetitions() {
        for path in 0..20 {
            // The dead end is driven twice at most.
            let walk = draw_walk(&multigraph(), 7, WalkKind::Explore, &mut path_rng(2, path));
            assert!(walk.exhaustive, "{walk:?}");
        }
    }

    #[test]
    fn kinds_of_walks_round_trip_through_text() {
        for kind in WalkKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        let refused = "back".parse::<WalkKind>().unwrap_err();
        assert_eq!(refused.to_string(), "a walk is uniform, forward or explore, not back");
    }

    #[test]
    fn observations_have_the_mean_and_deviation_of_their_place() {
        let place = Place { id: 0, mean_mm: 1354.0, sd_mm: 110.0 };
        let mut rng = path_rng(1, 0);
        let readings: Vec<f64> = (0..20_000).map(|_| f64::from(observe(&place, &mut rng).radius_mm())).collect();
        let mean = readings.iter().sum::<f64>() / readings.len() as f64;
        let variance = readings.iter().map(|reading| (reading - mean).powi(2)).sum::<f64>() / readings.len() as f64;
        assert!((mean - 1354.0).abs() < 4.0, "mean {mean}");
        assert!((variance.sqrt() - 110.0).abs() < 4.0, "deviation {}", variance.sqrt());
    }

    #[test]
    fn observations_stay_within_the_range_of_a_fingerprint() {
        let mut rng = path_rng(1, 0);
        let readings: Vec<_> = [0.0, 8188.0]
            .iter()
            .map(|&mean_mm| Place { id: 0, mean_mm, sd_mm: 500.0 })
            .flat_map(|place| (0..50).map(|_| observe(&place, &mut rng)).collect::<Vec<_>>())
            .collect();
        assert_eq!(readings.iter().min().map(|reading| reading.radius_mm()), Some(0));
        assert_eq!(readings.iter().max(), Some(&Fingerprint::MAX));
    }

    #[test]
    fn quantised_fingerprints_are_the_nearest_of_equal_levels() {
        for (bits, levels) in [(6, 64), (8, 256), (12, 4095)] {
            let all = (0..=4094).map(|steps| Fingerprint::from_steps(steps).unwrap());
            let mut held = BTreeSet::new();
            for fingerprint in all {
                let level = quantise(fingerprint, bits);
                // Half of a level and the rounding to a step.
                assert!(fingerprint.distance_steps(level) <= 4094 / (1 << bits) / 2 + 1, "{bits}: {fingerprint:?}");
                assert_eq!(quantise(level, bits), level);
                held.insert(level);
            }
            assert_eq!(held.len(), levels);
            assert_eq!((held.first(), held.last()), (Some(&Fingerprint::ZERO), Some(&Fingerprint::MAX)));
        }
    }

    #[test]
    fn all_walks_counts_a_walk_and_its_reversal_once() {
        // 0-1-0 1-0-1 0-1-2 1-2-1 2-1-2
        let walks = all_walks(&line(), 3, 5).unwrap();
        assert_eq!(walks, [[0, 1, 0], [0, 1, 2], [1, 0, 1], [1, 2, 1], [2, 1, 2]]);
        assert_eq!(all_walks(&line(), 3, 4), None);
    }
}
