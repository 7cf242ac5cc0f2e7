//! Localisation with a known map.

use super::*;

/// The map of an environment, with this many visits of every place.
fn known<const V: usize>(environment: &Environment, visits: u32) -> Map<V> {
    let mut map = Map::new();
    for place in environment.places() {
        let label = Fingerprint::from_radius_mm(place.mean_mm.round() as u16).unwrap();
        let vertex = map.add_vertex(label).unwrap();
        (1..visits).for_each(|_| map.observe(vertex, label));
    }
    environment.graph().edges().iter().for_each(|&(a, b)| map.add_edge(vertex(a), vertex(b)));
    map
}

type Localiser = Box<RobustFilter<10, 16, 64>>;

fn localiser(environment: &Environment, seed: u64) -> Localiser {
    localiser_with(&known(environment, 20), seed)
}

fn localiser_with(map: &Map<16>, seed: u64) -> Localiser {
    let mut filter = Localiser::new(RobustFilter::new());
    let config = RobustConfig::DEFAULT.with_noise_mm(15);
    filter.start_with_map(config, seed, map).unwrap();
    filter.set_localise_only(true);
    filter
}

fn look_around(filter: &mut Localiser, robot: &mut Robot) {
    for _ in 0..30 {
        filter.observe(robot.step());
    }
}

/// Whether the filter is certain of the robot's place, whose number is that of the vertex.
fn is_found(filter: &Localiser, robot: &Robot) -> bool {
    let place = vertex(*robot.walk.last().unwrap());
    f64::from(filter.vertex_probability_q16(place)) > 0.9 * 65536.0 && filter.path().last() == Some(place)
}

/// The number of places until the robot is localised.
fn places_until_found(filter: &mut Localiser, robot: &mut Robot) -> usize {
    (1..=40)
        .find(|_| {
            filter.observe(robot.step());
            is_found(filter, robot)
        })
        .unwrap_or(usize::MAX)
}

fn summary(name: &str, places: &[usize]) -> (f64, usize) {
    let mean = places.iter().map(|&places| places.min(1000) as f64).sum::<f64>() / places.len() as f64;
    let most = places.iter().copied().max().unwrap();
    println!("{name}: {mean:.2} places on average, at most {most}: {places:?}");
    (mean, most)
}

#[test]
fn a_robot_with_a_map_is_localised_within_a_few_places() {
    for (name, environment, most_mean) in [("six rooms", six_rooms(), 4.0), ("floor", floor(), 6.0)] {
        for (hints, with) in [(Hints::default(), "no hints"), (TURNS, "turns")] {
            let find = |seed| {
                let mut robot = Robot::new(&environment, hints, seed);
                let mut filter = localiser(&environment, seed);
                let before = *filter.map();
                let places = places_until_found(&mut filter, &mut robot);
                assert!(filter.map().edges().eq(before.edges()) && filter.map().labels() == before.labels());
                assert!(filter.map().vertices().eq(before.vertices()));
                places
            };
            let places: Vec<usize> = (0..60).map(find).collect();
            let (mean, most) = summary(&format!("{name}, {with}"), &places);
            assert!(mean <= most_mean && most <= 15);
        }
    }
}

/// For each of 60 kidnapped robots the number of places until it is localised.
fn places_after_kidnapping(environment: &Environment, is_reported: bool) -> Vec<usize> {
    let kidnap = |seed| {
        let mut robot = Robot::new(environment, Hints::default(), seed);
        let mut filter = localiser(environment, seed);
        look_around(&mut filter, &mut robot);
        robot.carry_off(is_reported);
        places_until_found(&mut filter, &mut robot)
    };
    (0..60).map(kidnap).collect()
}

#[test]
fn a_robot_that_reports_a_kidnapping_is_localised_within_a_few_places() {
    for (name, environment) in [("six rooms", six_rooms()), ("floor", floor())] {
        let (mean, most) =
            summary(&format!("{name}, kidnapping reported"), &places_after_kidnapping(&environment, true));
        assert!(mean <= 4.0 && most <= 15);
    }
}

