//! Requests and replies: every command with its outcome, snapshots in chunks, and lines that lose requests or replies.

use super::console::{Damage, Direction, FakeLine, FakeRobot, TURNS};
use super::robot::Random;
use super::samples::{largest_requests, requests};
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;
use toposlam::wire::{CHUNK_BYTES, Command, Message, Refusal, ResetCause, Setting, Version};
use toposlam_link::client::{Client, ClientError};
use toposlam_link::listener::{Event, Listener};

type FakeClient = Client<FakeLine, fn(&Listener, Event<'_>)>;

/// A client of a fake robot over a line with this damage.
fn client(damage: Damage) -> (FakeClient, Rc<RefCell<FakeRobot>>) {
    let line = FakeLine::new(damage);
    let robot = line.robot();
    let mut client: FakeClient = Client::new(line, 65_530, |_, _| {});
    client.timeout = Duration::from_secs(5);
    (client, robot)
}

fn good_line() -> Damage {
    Box::new(|_, bytes| bytes)
}

#[test]
fn every_command_is_executed_unchanged_and_its_outcome_is_returned() {
    let (mut client, robot) = client(good_line());
    for sent in [requests(), largest_requests()].concat() {
        let outcome = client.request(sent.command).unwrap();
        let robot = robot.borrow();
        assert_eq!(robot.executed.last(), Some(&sent.command));
        let mut replies = robot.said.iter().filter_map(|said| match said {
            Message::Reply(reply) => Some(reply.outcome),
            _ => None,
        });
        assert_eq!(replies.next_back(), Some(outcome));
    }
    assert_eq!(robot.borrow().executed.len(), 2 * requests().len(), "each command is executed once");
}

#[test]
fn the_info_reply_reflects_the_state_set_by_commands() {
    let (mut client, robot) = client(good_line());
    client.order(Command::LocaliseOnly { on: true }).unwrap();
    client.order(Command::Pause { on: true }).unwrap();
    let info = client.info().unwrap();
    assert_eq!((info.paused, info.localise_only, info.goal), (true, true, None));
    assert_eq!((info.version, info.boot, info.reset_cause), (Version::LIBRARY, 17, ResetCause::BrownOut));
    client.order(Command::SetConfig(Setting::NoiseMm(77))).unwrap();
    assert_eq!(robot.borrow().settings.filter.noise_mm, 77);
    let refused = client.order(Command::SetConfig(Setting::NoiseMm(0)));
    assert!(matches!(refused, Err(ClientError::Refused(Refusal::OutOfRange))), "{refused:?}");
    assert_eq!(robot.borrow().settings.filter.noise_mm, 77);
}

#[test]
fn a_map_request_sends_the_whole_map() {
    let (mut client, robot) = client(good_line());
    for _ in 0..TURNS {
        robot.borrow_mut().turn(&[]);
    }
    let vertices = robot.borrow().mapper.map().vertices().len();
    assert!(vertices > 4, "{vertices} vertices");
    let turns = robot.borrow().said.len();
    let replica = client.map().unwrap();
    let robot = robot.borrow();
    assert!(replica.edges().eq(robot.mapper.map().edges().map(|(a, b)| (a.into(), b.into()))));
    assert_eq!(usize::from(replica.vertices()), robot.mapper.map().vertices().len());
    assert!(robot.said.len() - turns < vertices + 20, "only the map was sent");
    assert!(replica.hello().is_some());
}

#[test]
fn a_reset_removes_every_vertex_of_the_replica() {
    let (mut client, robot) = client(good_line());
    for _ in 0..TURNS {
        robot.borrow_mut().turn(&[]);
    }
    client.map().unwrap();
    assert!(client.listener().replica().vertices() > 4 && client.listener().replica().location().is_some());
    client.order(Command::Reset).unwrap();
    client.info().unwrap();
    assert_eq!((client.listener().replica().vertices(), client.listener().replica().location()), (0, None));
    assert_eq!(usize::from(client.map().unwrap().vertices()), robot.borrow().mapper.map().vertices().len());
}

#[test]
fn snapshots_are_transferred_unchanged_in_both_directions() {
    let (mut client, robot) = client(good_line());
    assert_eq!(client.snapshot().unwrap(), [1; 150]);
    assert_eq!(client.snapshot().unwrap(), [2; 150], "each request takes a new snapshot");
    for length in [1, CHUNK_BYTES - 1, CHUNK_BYTES, CHUNK_BYTES + 1, 300] {
        let snapshot: Vec<u8> = (0..length).map(|byte| byte as u8).collect();
        client.restore(&snapshot).unwrap();
        assert_eq!(robot.borrow().restored, snapshot);
    }
    for (bad, refusal) in [(&[0; 301][..], Refusal::TooLong), (&[], Refusal::BadSnapshot)] {
        let refused = client.restore(bad);
        assert!(matches!(refused, Err(ClientError::Refused(why)) if why == refusal), "{refused:?}");
        assert_eq!(robot.borrow().restored.len(), 300, "a refused snapshot changes nothing");
    }
}

#[test]
fn retries_recover_lost_requests_and_replies_and_each_command_is_executed_once() {
    for lost in [Direction::ToRobot, Direction::FromRobot] {
        let mut random = Random(7);
        let (mut client, robot) =
            client(Box::new(
                move |direction, bytes| {
                    if direction == lost && random.happens(50) { Vec::new() } else { bytes }
                },
            ));
        client.timeout = Duration::from_millis(20);
        client.attempts = 100;
        let snapshot: Vec<u8> = (0..=255).collect();
        client.restore(&snapshot).unwrap();
        assert_eq!(robot.borrow().restored, snapshot);
        assert_eq!(client.snapshot().unwrap(), [1; 150], "repeated requests take one snapshot");
        assert_eq!(robot.borrow().executed.len(), 1 + 4 + 1 + 3, "{lost:?}");
        client.order(Command::Pause { on: true }).unwrap();
        client.order(Command::Pause { on: true }).unwrap();
        assert_eq!(robot.borrow().executed.len(), 11, "the same command with another id is another request");
    }
}

#[test]
fn a_silent_robot_is_an_error() {
    let (mut client, _) = client(Box::new(|direction, bytes| match direction {
        Direction::ToRobot => bytes,
        Direction::FromRobot => Vec::new(),
    }));
    client.timeout = Duration::from_millis(2);
    assert!(matches!(client.info(), Err(ClientError::NoReply { attempts: 5 })));
}
