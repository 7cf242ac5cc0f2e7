//! The names of vertices, at the robot and at a listener.

use super::frame;
use super::listener::{Listener, robot};
use super::robot::{Random, Robot};
use toposlam::wire::{Message, Name, Names, Refusal};

const V: usize = 16;

fn name(text: &str) -> Name {
    Name::new(text).expect("a valid name")
}

/// Gives names, moves them and clears them, one in four times each.
fn rename(robot: &mut Robot<V>, random: &mut Random, number: usize) {
    let vertex = random.vertex(robot.filter.map.vertices().len()).into();
    let (given, known) = (name(&format!("place {number}")), robot.reporter.names().iter().next());
    match random.below(4) {
        0 => robot.reporter.set_name(vertex, given).expect("a new name"),
        1 => robot.reporter.set_name(vertex, Name::NONE).expect("clearing is always possible"),
        2 if known.is_some_and(|(other, _)| other != vertex) => {
            let (other, name) = known.expect("just seen");
            assert_eq!(robot.reporter.set_name(vertex, name), Err(Refusal::NameTaken));
            robot.reporter.set_name(other, Name::NONE).expect("clearing is always possible");
            robot.reporter.set_name(vertex, name).expect("nobody has it now");
        }
        _ => {}
    }
}

/// The names that a listener has at the end of a run over a line that loses this share of its frames, and those of the robot.
fn run(seed: u64, lost_percent: usize, refused_percent: usize) {
    let mut random = Random(seed);
    let mut robot = robot(seed.is_multiple_of(2));
    let mut listener = Listener::<V>::new();
    let mut had_names = 0;
    for number in 0..150 {
        robot.refused_percent = refused_percent;
        robot.change(&mut random);
        let mut frames = robot.place(&mut random);
        rename(&mut robot, &mut random, number);
        (0..random.below(40)).for_each(|_| frames.extend(robot.tick(&mut random)));
        frames.retain(|_| !random.happens(lost_percent));
        frames.iter().for_each(|frame| listener.decode(frame));
        // One round over a good line, and a tick for each change that is still to be sent.
        robot.refused_percent = 0;
        for _ in 0..robot.round() {
            robot.tick(&mut random).iter().for_each(|frame| listener.decode(frame));
        }
        let vertices = robot.filter.map.vertices().len();
        assert_eq!(listener.replica.names(), robot.reporter.names(), "seed {seed}, place {number}");
        assert!(robot.reporter.names().iter().all(|(vertex, _)| usize::from(vertex) < vertices));
        had_names += robot.reporter.names().iter().count();
    }
    assert!(had_names > 150, "{had_names} names in all");
}

#[test]
fn a_listener_has_the_names_of_the_robot_after_one_round_of_the_repeated_map() {
    (0..20).for_each(|seed| run(seed, 0, 0));
    (20..40).for_each(|seed| run(seed, 30, 0));
    (40..60).for_each(|seed| run(seed, 0, 30));
}

#[test]
fn a_name_is_sent_with_the_next_tick_and_a_robot_without_names_sends_no_message_about_them() {
    let (mut robot, mut random) = (robot(true), Random(3));
    (0..20).for_each(|_| robot.drive(&mut random));
    robot.place(&mut random);
    let about_names = |robot: &mut Robot<V>, ticks: usize| {
        let mut random = Random(0);
        let frames = (0..ticks).flat_map(|_| robot.tick(&mut random)).collect::<Vec<_>>().concat();
        let messages = super::decode(&frames).messages.into_iter().map(|(_, message)| message);
        messages.filter(|message| matches!(message, Message::Name { .. } | Message::Named { .. })).collect::<Vec<_>>()
    };
    let round = robot.round();
    assert_eq!(about_names(&mut robot, round), []);
    robot.reporter.set_name(1, name("hall")).unwrap();
    assert_eq!(about_names(&mut robot, 1)[0], Message::Name { vertex: 1, name: name("hall") });
    robot.reporter.set_name(1, Name::NONE).unwrap();
    assert_eq!(about_names(&mut robot, 1)[0], Message::Named { vertices: 0 });
}

/// A listener whose session ends keeps no name.
#[test]
fn names_end_with_the_session() {
    let mut listener = Listener::<V>::new();
    for boot in [1, 2] {
        let (mut robot, mut random) = (Robot::<V>::new(boot), Random(boot.into()));
        robot.drive(&mut random);
        robot.place(&mut random).iter().for_each(|frame| listener.decode(frame));
        let round = robot.round() + 1;
        (0..round).for_each(|_| robot.tick(&mut random).iter().for_each(|frame| listener.decode(frame)));
        assert_eq!(*listener.replica.names(), Names::new(), "start {boot}");
        listener.decode(&frame(&mut robot.encoder, &Message::Name { vertex: 0, name: name("hall") }));
        assert_eq!(listener.replica.names().find("hall"), Some(0));
    }
}
