//! Convergence of listeners that join late, lose frames or receive them twice.

use super::listener::{Listener, robot, same};
use super::robot::{Random, Robot, TICKS_PER_HELLO};
use super::{frame, vertex};
use toposlam::wire::{Belief, Evidence, Exploration, Location, Message, QueueFull, Worst, map_digest};
use toposlam::{DartMap, FaultCounters, FaultKind, Fingerprint, Update, VertexId};

const V: usize = 16;

#[test]
fn a_listener_from_the_start_is_converged_after_every_place() {
    for has_ways in [false, true] {
        let mut random = Random(1);
        let mut robot = robot(has_ways);
        let mut listener = Listener::<64>::new();
        for step in 0..2000 {
            robot.change(&mut random);
            for frame in robot.place(&mut random) {
                listener.decode(&frame);
            }
            // A row with many changes is sent whole, so no change waits for the repeated map.
            assert!(listener.replica.is_converged(), "place {step}");
            assert!(same(&listener.replica, &robot.filter), "place {step}");
            assert_eq!(
                listener.replica.location(),
                Some(Location::from(&Update { place_index: step, ..robot.update() }))
            );
            assert_eq!(listener.replica.evidence().map(|evidence| evidence.place_index), Some(step));
            assert_eq!(listener.replica.belief(), Some(Belief::of(&robot.filter, step)));
            assert_eq!(listener.replica.worst(), Some(Worst::of(&robot.filter, step)));
        }
    }
}

#[test]
fn an_unchanged_map_is_not_resent_at_a_place() {
    for has_ways in [false, true] {
        let mut random = Random(2);
        let mut robot = robot(has_ways);
        robot.change_hypothesis(&mut random);
        robot.place(&mut random);
        assert_eq!(robot.place(&mut random).len(), 4, "location, belief, evidence and the worst n-gram");
    }
}

#[test]
fn a_new_vertex_and_its_edge_are_sent_as_events() {
    let mut robot = Robot::<V>::new(1);
    robot.filter.map.add_vertex(Fingerprint::ZERO).expect("there is room");
    robot.place(&mut Random(3));
    robot.filter.map.add_vertex(Fingerprint::MAX).expect("there is room");
    robot.filter.map.add_edge(vertex(0), vertex(1));
    robot.filter.location = vertex(1);
    let mut sent = Vec::new();
    robot.reporter.update(&robot.filter, &robot.update(), |message| {
        sent.push(*message);
        Ok(())
    });
    let update = robot.update();
    let expected = [
        Message::Vertex { vertex: 1, radius_mm: Fingerprint::MAX.radius_mm(), visits: 1 },
        Message::Edge { a: 0, b: 1, present: true },
        Message::Map { vertices: 2, edges: 1, digest: map_digest(&robot.filter.map, None) },
        Message::Location(Location::from(&update)),
        Message::Belief(Belief::of(&robot.filter, update.place_index)),
        Message::Evidence(Evidence::from(&update)),
        Message::Worst(Worst::of(&robot.filter, update.place_index)),
    ];
    assert_eq!(sent, expected);
}

#[test]
fn a_late_listener_converges_after_one_round_of_the_repeated_map() {
    for has_ways in [false, true] {
        let mut random = Random(4);
        for joined_at in 0..100 {
            let mut robot = robot(has_ways);
            for _ in 0..40 {
                robot.drive(&mut random);
                robot.place(&mut random);
            }
            robot.faults.record(FaultKind::BusError);
            for _ in 0..joined_at {
                robot.tick(&mut random);
            }
            let mut listener = Listener::<V>::new();
            for _ in 0..robot.round() {
                assert!(!listener.replica.is_converged() || same(&listener.replica, &robot.filter));
                for frame in robot.tick(&mut random) {
                    listener.decode(&frame);
                }
            }
            assert!(listener.replica.is_converged() && same(&listener.replica, &robot.filter), "joined at {joined_at}");
            assert_eq!(listener.replica.location().map(|location| location.vertex), Some(robot.filter.location.into()));
            assert_eq!(listener.replica.belief(), Some(Belief::of(&robot.filter, robot.place_index - 1)));
            assert_eq!(listener.replica.fault(FaultKind::BusError), 1);
            for _ in 0..TICKS_PER_HELLO {
                for frame in robot.tick(&mut random) {
                    listener.decode(&frame);
                }
            }
            assert!(listener.replica.hello().is_some_and(|hello| hello.check().is_ok()));
        }
    }
}

/// Every other robot knows the ways.
const fn has_ways(seed: u64) -> bool {
    seed.is_multiple_of(2)
}

/// A round with ways has twice as many ticks, in each of which a frame may be lost.
const fn least_share(seed: u64) -> usize {
    if has_ways(seed) { 5 } else { 10 }
}

