//! Vertex ids that change: a merge, a repair and a new order of the vertices.

use super::listener::{Listener, robot, same};
use super::robot::{Random, Robot};
use super::{frame, vertex};
use toposlam::wire::{List, Message, Remapped, VertexProbability};
use toposlam::{DartMap, Fingerprint, VertexId, WorstNgram};

const V: usize = 16;

/// A chain of vertices with these labels, sent to a listener.
fn chain(labels: &[u16]) -> (Robot<V>, Listener<V>) {
    let mut robot = Robot::<V>::new(1);
    let mut before = None;
    for &steps in labels {
        let label = Fingerprint::from_steps(steps).expect("in range");
        let vertex = robot.filter.map.add_vertex(label).expect("there is room");
        if let Some(before) = before.replace(vertex) {
            robot.filter.map.add_edge(before, vertex);
        }
    }
    let mut listener = Listener::new();
    robot.place(&mut Random(0)).iter().for_each(|frame| listener.decode(frame));
    (robot, listener)
}

#[test]
fn a_merge_sends_one_remapping_and_the_changed_vertices() {
    let (mut robot, mut listener) = chain(&[100, 200, 300, 400]);
    // Vertices 3 and 1 are merged; 0 and 2 swap ids. The chain 0-1-2-3 becomes a star around 1.
    robot.filter.names = [2, 1, 0, 1].map(|now| Some(vertex(now))).to_vec();
    robot.filter.map.clear();
    for steps in [300, 200, 100] {
        robot.filter.map.add_vertex(Fingerprint::from_steps(steps).expect("in range")).expect("there is room");
    }
    robot.filter.map.observe(vertex(1), Fingerprint::from_steps(400).expect("in range"));
    robot.filter.map.add_edge(vertex(0), vertex(1));
    robot.filter.map.add_edge(vertex(1), vertex(2));
    let mut sent = Vec::new();
    let update = robot.update();
    robot.reporter.update(&robot.filter, &update, |message| {
        sent.push(*message);
        listener.decode(&frame(&mut robot.encoder, message));
        Ok(())
    });
    let Message::Remapped(renamed) = sent[0] else { panic!("{sent:?}") };
    assert_eq!(renamed.vertices.as_slice(), [2, 1, 0, 1]);
    assert_eq!(sent[1], Message::Vertex { vertex: 1, radius_mm: 600, visits: 2 });
    assert!(matches!(sent[2], Message::Map { vertices: 3, edges: 2, .. }), "{sent:?}");
    assert!(listener.replica.is_converged() && same(&listener.replica, &robot.filter));
}

#[test]
fn all_state_of_a_vertex_follows_its_new_id() {
    let (mut robot, mut listener) = chain(&[100, 200, 300, 400]);
    robot.filter.location = vertex(2);
    robot.filter.worst =
        WorstNgram { distance_mm: 50, length: 3, newest_age: 1, vertices: [3, 2, 1, 0, 0, 0, 0].map(vertex) };
    robot.place(&mut Random(0)).iter().for_each(|frame| listener.decode(frame));
    let rename = |listener: &mut Listener<V>, robot: &mut Robot<V>, names: &[u8]| {
        let renamed = Remapped { place_index: 2, vertices: List::new(names.iter().copied()) };
        listener.decode(&frame(&mut robot.encoder, &Message::Remapped(renamed)));
    };
    let likely = |listener: &Listener<V>| -> Vec<(u8, u16)> {
        let belief = listener.replica.belief().expect("a belief was sent");
        belief.vertices.as_slice().iter().map(|&VertexProbability { vertex, permille }| (vertex, permille)).collect()
    };
    assert_eq!(likely(&listener), [(2, 667), (1, 167), (3, 167)]);
    // 1 and 3 are merged and have id 0; 0 has id 1.
    rename(&mut listener, &mut robot, &[1, 0, 2, 0]);
    assert_eq!(listener.replica.location().map(|location| location.vertex), Some(2));
    assert_eq!(likely(&listener), [(2, 667), (0, 334)]);
    assert_eq!(listener.replica.worst().map(|worst| worst.vertices), Some(List::new([0, 2, 0])));
    assert_eq!(listener.replica.edges().collect::<Vec<_>>(), [(0, 1), (0, 2)]);
    assert_eq!(listener.replica.row(0).map(|row| row.radius_mm), Some(400));
    assert_eq!(listener.replica.vertices(), 3);
    assert!(!listener.replica.is_converged());
    // The vertex of the location was removed, and so was all that refers to it.
    rename(&mut listener, &mut robot, &[0, 1, 255]);
    assert_eq!((listener.replica.location(), listener.replica.worst()), (None, None));
    assert_eq!(likely(&listener), [(0, 334)]);
    assert_eq!(listener.replica.vertices(), 2);
}

