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
    PROTOCOL_VERSION, Progress, Start, Velocity,
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

/// State of a robot, decoded from its stream. Memory: about 7 KiB, no heap.
#[derive(Clone, Debug)]
pub struct Listener {
    decoder: Decoder,
    replica: MapReplica<64>,
    latest: Latest,
    /// The last two starts that differ, the newest first.
    starts: [Option<Start>; 2],
    /// Whether a start returned after another one.
    alternates: bool,
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
    /// The frames of several robots alternate on the line: each replaces the state of the other.
    Several,
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
            Self::Several => f.write_str("several robots send on this line, and each replaces the map of the other"),
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
        Self {
            decoder: Decoder::new(),
            replica: MapReplica::new(),
            latest: Latest::default(),
            starts: [None; 2],
            alternates: false,
        }
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
            Message::Hello(hello) => self.note(hello.start()),
            Message::Ring { frame_index, echoes } => self.latest.ring = Some((frame_index, echoes)),
            Message::Velocity(velocity) => self.latest.velocity = Some(velocity),
            Message::Place { place_index, frame_index, radius_mm, degree } => {
                self.latest.sighting = Some(Sighting { place_index, frame_index, radius_mm, degree });
            }
            _ => {}
        }
    }

    /// A start that returns after another one is not a restart: two robots send.
    fn note(&mut self, start: Start) {
        let [newest, before] = self.starts;
        if newest != Some(start) {
            self.alternates |= before == Some(start);
            self.starts = [Some(start), newest];
        }
    }

    /// Prepares for a reopened line: keeps the state and discards an incomplete frame. Another robot may be at the other end.
    pub fn reconnected(&mut self, mut on_event: impl FnMut(&Self, Event<'_>)) {
        self.feed(&[0], &mut on_event);
        self.decoder.reconnected();
        self.starts = [None; 2];
        self.alternates = false;
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
        if self.alternates { Understanding::Several } else { Understanding::of(self.replica.hello()) }
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
    use toposlam::FaultKind;
    use toposlam::wire::{
        Belief, Capacities, Encoder, GoalState, GoalStatus, List, Location, MAX_FRAME_BYTES, ResetCause,
    };

    fn listener_of(hello: Hello) -> Listener {
        let mut frame = [0; MAX_FRAME_BYTES];
        let mut listener = Listener::new();
        listener.feed(Encoder::new(0).encode(&Message::Hello(hello), &mut frame).unwrap(), |_, _| ());
        listener
    }

    const HELLO: Hello = {
        let capacities = Capacities {
            vertices: 16,
            hypotheses: 10,
            history: 400,
            ngram_length: 5,
            fingerprint_step_mm: 4,
            sonars: 16,
        };
        Hello { session: 77, ..Hello::new(0, ResetCause::PowerOn, 1, capacities) }
    };

    fn send(listener: &mut Listener, encoder: &mut Encoder, messages: &[Message]) {
        for message in messages {
            listener.feed(encoder.encode(message, &mut [0; MAX_FRAME_BYTES]).unwrap(), |_, _| ());
        }
    }

    /// The same robot at two starts, with a gap in the numbers that may as well be lost frames.
    #[test]
    fn no_state_of_the_session_before_a_restart_is_left() {
        let ring = |frame_index| Message::Ring { frame_index, echoes: Echoes::EMPTY };
        let before = [
            Message::Hello(HELLO),
            Message::Edge { a: 0, b: 1, present: true },
            Message::Vertex { vertex: 0, radius_mm: 1000, visits: 1 },
            Message::Vertex { vertex: 1, radius_mm: 1000, visits: 1 },
            Message::Location(Location { place_index: 4, vertex: 1 }),
            Message::Belief(Belief { place_index: 4, map_permille: 1000, vertices: List::new([]) }),
            Message::GoalStatus(GoalStatus { vertex: 0, state: GoalState::Active }),
            Message::Fault { kind: FaultKind::BusError as u8, count: 3 },
            Message::Place { place_index: 4, frame_index: 900, radius_mm: 1000, degree: None },
            ring(900),
        ];
        let hello = Message::Hello(Hello { session: 78, ..HELLO });
        for (first, restarts_by) in [(hello, "session"), (ring(30), "clock")] {
            let mut listener = Listener::new();
            send(&mut listener, &mut Encoder::new(0), &before);
            assert_eq!((listener.map().edges.len(), listener.replica().fault(FaultKind::BusError)), (1, 3));
            listener.reconnected(|_, _| ());
            send(&mut listener, &mut Encoder::new(500), &[first, hello]);
            let replica = listener.replica();
            assert_eq!((replica.vertices(), replica.edges().count()), (0, 0), "{restarts_by}");
            assert_eq!((replica.location(), replica.belief(), replica.goal_status()), (None, None, None));
            assert_eq!((replica.fault(FaultKind::BusError), listener.sighting()), (0, None));
            assert_eq!((replica.hello().unwrap().session, listener.counters().restarts), (78, 1));
            assert!(!replica.is_converged());
            assert_eq!(listener.understanding(), Understanding::Whole);
        }
    }

    #[test]
    fn two_robots_on_one_line_are_not_taken_for_one_that_restarts() {
        let other = Hello { session: 78, ..HELLO };
        let mut listener = Listener::new();
        for (number, hello) in [HELLO, other].into_iter().cycle().take(4).enumerate() {
            assert_eq!(listener.understanding() == Understanding::Several, number > 2, "{number}");
            send(&mut listener, &mut Encoder::new(number as u16), &[Message::Hello(hello)]);
        }
        listener.reconnected(|_, _| ());
        assert_eq!(listener.understanding(), Understanding::Whole);
    }

    #[test]
    fn a_version_mismatch_reports_both_versions() {
        assert_eq!(Listener::new().understanding(), Understanding::Unknown);
        let hello = HELLO;
        assert_eq!(listener_of(hello).understanding(), Understanding::Whole);
        let newer = Hello { protocol_version: PROTOCOL_VERSION + 1, ..hello };
        let text = listener_of(newer).understanding().to_string();
        assert!(text.contains(&format!("version {}, this program {PROTOCOL_VERSION}", PROTOCOL_VERSION + 1)), "{text}");
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
