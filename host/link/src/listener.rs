//! A listener to a robot: bytes in, events out, and the newest of everything at hand.
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

/// What came of the bytes that were fed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'listener> {
    /// A message, already taken in.
    Message(Header, &'listener Message),
    /// Bytes that were no message; they are counted, see [`Listener::counters`].
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

/// All that is known of a robot from what it said. Memory: some 2 KiB, and nothing on the heap.
#[derive(Clone, Debug)]
pub struct Listener {
    decoder: Decoder,
    replica: MapReplica<64>,
    latest: Latest,
}

/// The newest of what [`MapReplica`] does not keep.
#[derive(Clone, Copy, Debug, Default)]
struct Latest {
    ring: Option<(u32, Echoes)>,
    velocity: Option<Velocity>,
    sighting: Option<Sighting>,
}

/// A place as the robot's detector saw it, before any inference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sighting {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// The ring frame in which the place was confirmed, from 0.
    pub frame_index: u32,
    /// The radius of the largest free disc around the place, in millimetres.
    pub radius_mm: u16,
    /// How many ways lead away from the place, when the detector could count them.
    pub degree: Option<u8>,
}

/// How well the robot is understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Understanding {
    /// It has not introduced itself yet.
    Unknown,
    /// Both speak the same messages.
    Whole,
    /// The robot speaks another version; the messages that both know are understood.
    Partly {
        /// The robot's [`PROTOCOL_VERSION`].
        theirs: u16,
    },
    /// The robot means other things by the same messages: do not trust what is shown.
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
    /// A listener who has heard nothing.
    pub fn new() -> Self {
        Self { decoder: Decoder::new(), replica: MapReplica::new(), latest: Latest::default() }
    }

    /// Takes bytes as the line delivers them, in pieces of any length, and tells what they were, with itself as it is then.
    pub fn feed(&mut self, bytes: &[u8], mut heard: impl FnMut(&Self, Event<'_>)) {
        let mut rest = bytes;
        loop {
            rest = match self.decoder.feed(rest) {
                Progress::NeedsMore => return,
                Progress::Error { error, rest } => {
                    heard(self, Event::Damaged(error));
                    rest
                }
                Progress::Message { header, message, rest } => {
                    self.take_in(header, &message);
                    heard(self, Event::Message(header, &message));
                    rest
                }
            };
        }
    }

    fn take_in(&mut self, header: Header, message: &Message) {
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

    /// The line was opened anew: what was heard stays, a frame that was cut is given up.
    pub fn reconnected(&mut self, mut heard: impl FnMut(&Self, Event<'_>)) {
        self.feed(&[0], &mut heard);
    }

    /// The map and the rest of what was heard.
    pub const fn replica(&self) -> &MapReplica<64> {
        &self.replica
    }

    /// The map alone.
    pub fn map(&self) -> TopologicalMap {
        TopologicalMap::from(&self.replica)
    }

    /// How many messages came, and what was lost or damaged on the line.
    pub const fn counters(&self) -> DecoderCounters {
        self.decoder.counters()
    }

    /// How well the robot is understood.
    pub fn understanding(&self) -> Understanding {
        Understanding::of(self.replica.hello())
    }

    /// The newest ring frame: its number and what each sonar said.
    pub fn ring(&self) -> Option<(u32, Echoes)> {
        self.latest.ring
    }

    /// The last velocity command.
    pub const fn velocity(&self) -> Option<Velocity> {
        self.latest.velocity
    }

    /// The newest place, as its detector saw it.
    pub const fn sighting(&self) -> Option<Sighting> {
        self.latest.sighting
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::wire::{Capacities, Encoder, MAX_FRAME_BYTES, ResetCause};

    fn heard_with(hello: Hello) -> Listener {
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut listener = Listener::new();
        listener.feed(Encoder::new(0).encode(&Message::Hello(hello), &mut frame).unwrap(), |_, _| ());
        listener
    }

    #[test]
    fn a_robot_of_another_version_is_named_with_both_versions() {
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
        assert_eq!(heard_with(hello).understanding(), Understanding::Whole);
        let newer = Hello { protocol_version: PROTOCOL_VERSION + 1, ..hello };
        let text = heard_with(newer).understanding().to_string();
        assert!(text.contains("version 5, this program 4"), "{text}");
        let other = Hello { schema_hash: 7, ..hello };
        assert!(matches!(heard_with(other).understanding(), Understanding::Not(_)));
    }

    #[test]
    fn damage_is_told_and_counted_and_the_next_message_heard() {
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut encoder = Encoder::new(0);
        let mut bytes = encoder.encode(&Message::Edge { a: 0, b: 1, present: true }, &mut frame).unwrap().to_vec();
        // Within the CRC, and no zero afterwards.
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