/// Runs a robot over a bad line and asserts that a converged replica equals the robot's map. Returns the percentage of
/// ticks after which the replica was converged.
fn assert_converged_is_correct(
    seed: u64,
    refused_percent: usize,
    mut line: impl FnMut(&mut Random, Vec<u8>) -> Vec<u8>,
) -> usize {
    let mut random = Random(seed);
    let mut robot = robot(has_ways(seed));
    robot.refused_percent = refused_percent;
    let mut listener = Listener::<V>::new();
    let (mut ticks, mut converged) = (0, 0);
    for _ in 0..200 {
        robot.change(&mut random);
        let mut frames = robot.place(&mut random);
        // The last frame of an update is never lost, so that the listener detects the gaps before it.
        let update = robot.update();
        frames.push(frame(&mut robot.encoder, &Message::Evidence(Evidence::from(&update))));
        let (closing, open) = frames.split_last().expect("an update has a frame");
        for frame in open {
            listener.decode(&line(&mut random, frame.clone()));
        }
        listener.decode(&[0]);
        listener.decode(closing);
        assert!(!listener.replica.is_converged() || same(&listener.replica, &robot.filter), "seed {seed}");
        for _ in 0..if robot.filter.darts.is_some() { 60 } else { 30 } {
            for frame in robot.tick(&mut random) {
                listener.decode(&line(&mut random, frame));
                assert!(!listener.replica.is_converged() || same(&listener.replica, &robot.filter), "seed {seed}");
            }
            ticks += 1;
            converged += usize::from(listener.replica.is_converged());
        }
    }
    robot.refused_percent = 0;
    listener.decode(&[0]);
    for _ in 0..robot.round() {
        for frame in robot.tick(&mut random) {
            listener.decode(&frame);
        }
    }
    assert!(
        listener.replica.is_converged() && same(&listener.replica, &robot.filter),
        "the replica converges over a good line"
    );
    100 * converged / ticks
}

#[test]
fn lost_frames_delay_convergence_without_false_positives() {
    for seed in 0..20 {
        let share =
            assert_converged_is_correct(seed, 0, |random, frame| if random.happens(30) { vec![] } else { frame });
        assert!(share > least_share(seed), "converged after {share} % of the ticks");
    }
}

#[test]
fn damaged_and_repeated_frames_delay_convergence_without_false_positives() {
    for seed in 20..40 {
        let share = assert_converged_is_correct(seed, 0, |random, mut frame| match random.below(10) {
            0 => {
                let place = random.below(frame.len());
                frame[place] ^= 1 << random.below(8);
                frame
            }
            1 => frame.repeat(2),
            2 => frame.split_off(random.below(frame.len())),
            _ => frame,
        });
        assert!(share > least_share(seed), "converged after {share} % of the ticks");
    }
}

#[test]
fn a_full_transmit_queue_delays_convergence_without_false_positives() {
    for seed in 40..60 {
        let share = assert_converged_is_correct(seed, 30, |_, frame| frame);
        assert!(share > least_share(seed), "converged after {share} % of the ticks");
    }
}

#[test]
fn reordered_frames_are_ignored_and_the_replica_converges() {
    for has_ways in [false, true] {
        let mut random = Random(60);
        let mut robot = robot(has_ways);
        let mut listener = Listener::<V>::new();
        for _ in 0..200 {
            robot.change(&mut random);
            let mut frames = robot.place(&mut random);
            for _ in 0..frames.len() / 4 {
                let first = random.below(frames.len() - 1);
                frames.swap(first, first + 1);
            }
            frames.iter().for_each(|frame| listener.decode(frame));
            for _ in 0..robot.round() {
                robot.tick(&mut random).iter().for_each(|frame| listener.decode(frame));
            }
            assert!(listener.replica.is_converged() && same(&listener.replica, &robot.filter));
        }
    }
}

#[test]
fn a_restarted_robot_clears_the_replica() {
    let mut random = Random(61);
    let mut listener = Listener::<V>::new();
    let mut robot = Robot::<V>::new(1);
    robot.change_hypothesis(&mut random);
    robot.tick(&mut random).iter().for_each(|frame| listener.decode(frame));
    robot.place(&mut random).iter().for_each(|frame| listener.decode(frame));
    assert!(listener.replica.is_converged());
    let mut robot = Robot::<V>::new(2);
    robot.tick(&mut random).iter().for_each(|frame| listener.decode(frame));
    assert_eq!((listener.replica.vertices(), listener.replica.location()), (0, None));
    assert!(listener.replica.is_converged());
}

