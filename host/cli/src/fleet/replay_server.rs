//! Many robots at one TCP port, for testing and measuring a fleet: each connection is one robot.
//!
//! The robots replay recorded streams. A thousand simulated robots would cost more than monitoring them.

use std::io::{self, ErrorKind, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::wire::{Decoder, Progress};

use super::cost;
use toposlam_link::topology::TopologicalMap;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel, VoronoiError};

/// Duration of a ring frame at a robot's normal pace.
const FRAME_TIME: Duration = Duration::from_millis(100);
/// Maximum number of bytes that a robot sends in one turn at unlimited pace.
const PIECE_BYTES: usize = 1 << 12;
/// A restart after this many messages is recognised as one; after more messages it would look like lost frames.
const MOST_MESSAGES: u32 = 30_000;

/// The recorded stream of a simulated robot.
#[derive(Clone, Debug)]
pub struct RecordedStream {
    bytes: Vec<u8>,
    /// Number of bytes sent by the end of each ring frame.
    ends: Vec<usize>,
    map: TopologicalMap,
}

impl RecordedStream {
    /// Records a robot that explores a plan for a number of ring frames, or fewer if its stream exceeds the range of
    /// sequence numbers.
    ///
    /// # Errors
    /// If the plan has no true map.
    pub fn record(plan: &Plan, seed: u64, frames: usize) -> Result<Self, VoronoiError> {
        let mut buffer = [0; SNAPSHOT_BYTES];
        let mut exploration = Exploration::start(plan, RobotModel::default(), seed, &mut buffer)?;
        let (mut bytes, mut ends, mut messages) = (Vec::new(), Vec::new(), 0);
        while ends.len() < frames && messages < MOST_MESSAGES {
            exploration.advance();
            bytes.extend_from_slice(&exploration.board().sent);
            ends.push(bytes.len());
            messages += messages_in(&exploration.board().sent);
        }
        let map = TopologicalMap::of(exploration.robot().mapper().filter());
        Ok(Self { bytes, ends, map })
    }

    /// Number of ring frames.
    pub const fn frames(&self) -> usize {
        self.ends.len()
    }

    /// Number of bytes of the stream.
    pub const fn bytes(&self) -> usize {
        self.bytes.len()
    }

    /// The robot's final map.
    pub const fn map(&self) -> &TopologicalMap {
        &self.map
    }

    fn bytes_before(&self, frame: usize) -> usize {
        if frame == 0 { 0 } else { self.ends[frame.min(self.ends.len()) - 1] }
    }
}

fn messages_in(bytes: &[u8]) -> u32 {
    let mut decoder: Decoder = Decoder::new();
    let mut rest = bytes;
    loop {
        rest = match decoder.feed(rest) {
            Progress::NeedsMore => return decoder.counters().messages,
            Progress::Message { rest, .. } | Progress::Error { rest, .. } => rest,
        };
    }
}

/// Behaviour of a robot at the end of its recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtEnd {
    /// Restarts with an empty map, as after a reset.
    Restart,
    /// Stops sending, and keeps the line open.
    Silence,
}

/// Speed of the replay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// A multiple of real time.
    Times(f64),
    /// As fast as the bytes are read.
    Unbounded,
}

/// The robots and their port.
pub struct ReplayServer {
    port: TcpListener,
    streams: Vec<RecordedStream>,
    count: usize,
    at_end: AtEnd,
    connections: Vec<Option<Connection>>,
}

/// A connected robot.
struct Connection {
    stream: TcpStream,
    recorded: usize,
    /// Start of the current replay, in ring frames.
    frame: f64,
    /// Number of bytes sent in the current replay.
    sent: usize,
}

impl ReplayServer {
    /// Opens a port, `HOST:PORT`, for `count` robots. Robot `n` replays stream `n` modulo the number of streams, and starts
    /// at the fraction `n / count` of its first half.
    ///
    /// # Errors
    /// If the address is not one of this computer, or is in use.
    ///
    /// # Panics
    /// If there is no stream, or one without ring frames.
    pub fn bind(address: &str, streams: Vec<RecordedStream>, count: usize, at_end: AtEnd) -> io::Result<Self> {
        assert!(
            !streams.is_empty() && streams.iter().all(|recorded| recorded.frames() > 0),
            "every robot needs a recording"
        );
        let port = TcpListener::bind(address)?;
        port.set_nonblocking(true)?;
        cost::expect_many(&port, count)?;
        Ok(Self { port, streams, count, at_end, connections: Vec::new() })
    }

    /// The address of the listening socket.
    ///
    /// # Errors
    /// If the operating system does not report it.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.port.local_addr()
    }

    /// Number of robots that have ever been connected.
    pub const fn accepted(&self) -> usize {
        self.connections.len()
    }

    /// Number of connected robots.
    pub fn connected(&self) -> usize {
        self.connections.iter().flatten().count()
    }

    /// Advances all robots by some time, which is ignored at unlimited pace; never blocks. Returns the number of bytes
    /// sent.
    pub fn send(&mut self, time: Duration, pace: Pace) -> usize {
        self.accept();
        let mut sent = 0;
        for slot in &mut self.connections {
            let Some(connection) = slot else { continue };
            match connection.send(&self.streams[connection.recorded], time, pace, self.at_end) {
                Ok(bytes) => sent += bytes,
                Err(_) => *slot = None,
            }
        }
        sent
    }

    fn accept(&mut self) {
        while self.connections.len() < self.count {
            let Ok((stream, _)) = self.port.accept() else { return };
            let number = self.connections.len();
            let recorded_number = number % self.streams.len();
            let recorded = &self.streams[recorded_number];
            // The fraction distributes the robots over a ring frame, so that they do not all send at once.
            let frame = number as f64 / self.count as f64 * (recorded.frames() as f64 / 2.0);
            let connection =
                Connection { stream, recorded: recorded_number, frame, sent: recorded.bytes_before(frame as usize) };
            self.connections.push(connection.prepare().ok());
        }
    }
}

impl Connection {
    fn prepare(self) -> io::Result<Self> {
        self.stream.set_nonblocking(true)?;
        self.stream.set_nodelay(true)?;
        cost::bound_sending(&self.stream)?;
        Ok(self)
    }

    fn send(&mut self, recorded: &RecordedStream, time: Duration, pace: Pace, at_end: AtEnd) -> io::Result<usize> {
        let due = match pace {
            Pace::Times(speed) => {
                self.frame += time.as_secs_f64() * speed / FRAME_TIME.as_secs_f64();
                recorded.bytes_before(self.frame as usize)
            }
            Pace::Unbounded => (self.sent + PIECE_BYTES).min(recorded.bytes()),
        };
        let mut written = 0;
        while self.sent < due {
            match self.stream.write(&recorded.bytes[self.sent..due]) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => {
                    self.sent += count;
                    written += count;
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        if self.sent == recorded.bytes() && at_end == AtEnd::Restart {
            self.sent = 0;
            self.frame = (self.frame - recorded.frames() as f64).max(0.0);
        }
        Ok(written)
    }
}
