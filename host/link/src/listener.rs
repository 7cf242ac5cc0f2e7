//! Listener for the stream of a robot: decodes bytes into events and keeps the newest state.
//!
//! ```
//! use toposlam::wire::{Encoder, MAX_FRAME_BYTES, Message};
//! use toposlam_link::listener::{Event, Listener};
//!
//! let mut frame = [0; MAX_FRAME_BYTES];
//! let edge = Message::Edge { a: 0, b: 1, present: true };
//! let bytes = Encoder::new(0).encode(&edge, &mut frame)?;
//! let mut listener = Listener::new();
//! listener.feed(bytes, |_, event| assert!(matches!(event, Event::Message(_, message) if *message == edge)));
//! assert_eq!(listener.map().edges, [(0, 1)]);
//! # Ok::<(), toposlam::wire::EncodeError>(())
//! ```

use std::fmt;

use toposlam::wire::{
    Arrival, DecodeError, Decoder, DecoderCounters, Echoes, Header, Hello, HelloError, MapReplica, Message,
    PROTOCOL_VERSION, Progress, Velocity,
};

use crate::topology::TopologicalMap;

/// A decoded frame, or an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'listener> {
    /// A message. The listener has already processed it.
    Message(Header, &'listener Message),
    /// Bytes that are not a valid message; [`Listener::counters`] counts them.
    Damaged(DecodeError),
}

impl<'a> From<&'a Result<(Header, Message), DecodeError>> for Event<'a> {
    fn from(kept: &'a Result<(Header, Message), DecodeError>) -> Self {
        match kept {
            Ok((header, message)) => Self::Message(*header, message),
            Err(error) => Self::Damaged(*error),
        }
    }
}

/// State of a robot, decoded from its stream. Memory: about 6 KiB, no heap.
#[derive(Clone, Debug)]
pub struct Listener {
    decoder: Decoder,
    replica: MapReplica<64>,
    latest: Latest,
}

/// The newest values that [`MapReplica`] does not keep.
#[derive(Clone, Copy, Debug, Default)]
struct Latest {
    ring: Option<(u32, Echoes)>,
    velocity: Option<Velocity>,
    sighting: Option<Sighting>,
}

/// A place as detected by the robot, before inference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sighting {
    /// Index of the place since the start, from 0.
    pub place_index: u32,
    /// Index of the ring frame that confirmed the place, from 0.
    pub frame_index: u32,
    /// Radius of the largest free disc around the place, in millimetres.
    pub radius_mm: u16,
    /// Number of exits of the place, if the detector could count them.
    pub degree: Option<u8>,
}

/// Compatibility between the robot's protocol and this program's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Understanding {
    /// No `Hello` received yet.
    Unknown,
    /// Same protocol version and schema.
    Whole,
    /// The robot has another protocol version; messages known to both are decoded.
    Partly {
        /// The robot's [`PROTOCOL_VERSION`].
        theirs: u16,
    },
    /// The robot's messages have another schema: the decoded values are not reliable.
    Not(HelloError),
}

impl Understanding {
    fn of(hello: Option<Hello>) -> Self {
        let Some(hello) = hello else { return Self::Unknown };
        match hello.check() {
            Err(error) => Self::Not(error),
            Ok(()) if hello.protocol_version == PROTOCOL_VERSION => Self::Whole,
            Ok(()) => Self::Partly { theirs: hello.protocol_version },
        }
    }
}

impl fmt::Display for Understanding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("the robot has not introduced itself yet"),
            Self::Whole => write!(f, "protocol version {PROTOCOL_VERSION} on both sides"),
            Self::Partly { theirs } => {
                write!(
                    f,
                    "the robot speaks protocol version {theirs}, this program {PROTOCOL_VERSION}: messages that only one knows are missing"
                )
            }
            Self::Not(error) => write!(f, "not understood: {error}"),
        }
    }
}

impl Default for Listener {
    fn default() -> Self {
        Self::new()
    }
}

impl Listener {
    /// A listener that has received nothing.
    pub fn new() -> Self {
        Self { decoder: Decoder::new(), replica: MapReplica::new(), latest: Latest::default() }
    }

