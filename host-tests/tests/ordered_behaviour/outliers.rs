//! Places that are none, and places that the detector did not detect.

use super::*;

/// Observes a place, with refinement.
fn observe(filter: &mut Mapper, observation: Observation) {
    filter.observe(observation);
    (0..6).for_each(|_| filter.refine());
}

#[test]
fn a_place_that_is_none_is_at_no_vertex_of_a_known_map() {
    let mut none = 0;
    for building in [&HOUSE, &RING] {
        for (seed, goes_back) in (0..6).flat_map(|seed| [(seed, false), (seed, true)]) {
            let mut filter = started(seed);
            let mut robot = Robot::new(building, seed);
            robot.drive(&mut filter, 90);
            assert!(is_complete(building, filter.darts().unwrap()), "seed {seed}");
            observe(&mut filter, robot.step_to_no_place(3000));
            none += usize::from(filter.recent(0).is_none() && filter.arrival().is_none());
            observe(&mut filter, robot.step_from_no_place(goes_back));
            assert!(filter.recent(0).is_some());
            robot.drive(&mut filter, 20);
            assert!(is_complete(building, filter.darts().unwrap()), "seed {seed}");
            check(&filter);
        }
    }
    // A way that is none may explain it as well at first.
    assert!(none >= 22, "{none} of 24");
}

#[test]
fn a_vertex_that_is_not_detected_stays_on_the_map() {
    for building in [&HOUSE, &RING] {
        for seed in 0..6 {
            let mut filter = started(seed);
            let mut robot = Robot::new(building, seed);
            robot.drive(&mut filter, 90);
            observe(&mut filter, robot.step_past());
            robot.drive(&mut filter, 4);
            assert!(is_complete(building, filter.darts().unwrap()), "seed {seed}");
            check(&filter);
        }
    }
}

#[test]
fn the_map_is_right_although_one_of_fifty_places_is_none_and_one_of_fifty_is_missed() {
    let mut right = 0;
    for seed in 0..20 {
        let building = if seed % 2 == 0 { &HOUSE } else { &RING };
        let mut filter = started(seed);
        let mut robot = Robot::new(building, seed);
        let mut random = split_mix::Random(seed);
        observe(&mut filter, robot.step());
        for _ in 0..150 {
            match random.below(50) {
                0 => {
                    let radius_mm = 600 + random.below(2000) as u16;
                    observe(&mut filter, robot.step_to_no_place(radius_mm));
                    observe(&mut filter, robot.step_from_no_place(random.below(2) == 0));
                }
                1 => observe(&mut filter, robot.step_past()),
                _ => observe(&mut filter, robot.step()),
            }
        }
        right += usize::from(is_complete(building, filter.darts().unwrap()));
        check(&filter);
    }
    assert!(right >= 18, "{right} of 20");
}
