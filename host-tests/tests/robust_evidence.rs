//! The robust filter: evidence, map, belief and worst n-gram are what the reference makes of the path that it publishes.

mod common;

use common::drive::Random;
use common::watched::{Tally, Watched};
use toposlam::{Filter, Fingerprint, Observation, RobustConfig, Turn};
use toposlam_host_tests::graph::Graph;

/// What a drive tells besides fingerprints.
#[derive(Clone, Copy, Debug)]
struct Told {
    turns: bool,
    degrees: bool,
    /// How often the robot is carried elsewhere and says so, in percent.
    carried_percent: usize,
}

/// A drive through a building with noise of up to so many steps; hints are missing or wrong at times.
fn drive(random: &mut Random, building: &Graph, places: usize, noise_steps: usize, told: Told) -> Vec<Observation> {
    let mut walk: Vec<usize> = Vec::new();
    let mut begin = 0;
    let mut observe = |_| {
        let starts_sequence = random.below(100) < told.carried_percent;
        let place = match walk.last() {
            Some(&here) if !starts_sequence => {
                let ways: Vec<usize> = building.neighbours(here).iter().copied().collect();
                ways[random.below(ways.len())]
            }
            _ => random.below(building.vertices()),
        };
        if starts_sequence {
            begin = walk.len();
        }
        walk.push(place);
        let before = walk[begin..].iter().rev().nth(2).copied();
        let wrong = random.below(10) == 0;
        // At the first two places of a sequence a hint means nothing, and must change nothing.
        let is_back = before.map_or(random.below(2) == 0, |before| (before == place) != wrong);
        let turn = (told.turns && random.below(4) > 0).then_some(if is_back { Turn::Back } else { Turn::On });
        let ways = building.neighbours(place).len() as u8;
        let degree = (told.degrees && random.below(4) > 0).then(|| if wrong { ways + 1 } else { ways });
        let noise = random.below(2 * noise_steps + 1) as f64 - noise_steps as f64;
        let steps = building.label(place) / 2.0 + noise;
        let fingerprint = Fingerprint::from_steps(steps as u16).expect("labels of tests are in range");
        Observation { fingerprint, turn, degree, starts_sequence }
    };
    (0..places).map(&mut observe).collect()
}

/// Drives a watched filter through so many buildings.
fn agree(drives: u64, most_places: usize, longest: usize, told: Told) {
    let mut tally = Tally::default();
    for seed in 0..drives {
        let mut random = Random(seed);
        let places = 2 + random.below(most_places - 1);
        let building = random.building(places);
        let noise_steps = [1, 5, 15][random.below(3)];
        let config = RobustConfig::DEFAULT
            .with_hypotheses(1 + random.below(10) as u8)
            .with_noise_mm([10, 30, 60][random.below(3)])
            .with_moves(random.below(4) as u8);
        let mut watched = Watched::<10, 7, 64>::new(config, seed);
        for observation in drive(&mut random, &building, longest, noise_steps, told) {
            watched.observe(observation);
            for _ in 0..random.below(4) {
                watched.filter.refine();
            }
        }
        tally += watched.tally;
    }
    println!("{tally:?}");
    assert!(tally.compared > 300 && tally.searched > 300, "{tally:?}");
    assert!(tally.pruned * 20 <= tally.compared, "what the core leaves out seldom matters: {tally:?}");
    assert!(tally.stale == 0, "surplus and place are those of the best hypothesis: {tally:?}");
    assert!(tally.overlooked == 0, "the worst n-gram is found: {tally:?}");
}

#[test]
fn a_drive_by_fingerprints_alone_is_weighed_as_the_reference_does() {
    agree(60, 5, 40, Told { turns: false, degrees: false, carried_percent: 0 });
}

#[test]
fn turns_are_weighed_as_the_reference_does() {
    agree(60, 5, 40, Told { turns: true, degrees: false, carried_percent: 0 });
}

#[test]
fn degrees_are_weighed_as_the_reference_does() {
    agree(60, 5, 40, Told { turns: false, degrees: true, carried_percent: 0 });
}

#[test]
fn sequences_with_all_hints_are_weighed_as_the_reference_does() {
    agree(130, 5, 60, Told { turns: true, degrees: true, carried_percent: 12 });
}
