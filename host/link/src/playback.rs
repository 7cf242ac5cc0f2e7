//! Plays a recorded stream as a robot: numbers its frames again, so that replies fit between them, and answers the requests
//! that a recording can answer.
//!
//! | Request | Answer |
//! |---|---|
//! | Info | from the recorded messages; a value that no message has is 0 or false |
//! | GetMap | the map at this point of the recording |
//! | Pause | stops and resumes the playback |
//! | others | refused: it is a recording |
//!
//! ```
//! use toposlam::wire::{Command, Encoder, MAX_FRAME_BYTES, Message, Request};
//! use toposlam_link::{listener::Listener, playback::Playback};
//!
//! let mut frame = [0; MAX_FRAME_BYTES];
//! let edge = Message::Edge { a: 0, b: 1, present: true };
//! let mut playback = Playback::new();
//! let mut sent = playback.play(Encoder::new(900).encode(&edge, &mut frame)?);
//! let request = Request { id: 7, command: Command::Reset };
//! sent.extend(playback.answer(Encoder::new(0).encode(&request, &mut frame)?));
//! let mut listener = Listener::new();
//! listener.feed(&sent, |_, event| println!("{}", toposlam_link::event_text::event(event)));
//! assert_eq!((listener.counters().messages, listener.counters().lost), (2, 0));
//! # Ok::<(), toposlam::wire::EncodeError>(())
//! ```

use toposlam::wire::{
    Command, Encoder, GoalState, Inbox, Info, List, MAX_FRAME_BYTES, Message, Outcome, Refusal, ResetCause, Version,
    VertexWays, crc32,
};

use crate::listener::{Event, Listener};

/// A sequence number this far behind the last one is a restart, not a late frame.
const RESTART: u16 = 0x4000;
const CRC_BYTES: usize = 4;

/// Plays recorded bytes as a robot.
#[derive(Debug, Default)]
pub struct Playback {
    listener: Listener,
    inbox: Inbox,
    /// The bytes of an incomplete frame.
    piece: Vec<u8>,
    /// What is added to the recorded sequence numbers; the first frame decides.
    offset: Option<u16>,
    /// The highest number sent.
    last: Option<u16>,
    map: Option<Message>,
    is_paused: bool,
}

impl Playback {
    /// A playback at the beginning.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes recorded bytes and returns those to send: every intact frame with its new number, everything else as it is.
    pub fn play(&mut self, bytes: &[u8]) -> Vec<u8> {
        let map = &mut self.map;
        self.listener.feed(bytes, |_, event| {
            if let Event::Message(_, message @ Message::Map { .. }) = event {
                *map = Some(*message);
            }
        });
        let mut sent = Vec::new();
        for &byte in bytes {
            self.piece.push(byte);
            if byte == 0 || self.piece.len() > MAX_FRAME_BYTES {
                self.renumber();
                sent.append(&mut self.piece);
            }
        }
        sent
    }

    /// Starts the recording again. Listeners notice a restart of the robot.
    pub fn rewind(&mut self) {
        let last = self.last.map(|last| last.wrapping_sub(RESTART));
        *self = Self { is_paused: self.is_paused, last, ..Self::default() };
    }

    /// Takes bytes received from clients and returns the answers to send. Executes at most one request.
    pub fn answer(&mut self, received: &[u8]) -> Vec<u8> {
        received.iter().for_each(|&byte| self.inbox.take(byte));
        let mut inbox = std::mem::take(&mut self.inbox);
        let mut wants_map = false;
        let reply = inbox.turn(|command| match command {
            Command::Info => Outcome::Info(self.info()),
            Command::GetMap => {
                wants_map = true;
                Outcome::Done
            }
            Command::Pause { on } => {
                self.is_paused = *on;
                Outcome::Done
            }
            _ => Outcome::Refused(Refusal::Recording),
        });
        self.inbox = inbox;
        let mut sent = reply.map_or_else(Vec::new, |reply| self.insert(&Message::Reply(reply)));
        if wants_map {
            sent.extend(self.whole_map());
        }
        sent
    }

