//! The serial protocol: frames, decoder, reporter and replica, and the specification in `docs/wire.md`.

mod commands;
mod console;
mod convergence;
mod damage;
mod golden;
mod inbox;
mod listener;
mod names;
mod remapping;
mod robot;
mod samples;
mod schema;
mod specification;
#[path = "../common/split_mix.rs"]
mod split_mix;
mod streams;

use samples::{largest, typical};
use toposlam::VertexId;
use toposlam::wire::{
    Arrival, Decoder, Echoes, Encoder, Header, Health, Hello, MAX_FRAME_BYTES, Message, PROTOCOL_VERSION, Payload,
    Progress, ResetCause, Velocity,
};

/// The vertex with an id.
fn vertex(number: usize) -> VertexId {
    VertexId::new(number as u8).expect("the tests use ids from 0 to 63")
}

/// The frame of a message or a request.
fn frame(encoder: &mut Encoder, message: &impl Payload) -> Vec<u8> {
    encoder.encode(message, &mut [0; MAX_FRAME_BYTES]).expect("every message fits the largest frame").to_vec()
}

/// The messages and errors of a decoder.
#[derive(Debug, Default, PartialEq)]
struct Decoded {
    messages: Vec<(Header, Message)>,
    errors: usize,
}

impl Decoded {
    fn decode(&mut self, decoder: &mut Decoder, mut bytes: &[u8]) {
        loop {
            match decoder.feed(bytes) {
                Progress::NeedsMore => return,
                Progress::Message { header, message, rest } => {
                    assert!(bytes.ends_with(rest), "the rest is the unread tail");
                    self.messages.push((header, message));
                    bytes = rest;
                }
                Progress::Error { rest, .. } => {
                    assert!(bytes.ends_with(rest), "the rest is the unread tail");
                    self.errors += 1;
                    bytes = rest;
                }
            }
        }
    }
}

fn decode(bytes: &[u8]) -> Decoded {
    let mut decoded = Decoded::default();
    decoded.decode(&mut Decoder::new(), bytes);
    decoded
}

#[test]
fn every_message_round_trips() {
    for message in typical().into_iter().chain(largest()) {
        let decoded = decode(&frame(&mut Encoder::new(300), &message));
        assert_eq!(decoded.messages, [(Header { sequence: 300, arrival: Arrival::First }, message)]);
        assert_eq!(decoded.errors, 0);
    }
}

#[test]
fn the_largest_message_fills_the_largest_frame_exactly() {
    let longest = largest().iter().map(|message| frame(&mut Encoder::new(0xFFFF), message).len()).max();
    assert_eq!(longest, Some(MAX_FRAME_BYTES));
}

#[test]
fn a_frame_holds_one_zero_and_it_is_the_last_byte() {
    for message in typical().into_iter().chain(largest()) {
        let frame = frame(&mut Encoder::new(0), &message);
        assert_eq!(frame.iter().position(|&byte| byte == 0), Some(frame.len() - 1));
    }
}

#[test]
fn the_sequence_wraps_without_a_gap() {
    let mut encoder = Encoder::new(0xFFFE);
    let mut decoder = Decoder::new();
    let mut decoded = Decoded::default();
    for message in typical().iter().take(4) {
        decoded.decode(&mut decoder, &frame(&mut encoder, message));
    }
    let headers: Vec<_> = decoded.messages.iter().map(|(header, _)| (header.sequence, header.arrival)).collect();
    let expected = [(0xFFFE, Arrival::First), (0xFFFF, Arrival::InOrder), (0, Arrival::InOrder), (1, Arrival::InOrder)];
    assert_eq!(headers, expected);
    assert_eq!(decoder.counters().lost, 0);
}

#[test]
fn lost_repeated_and_restarted_frames_are_distinguished() {
    let edge = Message::Edge { a: 0, b: 1, present: true };
    let Message::Hello(mut hello) = typical()[0] else { panic!("the first sample is a Hello") };
    let mut decoder = Decoder::new();
    let mut arrival = |sequence, message: Message| {
        let mut decoded = Decoded::default();
        decoded.decode(&mut decoder, &frame(&mut Encoder::new(sequence), &message));
        decoded.messages[0].0.arrival
    };
    assert_eq!(arrival(65530, Message::Hello(hello)), Arrival::First);
    assert_eq!(arrival(65533, edge), Arrival::AfterGap { lost: 2 });
    assert_eq!(arrival(65533, edge), Arrival::Late);
    assert_eq!(arrival(2, edge), Arrival::AfterGap { lost: 4 });
    assert_eq!(arrival(65535, edge), Arrival::Late);
    assert_eq!(arrival(3, Message::Hello(hello)), Arrival::InOrder);
    hello.session += 1;
    assert_eq!(arrival(0, Message::Hello(hello)), Arrival::Restart);
    assert_eq!(arrival(1, edge), Arrival::InOrder);
    assert_eq!(arrival(40_000, edge), Arrival::Restart);
    assert_eq!(decoder.counters().lost, 6);
}

