//! Random walks through an environment and the noisy fingerprints observed on the way.

use super::environment::{Environment, Place};
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_xoshiro::{SplitMix64, Xoshiro256PlusPlus};
use std::collections::BTreeSet;
use toposlam::Fingerprint;

/// Walks of this many places or more are redrawn until they traverse every edge.
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

/// The places that a robot visits, and whether it traversed every edge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Walk {
    /// The visited places by index, in order.
    pub places: Vec<usize>,
    /// Whether every edge of the environment was traversed in one direction or the other.
    pub exhaustive: bool,
}

/// Draws a walk of `length` places: a uniform start, then uniform steps to a neighbour, turns back included.
///
/// Walks of [`EXHAUSTIVE_FROM_LENGTH`] places or more that miss an edge are redrawn, up to [`MAX_DRAWS`] walks in all.
/// The last one is then kept and marked as not exhaustive.
pub fn draw_walk(environment: &Environment, length: usize, rng: &mut PathRng) -> Walk {
    let draws = if length >= EXHAUSTIVE_FROM_LENGTH { MAX_DRAWS } else { 1 };
    let mut walk = draw_once(environment, length, rng);
    for _ in 1..draws {
        if walk.exhaustive {
            break;
        }
        walk = draw_once(environment, length, rng);
    }
    walk
}

fn draw_once(environment: &Environment, length: usize, rng: &mut PathRng) -> Walk {
    let mut places: Vec<usize> = Vec::with_capacity(length);
    let mut traversed = BTreeSet::new();
    let mut place = rng.random_range(0..environment.places().len());
    for _ in 0..length {
        if let Some(&last) = places.last() {
            let neighbours = &environment.neighbours()[last];
            place = neighbours[rng.random_range(0..neighbours.len())];
            traversed.insert((place.min(last), place.max(last)));
        }
        places.push(place);
    }
    Walk { places, exhaustive: traversed.len() == environment.graph().edges().len() }
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
        let draw = |seed, path| draw_walk(&line(), 40, &mut path_rng(seed, path)).places;
        assert_eq!(draw(1, 7), draw(1, 7));
        assert_ne!(draw(1, 7), draw(1, 8));
        assert_ne!(draw(1, 7), draw(2, 7));
        // Neighbouring seeds do not share paths shifted by one.
        assert_ne!(draw(1, 8), draw(2, 7));
    }

    #[test]
    fn every_step_follows_an_edge_and_u_turns_occur() {
        let environment = line();
        let walk = draw_walk(&environment, 100, &mut path_rng(1, 0));
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
        assert!(!draw_walk(&corridor, 100, &mut path_rng(1, 0)).exhaustive);
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