    /// The map and the state at this point of the recording.
    pub fn whole_map(&mut self) -> Vec<u8> {
        let replica = self.listener.replica();
        let vertices = 0..replica.vertices();
        let mut messages: Vec<Message> = replica.hello().map(Message::Hello).into_iter().collect();
        messages.extend(vertices.clone().filter_map(|vertex| replica.row(vertex)).map(Message::Row));
        if replica.has_ways() {
            let ways = |vertex| VertexWays { vertex, ways: List::new(replica.ways(vertex).iter().copied()) };
            messages.extend(vertices.map(ways).map(Message::Ways));
        }
        messages.extend(self.map.filter(|_| replica.is_converged()));
        messages.extend(replica.location().map(Message::Location));
        messages.extend(replica.belief().map(Message::Belief));
        messages.extend(replica.exploration().map(Message::Exploration));
        messages.iter().flat_map(|message| self.insert(message)).collect()
    }

    /// Whether a client has paused the playback.
    pub const fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// The state of the recorded robot at this point.
    pub const fn listener(&self) -> &Listener {
        &self.listener
    }

    fn info(&self) -> Info {
        let replica = self.listener.replica();
        let hello = replica.hello();
        Info {
            version: Version::LIBRARY,
            boot: hello.map_or(0, |hello| hello.boot),
            reset_cause: hello.map_or(ResetCause::Unknown, |hello| hello.reset_cause),
            uptime_ms: replica.health().map_or(0, |health| health.uptime_ms),
            paused: self.is_paused,
            localise_only: false,
            goal: replica.goal_status().filter(|goal| goal.state == GoalState::Active).map(|goal| goal.vertex),
            stored_bytes: 0,
            stored_places_ago: 0,
        }
    }

    /// A frame between the recorded ones, which move up by one.
    fn insert(&mut self, message: &Message) -> Vec<u8> {
        let sequence = self.last.map_or(0, |last| last.wrapping_add(1));
        self.last = Some(sequence);
        self.offset = self.offset.map(|offset| offset.wrapping_add(1));
        let mut buffer = [0; MAX_FRAME_BYTES];
        // Every message fits this buffer.
        Encoder::new(sequence).encode(message, &mut buffer).map(<[u8]>::to_vec).unwrap_or_default()
    }

    /// Renumbers the frame in `piece`, if it is intact.
    fn renumber(&mut self) {
        let Some(mut raw) = unstuffed(&self.piece) else { return };
        let Some((body, crc)) = raw.split_last_chunk_mut::<CRC_BYTES>() else { return };
        let [_, low, high, ..] = *body else { return };
        if crc32(body) != u32::from_le_bytes(*crc) {
            return;
        }
        let recorded = u16::from_le_bytes([low, high]);
        let first = self.last.map_or(0, |last| last.wrapping_add(1).wrapping_sub(recorded));
        let sequence = recorded.wrapping_add(*self.offset.get_or_insert(first));
        if self.last.is_none_or(|last| sequence.wrapping_sub(last) < 1 << 15) {
            self.last = Some(sequence);
        }
        body[1..3].copy_from_slice(&sequence.to_le_bytes());
        *crc = crc32(body).to_le_bytes();
        self.piece = stuffed(&raw);
    }
}

/// Undoes COBS; `None` if a code byte points beyond the closing zero.
fn unstuffed(frame: &[u8]) -> Option<Vec<u8>> {
    let mut raw = frame.strip_suffix(&[0])?.to_vec();
    let mut code = 0;
    while code < raw.len() {
        let step = std::mem::take(&mut raw[code]);
        code += usize::from(step);
    }
    // The first code byte is none of the frame's.
    (code == raw.len() && code > 0).then(|| raw.split_off(1))
}

/// COBS of a frame below 254 bytes, with the closing zero.
fn stuffed(raw: &[u8]) -> Vec<u8> {
    let blocks = raw.split(|&byte| byte == 0).flat_map(|block| [&[block.len() as u8 + 1], block].concat());
    blocks.chain([0]).collect()
}