    /// Decodes bytes in pieces of any length. Calls back with each event and with the listener's state after it.
    pub fn feed(&mut self, bytes: &[u8], mut on_event: impl FnMut(&Self, Event<'_>)) {
        let mut rest = bytes;
        loop {
            rest = match self.decoder.feed(rest) {
                Progress::NeedsMore => return,
                Progress::Error { error, rest } => {
                    on_event(self, Event::Damaged(error));
                    rest
                }
                Progress::Message { header, message, rest } => {
                    self.update(header, &message);
                    on_event(self, Event::Message(header, &message));
                    rest
                }
            };
        }
    }

    fn update(&mut self, header: Header, message: &Message) {
        self.replica.apply(header, message);
        match header.arrival {
            Arrival::Late => return,
            Arrival::Restart => self.latest = Latest::default(),
            Arrival::First | Arrival::InOrder | Arrival::AfterGap { .. } => {}
        }
        match *message {
            Message::Ring { frame_index, echoes } => self.latest.ring = Some((frame_index, echoes)),
            Message::Velocity(velocity) => self.latest.velocity = Some(velocity),
            Message::Place { place_index, frame_index, radius_mm, degree } => {
                self.latest.sighting = Some(Sighting { place_index, frame_index, radius_mm, degree });
            }
            _ => {}
        }
    }

    /// Prepares for a reopened line: keeps the state and discards an incomplete frame.
    pub fn reconnected(&mut self, mut on_event: impl FnMut(&Self, Event<'_>)) {
        self.feed(&[0], &mut on_event);
    }

    /// The replica of the robot's map and state.
    pub const fn replica(&self) -> &MapReplica<64> {
        &self.replica
    }

    /// The map alone.
    pub fn map(&self) -> TopologicalMap {
        TopologicalMap::from(&self.replica)
    }

    /// Counts of received messages, and of frames lost or damaged on the line.
    pub const fn counters(&self) -> DecoderCounters {
        self.decoder.counters()
    }

    /// Compatibility with the robot's protocol.
    pub fn understanding(&self) -> Understanding {
        Understanding::of(self.replica.hello())
    }

    /// The newest ring frame: its index and the echo of each sonar.
    pub fn ring(&self) -> Option<(u32, Echoes)> {
        self.latest.ring
    }

    /// The newest velocity command.
    pub const fn velocity(&self) -> Option<Velocity> {
        self.latest.velocity
    }

    /// The newest detected place.
    pub const fn sighting(&self) -> Option<Sighting> {
        self.latest.sighting
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::wire::{Capacities, Encoder, MAX_FRAME_BYTES, ResetCause};

    fn listener_of(hello: Hello) -> Listener {
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut listener = Listener::new();
        listener.feed(Encoder::new(0).encode(&Message::Hello(hello), &mut frame).unwrap(), |_, _| ());
        listener
    }

    #[test]
    fn a_version_mismatch_reports_both_versions() {
        assert_eq!(Listener::new().understanding(), Understanding::Unknown);
        let capacities = Capacities {
            vertices: 16,
            hypotheses: 10,
            history: 400,
            ngram_length: 5,
            fingerprint_step_mm: 4,
            sonars: 16,
        };
        let hello = Hello::new(1, ResetCause::PowerOn, 1, capacities);
        assert_eq!(listener_of(hello).understanding(), Understanding::Whole);
        let newer = Hello { protocol_version: PROTOCOL_VERSION + 1, ..hello };
        let text = listener_of(newer).understanding().to_string();
        assert!(text.contains("version 6, this program 5"), "{text}");
        let other = Hello { schema_hash: 7, ..hello };
        assert!(matches!(listener_of(other).understanding(), Understanding::Not(_)));
    }

    #[test]
    fn a_damaged_frame_is_counted_and_the_next_message_decoded() {
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut encoder = Encoder::new(0);
        let mut bytes = encoder.encode(&Message::Edge { a: 0, b: 1, present: true }, &mut frame).unwrap().to_vec();
        // A bit flip within the CRC that leaves no zero byte.
        let last = bytes.len() - 2;
        bytes[last] = if bytes[last] == 1 { 2 } else { 1 };
        bytes.extend_from_slice(
            encoder.encode(&Message::Edge { a: 1, b: 2, present: true }, &mut [0; MAX_FRAME_BYTES]).unwrap(),
        );
        let mut listener = Listener::new();
        let mut events = Vec::new();
        listener.feed(&bytes, |_, event| events.push(matches!(event, Event::Damaged(_))));
        assert_eq!(events, [true, false]);
        assert_eq!((listener.counters().corrupt, listener.map().edges), (1, vec![(1, 2)]));
    }
}