#[test]
fn a_kidnapped_robot_that_does_not_know_it_is_localised_again() {
    for (name, environment, most_mean) in [("six rooms", six_rooms(), 5.0), ("floor", floor(), 15.0)] {
        let places: Vec<usize> =
            places_after_kidnapping(&environment, false).into_iter().map(|places| places.min(40)).collect();
        let (mean, _) = summary(&format!("{name}, kidnapping not reported"), &places);
        assert!(mean <= most_mean);
    }
}

#[test]
fn a_kidnapping_that_is_detected_late_adds_no_edge() {
    let environment = six_rooms();
    let is_exact = |&seed: &u64| {
        let mut robot = Robot::new(&environment, Hints::default(), seed);
        let mut filter = localiser(&environment, seed);
        look_around(&mut filter, &mut robot);
        robot.carry_off(false);
        look_around(&mut filter, &mut robot);
        filter.set_localise_only(false);
        drive(&mut filter, &mut robot, 30);
        robot.is_all_mapped_by(&*filter)
    };
    let exact = (0..60).filter(is_exact).count();
    println!("{exact} of 60 exact");
    assert!(exact >= 57, "{exact}");
}

#[test]
fn mapping_continues_after_localisation_alone() {
    let environment = six_rooms();
    for seed in 0..5 {
        let mut robot = Robot::new(&environment, Hints::default(), seed);
        let mut filter = localiser(&environment, seed);
        look_around(&mut filter, &mut robot);
        let visits = |filter: &Localiser| VertexId::first(6).map(|vertex| filter.map().visits(vertex)).sum::<u32>();
        filter.set_localise_only(false);
        drive(&mut filter, &mut robot, 30);
        assert!(robot.is_all_mapped_by(&*filter), "seed {seed}: {:?}", filter.map().edges().collect::<Vec<_>>());
        assert_eq!(visits(&filter), 6 * 20 + 60, "seed {seed}: what was seen meanwhile counts");
        // A place that is on no map: a corridor wide as nothing else.
        let new = Fingerprint::from_radius_mm(5000).unwrap();
        for _ in 0..8 {
            filter.observe(new);
            (0..REFINEMENTS).for_each(|_| filter.refine());
            let back = environment.places()[*robot.walk.last().unwrap()].mean_mm as u16;
            filter.observe(Fingerprint::from_radius_mm(back).unwrap());
        }
        assert!(filter.map().labels().contains(&new), "seed {seed}: {:?}", filter.map());
    }
}

#[test]
fn localisation_alone_adds_no_vertex() {
    let environment = six_rooms();
    let mut filter = localiser(&environment, 1);
    let before = *filter.map();
    for radius_mm in [0, 8188, 5000, 1, 4000, 8188, 8188] {
        filter.observe(Fingerprint::from_radius_mm(radius_mm).unwrap());
        filter.refine();
    }
    assert!(filter.map().edges().eq(before.edges()) && filter.map().labels() == before.labels());
    assert_eq!(filter.faults().count(FaultKind::VerticesFull), 0);
}

#[test]
fn localisation_alone_keeps_the_map_when_its_statistics_decay() {
    let environment = six_rooms();
    let mut robot = Robot::new(&environment, Hints::default(), 1);
    // With 600 visits the statistics decay at the first marginalised place.
    let mut filter = localiser_with(&known(&environment, 600), 1);
    filter.observe(robot.step());
    let before = *filter.map();
    for _ in 0..10 {
        look_around(&mut filter, &mut robot);
        robot.carry_off(false);
        assert_eq!(*filter.map(), before);
    }
}

#[test]
fn localisation_without_a_map_loses_the_places_and_mapping_starts_afterwards() {
    let environment = six_rooms();
    let mut robot = Robot::new(&environment, Hints::default(), 1);
    let mut filter = Localiser::new(RobustFilter::new());
    filter.start(RobustConfig::DEFAULT.with_noise_mm(15), 1).unwrap();
    filter.set_localise_only(true);
    for index in 0..5 {
        assert_eq!(filter.observe(robot.step()).place_index, index);
        assert_eq!((filter.map().vertices().len(), filter.path().count()), (0, 0));
    }
    filter.set_localise_only(false);
    let mut robot = Robot::new(&environment, Hints::default(), 1);
    drive(&mut filter, &mut robot, 60);
    assert!(robot.is_all_mapped_by(&*filter), "{:?}", filter.map().edges().collect::<Vec<_>>());
}