#[cfg(test)]
mod tests {
    use toposlam::wire::{DecodeError, Location, Request, Row};

    use super::*;

    fn frames(first: u16, messages: &[Message]) -> Vec<u8> {
        let mut encoder = Encoder::new(first);
        let frame = |message: &Message| encoder.encode(message, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec();
        messages.iter().flat_map(frame).collect()
    }

    fn request(id: u16, command: Command) -> Vec<u8> {
        Encoder::new(0).encode(&Request { id, command }, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
    }

    fn row(vertex: u8) -> Message {
        Message::Row(Row { vertex, radius_mm: 1000, visits: 1, neighbours: 0 })
    }

    #[test]
    fn every_frame_but_its_number_is_played_as_it_is() {
        let messages: Vec<Message> = (0..40).map(row).collect();
        let mut recorded = frames(65_530, &messages);
        let damaged = [9, 1, 2, 0];
        recorded.splice(0..0, damaged);
        let mut playback = Playback::new();
        let played: Vec<u8> = recorded.chunks(7).flat_map(|piece| playback.play(piece)).collect();
        assert_eq!(played, recorded, "nothing is inserted");
        let mut playback = Playback::new();
        let before = playback.answer(&request(1, Command::Info));
        let played = playback.play(&recorded);
        let (mut listener, mut seen) = (Listener::new(), Vec::new());
        listener.feed(&[before, played].concat(), |_, event| match event {
            Event::Message(_, message) => seen.push(*message),
            Event::Damaged(error) => assert_eq!(error, DecodeError::Cut),
        });
        assert_eq!(seen[1..], messages);
        assert_eq!((listener.counters().lost, listener.counters().cut), (0, 1));
    }

    #[test]
    fn lost_frames_stay_lost_and_requests_are_answered_without_a_gap() {
        let mut playback = Playback::new();
        let mut sent = playback.play(&frames(100, &[row(0)]));
        sent.extend(playback.answer(&request(1, Command::Explore)));
        sent.extend(playback.play(&frames(105, &[row(1)])));
        sent.extend(playback.answer(&request(2, Command::Pause { on: true })));
        assert!(playback.is_paused());
        sent.extend(playback.answer(&request(3, Command::Info)));
        let (mut listener, mut outcomes) = (Listener::new(), Vec::new());
        listener.feed(&sent, |_, event| {
            if let Event::Message(_, Message::Reply(reply)) = event {
                outcomes.push((reply.request, reply.outcome));
            }
        });
        assert_eq!(listener.counters().lost, 4);
        assert_eq!(outcomes[..2], [(1, Outcome::Refused(Refusal::Recording)), (2, Outcome::Done)]);
        assert!(matches!(outcomes[2], (3, Outcome::Info(Info { paused: true, .. }))), "{outcomes:?}");
    }

    #[test]
    fn the_whole_map_is_that_of_this_point_and_a_second_round_is_a_restart() {
        let digest = |vertices: u8| {
            let rows = (0..vertices).flat_map(|_| [232, 3, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
            crc32(&[vertices].into_iter().chain(rows).collect::<Vec<u8>>())
        };
        let map = |vertices| Message::Map { vertices, edges: 0, digest: digest(vertices) };
        let location = Message::Location(Location { place_index: 1, vertex: 0 });
        let mut playback = Playback::new();
        playback.play(&frames(0, &[row(0), map(1), location]));
        let mut late = Listener::new();
        late.feed(&playback.answer(&request(1, Command::GetMap)), |_, _| ());
        assert!(late.replica().is_converged() && late.replica().is_complete());
        assert_eq!((late.replica().vertices(), late.replica().location().unwrap().vertex), (1, 0));

        let mut listener = Listener::new();
        listener.feed(&playback.play(&frames(3, &[row(1), map(2)])), |_, _| ());
        playback.rewind();
        listener.feed(&playback.play(&frames(0, &[row(0), map(1)])), |_, _| ());
        assert_eq!((listener.counters().restarts, listener.replica().vertices()), (1, 1));
        assert_eq!(playback.listener().replica().vertices(), 1);
    }
}
