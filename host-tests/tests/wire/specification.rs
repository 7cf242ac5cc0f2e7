//! `docs/wire.md` is the specification: these tests check its examples, tables and constants against the library.

use std::fmt::Debug;

use super::samples::{largest, largest_requests, requests, typical};
use super::{decode, frame, schema};
use toposlam::FaultKind;
use toposlam::wire::{
    CHUNK_BYTES, Decoder, Encoder, FRAME_VERSION, GoalState, MAX_FRAME_BYTES, PROTOCOL_VERSION, Payload, Progress,
    Refusal, Request, ResetCause, SCHEMA_HASH,
};

const SPECIFICATION: &str = include_str!("../../../docs/wire.md");

/// The contents of the code blocks with an info string.
fn blocks(word: &str) -> Vec<&'static str> {
    let open = format!("```{word}\n");
    SPECIFICATION.split(&open).skip(1).map(|rest| rest.split("```").next().unwrap_or_default()).collect()
}

struct Example {
    sequence: u16,
    message: &'static str,
    frame: Vec<u8>,
}

/// An example: a line for the sequence number, one for the message and one for the bytes of the frame.
fn examples(kind: &str) -> Vec<Example> {
    let line = |block: &'static str, word: &str| -> &'static str {
        let start = format!("{word}: ");
        block.lines().find_map(|line| line.strip_prefix(start.as_str())).unwrap_or_else(|| panic!("{word} in {block}"))
    };
    let byte = |hex: &str| u8::from_str_radix(hex, 16).unwrap_or_else(|_| panic!("{hex} is not a byte"));
    blocks(kind)
        .into_iter()
        .map(|block| Example {
            sequence: line(block, "sequence").parse().unwrap_or_else(|_| panic!("sequence in {block}")),
            message: line(block, "message"),
            frame: line(block, "frame").split_whitespace().map(byte).collect(),
        })
        .collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

fn wanted<M: Payload + Debug>(sequence: u16, message: &M) -> String {
    let frame = frame(&mut Encoder::new(sequence), message);
    format!("sequence: {sequence}\nmessage: {message:?}\nframe: {}\n", hex(&frame))
}

#[test]
fn every_message_example_encodes_and_decodes() {
    for example in examples("example") {
        let decoded = decode(&example.frame);
        let [(header, message)] = decoded.messages[..] else { panic!("{} is not a message", example.message) };
        assert_eq!(format!("{message:?}"), example.message);
        assert_eq!(header.sequence, example.sequence);
        assert_eq!(hex(&frame(&mut Encoder::new(example.sequence), &message)), hex(&example.frame));
    }
}

#[test]
fn every_request_example_encodes_and_decodes() {
    for example in examples("request") {
        let mut decoder = Decoder::<Request>::new();
        let Progress::Message { header, message, rest: [] } = decoder.feed(&example.frame) else {
            panic!("{} is not a request", example.message)
        };
        assert_eq!(format!("{message:?}"), example.message);
        assert_eq!(header.sequence, example.sequence);
        assert_eq!(hex(&frame(&mut Encoder::new(example.sequence), &message)), hex(&example.frame));
    }
}

#[test]
fn every_command_and_setting_has_an_example() {
    let wanted: String = requests().iter().zip(0..).map(|(request, sequence)| wanted(sequence, request)).collect();
    assert_eq!(blocks("request").concat(), wanted);
}

#[test]
fn every_kind_of_message_has_an_example() {
    let wanted: String = typical().iter().zip(0..).map(|(message, sequence)| wanted(sequence, message)).collect();
    assert_eq!(blocks("example").concat(), wanted);
}

#[test]
fn the_specification_prints_the_schema_and_its_hash() {
    assert_eq!(blocks("schema").concat(), schema::description());
    assert!(SPECIFICATION.contains(&format!("{SCHEMA_HASH:#018X}")), "the schema hash is {SCHEMA_HASH:#018X}");
}

#[test]
fn the_specification_states_the_versions_and_the_largest_frame() {
    for sentence in [
        format!("frame version is {FRAME_VERSION}"),
        format!("protocol version is {PROTOCOL_VERSION}"),
        format!("at most {MAX_FRAME_BYTES} bytes"),
        format!("first byte is {}", Request::VERSION),
        format!("at most {CHUNK_BYTES} bytes of a snapshot"),
    ] {
        assert!(SPECIFICATION.contains(&sentence), "{sentence}");
    }
}

#[test]
fn the_specification_lists_every_one_byte_enum_with_its_numbers() {
    fn listed<T: Debug>(numbered: impl Iterator<Item = (u8, T)>) {
        let list: Vec<_> = numbered.map(|(number, kind)| format!("{number} {kind:?}")).collect();
        assert!(SPECIFICATION.contains(&(list.join(", ") + ";")), "{}", list.join(", "));
    }
    listed(FaultKind::ALL.iter().map(|&kind| (kind as u8, kind)));
    listed(ResetCause::ALL.iter().map(|&kind| (kind.into(), kind)));
    listed(GoalState::ALL.iter().map(|&kind| (kind.into(), kind)));
    // Each refusal has its own line.
    for &refusal in Refusal::ALL {
        assert!(SPECIFICATION.contains(&format!("| {} | {refusal:?} |", u8::from(refusal))), "{refusal:?}");
    }
}

#[test]
fn an_unknown_enum_number_decodes_to_the_first_variant() {
    for number in 0..=u8::MAX {
        let known = |kind: u8| if kind == 0 { 0 } else { number };
        assert_eq!(u8::from(ResetCause::from(number)), known(ResetCause::from(number).into()));
        assert_eq!(u8::from(Refusal::from(number)), known(Refusal::from(number).into()));
        assert_eq!(u8::from(GoalState::from(number)), known(GoalState::from(number).into()));
    }
    assert_eq!(ResetCause::from(u8::MAX), ResetCause::Unknown);
}

/// The rows of the table of costs: a name, and the length of a typical and of the largest frame.
fn costs<M: Payload + Debug>(typical: &[M], largest: &[M]) -> String {
    let name = |message: &M| {
        let text = format!("{message:?}");
        let of_kind = |text: &str| text.split([' ', '(']).next().unwrap_or_default().to_owned();
        match text.split_once("outcome: ").or(text.split_once("command: ")) {
            Some((before, inner)) if before.starts_with("Reply") => format!("Reply, {}", of_kind(inner)),
            Some((_, inner)) => of_kind(inner),
            None => of_kind(&text),
        }
    };
    let bytes = |message: &M| frame(&mut Encoder::new(0xFFFF), message).len();
    let rows = typical.iter().zip(largest).map(|(typical, largest)| (name(typical), bytes(typical), bytes(largest)));
    let mut rows: Vec<_> =
        rows.map(|(name, typical, largest)| format!("| {name} | {typical} | {largest} |\n")).collect();
    rows.dedup();
    rows.concat()
}

#[test]
fn the_tables_of_costs_match_the_frame_lengths() {
    for costs in [costs(&typical(), &largest()), costs(&requests(), &largest_requests())] {
        assert!(SPECIFICATION.contains(&costs), "the table is\n{costs}");
    }
}
