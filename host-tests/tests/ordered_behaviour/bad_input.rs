//! Nothing that a robot may report ends the mapping.

use super::*;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

fn seen(radius_mm: u16) -> Observation {
    Observation::new(Fingerprint::from_radius_mm(radius_mm).unwrap())
}

#[test]
fn a_filter_that_was_not_started_ignores_observations() {
    let mut filter = Box::new(Mapper::new());
    filter.observe(seen(1000));
    filter.refine();
    assert_eq!((filter.map().vertices().len(), filter.observed(), filter.arrival()), (0, 0, None));
}

#[test]
fn a_full_map_keeps_its_vertices_and_reports_the_fault_each_time() {
    let mut filter = Box::new(OrderedFilter::<6, 4, 40, 64>::new());
    filter.start(OrderedConfig::DEFAULT.with_noise_mm(15), 1).unwrap();
    let mut robot = Robot::new(&RING, 1);
    let mut before = 0;
    let mut off_map = 0;
    for _ in 0..200 {
        filter.observe(robot.step());
        check(&filter);
        let faults = filter.faults().count(FaultKind::VerticesFull);
        if filter.recent(0).is_none() {
            off_map += 1;
            assert_eq!(faults, before + 1, "a place that is not on the map is a fault");
        }
        before = faults;
        (0..6).for_each(|_| filter.refine());
        assert!(filter.map().vertices().len() <= 4);
    }
    assert!(off_map > 10, "{off_map}");
    assert_eq!(filter.map().vertices().len(), 4);
}

#[test]
fn a_full_table_of_darts_reports_the_fault() {
    let mut filter = Box::new(OrderedFilter::<6, 8, 8, 64>::new());
    filter.start(OrderedConfig::DEFAULT.with_noise_mm(15), 1).unwrap();
    Robot::new(&RING, 1).drive(&mut filter, 40);
    check(&filter);
    assert!(filter.faults().count(FaultKind::VerticesFull) > 0);
}

#[test]
fn hints_that_contradict_the_place_before_are_counted_and_ignored() {
    let mut filter = started(1);
    let ways = Ways::from_bearings_mrad(&[1600, 3100]).ok();
    filter.observe(Observation { ways, ..seen(1000) });
    let invalid = |filter: &Mapper| filter.faults().count(FaultKind::InvalidHint);
    filter.observe(Observation { exit: Some(Exit::from_bearing_mrad(1650).unwrap()), ..seen(2000) });
    assert_eq!(invalid(&filter), 0);
    filter.observe(Observation { ways, exit: Some(Exit::Back), ..seen(1000) });
    filter.observe(Observation { exit: Some(Exit::from_bearing_mrad(4700).unwrap()), ..seen(2000) });
    assert_eq!(invalid(&filter), 1, "no way was seen at this bearing");
    filter.observe(Observation { travel_frames: Some(0), ..seen(1000) });
    assert_eq!(invalid(&filter), 2, "no corridor takes no time");
    check(&filter);
}

#[test]
fn an_exit_that_no_visit_has_shown_is_a_new_way() {
    let mut filter = started(1);
    let exit = Some(Exit::from_bearing_mrad(1600).unwrap());
    filter.observe(seen(1000));
    let update = filter.observe(Observation { exit, ..seen(2000) });
    assert!(update.is_new);
    let darts = filter.darts().unwrap();
    let left = darts.partner(filter.arrival().unwrap()).unwrap();
    assert_eq!((darts.position(left), darts.edges().count()), (Some(1), 1));
}

#[test]
fn contradictory_hints_at_every_place_do_not_end_the_mapping() {
    let mut filter = started(3);
    let mut random = split_mix::Random(5);
    for _ in 0..300 {
        let bearings: Vec<u16> = {
            let mut bearings: Vec<u16> = (0..random.below(6)).map(|_| 1 + random.below(6282) as u16).collect();
            bearings.sort_unstable();
            bearings.dedup();
            bearings
        };
        let exit = [None, Some(Exit::Back), Some(Exit::On), Some(Exit::Bearing(random.bits() as u8))][random.below(4)];
        filter.observe(Observation {
            ways: Ways::from_bearings_mrad(&bearings).ok(),
            exit,
            travel_frames: Some(random.below(1000) as u16),
            ..seen(2 * random.below(2000) as u16)
        });
        check(&filter);
        (0..4).for_each(|_| filter.refine());
        assert!(filter.map().vertices().len() > 0 && filter.score().is_finite());
    }
    // A filter that is started again maps a building.
    filter.start(OrderedConfig::DEFAULT.with_noise_mm(15), 3).unwrap();
    Robot::new(&HOUSE, 3).drive(&mut filter, 90);
    assert!(is_complete(&HOUSE, filter.darts().unwrap()));
}

