//! Any bytes on the line, in any pieces: both decoders, and the listener's replica.
#![no_main]

use std::fmt::Debug;

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use toposlam::wire::{
    Arrival, DecodeError, Decoder, DecoderCounters, Encoder, Header, List, MAX_FRAME_BYTES, MapReplica, Message,
    Payload, Progress, Remapped, Request, Row,
};
use toposlam_fuzz::line::{Line, Piece};

#[derive(Arbitrary, Debug)]
struct Input<'a> {
    /// The lengths of the pieces in which the bytes are fed, over and over.
    splits: Vec<u8>,
    parts: Vec<Part<'a>>,
}

#[derive(Arbitrary, Debug)]
enum Part<'a> {
    /// Anything.
    Any(Piece<'a>),
    /// A message about the map: it takes several to make a replica wrong.
    Edge {
        a: u8,
        b: u8,
        present: bool,
    },
    Vertex {
        vertex: u8,
    },
    Row {
        vertex: u8,
        neighbours: u64,
    },
    Size {
        vertices: u8,
    },
    Remapped {
        vertices: &'a [u8],
    },
}

impl Part<'_> {
    fn bytes(&self, line: &mut Line) -> Vec<u8> {
        let message = match *self {
            Self::Any(ref piece) => return line.carry(piece),
            Self::Edge { a, b, present } => Message::Edge { a: near(a), b: near(b), present },
            Self::Vertex { vertex } => Message::Vertex { vertex: near(vertex), radius_mm: 1000, visits: 1 },
            Self::Row { vertex, neighbours } => {
                Message::Row(Row { vertex: near(vertex), radius_mm: 1000, visits: 1, neighbours })
            }
            Self::Size { vertices } => Message::Map { vertices: near(vertices), edges: 0, digest: 0 },
            Self::Remapped { vertices } => Message::Remapped(Remapped {
                place_index: 0,
                vertices: List::new(vertices.iter().map(|&vertex| near(vertex))),
            }),
        };
        line.say(&message)
    }
}

/// The number of a vertex, most often one that the smaller maps have, or nearly.
fn near(vertex: u8) -> u8 {
    if vertex < 128 { vertex % 6 } else { vertex }
}

/// What a decoder handed out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Heard<M> {
    Message(Header, M),
    Error(DecodeError),
}

fuzz_target!(|input: Input<'_>| {
    let mut line = Line::default();
    let bytes: Vec<u8> = input.parts.iter().flat_map(|part| part.bytes(&mut line)).collect();
    let messages = listen::<Message>(&bytes, &input.splits);
    listen::<Request>(&bytes, &input.splits);
    draw::<64>(&messages);
    draw::<3>(&messages);
});

/// Hears the bytes in three ways, which must not differ.
fn listen<M: Payload + Copy + PartialEq + Debug>(bytes: &[u8], splits: &[u8]) -> Vec<Heard<M>> {
    let at_once = hear::<M>([bytes]);
    assert_eq!(at_once, hear(bytes.chunks(1)), "byte by byte");
    let mut rest = bytes;
    let mut lengths = splits.iter().cycle();
    let pieces = std::iter::from_fn(|| {
        let (piece, behind) = rest.split_at(rest.len().min(usize::from(*lengths.next()?)));
        rest = behind;
        (splits.iter().any(|&length| length > 0) && !(piece.is_empty() && rest.is_empty())).then_some(piece)
    });
    let pieces: Vec<&[u8]> = pieces.collect();
    assert_eq!(at_once, hear(pieces.into_iter().chain([rest])), "in pieces");
    let (heard, counters) = at_once;
    check_counters(&heard, counters);
    assert!(heard.len() <= bytes.iter().filter(|&&byte| byte == 0).count(), "more frames than ends of frames");
    for heard in &heard {
        if let Heard::Message(_, message) = heard {
            comes_back(message);
        }
    }
    heard
}

fn hear<'bytes, M: Payload>(pieces: impl IntoIterator<Item = &'bytes [u8]>) -> (Vec<Heard<M>>, DecoderCounters) {
    let mut decoder = Decoder::<M>::new();
    let mut heard = Vec::new();
    for mut piece in pieces {
        loop {
            let before = piece.len();
            match decoder.feed(piece) {
                Progress::NeedsMore => break,
                Progress::Message { header, message, rest } => {
                    heard.push(Heard::Message(header, message));
                    piece = rest;
                }
                Progress::Error { error, rest } => {
                    heard.push(Heard::Error(error));
                    piece = rest;
                }
            }
            assert!(piece.len() < before, "a frame takes a byte at least");
        }
    }
    (heard, decoder.counters())
}

/// The counters are what was handed out.
fn check_counters<M>(heard: &[Heard<M>], counters: DecoderCounters) {
    let mut expected = DecoderCounters::default();
    for heard in heard {
        match heard {
            Heard::Message(header, _) => {
                expected.messages += 1;
                if let Arrival::AfterGap { lost } = header.arrival {
                    expected.lost += u32::from(lost);
                }
            }
            Heard::Error(DecodeError::Corrupt) => expected.corrupt += 1,
            Heard::Error(DecodeError::Cut) => expected.cut += 1,
            Heard::Error(DecodeError::TooLong) => expected.too_long += 1,
            Heard::Error(DecodeError::UnknownVersion { .. }) => expected.unknown_version += 1,
            Heard::Error(DecodeError::UnknownMessage) => expected.unknown_message += 1,
            Heard::Error(error) => panic!("{error} has no counter"),
        }
    }
    assert_eq!(counters, expected);
}

/// A message that was decoded can be encoded, and is the same then.
fn comes_back<M: Payload + PartialEq + Debug>(message: &M) {
    let mut buffer = [0; MAX_FRAME_BYTES];
    let frame = Encoder::new(7).encode(message, &mut buffer).expect("what was decoded has room in a frame");
    match Decoder::<M>::new().feed(frame) {
        Progress::Message { message: again, rest: [], .. } => assert_eq!(again, *message),
        other => panic!("{other:?}"),
    }
}

/// Draws the map, which must be one whatever was heard.
fn draw<const V: usize>(heard: &[Heard<Message>]) {
    let mut replica = MapReplica::<V>::new();
    for heard in heard {
        if let Heard::Message(header, message) = heard {
            replica.apply(*header, message);
            if V < 16 {
                check_picture(&replica);
            }
        }
    }
    check_picture(&replica);
}

fn check_picture<const V: usize>(replica: &MapReplica<V>) {
    let vertices = replica.vertices();
    assert!(usize::from(vertices) <= V);
    for from in 0..=V as u8 {
        let row = replica.neighbours(from);
        for to in (0..64).filter(|to| row >> to & 1 == 1) {
            assert!(from < vertices && to < vertices, "an edge from {from} to {to} of {vertices}");
            assert!(replica.neighbours(to) >> from & 1 == 1, "the edge from {from} to {to} does not lead back");
        }
        let row = replica.row(from);
        assert!(row.is_none_or(|row| row.vertex == from && from < vertices));
        assert!(!replica.is_complete() || row.is_some() == (from < vertices));
    }
    assert!(replica.edges().all(|(a, b)| a <= b && b < vertices));
    // It must not panic; whether it holds is up to the sender.
    let _ = replica.is_converged();
}