#[test]
fn a_lost_remapping_is_repaired_by_one_round_of_the_repeated_map() {
    for has_ways in [false, true] {
        let mut random = Random(5);
        for _ in 0..200 {
            let mut robot = robot(has_ways);
            let mut listener = Listener::<V>::new();
            for _ in 0..40 {
                robot.drive(&mut random);
                robot.place(&mut random).iter().for_each(|frame| listener.decode(frame));
            }
            robot.repair(&mut random);
            // The first frame is the `Remapped`.
            robot.place(&mut random).iter().skip(1).for_each(|frame| listener.decode(frame));
            for _ in 0..robot.round() {
                robot.tick(&mut random).iter().for_each(|frame| listener.decode(frame));
            }
            assert!(listener.replica.is_converged() && same(&listener.replica, &robot.filter));
        }
    }
}

#[test]
fn ways_follow_new_vertex_ids_without_a_message_of_their_own() {
    let mut robot = robot(true);
    let mut random = Random(7);
    let mut listener = Listener::<V>::new();
    while robot.filter.map.vertices().len() < 10 {
        robot.drive(&mut random);
    }
    // Edges without travel times.
    let darts = robot.filter.darts.as_mut().expect("a robot with ways");
    for (a, b) in darts.edges().collect::<Vec<_>>() {
        darts.part(a);
        darts.join(a, b);
    }
    robot.place(&mut random).iter().for_each(|frame| listener.decode(frame));
    let (map, darts) = (robot.filter.map, robot.filter.darts.clone().expect("a robot with ways"));
    // The same map with all vertices in reverse order.
    let reversed = |id: VertexId| vertex(9 - id.index());
    robot.filter.names = map.vertices().map(reversed).map(Some).collect();
    robot.filter.map.clear();
    for vertex in map.vertices().rev() {
        let label = map.label(vertex).expect("a label");
        let now = robot.filter.map.add_vertex(label).expect("there is room");
        (1..map.visits(vertex)).for_each(|_| robot.filter.map.observe(now, label));
    }
    map.edges().for_each(|(a, b)| robot.filter.map.add_edge(reversed(a), reversed(b)));
    let now = robot.filter.darts.insert(DartMap::EMPTY);
    (0..10).for_each(|_| assert!(now.add_vertex().is_some()));
    let renumbered: Vec<u8> = (0..darts.darts())
        .map(|dart| now.add_way(9 - darts.vertex(dart), darts.bearing(dart)).expect("there is room"))
        .collect();
    for (a, b) in darts.edges() {
        now.join(renumbered[usize::from(a)], renumbered[usize::from(b)]);
    }
    let update = robot.update();
    let mut sent = Vec::new();
    robot.reporter.update(&robot.filter, &update, |message| {
        sent.push(*message);
        listener.decode(&frame(&mut robot.encoder, message));
        Ok(())
    });
    assert!(listener.replica.is_converged() && same(&listener.replica, &robot.filter));
    assert!(matches!(sent[0], Message::Remapped(_)), "{sent:?}");
    assert!(!sent.iter().any(|message| matches!(message, Message::Ways(_))), "{sent:?}");
}
