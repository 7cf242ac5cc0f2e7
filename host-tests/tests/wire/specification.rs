//! `docs/wire.md` is the specification: its examples, tables and constants are checked here against the library.

use super::samples::{largest, typical};
use super::{frame, hear, schema};
use toposlam::FaultKind;
use toposlam::wire::{Encoder, FRAME_VERSION, MAX_FRAME_BYTES, Message, PROTOCOL_VERSION, SCHEMA_HASH};

const SPECIFICATION: &str = include_str!("../../../docs/wire.md");

/// The contents of the code blocks that are marked with a word.
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
fn examples() -> Vec<Example> {
    let line = |block: &'static str, word: &str| -> &'static str {
        let start = format!("{word}: ");
        block.lines().find_map(|line| line.strip_prefix(start.as_str())).unwrap_or_else(|| panic!("{word} in {block}"))
    };
    let byte = |hex: &str| u8::from_str_radix(hex, 16).unwrap_or_else(|_| panic!("{hex} is no byte"));
    blocks("example")
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

fn wanted(sequence: u16, message: &Message) -> String {
    let frame = frame(&mut Encoder::new(sequence), message);
    format!("sequence: {sequence}\nmessage: {message:?}\nframe: {}\n", hex(&frame))
}

#[test]
fn every_example_is_packed_and_read_as_it_says() {
    for example in examples() {
        let heard = hear(&example.frame);
        let [(header, message)] = heard.messages[..] else { panic!("{} is no message", example.message) };
        assert_eq!(format!("{message:?}"), example.message);
        assert_eq!(header.sequence, example.sequence);
        assert_eq!(hex(&frame(&mut Encoder::new(example.sequence), &message)), hex(&example.frame));
    }
}

#[test]
fn every_kind_of_message_has_its_example() {
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
    ] {
        assert!(SPECIFICATION.contains(&sentence), "{sentence}");
    }
}

#[test]
fn the_specification_lists_every_kind_of_fault_with_its_number() {
    let kinds: Vec<_> = FaultKind::ALL.iter().map(|&kind| format!("{} {kind:?}", kind as u8)).collect();
    assert!(SPECIFICATION.contains(&(kinds.join(", ") + ";")), "{}", kinds.join(", "));
}

#[test]
fn the_table_of_costs_is_what_the_frames_take() {
    let costs: String = typical()
        .iter()
        .zip(largest())
        .map(|(typical, largest)| {
            let name = format!("{typical:?}");
            let name = name.split([' ', '(']).next().unwrap_or_default();
            let bytes = |message| frame(&mut Encoder::new(0xFFFF), message).len();
            format!("| {name} | {} | {} |\n", bytes(typical), bytes(&largest))
        })
        .collect();
    assert!(SPECIFICATION.contains(&costs), "the table is\n{costs}");
}
