//! The behaviour of the robust filter: wrong hints and noise, recovery, long runs, localisation, and invalid input.

mod bad_input;
#[path = "../common/mod.rs"]
mod common;
mod localisation;
mod long_runs;
mod wrong_vertices;

use common::drive::Random;
use common::environments::{easy, floor, ring_with_a_repeated_part, six_rooms};
use common::robot::{Hints, Robot, TURNS};
use common::vertex;
use toposlam::{Exit, FaultKind, Filter, Fingerprint, Map, Observation, RobustConfig, RobustFilter, VertexId};
use toposlam_eval::environment::Environment;
use toposlam_eval::walk::all_walks;

/// Refinement steps between two places.
const REFINEMENTS: usize = 4;

fn started<const N: usize, const V: usize, const HISTORY: usize>(seed: u64) -> Box<RobustFilter<N, V, HISTORY>> {
    let mut filter = Box::new(RobustFilter::new());
    filter.start(RobustConfig::DEFAULT, seed).unwrap();
    filter
}

fn drive<const N: usize, const V: usize, const HISTORY: usize>(
    filter: &mut RobustFilter<N, V, HISTORY>,
    robot: &mut Robot,
    places: usize,
) {
    for _ in 0..places {
        filter.observe(robot.step());
        (0..REFINEMENTS).for_each(|_| filter.refine());
    }
}

/// Drives until the map is exact, and returns the number of places; `None` if it is not exact after `most` places.
fn until_exact<const N: usize, const V: usize, const HISTORY: usize>(
    filter: &mut RobustFilter<N, V, HISTORY>,
    robot: &mut Robot,
    (most, refinements): (usize, usize),
) -> Option<usize> {
    (1..=most).find(|_| {
        filter.observe(robot.step());
        (0..refinements).for_each(|_| filter.refine());
        robot.is_mapped_by(filter)
    })
}

/// The number of drives of ten whose map is exact after `places` places.
fn exact_of_ten(environment: &Environment, hints: Hints, config: RobustConfig, places: usize) -> usize {
    let is_exact = |&seed: &u64| {
        let mut robot = Robot::new(environment, hints, 100 + seed);
        let mut filter = Box::new(RobustFilter::<10, 16, 400>::new());
        filter.start(config, seed).unwrap();
        for _ in 0..places {
            filter.observe(robot.step());
            (0..REFINEMENTS).for_each(|_| filter.refine());
        }
        robot.is_mapped_by(&*filter)
    };
    (0..10).filter(is_exact).count()
}

#[test]
fn wrong_and_missing_turn_hints_do_not_prevent_the_exact_map() {
    let hints = Hints { missing_percent: 30, wrong_percent: 5, ..TURNS };
    for (name, environment, places) in [("six rooms", six_rooms(), 200), ("ring", ring_with_a_repeated_part(), 300)] {
        let exact = exact_of_ten(&environment, hints, RobustConfig::DEFAULT, places);
        println!("{name}: {exact} of 10 exact after {places} places");
        assert!(exact >= 8, "{name}: {exact}");
    }
}

#[test]
fn a_configured_noise_that_is_off_by_a_factor_of_two_gives_the_same_map() {
    // The places of this environment have a standard deviation of 20 mm.
    for noise_mm in [10, 20, 40] {
        let config = RobustConfig::DEFAULT.with_noise_mm(noise_mm);
        let exact = exact_of_ten(&easy(), Hints::default(), config, 100);
        println!("guess {noise_mm} mm: {exact} of 10 exact");
        assert!(exact >= 9, "{noise_mm}: {exact}");
    }
}

#[test]
fn the_same_seed_and_input_give_the_same_result() {
    let environment = floor();
    let results = |seed: u64, refinements: usize| -> Vec<String> {
        let mut robot = Robot::new(&environment, TURNS, 9);
        let mut filter = started::<10, 16, 64>(seed);
        let mut observe = |_| {
            let update = filter.observe(robot.step());
            (0..refinements).for_each(|_| filter.refine());
            format!("{update:?} {:?} {:?} {:?}", filter.map(), filter.worst(), filter.evidence())
        };
        (0..100).map(&mut observe).collect()
    };
    assert_eq!(results(1, 2), results(1, 2));
    assert_eq!(results(1, 0), results(1, 0));
    assert_ne!(results(1, 2), results(2, 2), "the proposals are drawn");
}

#[test]
fn the_n_grams_of_an_exploration_give_the_exact_map_earlier() {
    let environment = six_rooms();
    let walks = all_walks(&environment, 5, 1000).unwrap();
    let checks = [10, 25];
    let exact = |with_prior: bool| {
        let mut exact = [0; 2];
        for seed in 0..10 {
            let mut filter = started::<10, 16, 600>(seed);
            let mut robot = Robot::new(&environment, Hints::default(), 100 + seed);
            let mut order: Vec<&Vec<usize>> = walks.iter().filter(|_| with_prior).collect();
            let mut random = Random(seed);
            (1..order.len()).for_each(|last| order.swap(last, random.below(last + 1)));
            for ngram in order {
                for (at, &place) in ngram.iter().enumerate() {
                    robot.carry_to(place, at == 0);
                    filter.observe(robot.step());
                }
            }
            let place = Random(seed).below(6);
            robot.carry_to(place, true);
            for steps in 1..=checks[1] {
                drive(&mut filter, &mut robot, 1);
                if let Some(check) = checks.iter().position(|&check| check == steps) {
                    exact[check] += usize::from(robot.is_all_mapped_by(&*filter));
                }
            }
        }
        exact
    };
    let [with, without] = [exact(true), exact(false)];
    println!("exact after {checks:?} places, of 10: {with:?} with {} n-grams before, {without:?} without", walks.len());
    assert!(with.iter().all(|&exact| exact >= 9), "{with:?}");
    assert!(without[0] <= 1 && without[1] <= 6, "{without:?}");
}
