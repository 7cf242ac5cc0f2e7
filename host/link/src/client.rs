//! Client of a robot: sends a request until its reply arrives, and processes all other messages meanwhile.

use std::{
    fmt,
    io::{self, Read, Write},
    time::{Duration, Instant},
};

use toposlam::wire::{
    CHUNK_BYTES, Chunk, Command, Encoder, Info, MAX_FRAME_BYTES, MapReplica, Message, Outcome, Refusal, Request,
    Setting, crc32,
};

use crate::listener::{Event, Listener};
use crate::plural::count;
use crate::setting;

const BUFFER_BYTES: usize = 4096;

/// A blocking client over any line. Reads of the line should time out after some milliseconds.
///
/// A request without a reply within the timeout is sent again; the robot executes it only once. The callback receives
/// every event, replies included.
///
/// ```no_run
/// use toposlam::wire::Command;
/// use toposlam_link::{client::Client, line, event_text};
///
/// let robot = line::open("tcp:127.0.0.1:7070", 115_200)?;
/// let mut client = Client::new(robot, 1, |_, _| ());
/// println!("{} vertices", client.map()?.vertices());
/// println!("{}", event_text::outcome(&client.request(Command::GoTo { vertex: 0 })?));
/// std::fs::write("office.map", client.snapshot()?)?;
/// # Ok::<(), anyhow::Error>(())
/// ```
pub struct Client<L, F> {
    line: L,
    on_event: F,
    encoder: Encoder,
    listener: Listener,
    next_id: u16,
    /// Timeout of a reply; 1 s by default. The whole map may take five times as long.
    pub timeout: Duration,
    /// Number of times a request is sent before the client fails; 5 by default.
    pub attempts: u32,
}

impl<L: Read + Write, F: FnMut(&Listener, Event<'_>)> Client<L, F> {
    /// A client on a line. `first_id` should differ from the last request id of the previous client; use a random
    /// number.
    pub fn new(line: L, first_id: u16, on_event: F) -> Self {
        Self {
            line,
            on_event,
            encoder: Encoder::default(),
            listener: Listener::new(),
            next_id: first_id,
            timeout: Duration::from_secs(1),
            attempts: 5,
        }
    }

    /// The state of the robot so far.
    pub const fn listener(&self) -> &Listener {
        &self.listener
    }

    /// Continues on another line after the previous one failed; keeps the state.
    pub fn reconnect(&mut self, line: L) {
        self.line = line;
        self.listener.reconnected(&mut self.on_event);
    }

    /// Reads the line once and processes the received bytes, if any.
    ///
    /// # Errors
    /// If the line fails or ends.
    pub fn listen(&mut self) -> Result<(), ClientError> {
        self.await_reply(None).map(drop)
    }

    /// Sends a command and waits for its outcome. A refusal is an outcome, not an error.
    ///
    /// # Errors
    /// [`ClientError::NoReply`] after the last attempt; [`ClientError::Line`] if the line fails.
    pub fn request(&mut self, command: Command) -> Result<Outcome, ClientError> {
        let request = Request { id: self.next_id, command };
        self.next_id = self.next_id.wrapping_add(1);
        for _ in 0..self.attempts {
            self.send(&request)?;
            let deadline = Instant::now() + self.timeout;
            while Instant::now() < deadline {
                if let Some(outcome) = self.await_reply(Some(request.id))? {
                    return Ok(outcome);
                }
            }
        }
        Err(ClientError::NoReply { attempts: self.attempts })
    }

    /// Sends a command whose only successful outcome is `Done`.
    ///
    /// # Errors
    /// As [`Client::request`], and [`ClientError::Refused`].
    pub fn order(&mut self, command: Command) -> Result<(), ClientError> {
        match self.request(command)? {
            Outcome::Done => Ok(()),
            other => Err(other.into()),
        }
    }

    /// Requests the robot's version, settings and state.
    ///
    /// # Errors
    /// As [`Client::order`].
    pub fn info(&mut self) -> Result<Info, ClientError> {
        match self.request(Command::Info)? {
            Outcome::Info(info) => Ok(info),
            other => Err(other.into()),
        }
    }

    /// Requests the settings of the robot.
    ///
    /// # Errors
    /// As [`Client::order`]; [`ClientError::NoReply`] of a robot with protocol version 5 or less.
    pub fn settings(&mut self) -> Result<Vec<Setting>, ClientError> {
        match self.request(Command::GetSettings)? {
            Outcome::Settings { settings } => Ok(settings.as_slice().to_vec()),
            other => Err(other.into()),
        }
    }

    /// Requests the mode and the settings.
    ///
    /// # Errors
    /// As [`Client::settings`].
    pub fn modes(&mut self) -> Result<Modes, ClientError> {
        Ok(Modes { localise_only: self.info()?.localise_only, settings: self.settings()? })
    }

    /// Restores a snapshot as [`Client::restore`]. Returns in words what it changes of the modes `before`; with `keep_settings`
    /// these changes are reverted.
    ///
    /// # Errors
    /// As [`Client::modes`] and [`Client::restore`].
    pub fn restore_and_compare(
        &mut self,
        snapshot: &[u8],
        before: &Modes,
        keep_settings: bool,
    ) -> Result<Vec<String>, ClientError> {
        self.restore(snapshot)?;
        let after = self.modes()?;
        let changes = before.changes(&after);
        if keep_settings {
            for setting in before.settings.iter().filter(|&setting| !after.settings.contains(setting)) {
                self.order(Command::SetConfig(*setting))?;
            }
            if before.localise_only != after.localise_only {
                self.order(Command::LocaliseOnly { on: before.localise_only })?;
            }
        }
        Ok(changes)
    }

    /// Requests the whole map and waits until it is complete.
    ///
    /// # Errors
    /// As [`Client::order`], and [`ClientError::NoMap`] if part of the map is lost on the line in every attempt.
    pub fn map(&mut self) -> Result<&MapReplica<64>, ClientError> {
        for _ in 0..self.attempts {
            self.order(Command::GetMap)?;
            let deadline = Instant::now() + 5 * self.timeout;
            while Instant::now() < deadline {
                self.listen()?;
                let replica = self.listener.replica();
                if replica.is_converged() && replica.is_complete() {
                    return Ok(self.listener.replica());
                }
            }
        }
        Err(ClientError::NoMap)
    }

    /// Requests a snapshot and fetches it.
    ///
    /// # Errors
    /// As [`Client::order`].
    pub fn snapshot(&mut self) -> Result<Vec<u8>, ClientError> {
        let mut snapshot = Vec::new();
        loop {
            let offset = snapshot.len() as u16;
            match self.request(Command::GetSnapshot { offset })? {
                Outcome::Snapshot { total, offset: from, bytes } if from == offset => {
                    snapshot.extend(bytes.as_slice());
                    if snapshot.len() >= total.into() || bytes.as_slice().is_empty() {
                        return Ok(snapshot);
                    }
                }
                other => return Err(other.into()),
            }
        }
    }

    /// Sends a snapshot; the robot replaces its map with it.
    ///
    /// # Errors
    /// As [`Client::order`]; the robot then keeps its own map.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), ClientError> {
        let length = u16::try_from(snapshot.len()).map_err(|_| ClientError::Refused(Refusal::TooLong))?;
        self.order(Command::RestoreBegin { length, crc: crc32(snapshot) })?;
        for (offset, bytes) in (0..=length).step_by(CHUNK_BYTES).zip(snapshot.chunks(CHUNK_BYTES)) {
            self.order(Command::RestoreChunk { offset, bytes: Chunk::new(bytes.iter().copied()) })?;
        }
        self.order(Command::RestoreCommit)
    }

    /// A zero byte before the frame terminates any preceding noise.
    fn send(&mut self, request: &Request) -> Result<(), ClientError> {
        let mut buffer = [0; MAX_FRAME_BYTES + 1];
        let (_, frame) = buffer.split_at_mut(1);
        let length = self.encoder.encode(request, frame).map_err(io::Error::other)?.len();
        self.line.write_all(&buffer[..=length])?;
        self.line.flush()?;
        Ok(())
    }

    /// Reads once and processes the received bytes; returns the outcome of request `id` if it has arrived.
    fn await_reply(&mut self, id: Option<u16>) -> Result<Option<Outcome>, ClientError> {
        let mut buffer = [0; BUFFER_BYTES];
        let count = match self.line.read(&mut buffer) {
            Ok(0) => return Err(ClientError::Line(io::ErrorKind::UnexpectedEof.into())),
            Ok(count) => count,
            Err(error) if is_pause(&error) => 0,
            Err(error) => return Err(error.into()),
        };
        let mut outcome = None;
        let on_event = &mut self.on_event;
        self.listener.feed(&buffer[..count], |listener, event| {
            if let Event::Message(_, Message::Reply(reply)) = event
                && Some(reply.request) == id
            {
                outcome = Some(reply.outcome);
            }
            on_event(listener, event);
        });
        Ok(outcome)
    }
}

