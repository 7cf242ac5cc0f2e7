//! Arbitrary bytes in arbitrary pieces to both decoders and to the listener's replica.
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
    /// The lengths of the pieces in which the bytes are fed, in rotation.
    splits: Vec<u8>,
    parts: Vec<Part<'a>>,
}

#[derive(Arbitrary, Debug)]
enum Part<'a> {
    /// Arbitrary bytes.
    Any(Piece<'a>),
    /// A message about the map; only several of them can corrupt a replica.
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

/// A vertex id, mostly within or just above the capacity of the smaller maps.
fn near(vertex: u8) -> u8 {
    if vertex < 128 { vertex % 6 } else { vertex }
}

/// A result of a decoder.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Decoded<M> {
    Message(Header, M),
    Error(DecodeError),
}

fuzz_target!(|input: Input<'_>| {
    let mut line = Line::default();
    let bytes: Vec<u8> = input.parts.iter().flat_map(|part| part.bytes(&mut line)).collect();
    let messages = decode_three_ways::<Message>(&bytes, &input.splits);
    decode_three_ways::<Request>(&bytes, &input.splits);
    check_replicas::<64>(&messages);
    check_replicas::<3>(&messages);
});

/// Decodes the bytes at once, byte by byte and in pieces; the results must be equal.
fn decode_three_ways<M: Payload + Copy + PartialEq + Debug>(bytes: &[u8], splits: &[u8]) -> Vec<Decoded<M>> {
    let at_once = decode::<M>([bytes]);
    assert_eq!(at_once, decode(bytes.chunks(1)), "byte by byte");
    let mut rest = bytes;
    let mut lengths = splits.iter().cycle();
    let pieces = std::iter::from_fn(|| {
        let (piece, behind) = rest.split_at(rest.len().min(usize::from(*lengths.next()?)));
        rest = behind;
        (splits.iter().any(|&length| length > 0) && !(piece.is_empty() && rest.is_empty())).then_some(piece)
    });
    let pieces: Vec<&[u8]> = pieces.collect();
    assert_eq!(at_once, decode(pieces.into_iter().chain([rest])), "in pieces");
    let (decoded, counters) = at_once;
    check_counters(&decoded, counters);
    assert!(decoded.len() <= bytes.iter().filter(|&&byte| byte == 0).count(), "more frames than closing zeros");
    for decoded in &decoded {
        if let Decoded::Message(_, message) = decoded {
            check_round_trip(message);
        }
    }
    decoded
}

fn decode<'bytes, M: Payload>(pieces: impl IntoIterator<Item = &'bytes [u8]>) -> (Vec<Decoded<M>>, DecoderCounters) {
    let mut decoder = Decoder::<M>::new();
    let mut decoded = Vec::new();
    for mut piece in pieces {
        loop {
            let before = piece.len();
            match decoder.feed(piece) {
                Progress::NeedsMore => break,
                Progress::Message { header, message, rest } => {
                    decoded.push(Decoded::Message(header, message));
                    piece = rest;
                }
                Progress::Error { error, rest } => {
                    decoded.push(Decoded::Error(error));
                    piece = rest;
                }
            }
            assert!(piece.len() < before, "a frame has at least one byte");
        }
    }
    (decoded, decoder.counters())
}

/// Asserts that the counters match the results.
fn check_counters<M>(decoded: &[Decoded<M>], counters: DecoderCounters) {
    let mut expected = DecoderCounters::default();
    for decoded in decoded {
        match decoded {
            Decoded::Message(header, _) => {
                expected.messages += 1;
                match header.arrival {
                    Arrival::AfterGap { lost } => expected.lost += u32::from(lost),
                    Arrival::Restart => expected.restarts += 1,
                    Arrival::First | Arrival::InOrder | Arrival::Late => {}
                }
            }
            Decoded::Error(DecodeError::Corrupt) => expected.corrupt += 1,
            Decoded::Error(DecodeError::Cut) => expected.cut += 1,
            Decoded::Error(DecodeError::TooLong) => expected.too_long += 1,
            Decoded::Error(DecodeError::UnknownVersion { .. }) => expected.unknown_version += 1,
            Decoded::Error(DecodeError::UnknownMessage) => expected.unknown_message += 1,
            Decoded::Error(error) => panic!("{error} has no counter"),
        }
    }
    assert_eq!(counters, expected);
}

/// Asserts that a decoded message can be encoded and decodes to itself.
fn check_round_trip<M: Payload + PartialEq + Debug>(message: &M) {
    let mut buffer = [0; MAX_FRAME_BYTES];
    let frame = Encoder::new(7).encode(message, &mut buffer).expect("a decoded message fits a frame");
    match Decoder::<M>::new().feed(frame) {
        Progress::Message { message: again, rest: [], .. } => assert_eq!(again, *message),
        other => panic!("{other:?}"),
    }
}

/// Applies the messages to a replica, which must be consistent after any input.
fn check_replicas<const V: usize>(decoded: &[Decoded<Message>]) {
    let mut replica = MapReplica::<V>::new();
    for decoded in decoded {
        if let Decoded::Message(header, message) = decoded {
            replica.apply(*header, message);
            if V < 16 {
                check_consistency(&replica);
            }
        }
    }
    check_consistency(&replica);
}

fn check_consistency<const V: usize>(replica: &MapReplica<V>) {
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
    // It must not panic; the result depends on the sender.
    let _ = replica.is_converged();
}
