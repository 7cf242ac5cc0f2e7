//! Nothing that a robot may say ends the mapping.

use super::*;
use common::random::cases;
use common::watched::Watched;
use proptest::collection::vec;
use proptest::prelude::*;
use toposlam::Ways;

fn seen(radius_mm: u16) -> Observation {
    Observation::new(Fingerprint::from_radius_mm(radius_mm).unwrap())
}

#[test]
fn a_full_map_keeps_its_vertices_and_reports_the_fault() {
    let environment = six_rooms();
    let mut robot = Robot::new(&environment, Hints::default(), 1);
    let mut filter = started::<10, 4, 64>(1);
    drive(&mut filter, &mut robot, 200);
    println!("full {}", filter.faults().count(FaultKind::VerticesFull));
    assert!(filter.faults().count(FaultKind::VerticesFull) > 0);
    assert_eq!(filter.map().vertices().len(), 4);
    assert!(filter.path().all(|vertex| vertex.index() < 4));
}

#[test]
fn turn_hints_at_the_first_two_places_of_a_sequence_are_ignored() {
    let paths = [None, Some(Exit::Back), Some(Exit::On)].map(|turn| {
        let environment = easy();
        let mut robot = Robot::new(&environment, Hints::default(), 3);
        let mut filter = started::<10, 8, 64>(3);
        for place in 0..40 {
            let begins = place == 0 || place == 20;
            let turn = turn.filter(|_| begins || place == 1 || place == 21);
            filter.observe(Observation { exit: turn, starts_sequence: begins, ..robot.step() });
        }
        (filter.evidence(), filter.path().collect::<Vec<_>>())
    });
    assert!(paths[0] == paths[1] && paths[0] == paths[2]);
}

#[test]
fn places_that_all_look_alike_give_a_consistent_map() {
    for (name, radii_mm) in [
        ("all alike", vec![1200]),
        ("two in turn", vec![1200, 2000]),
        ("no room at all", vec![0]),
        ("as much room as can be", vec![8188]),
        ("nothing and all", vec![0, 8188]),
    ] {
        let mut watched = Watched::<10, 6, 64>::new(RobustConfig::DEFAULT, 1);
        for radius_mm in radii_mm.into_iter().cycle().take(60) {
            watched.observe(seen(radius_mm));
            watched.filter.refine();
        }
        println!("{name}: {} vertices", watched.filter.map().vertices().len());
        assert!((2..=3).contains(&watched.filter.map().vertices().len()), "{name}: a place is not its own neighbour");
    }
}

#[test]
fn a_robot_that_is_kidnapped_before_every_place_has_a_map_without_edges() {
    let mut watched = Watched::<10, 6, 64>::new(RobustConfig::DEFAULT, 1);
    for radius_mm in [900, 1300, 1700].into_iter().cycle().take(45) {
        watched.observe(Observation { starts_sequence: true, ..seen(radius_mm) });
        watched.filter.refine();
    }
    assert_eq!(watched.filter.map().vertices().len(), 3);
    assert_eq!(watched.filter.map().edges().count(), 0);
}

#[test]
fn statistics_of_a_sequence_that_left_the_history_stay_with_their_vertex() {
    let config =
        RobustConfig::DEFAULT.with_noise_mm(1).with_moves(3).with_wrong_turn_permille(1).with_wrong_degree_permille(25);
    // The first place is a sequence of its own, so it leaves the history without an edge.
    let places = [
        (402, Some(4), false),
        (500, Some(6), true),
        (500, None, false),
        (500, None, false),
        (403, Some(6), false),
        (403, None, false),
        (404, Some(3), false),
        (500, None, false),
        (550, None, false),
        (502, None, false),
        (450, None, false),
        (450, None, false),
    ];
    let observation = |&(steps, degree, starts_sequence): &(u16, Option<u8>, bool)| {
        let fingerprint = Fingerprint::from_steps(steps).unwrap();
        let ways = degree.map(|degree| Ways::from_count(degree).unwrap());
        (Observation { ways, starts_sequence, ..Observation::new(fingerprint) }, 0)
    };
    let observations: Vec<(Observation, u8)> = places.iter().map(observation).collect();
    bears::<3, 4>(config, &observations, 4_264_363_679_906_593_650);
}

/// Anything: labels of a few kinds or of any, hints that contradict each other, sequences of one place.
fn anything() -> impl Strategy<Value = Observation> {
    let steps =
        prop_oneof![4 => (0_u16..4, 0_u16..8).prop_map(|(kind, noise)| 400 + 50 * kind + noise), 1 => 0..=4094_u16];
    let exit = prop_oneof![
        2 => Just(None),
        1 => Just(Some(Exit::Back)),
        1 => Just(Some(Exit::On)),
        1 => any::<u8>().prop_map(|bearing| Some(Exit::Bearing(bearing))),
    ];
    let ways = prop_oneof![2 => Just(None), 2 => (1_u8..5).prop_map(Some), 1 => (1_u8..8).prop_map(Some)];
    (steps, exit, ways, prop::bool::weighted(0.1)).prop_map(|(steps, exit, ways, starts_sequence)| {
        let fingerprint = Fingerprint::from_steps(steps).unwrap();
        let ways = ways.and_then(|count| Ways::from_count(count).ok());
        Observation { ways, exit, starts_sequence, ..Observation::new(fingerprint) }
    })
}

fn config() -> impl Strategy<Value = RobustConfig> {
    (prop_oneof![Just(1_u16), Just(30), Just(1000)], 0_u8..4, 1_u16..=500, 1_u16..=500).prop_map(
        |(noise_mm, moves, wrong_turn_permille, wrong_degree_permille)| {
            RobustConfig::DEFAULT
                .with_hypotheses(1)
                .with_noise_mm(noise_mm)
                .with_moves(moves)
                .with_wrong_turn_permille(wrong_turn_permille)
                .with_wrong_degree_permille(wrong_degree_permille)
        },
    )
}

fn bears<const N: usize, const V: usize>(config: RobustConfig, observations: &[(Observation, u8)], seed: u64) {
    let config = config.with_hypotheses(N as u8);
    let mut watched = Watched::<N, V, 8>::new(config, seed);
    for (observation, refine) in observations {
        watched.observe(*observation);
        (0..*refine).for_each(|_| watched.filter.refine());
    }
    // In between, the filter localises only.
    watched.filter.set_localise_only(true);
    for (observation, _) in observations.iter().take(12) {
        watched.filter.observe(*observation);
    }
    watched.filter.set_localise_only(false);
    for (observation, _) in observations.iter().take(12) {
        watched.filter.observe(*observation);
        watched.filter.refine();
    }
    assert!(watched.filter.path().all(|vertex| watched.filter.map().contains(vertex)));
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn the_smallest_filters_bear_anything(
        config in config(),
        observations in vec((anything(), 0_u8..4), 1..40),
        seed in any::<u64>(),
        size in 0..4,
    ) {
        match size {
            0 => bears::<1, 2>(config, &observations, seed),
            1 => bears::<2, 3>(config, &observations, seed),
            2 => bears::<3, 4>(config, &observations, seed),
            _ => bears::<3, 2>(config, &observations, seed),
        }
    }
}
