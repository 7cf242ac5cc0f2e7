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
pub struct Life {
    bytes: Vec<u8>,
    /// Number of bytes sent by the end of each ring frame.
    ends: Vec<usize>,
    map: TopologicalMap,
}

impl Life {
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
pub enum Afterwards {
    /// Restarts with an empty map, as after a reset.
    Again,
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
pub struct Crowd {
    port: TcpListener,
    lives: Vec<Life>,
    count: usize,
    afterwards: Afterwards,
    speakers: Vec<Option<Speaker>>,
}

/// A connected robot.
struct Speaker {
    stream: TcpStream,
    life: usize,
    /// Start of the current replay, in ring frames.
    frame: f64,
    /// Number of bytes sent in the current replay.
    said: usize,
}

impl Crowd {
    /// Opens a port, `HOST:PORT`, for `count` robots. Robot `n` replays life `n` modulo the number of lives, and starts
    /// at the fraction `n / count` of its first half.
    ///
    /// # Errors
    /// If the address is not one of this computer, or is in use.
    ///
    /// # Panics
    /// If there is no life, or one without ring frames.
    pub fn bind(address: &str, lives: Vec<Life>, count: usize, afterwards: Afterwards) -> io::Result<Self> {
        assert!(!lives.is_empty() && lives.iter().all(|life| life.frames() > 0), "every robot needs a recording");
        let port = TcpListener::bind(address)?;
        port.set_nonblocking(true)?;
        cost::expect_many(&port, count)?;
        Ok(Self { port, lives, count, afterwards, speakers: Vec::new() })
    }

    /// The address of the listening socket.
    ///
    /// # Errors
    /// If the operating system does not report it.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.port.local_addr()
    }

    /// Number of robots that have ever been connected.
    pub const fn met(&self) -> usize {
        self.speakers.len()
    }

    /// Number of connected robots.
    pub fn heard(&self) -> usize {
        self.speakers.iter().flatten().count()
    }

    /// Advances all robots by some time, which is ignored at unlimited pace; never blocks. Returns the number of bytes
    /// sent.
    pub fn live(&mut self, time: Duration, pace: Pace) -> usize {
        self.accept();
        let mut said = 0;
        for slot in &mut self.speakers {
            let Some(speaker) = slot else { continue };
            match speaker.live(&self.lives[speaker.life], time, pace, self.afterwards) {
                Ok(bytes) => said += bytes,
                Err(_) => *slot = None,
            }
        }
        said
    }

    fn accept(&mut self) {
        while self.speakers.len() < self.count {
            let Ok((stream, _)) = self.port.accept() else { return };
            let number = self.speakers.len();
            let life_number = number % self.lives.len();
            let life = &self.lives[life_number];
            // The fraction distributes the robots over a ring frame, so that they do not all send at once.
            let frame = number as f64 / self.count as f64 * (life.frames() as f64 / 2.0);
            let speaker = Speaker { stream, life: life_number, frame, said: life.bytes_before(frame as usize) };
            self.speakers.push(speaker.prepare().ok());
        }
    }
}

impl Speaker {
    fn prepare(self) -> io::Result<Self> {
        self.stream.set_nonblocking(true)?;
        self.stream.set_nodelay(true)?;
        cost::bound_sending(&self.stream)?;
        Ok(self)
    }

    fn live(&mut self, life: &Life, time: Duration, pace: Pace, afterwards: Afterwards) -> io::Result<usize> {
        let due = match pace {
            Pace::Times(speed) => {
                self.frame += time.as_secs_f64() * speed / FRAME_TIME.as_secs_f64();
                life.bytes_before(self.frame as usize)
            }
            Pace::Unbounded => (self.said + PIECE_BYTES).min(life.bytes()),
        };
        let mut written = 0;
        while self.said < due {
            match self.stream.write(&life.bytes[self.said..due]) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => {
                    self.said += count;
                    written += count;
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        if self.said == life.bytes() && afterwards == Afterwards::Again {
            self.said = 0;
            self.frame = (self.frame - life.frames() as f64).max(0.0);
        }
        Ok(written)
    }
}
