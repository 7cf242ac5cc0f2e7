//! The robot's inbox: requests truncated and corrupted at every byte, and floods that must not affect the mapping.

use super::console::{FakeRobot, TURNS};
use super::damage::with_crc;
use super::frame;
use super::robot::Random;
use super::samples::{largest, largest_requests, requests, typical};
use proptest::prelude::*;
use toposlam::wire::{Command, Encoder, Inbox, Message, Outcome, Payload, Refusal, Reply, Request, map_digest};
use toposlam::{FaultKind, Filter};

/// The bytes of a line of 115,200 baud per ring frame of 130 ms.
const LINE_BYTES_PER_TURN: usize = 1500;

/// The commands that an inbox executes, with one turn after each zero byte.
fn executed(inbox: &mut Inbox, bytes: &[u8]) -> Vec<Command> {
    let mut executed = Vec::new();
    for &byte in bytes {
        inbox.take(byte);
        if byte == 0 {
            inbox.turn(|command| {
                executed.push(*command);
                Outcome::Done
            });
        }
    }
    executed
}

const AFTER: Request = Request { id: 9, command: Command::Pause { on: false } };

#[test]
fn a_truncated_request_is_not_executed_and_the_next_one_is() {
    for request in [requests(), largest_requests()].concat() {
        let whole = frame(&mut Encoder::new(0), &request);
        let after = frame(&mut Encoder::new(1), &AFTER);
        for length in 0..whole.len() - 1 {
            for cut in [&whole[..length], &whole[whole.len() - 1 - length..]] {
                let mut inbox = Inbox::new();
                // A client sends a zero before each frame.
                let bytes = [cut, &[0], &after].concat();
                assert_eq!(executed(&mut inbox, &bytes), [AFTER.command], "{request:?} cut to {length}");
                assert_eq!(inbox.faults().count(FaultKind::WireCorrupt), u32::from(!cut.iter().all(|&byte| byte == 0)));
            }
        }
    }
}

#[test]
fn a_corrupt_request_is_not_executed_and_the_next_one_is() {
    for request in [requests(), largest_requests()].concat() {
        let whole = frame(&mut Encoder::new(0), &request);
        let after = frame(&mut Encoder::new(1), &AFTER);
        for place in 0..whole.len() {
            for flip in 1..=255 {
                let mut damaged = whole.clone();
                damaged[place] ^= flip;
                let commands = executed(&mut Inbox::new(), &[&damaged[..], &[0], &after].concat());
                // Without its closing zero, the frame ends at the zero of the next one, with one byte too many.
                assert_eq!(commands, [AFTER.command], "{request:?}, byte {place} ^ {flip}");
            }
        }
    }
}

#[test]
fn echoed_robot_messages_are_not_commands() {
    let mut inbox = Inbox::new();
    let messages = [typical(), largest()].concat();
    for (number, message) in (1..).zip(&messages) {
        assert_eq!(executed(&mut inbox, &frame(&mut Encoder::new(0), message)), []);
        assert_eq!(inbox.faults().count(FaultKind::WireCorrupt), number);
    }
}

proptest! {
    #[test]
    fn an_intact_frame_of_any_payload_is_one_request_or_one_fault(payload in proptest::collection::vec(any::<u8>(), 0..103)) {
        let mut inbox = Inbox::new();
        let executed = executed(&mut inbox, &with_crc(&[&[Request::VERSION, 0, 0], &payload[..]].concat()));
        prop_assert_eq!(executed.len() as u32 + inbox.faults().count(FaultKind::WireCorrupt), 1);
    }
}

#[test]
fn a_turn_decodes_a_bounded_number_of_bytes_and_executes_one_request() {
    let mut inbox = Inbox::new();
    let mut encoder = Encoder::new(0);
    let flood: Vec<u8> =
        (0..2000).flat_map(|id| frame(&mut encoder, &Request { id, command: Command::Explore })).collect();
    let per_frame = flood.len() / 2000;
    for turn in 1..=3 {
        flood.iter().for_each(|&byte| inbox.take(byte));
        let mut executions = 0;
        let reply = inbox.turn(|_| {
            executions += 1;
            Outcome::Done
        });
        assert!(executions <= 1 && reply.is_some());
        let looked_at = usize::from(Inbox::BYTES_PER_TURN) / per_frame + 1;
        let faults = inbox.faults().count(FaultKind::CommandFlood) + inbox.faults().count(FaultKind::WireCorrupt);
        assert!(faults as usize <= turn * (looked_at + 1), "{faults} faults: the rest was dropped undecoded");
        assert!(inbox.faults().count(FaultKind::CommandFlood) > 0);
    }
    assert_eq!(inbox.turn(|_| unreachable!("no request waits")), None);
    assert_eq!(executed(&mut inbox, &[&[0][..], &frame(&mut encoder, &AFTER)].concat()), [AFTER.command]);
}