/// Anything: labels of a few kinds or of any, ways and exits that contradict each other, sequences of one place.
fn anything() -> impl Strategy<Value = Observation> {
    let steps =
        prop_oneof![4 => (0_u16..4, 0_u16..8).prop_map(|(kind, noise)| 400 + 50 * kind + noise), 1 => 0..=4094_u16];
    let exit = prop_oneof![
        2 => Just(None),
        2 => Just(Some(Exit::Back)),
        1 => Just(Some(Exit::On)),
        3 => any::<u8>().prop_map(|bearing| Some(Exit::Bearing(bearing))),
    ];
    let bearings = vec(1_u16..6283, 0..6).prop_map(|mut bearings| {
        bearings.sort_unstable();
        bearings.dedup();
        Ways::from_bearings_mrad(&bearings).ok()
    });
    let ways = prop_oneof![
        1 => Just(None),
        1 => (1_u8..8).prop_map(|count| Ways::from_count(count).ok()),
        2 => Just(Ways::from_bearings_mrad(&[2000, 4000]).ok()),
        4 => bearings,
    ];
    let frames = prop_oneof![1 => Just(None), 3 => (10_u16..90).prop_map(Some), 1 => any::<u16>().prop_map(Some)];
    (steps, exit, ways, frames, prop::bool::weighted(0.1)).prop_map(
        |(steps, exit, ways, travel_frames, starts_sequence)| {
            let fingerprint = Fingerprint::from_steps(steps).unwrap();
            Observation { fingerprint, ways, exit, travel_frames, starts_sequence }
        },
    )
}

fn config() -> impl Strategy<Value = OrderedConfig> {
    let noise_mm = prop_oneof![Just(1_u16), Just(30), Just(1000)];
    (noise_mm, 1_u16..=500, 1_u16..=500, 1_u16..=500, 10_u16..=500, 10_u16..=500).prop_map(
        |(noise_mm, wrong_exit, missed, false_way, bearing_mrad, travel)| {
            OrderedConfig::DEFAULT
                .with_noise_mm(noise_mm)
                .with_wrong_exit_permille(wrong_exit)
                .with_missed_way_permille(missed)
                .with_false_way_permille(false_way)
                .with_bearing_noise_mrad(bearing_mrad)
                .with_travel_noise_permille(travel)
        },
    )
}

fn bears<const N: usize, const V: usize, const D: usize>(
    config: OrderedConfig,
    observations: &[(Observation, u8)],
    seed: u64,
) {
    let mut filter = Box::new(OrderedFilter::<N, V, D, 9>::new());
    filter.start(config, seed).unwrap();
    let observe = |filter: &mut OrderedFilter<N, V, D, 9>, (observation, refinements): (Observation, u8)| {
        let update = filter.observe(observation);
        check(filter);
        assert!(filter.map().contains(update.vertex));
        assert!(update.distinct >= 1 && filter.score().is_finite());
        (0..refinements).for_each(|_| filter.refine());
    };
    observations.iter().for_each(|&observation| observe(&mut filter, observation));
    filter.set_localise_only(true);
    let before: Vec<_> = filter.darts().unwrap().edges().collect();
    for &(observation, _) in observations.iter().take(25) {
        observe(&mut filter, (observation, 1));
        assert!(filter.darts().unwrap().edges().eq(before.iter().copied()));
    }
    filter.set_localise_only(false);
    observations.iter().take(25).for_each(|&observation| observe(&mut filter, observation));
}

proptest! {
    #![proptest_config(Config { cases: 300, rng_seed: RngSeed::Fixed(0x7090_51A0), failure_persistence: None, ..Config::default() })]

    #[test]
    fn the_smallest_filters_bear_anything(
        config in config(),
        observations in vec((anything(), 0_u8..5), 1..50),
        seed in any::<u64>(),
        size in 0..4,
    ) {
        match size {
            0 => bears::<1, 1, 8>(config, &observations, seed),
            1 => bears::<2, 3, 22>(config, &observations, seed),
            2 => bears::<3, 9, 64>(config, &observations, seed),
            _ => bears::<4, 24, 200>(config, &observations, seed),
        }
    }
}
