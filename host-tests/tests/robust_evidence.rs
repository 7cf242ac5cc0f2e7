//! The robust filter: evidence, map, belief and worst n-gram are those that the reference computes from the published path.

mod common;

use common::drive::Random;
use common::watched::{Counts, Watched};
use toposlam::{Exit, Filter, Fingerprint, Observation, RobustConfig, Ways};
use toposlam_host_tests::graph::Graph;

/// The hints of a drive.
#[derive(Clone, Copy, Debug)]
struct DriveHints {
    turns: bool,
    degrees: bool,
    /// How often the robot is kidnapped and reports it, in percent.
    kidnapped_percent: usize,
}

/// A drive through a building with uniform noise of up to `noise_steps`. Some hints are missing or wrong.
fn drive(
    random: &mut Random,
    building: &Graph,
    places: usize,
    noise_steps: usize,
    hints: DriveHints,
) -> Vec<Observation> {
    let mut walk: Vec<usize> = Vec::new();
    let mut start = 0;
    let mut observe = |_| {
        let starts_sequence = random.below(100) < hints.kidnapped_percent;
        let place = match walk.last() {
            Some(&here) if !starts_sequence => {
                let exits: Vec<usize> = building.neighbours(here).iter().copied().collect();
                exits[random.below(exits.len())]
            }
            _ => random.below(building.vertices()),
        };
        if starts_sequence {
            start = walk.len();
        }
        walk.push(place);
        let before = walk[start..].iter().rev().nth(2).copied();
        let wrong = random.below(10) == 0;
        // At the first two places of a sequence a hint has no meaning and must change nothing.
        let is_back = before.map_or(random.below(2) == 0, |before| (before == place) != wrong);
        let turn = (hints.turns && random.below(4) > 0).then_some(if is_back { Exit::Back } else { Exit::On });
        let exits = building.neighbours(place).len() as u8;
        let degree = (hints.degrees && random.below(4) > 0).then(|| if wrong { exits + 1 } else { exits });
        let noise = random.below(2 * noise_steps + 1) as f64 - noise_steps as f64;
        let steps = building.label(place) / 2.0 + noise;
        let fingerprint = Fingerprint::from_steps(steps as u16).expect("labels of tests are in range");
        let ways = degree.map(|degree| Ways::from_count(degree).expect("a place of a test has few ways"));
        Observation { ways, exit: turn, starts_sequence, ..Observation::new(fingerprint) }
    };
    (0..places).map(&mut observe).collect()
}

/// Drives a watched filter through random buildings.
fn agree(drives: u64, most_places: usize, longest: usize, hints: DriveHints) {
    let mut counts = Counts::default();
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
        for observation in drive(&mut random, &building, longest, noise_steps, hints) {
            watched.observe(observation);
            for _ in 0..random.below(4) {
                watched.filter.refine();
            }
        }
        counts += watched.counts;
    }
    println!("{counts:?}");
    assert!(counts.compared > 300 && counts.searched > 300, "{counts:?}");
    assert!(counts.pruned * 20 <= counts.compared, "the paths that the core leaves out seldom matter: {counts:?}");
    assert!(counts.stale == 0, "bound and belief are those of the best hypothesis: {counts:?}");
    assert!(counts.overlooked == 0, "the worst n-gram is found: {counts:?}");
}

#[test]
fn the_evidence_of_fingerprints_alone_agrees_with_the_reference() {
    agree(60, 5, 40, DriveHints { turns: false, degrees: false, kidnapped_percent: 0 });
}

#[test]
fn the_evidence_with_turn_hints_agrees_with_the_reference() {
    agree(60, 5, 40, DriveHints { turns: true, degrees: false, kidnapped_percent: 0 });
}

#[test]
fn the_evidence_with_degrees_agrees_with_the_reference() {
    agree(60, 5, 40, DriveHints { turns: false, degrees: true, kidnapped_percent: 0 });
}

#[test]
fn the_evidence_of_sequences_with_all_hints_agrees_with_the_reference() {
    agree(130, 5, 60, DriveHints { turns: true, degrees: true, kidnapped_percent: 12 });
}