#[test]
fn a_second_request_in_a_turn_is_dropped_and_a_repeated_one_is_not() {
    let mut inbox = Inbox::new();
    let first = Request { id: 1, command: Command::Info };
    for request in [first, first, Request { id: 2, command: Command::Info }] {
        frame(&mut Encoder::new(0), &request).iter().for_each(|&byte| inbox.take(byte));
    }
    assert_eq!(inbox.faults().count(FaultKind::CommandFlood), 1);
    let reply = |inbox: &mut Inbox| inbox.turn(|_| Outcome::Refused(Refusal::Busy));
    let expected = Some(Reply { request: 1, outcome: Outcome::Refused(Refusal::Busy) });
    assert_eq!(reply(&mut inbox), expected);
    assert_eq!(reply(&mut inbox), None);
    frame(&mut Encoder::new(0), &first).iter().for_each(|&byte| inbox.take(byte));
    assert_eq!(
        inbox.turn(|_| unreachable!("a repeated request is not executed again")),
        expected,
        "a repeated request gets the same reply"
    );
    assert_eq!(inbox.faults().count(FaultKind::CommandRefused), 1, "the refusal is counted once");
    // The same id with another command is another request.
    frame(&mut Encoder::new(0), &Request { id: 1, ..AFTER }).iter().for_each(|&byte| inbox.take(byte));
    assert_eq!(inbox.turn(|_| Outcome::Done), Some(Reply { request: 1, outcome: Outcome::Done }));
}

/// The bytes of a flood in each turn.
type Flood = Box<dyn FnMut(usize) -> Vec<u8>>;

fn floods() -> Vec<(&'static str, FaultKind, Flood)> {
    fn repeated(bytes: Vec<u8>) -> Flood {
        Box::new(move |count| bytes.iter().copied().cycle().take(count).collect())
    }
    let mut random = Random(3);
    let noise: Flood = Box::new(move |count| (0..count).map(|_| random.bits() as u8).collect());
    let (mut id, mut encoder) = (0, Encoder::new(0));
    let mut flood_of = move |command: fn(u16) -> Command| -> Flood {
        let mut encoder = std::mem::take(&mut encoder);
        Box::new(move |count| {
            let mut bytes = Vec::new();
            while bytes.len() < count {
                id = u16::wrapping_add(id, 1);
                bytes.extend(frame(&mut encoder, &Request { id, command: command(id) }));
            }
            bytes
        })
    };
    let echo = typical().iter().flat_map(|message| frame(&mut Encoder::new(0), message)).collect();
    vec![
        ("noise", FaultKind::WireCorrupt, noise),
        ("shortest frames", FaultKind::WireCorrupt, repeated(vec![1, 0])),
        ("no zero", FaultKind::CommandFlood, repeated(vec![0xFF])),
        ("its own messages", FaultKind::WireCorrupt, repeated(echo)),
        ("valid requests", FaultKind::CommandFlood, flood_of(|_| Command::Info)),
        ("valid requests that are refused", FaultKind::CommandRefused, flood_of(|_| Command::GoTo { vertex: 255 })),
        ("snapshots", FaultKind::CommandFlood, flood_of(|_| Command::GetSnapshot { offset: 0 })),
    ]
}

/// The messages about the map and the places.
fn map_messages(said: &[Message]) -> Vec<Message> {
    said.iter().filter(|message| !matches!(message, Message::Fault { .. } | Message::Reply(_))).copied().collect()
}

#[test]
fn a_flood_at_the_full_line_rate_does_not_change_the_mapping() {
    let mut calm = FakeRobot::new();
    for _ in 0..TURNS {
        calm.turn(&[]);
    }
    let (mapping, said) = (calm.mapping(), map_messages(&calm.said));
    assert!(calm.mapper.map().vertices().len() > 4);
    for (what, kind, mut flood) in floods() {
        let mut robot = FakeRobot::new();
        for _ in 0..TURNS {
            robot.turn(&flood(LINE_BYTES_PER_TURN));
        }
        assert!(robot.inbox.faults().count(kind) > 0, "{what}: {:?}", robot.inbox.faults());
        assert!(robot.mapping() == mapping, "{what}");
        assert_eq!(
            map_digest(robot.mapper.map(), robot.mapper.filter().darts()),
            map_digest(calm.mapper.map(), calm.mapper.filter().darts()),
            "{what}"
        );
        assert!(map_messages(&robot.said) == said, "{what}");
        // The counts are sent, and the next request is answered.
        let expected = Message::Fault { kind: kind as u8, count: robot.inbox.faults().count(kind) };
        assert!(robot.said.iter().rev().take(40).any(|message| *message == expected), "{what}: the last count is sent");
        robot.turn(&[]);
        robot.turn(&[&[0][..], &frame(&mut Encoder::new(0), &AFTER)].concat());
        let answered = Message::Reply(Reply { request: AFTER.id, outcome: Outcome::Done });
        assert!(robot.said.contains(&answered), "{what}");
    }
}
