//! Runs far longer than the history.

use super::*;

fn ten_thousand_places<const HISTORY: usize>(environment: &Environment, hints: Hints) {
    const PLACES: usize = 10_000;
    let mut robot = Robot::new(environment, hints, 5);
    let mut filter = started::<10, 12, HISTORY>(5);
    let (mut exact, mut right) = (Vec::new(), 0);
    for place in 1..=PLACES {
        let update = filter.observe(robot.step());
        let path: Vec<u8> = filter.path().map(u8::from).collect();
        if place > PLACES - 1000 {
            right += usize::from(robot.place_of(&path, update.vertex.into()) == robot.walk.last().copied());
        }
        if place % 500 == 0 {
            exact.push(robot.is_all_mapped_by(&*filter));
        }
    }
    let map = filter.map();
    let visits: Vec<u32> = map.vertices().map(|vertex| map.visits(vertex)).collect();
    println!("{HISTORY}: exact {exact:?}, right {right} of the last 1000, visits {visits:?}");
    assert!(exact.iter().all(|&exact| exact), "{exact:?}");
    assert!(right >= 950, "{right}");
    assert_eq!(filter.observed(), PLACES as u32);
    assert_eq!(filter.faults().count(FaultKind::HistoryFull), (PLACES - HISTORY) as u32);
    assert_eq!(filter.faults().count(FaultKind::VerticesFull), 0);
    // Marginalised visits decay at 512 of a vertex; those of the history are added.
    assert!(visits.iter().all(|&visits| (10..=512 + HISTORY as u32).contains(&visits)), "{visits:?}");
    assert!(filter.evidence().0.is_finite());
    assert!(filter.noise_mm() < 60.0, "{}", filter.noise_mm());
}

#[test]
fn after_10_000_places_the_map_is_exact_with_a_history_of_64() {
    ten_thousand_places::<64>(&six_rooms(), Hints::default());
}

#[test]
fn after_10_000_places_the_map_is_exact_with_a_history_of_128_and_turn_hints() {
    ten_thousand_places::<128>(&ring_with_a_repeated_part(), TURNS);
}
