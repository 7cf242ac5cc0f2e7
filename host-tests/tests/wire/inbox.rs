//! The robot's end of the line: requests that are cut and changed at every byte, and floods that must not touch the mapping.

use super::console::{FakeRobot, TURNS};
use super::damage::with_crc;
use super::frame;
use super::robot::Random;
use super::samples::{largest, largest_requests, requests, typical};
use proptest::prelude::*;
use toposlam::FaultKind;
use toposlam::wire::{Command, Encoder, Inbox, Message, Outcome, Payload, Refusal, Reply, Request, map_digest};

/// What a line of 115,200 baud brings in a ring frame of 130 ms.
const LINE_BYTES_PER_TURN: usize = 1500;

/// What an inbox executes of some bytes, one turn after each zero.
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
fn a_request_that_is_cut_anywhere_is_not_executed_and_the_next_one_is() {
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
fn a_request_with_any_byte_changed_is_not_executed_and_the_next_one_is() {
    for request in [requests(), largest_requests()].concat() {
        let whole = frame(&mut Encoder::new(0), &request);
        let after = frame(&mut Encoder::new(1), &AFTER);
        for place in 0..whole.len() {
            for flip in 1..=255 {
                let mut damaged = whole.clone();
                damaged[place] ^= flip;
                let heard = executed(&mut Inbox::new(), &[&damaged[..], &[0], &after].concat());
                // Without its closing zero the frame is closed by the next one, with a byte too many.
                assert_eq!(heard, [AFTER.command], "{request:?}, byte {place} ^ {flip}");
            }
        }
    }
}

#[test]
fn a_line_that_echoes_what_the_robot_says_gives_no_commands() {
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
fn a_turn_looks_at_a_bounded_number_of_bytes_and_executes_one_request() {
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
        assert!(faults as usize <= turn * (looked_at + 1), "{faults} faults: the rest was not looked at");
        assert!(inbox.faults().count(FaultKind::CommandFlood) > 0);
    }
    assert_eq!(inbox.turn(|_| unreachable!("nothing waits")), None);
    assert_eq!(executed(&mut inbox, &[&[0][..], &frame(&mut encoder, &AFTER)].concat()), [AFTER.command]);
}

#[test]
fn a_second_request_in_a_turn_is_dropped_and_the_same_one_again_is_not_a_second() {
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
    assert_eq!(inbox.turn(|_| unreachable!("it was executed")), expected, "the same reply again");
    assert_eq!(inbox.faults().count(FaultKind::CommandRefused), 1, "it was refused once");
    // The same number with another command is another request.
    frame(&mut Encoder::new(0), &Request { id: 1, ..AFTER }).iter().for_each(|&byte| inbox.take(byte));
    assert_eq!(inbox.turn(|_| Outcome::Done), Some(Reply { request: 1, outcome: Outcome::Done }));
}

/// What a flood brings in each turn.
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

/// What was said of the map and the places.
fn of_the_map(said: &[Message]) -> Vec<Message> {
    said.iter().filter(|message| !matches!(message, Message::Fault { .. } | Message::Reply(_))).copied().collect()
}

#[test]
fn a_flood_at_the_full_rate_of_the_line_leaves_the_mapping_bit_for_bit_as_it_is() {
    let mut calm = FakeRobot::new();
    for _ in 0..TURNS {
        calm.turn(&[]);
    }
    let (mapping, said) = (calm.mapping(), of_the_map(&calm.said));
    assert!(calm.mapper.map().vertices().len() > 4);
    for (what, kind, mut flood) in floods() {
        let mut robot = FakeRobot::new();
        for _ in 0..TURNS {
            robot.turn(&flood(LINE_BYTES_PER_TURN));
        }
        assert!(robot.inbox.faults().count(kind) > 0, "{what}: {:?}", robot.inbox.faults());
        assert!(robot.mapping() == mapping, "{what}");
        assert_eq!(map_digest(robot.mapper.map()), map_digest(calm.mapper.map()), "{what}");
        assert!(of_the_map(&robot.said) == said, "{what}");
        // The counts go out, and the next request is answered.
        let told = Message::Fault { kind: kind as u8, count: robot.inbox.faults().count(kind) };
        assert!(robot.said.iter().rev().take(40).any(|message| *message == told), "{what}: the last count is told");
        robot.turn(&[]);
        robot.turn(&[&[0][..], &frame(&mut Encoder::new(0), &AFTER)].concat());
        let answered = Message::Reply(Reply { request: AFTER.id, outcome: Outcome::Done });
        assert!(robot.said.contains(&answered), "{what}");
    }
}
