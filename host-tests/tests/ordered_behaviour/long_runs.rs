//! Runs far longer than the history.

use super::*;

#[test]
fn a_map_stays_right_for_ten_thousand_places() {
    let mut filter = started(5);
    let mut robot = Robot::new(&RING, 5);
    robot.drive(&mut filter, 200);
    let ids: Vec<VertexId> = filter.map().vertices().collect();
    for place in 200..10_000 {
        robot.drive(&mut filter, 1);
        if place % 500 == 0 {
            check(&filter);
            assert!(is_complete(&RING, filter.darts().unwrap()), "at {place}");
        }
        assert!(ids.iter().all(|&id| filter.remapped(id) == Some(id)), "vertices keep their ids, at {place}");
    }
    assert!(filter.score().abs() < 1e4, "{}", filter.score());
}

#[test]
fn ways_that_are_none_do_not_fill_the_map() {
    let mut filter = started(7);
    let mut robot = Robot::new(&RING, 7);
    let mut random = split_mix::Random(3);
    for _ in 0..3000 {
        let mut observation = robot.step();
        if random.below(20) == 0 {
            let others = observation.ways.and_then(|ways| ways.others().map(<[u8]>::to_vec)).unwrap();
            let mut mrad: Vec<u16> = others.iter().map(|&bearing| (f64::from(bearing) * 24.54) as u16).collect();
            mrad.push(1 + random.below(6282) as u16);
            mrad.sort_unstable();
            mrad.dedup();
            observation.ways = Ways::from_bearings_mrad(&mrad).ok().or(observation.ways);
        }
        filter.observe(observation);
        (0..6).for_each(|_| filter.refine());
    }
    let darts = filter.darts().unwrap();
    assert_eq!((darts.vertices().len(), darts.edges().count()), (8, 9));
    assert!(darts.frontiers().count() <= 12, "{}", darts.frontiers().count());
    assert_eq!(filter.faults().count(FaultKind::VerticesFull), 0);
}
