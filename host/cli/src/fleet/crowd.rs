//! Many robots at one TCP port, for trying and measuring a listener: each connection is one of them.
//!
//! They are robots that lived before and say all of it again. A thousand that live would cost more than listening to them.

use std::io::{self, ErrorKind, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::wire::{Decoder, Progress};

use super::cost;
use toposlam_link::topology::TopologicalMap;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel, VoronoiError};

/// How long a ring frame lasts at a robot's normal pace.
const FRAME_TIME: Duration = Duration::from_millis(100);
/// What one robot says before the next one does, when all are as fast as they can.
const PIECE_BYTES: usize = 1 << 12;
/// A robot that starts anew after that many messages is understood as one that did; after more it would look like one of
/// which frames were lost.
const MOST_MESSAGES: u32 = 30_000;

/// All that a simulated robot said.
#[derive(Clone, Debug)]
pub struct Life {
    bytes: Vec<u8>,
    /// How many of the bytes were said by the end of each ring frame.
    ends: Vec<usize>,
    map: TopologicalMap,
}

impl Life {
    /// Lets a robot explore a plan for so many ring frames, fewer when it says more than the line's numbers can tell apart.
    ///
    /// # Errors
    /// When the plan has no true map.
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
        let map = TopologicalMap::from(exploration.robot().mapper().map());
        Ok(Self { bytes, ends, map })
    }

    /// How many ring frames it lasts.
    pub const fn frames(&self) -> usize {
        self.ends.len()
    }

    /// How many bytes the robot said.
    pub const fn bytes(&self) -> usize {
        self.bytes.len()
    }

    /// The robot's map at the end.
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

/// What becomes of a robot that has said all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Afterwards {
    /// It starts anew, with an empty map, as after a reset.
    Again,
    /// It says nothing more, and the line stays open.
    Silence,
}

/// How fast the robots live.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// So many times as fast as a real one.
    Times(f64),
    /// As fast as they are listened to.
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

/// A robot that someone listens to.
struct Speaker {
    stream: TcpStream,
    life: usize,
    /// Since when it lives, in ring frames of this life.
    frame: f64,
    /// How much of this life was said, in bytes.
    said: usize,
}

impl Crowd {
    /// Opens a port, `HOST:PORT`, for `count` robots. Robot `n` lives life `n` modulo their number, and begins `n / count` of
    /// the way through the first half of it.
    ///
    /// # Errors
    /// When the address is not this computer's, or taken.
    ///
    /// # Panics
    /// When there is no life, or one of no ring frames.
    pub fn bind(address: &str, lives: Vec<Life>, count: usize, afterwards: Afterwards) -> io::Result<Self> {
        assert!(!lives.is_empty() && lives.iter().all(|life| life.frames() > 0), "a robot needs something to say");
        let port = TcpListener::bind(address)?;
        port.set_nonblocking(true)?;
        cost::expect_many(&port, count)?;
        Ok(Self { port, lives, count, afterwards, speakers: Vec::new() })
    }

    /// The address that it listens at.
    ///
    /// # Errors
    /// When the system does not know it.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.port.local_addr()
    }

    /// How many robots someone ever listened to.
    pub const fn met(&self) -> usize {
        self.speakers.len()
    }

    /// How many robots someone listens to.
    pub fn heard(&self) -> usize {
        self.speakers.iter().flatten().count()
    }

    /// Lets all robots live on by some time, which is of no account when the pace is unbounded; never waits. Gives how many
    /// bytes were said.
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
            // The fraction spreads the robots over a ring frame, so that they do not all speak at once.
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