/// Every way in which two starts may differ; the sequence numbers look like lost frames.
#[test]
fn a_start_that_differs_in_anything_is_a_restart() {
    let Message::Hello(hello) = typical()[0] else { panic!("the first sample is a Hello") };
    let others = [
        Hello { session: hello.session + 1, ..hello },
        Hello { session: 0, boot: hello.boot + 1, ..hello },
        Hello { session: 0, seed: hello.seed + 1, ..hello },
        Hello { session: 0, reset_cause: ResetCause::Watchdog, ..hello },
    ];
    for other in others {
        let last = Hello { session: if other.session == 0 { 0 } else { hello.session }, ..hello };
        let arrivals =
            arrivals([(100, Message::Hello(last)), (900, Message::Hello(other)), (901, Message::Hello(other))]);
        assert_eq!(arrivals, [Arrival::First, Arrival::Restart, Arrival::InOrder], "{other:?}");
    }
}

#[test]
fn a_clock_that_runs_backwards_is_a_restart_and_the_hello_after_it_is_not() {
    let Message::Hello(hello) = typical()[0] else { panic!("the first sample is a Hello") };
    let again = Message::Hello(Hello { session: hello.session + 1, ..hello });
    let ring = |frame_index| Message::Ring { frame_index, echoes: Echoes::EMPTY };
    let velocity =
        |frame_index| Message::Velocity(Velocity { frame_index, heading_mrad: 0, speed_permille: 0, state: 0 });
    let health = |uptime_ms| Message::Health(Health { uptime_ms, ..Health::default() });
    for (before, after) in [(ring(70), ring(69)), (velocity(70), ring(0)), (health(9000), health(0))] {
        let stream = [(0, Message::Hello(hello)), (1, before), (500, after), (501, again), (502, after)];
        let expected = [Arrival::First, Arrival::InOrder, Arrival::Restart, Arrival::InOrder, Arrival::InOrder];
        assert_eq!(arrivals(stream), expected, "{before:?}");
    }
    // A clock wraps, stands still in a message that is repeated, and is behind in one that was overtaken.
    let stream = [(0, ring(u32::MAX)), (1, ring(0)), (2, velocity(0)), (1, ring(u32::MAX)), (3, ring(1))];
    assert!(!arrivals(stream).contains(&Arrival::Restart));
}

#[test]
fn no_frame_of_a_reopened_line_is_late() {
    let edge = Message::Edge { a: 0, b: 1, present: true };
    let mut decoder = Decoder::new();
    let mut arrival = |sequence, reopens| {
        if reopens {
            decoder.reconnected();
        }
        let mut decoded = Decoded::default();
        decoded.decode(&mut decoder, &frame(&mut Encoder::new(sequence), &edge));
        decoded.messages[0].0.arrival
    };
    assert_eq!(arrival(100, false), Arrival::First);
    assert_eq!(arrival(90, false), Arrival::Late);
    assert_eq!(arrival(90, true), Arrival::Restart);
    assert_eq!(arrival(91, true), Arrival::InOrder);
    assert_eq!(arrival(99, true), Arrival::AfterGap { lost: 7 });
    assert_eq!(decoder.counters().restarts, 1);
}

#[test]
fn a_hello_of_an_older_or_newer_version_is_read_as_far_as_it_is_known() {
    let decoded = decode(&streams::version_5());
    let versions: Vec<_> = decoded
        .messages
        .iter()
        .map(|(header, message)| match message {
            Message::Hello(hello) => (hello.protocol_version, hello.session, header.arrival),
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(versions, [(5, 0, Arrival::First), (PROTOCOL_VERSION + 1, 0x5E55_1017, Arrival::Restart)]);
    assert_eq!(decoded.errors, 0);
}

fn arrivals<const N: usize>(stream: [(u16, Message); N]) -> [Arrival; N] {
    let mut decoder = Decoder::new();
    stream.map(|(sequence, message)| {
        let mut decoded = Decoded::default();
        decoded.decode(&mut decoder, &frame(&mut Encoder::new(sequence), &message));
        decoded.messages[0].0.arrival
    })
}

#[test]
fn a_hello_with_another_schema_under_the_same_version_is_refused() {
    let Message::Hello(mut hello) = typical()[0] else { panic!("the first sample is a Hello") };
    assert_eq!(hello.check(), Ok(()));
    hello.schema_hash ^= 1;
    assert!(hello.check().is_err());
    hello.protocol_version += 1;
    assert_eq!(hello.check(), Ok(()), "a robot with a newer protocol version is accepted");
}