#[test]
fn a_map_of_64_vertices_converges() {
    let mut random = Random(62);
    let mut robot = Robot::<64>::new(1);
    while robot.filter.map.vertices().len() < 64 {
        robot.drive(&mut random);
    }
    let all = || VertexId::first(64);
    for (a, b) in all().flat_map(|a| all().map(move |b| (a, b))) {
        robot.filter.map.add_edge(a, b);
    }
    let mut listener = Listener::<64>::new();
    robot.place(&mut random).iter().for_each(|frame| listener.decode(frame));
    assert!(listener.replica.is_converged() && same(&listener.replica, &robot.filter));
}

#[test]
fn a_map_of_64_vertices_with_ways_converges() {
    let mut random = Random(63);
    let mut robot = Robot::<64>::new(1).with_ways();
    while robot.filter.map.vertices().len() < 64 {
        robot.drive(&mut random);
    }
    let mut listener = Listener::<64>::new();
    robot.place(&mut random).iter().for_each(|frame| listener.decode(frame));
    assert!(listener.replica.is_converged() && same(&listener.replica, &robot.filter));
    let mut late = Listener::<64>::new();
    for _ in 0..robot.round() {
        robot.tick(&mut random).iter().for_each(|frame| late.decode(frame));
    }
    assert!(late.replica.is_converged() && same(&late.replica, &robot.filter));
}

#[test]
fn only_the_ways_that_have_changed_are_sent() {
    let mut robot = robot(true);
    let mut random = Random(6);
    while robot.filter.map.vertices().len() < 10 {
        robot.drive(&mut random);
    }
    let darts = robot.filter.darts.as_mut().expect("a robot with ways");
    *darts = DartMap::EMPTY;
    (0..10).for_each(|_| assert!(darts.add_vertex().is_some()));
    let [a, b] = [2, 7].map(|vertex| darts.add_way(vertex, 0).expect("there is room"));
    robot.place(&mut random);
    robot.filter.darts.as_mut().expect("a robot with ways").join(a, b);
    let mut vertices = Vec::new();
    let update = robot.update();
    robot.reporter.update(&robot.filter, &update, |message| {
        if let Message::Ways(ways) = message {
            vertices.push(ways.vertex);
        }
        Ok(())
    });
    assert_eq!(vertices, [2, 7]);
}

#[test]
fn the_exploration_is_sent_when_it_changes_and_in_turn() {
    let mut robot = robot(true);
    let mut random = Random(8);
    robot.drive(&mut random);
    let darts = robot.filter.darts.as_mut().expect("a robot with ways");
    *darts = DartMap::EMPTY;
    darts.add_vertex().expect("there is room");
    let [a, b] = [0, 9].map(|bearing| darts.add_way(0, bearing).expect("there is room"));
    let mut listener = Listener::<V>::new();
    let mut tick = |robot: &mut Robot<V>, listener: &mut Listener<V>| {
        robot.tick(&mut random).iter().for_each(|frame| listener.decode(frame));
        listener.replica.exploration()
    };
    let open = Some(Exploration { frontiers: 2, complete: false });
    assert_eq!(tick(&mut robot, &mut listener), open);
    robot.filter.darts.as_mut().expect("a robot with ways").join(a, b);
    robot.reporter.set_complete(true);
    let closed = Some(Exploration { frontiers: 0, complete: true });
    assert_eq!(tick(&mut robot, &mut listener), closed);
    let mut late = Listener::<V>::new();
    for _ in 0..robot.round() {
        tick(&mut robot, &mut late);
    }
    assert_eq!(late.replica.exploration(), closed);
}

#[test]
fn a_full_send_takes_a_quarter_of_the_ticks_and_then_the_usual_pace_resumes() {
    let mut random = Random(11);
    let mut robot = Robot::<V>::new(1);
    while robot.filter.map.vertices().len() < 14 {
        robot.drive(&mut random);
        robot.place(&mut random);
    }
    robot.tick(&mut random);
    let usual = robot.tick(&mut random).len();
    robot.reporter.send_full();
    let lengths: Vec<usize> = (0..7).map(|_| robot.tick(&mut random).len()).collect();
    assert_eq!(usual, 1);
    // A `Hello`, 14 rows, the size, the location, the belief, no exploration and no fault.
    assert_eq!(lengths, [5, 4, 4, 4, 1, 1, 1]);
    // A full queue delays the rest of the round.
    robot.reporter.send_full();
    let mut sent = 0;
    let mut calls = 0;
    while sent < 18 {
        robot.reporter.tick(&robot.filter, &FaultCounters::new(), |message| {
            calls += 1;
            let is_taken = calls % 3 == 0;
            sent += usize::from(is_taken && !matches!(message, Message::Hello(_)));
            if is_taken { Ok(()) } else { Err(QueueFull) }
        });
        assert!(calls < 100);
    }
}