/// What a snapshot changes beside the map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Modes {
    /// Whether the robot only localises.
    pub localise_only: bool,
    /// Its settings.
    pub settings: Vec<Setting>,
}

impl Modes {
    /// What differs later, in words.
    fn changes(&self, later: &Self) -> Vec<String> {
        let value = |setting: Setting| setting::parts(setting).map_or(0, |(_, value)| value);
        let settings = self.settings.iter().zip(&later.settings).filter(|(before, after)| before != after);
        let mut changes: Vec<String> =
            settings.map(|(&before, &after)| format!("{}, was {}", setting::text(after), value(before))).collect();
        if self.localise_only != later.localise_only {
            let word = |on| if on { "on" } else { "off" };
            changes.push(format!("localise-only {}, was {}", word(later.localise_only), word(self.localise_only)));
        }
        changes
    }
}

fn is_pause(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// Why a command failed.
#[derive(Debug)]
pub enum ClientError {
    /// The line failed.
    Line(io::Error),
    /// No reply was received.
    NoReply {
        /// Number of times the request was sent.
        attempts: u32,
    },
    /// The robot refused the command.
    Refused(Refusal),
    /// The reply does not match the request.
    OutOfPlace(Box<Outcome>),
    /// The robot accepted the command, but its map arrived incomplete.
    NoMap,
}

impl From<io::Error> for ClientError {
    fn from(error: io::Error) -> Self {
        Self::Line(error)
    }
}

/// The error for an outcome that does not match the request.
impl From<Outcome> for ClientError {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Refused(refusal) => Self::Refused(refusal),
            other => Self::OutOfPlace(Box::new(other)),
        }
    }
}

impl fmt::Display for ClientError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(_) => f.write_str("the line to the robot failed"),
            Self::NoReply { attempts } => {
                write!(
                    f,
                    "no reply to {}: the robot is not connected, or does not know the command",
                    count(*attempts, "request", "requests")
                )
            }
            Self::Refused(refusal) => write!(f, "the robot refused: {refusal}"),
            Self::OutOfPlace(outcome) => write!(f, "unexpected reply: {outcome:?}"),
            Self::NoMap => f.write_str("the received map is incomplete"),
        }
    }
}

impl std::error::Error for ClientError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        if let Self::Line(error) = self { Some(error) } else { None }
    }
}
