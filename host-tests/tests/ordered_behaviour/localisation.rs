//! Localisation with a known map, and kidnapping.

use super::*;

fn localiser(building: &Building, visits: u32, seed: u64) -> Box<Mapper> {
    let mut filter = Box::new(Mapper::new());
    let (map, darts) = building.known(visits);
    filter.start_with_map(OrderedConfig::DEFAULT.with_noise_mm(15), seed, &map, &darts).unwrap();
    filter
}

/// The number of places until the filter is certain of the robot's place, whose number is that of the vertex.
fn places_until_found(filter: &mut Mapper, robot: &mut Robot) -> usize {
    let is_found = |filter: &Mapper, robot: &Robot| {
        let place = VertexId::new(RING.place(robot.at) as u8).unwrap();
        filter.vertex_probability_q16(place) > 58982 && filter.recent(0) == Some(place)
    };
    let place = (1..=40).find(|_| {
        filter.observe(robot.step());
        check(filter);
        is_found(filter, robot)
    });
    place.unwrap_or(usize::MAX)
}

fn mean(name: &str, places: &[usize]) -> f64 {
    let mean = places.iter().map(|&places| places.min(1000) as f64).sum::<f64>() / places.len() as f64;
    println!("{name}: {mean:.2} places on average: {places:?}");
    mean
}

#[test]
fn a_robot_with_a_map_is_localised_within_a_few_places() {
    let find = |seed| {
        let mut robot = Robot::new(&RING, seed);
        let mut filter = localiser(&RING, 20, seed);
        filter.set_localise_only(true);
        let before = *filter.map();
        let places = places_until_found(&mut filter, &mut robot);
        assert_eq!(*filter.map(), before);
        places
    };
    let places: Vec<usize> = (0..40).map(find).collect();
    assert!(mean("known map", &places) <= 2.5);
}

#[test]
fn a_kidnapped_robot_is_localised_again() {
    for is_reported in [true, false] {
        let kidnap = |seed| {
            let mut robot = Robot::new(&RING, seed);
            let mut filter = localiser(&RING, 20, seed);
            filter.set_localise_only(true);
            for _ in 0..30 {
                filter.observe(robot.step());
            }
            robot.carry_off(is_reported);
            places_until_found(&mut filter, &mut robot)
        };
        let places: Vec<usize> = (0..40).map(kidnap).collect();
        assert!(mean(if is_reported { "reported" } else { "not reported" }, &places) <= 4.0);
    }
}

#[test]
fn a_kidnapped_robot_finds_its_place_on_the_map_it_makes() {
    let mut found = 0;
    for seed in 0..20 {
        let mut robot = Robot::new(&RING, seed);
        let mut filter = started(seed);
        robot.drive(&mut filter, 70);
        robot.carry_off(true);
        robot.drive(&mut filter, 60);
        check(&filter);
        found += u32::from(is_complete(&RING, filter.darts().unwrap()));
    }
    println!("{found} of 20 complete");
    assert!(found >= 18, "{found}");
}

#[test]
fn a_map_stays_the_same_while_the_filter_only_localises() {
    let mut filter = started(1);
    let mut robot = Robot::new(&RING, 1);
    robot.drive(&mut filter, 120);
    filter.set_localise_only(true);
    filter.observe(robot.step());
    let (before, edges) = (*filter.map(), filter.darts().unwrap().edges().collect::<Vec<_>>());
    for round in 0..400 {
        if round % 40 == 20 {
            robot.carry_off(round % 80 == 20);
        }
        filter.observe(robot.step());
        filter.refine();
        check(&filter);
        assert_eq!(*filter.map(), before);
        assert!(filter.darts().unwrap().edges().eq(edges.iter().copied()));
    }
    for radius_mm in [0, 8188, 5000, 1, 4000, 8188] {
        filter.observe(Fingerprint::from_radius_mm(radius_mm).unwrap());
        assert_eq!(*filter.map(), before, "a place that is on no map");
    }
}

#[test]
fn mapping_continues_after_localisation_alone() {
    for seed in 0..10 {
        let mut filter = localiser(&RING, 20, seed);
        let mut robot = Robot::new(&RING, seed);
        filter.set_localise_only(true);
        for round in 0..60 {
            if round == 30 {
                robot.carry_off(false);
            }
            filter.observe(robot.step());
        }
        filter.set_localise_only(false);
        robot.drive(&mut filter, 30);
        check(&filter);
        assert!(is_complete(&RING, filter.darts().unwrap()), "seed {seed}");
        let visits: u32 = filter.map().vertices().map(|vertex| filter.map().visits(vertex)).sum();
        assert_eq!(visits, 8 * 20 + 90, "seed {seed}: what was seen meanwhile counts");
    }
}

#[test]
fn localisation_without_a_map_loses_the_places_and_mapping_starts_afterwards() {
    let mut filter = started(1);
    let mut robot = Robot::new(&RING, 1);
    filter.set_localise_only(true);
    for index in 0..5 {
        assert_eq!(filter.observe(robot.step()).place_index, index);
        assert_eq!((filter.map().vertices().len(), filter.path().len()), (0, 0));
    }
    filter.set_localise_only(false);
    robot.drive(&mut filter, 120);
    assert!(is_complete(&RING, filter.darts().unwrap()));
}

#[test]
fn a_known_map_of_other_vertices_is_refused() {
    let (map, _) = RING.known::<16, 80>(20);
    let (_, darts) = HOUSE.known::<16, 80>(20);
    let mut filter = Box::new(Mapper::new());
    assert!(filter.start_with_map(OrderedConfig::DEFAULT, 1, &map, &darts).is_err());
}
