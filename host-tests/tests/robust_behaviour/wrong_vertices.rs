//! Recovery from a wrong map.

use super::*;

type Mapped = (Box<RobustFilter<10, 16, 400>>, Vec<u8>);

/// A filter that has mapped its environment after 100 places or more, and its path.
fn mapped(robot: &mut Robot, seed: u64) -> Mapped {
    let mut filter = started(seed);
    drive(&mut filter, robot, 100);
    if !robot.is_all_mapped_by(&*filter) {
        (0..40).find(|_| {
            drive(&mut filter, robot, 10);
            robot.is_all_mapped_by(&*filter)
        });
    }
    assert!(robot.is_all_mapped_by(&*filter), "seed {seed}: mapped in the end");
    let path = filter.path().map(u8::from).collect();
    (filter, path)
}

/// Forces a mistake and returns, for each seed, the number of places until the map is exact again.
fn places_until_right_again(
    environment: &Environment,
    hints: Hints,
    refine: usize,
    mistake: impl Fn(&Robot, &[u8]) -> Vec<u8>,
) -> Vec<usize> {
    let recover = |seed: u64| {
        let mut robot = Robot::new(environment, hints, seed);
        let (mut filter, path) = mapped(&mut robot, seed);
        let wrong: Vec<_> = mistake(&robot, &path).into_iter().map(|at| vertex(at.into())).collect();
        filter.assume_path(&wrong).expect("the mistake is a path");
        assert!(!robot.is_all_mapped_by(&*filter), "seed {seed}: the mistake was made");
        until_exact(&mut filter, &mut robot, (200, refine)).unwrap_or(usize::MAX)
    };
    (0..12).map(recover).collect()
}

/// The vertex of a path that stands for a place.
fn vertex_of(robot: &Robot, path: &[u8], place: usize) -> u8 {
    (0..16).find(|&vertex| robot.place_of(path, vertex) == Some(place)).expect("every place has a vertex")
}

/// Numbers the vertices without gaps.
fn closed(path: Vec<u8>) -> Vec<u8> {
    let mut used = path.clone();
    used.sort_unstable();
    used.dedup();
    path.iter().map(|vertex| used.iter().position(|held| held == vertex).unwrap() as u8).collect()
}

fn is_soon(places: &[usize], within: usize) {
    println!("places until right again: {places:?}");
    assert!(places.iter().all(|&places| places <= within), "{places:?}");
}

#[test]
fn a_split_place_is_merged_within_10_places() {
    let split = |robot: &Robot, path: &[u8]| {
        let mut visits = 0;
        let vertex = vertex_of(robot, path, 1);
        let fresh = path.iter().max().unwrap() + 1;
        let alternate = |&at: &u8| {
            visits += usize::from(at == vertex);
            if at == vertex && visits % 2 == 0 { fresh } else { at }
        };
        path.iter().map(alternate).collect()
    };
    is_soon(&places_until_right_again(&six_rooms(), Hints::default(), REFINEMENTS, split), 10);
}

#[test]
fn two_merged_places_that_look_alike_are_split_within_20_places() {
    let merge = |robot: &Robot, path: &[u8]| {
        let [kept, gone] = [0, 3].map(|place| vertex_of(robot, path, place));
        closed(path.iter().map(|&at| if at == gone { kept } else { at }).collect())
    };
    is_soon(&places_until_right_again(&six_rooms(), Hints::default(), REFINEMENTS, merge), 20);
}

#[test]
fn a_part_that_was_folded_onto_another_is_unfolded_within_10_places() {
    let fold = |robot: &Robot, path: &[u8]| {
        let pairs =
            [(0, 4), (1, 5), (2, 6)].map(|(kept, gone)| [kept, gone].map(|place| vertex_of(robot, path, place)));
        let folded = |&at: &u8| pairs.iter().find(|[_, gone]| *gone == at).map_or(at, |[kept, _]| *kept);
        closed(path.iter().map(folded).collect())
    };
    is_soon(&places_until_right_again(&ring_with_a_repeated_part(), TURNS, 16, fold), 10);
}
