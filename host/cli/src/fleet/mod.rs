//! Monitors a thousand robots over TCP in a single thread.
//!
//! | Module | Purpose |
//! |---|---|
//! | [`Fleet`] | the monitoring side: a [`Listener`] for each robot, fed when its line is readable |
//! | [`maps`] | one merged map per building |
//! | [`replay_server`] | the robots' side, for tests and measurements: recorded robots that repeat their streams |
//! | [`cost`] | the resources that this process uses |
//!
//! ```
//! use std::{io::Write, net::TcpListener, time::Duration};
//! use toposlam::wire::{Encoder, MAX_FRAME_BYTES, Message};
//! use toposlam_cli::fleet::Fleet;
//!
//! let robot = TcpListener::bind("127.0.0.1:0")?;
//! let mut fleet = Fleet::new()?;
//! fleet.connect("kitchen", &robot.local_addr()?.to_string());
//! let edge = Message::Edge { a: 0, b: 1, present: true };
//! robot.accept()?.0.write_all(Encoder::new(0).encode(&edge, &mut [0; MAX_FRAME_BYTES])?)?;
//! while fleet.totals().messages == 0 {
//!     fleet.listen(Duration::from_millis(10), |_, _, _| ())?;
//! }
//! assert_eq!(fleet.robots()[0].listener().map().edges, [(0, 1)]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod cost;
pub mod maps;
pub mod replay_server;

use std::io::{self, ErrorKind, Read};
use std::net::ToSocketAddrs;
use std::time::Duration;

use mio::net::TcpStream;
use mio::{Events, Interest, Poll, Token};
use toposlam::wire::Message;

use toposlam_link::listener::{Event, Listener};

/// Maximum number of bytes read from one robot per turn.
const READ_BYTES: usize = 1 << 14;
/// Maximum number of robots reported by one poll.
const EVENTS: usize = 1024;
/// On epoll and kqueue a read that does not fill the buffer has emptied the line; elsewhere only a read that would
/// block has.
const SHORT_READ_EMPTIES: bool = cfg!(any(target_os = "linux", target_os = "android", target_vendor = "apple"));

/// A monitor of many robots.
///
/// Memory: one [`Robot`] per robot, one shared buffer, and the operating system's buffers for each TCP connection. A
/// robot that fails, disconnects or sends invalid data does not affect the others; it is not reconnected.
pub struct Fleet {
    poll: Poll,
    events: Events,
    robots: Vec<Robot>,
    /// Robots with unread data.
    ready: Vec<usize>,
    buffer: Box<[u8]>,
}

/// One robot of a fleet.
#[derive(Debug)]
pub struct Robot {
    name: Box<str>,
    line: Line,
    is_ready: bool,
    /// The robot has closed its end; unread data may remain.
    is_ending: bool,
    listener: Listener,
    bytes: u64,
    places: u64,
}

/// The state of a robot's line.
#[derive(Debug)]
enum Line {
    Opening(TcpStream),
    Open(TcpStream),
    Ended(End),
}

/// Why a robot is no longer monitored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The robot closed the line.
    Closed,
    /// The line could not be opened, or failed.
    Failed(ErrorKind),
}

/// Totals of a fleet. Counts are since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Robots that are still connecting.
    pub connecting: usize,
    /// Robots whose line is open.
    pub connected: usize,
    /// Robots that closed their line.
    pub closed: usize,
    /// Robots whose line could not be opened, or failed.
    pub failed: usize,
    /// Robots whose map is known to be complete, whether or not their line is still open.
    pub converged: usize,
    /// Messages.
    pub messages: u64,
    /// Bytes, valid or not.
    pub bytes: u64,
    /// Places that the robots detected; each is a map update.
    pub places: u64,
    /// Lost frames.
    pub lost: u64,
    /// Damaged frames.
    pub damaged: u64,
    /// Intact frames of another version, or with an unknown message.
    pub unknown: u64,
}

impl Fleet {
    /// A fleet without robots.
    ///
    /// # Errors
    /// If the operating system provides no polling of many lines.
    pub fn new() -> io::Result<Self> {
        Ok(Self {
            poll: Poll::new()?,
            events: Events::with_capacity(EVENTS),
            robots: Vec::new(),
            ready: Vec::new(),
            buffer: vec![0; READ_BYTES].into(),
        })
    }

    /// Starts to connect to a robot at `HOST:PORT` and returns its index, from 0. Blocks only for the resolution of the
    /// host name. A robot that cannot be reached keeps its index, and [`Robot::end`] gives the reason after the
    /// connection times out.
    pub fn connect(&mut self, name: &str, address: &str) -> usize {
        let number = self.robots.len();
        let line = match self.open(address, number) {
            Ok(stream) => Line::Opening(stream),
            Err(error) => Line::Ended(End::Failed(error.kind())),
        };
        self.robots.push(Robot {
            name: name.into(),
            line,
            is_ready: false,
            is_ending: false,
            listener: Listener::new(),
            bytes: 0,
            places: 0,
        });
        number
    }

    fn open(&self, address: &str, number: usize) -> io::Result<TcpStream> {
        let address = address.to_socket_addrs()?.next().ok_or(ErrorKind::NotFound)?;
        let mut stream = TcpStream::connect(address)?;
        cost::bound_receiving(&stream)?;
        // The socket becomes writable when it is connected.
        self.poll.registry().register(&mut stream, Token(number), Interest::READABLE | Interest::WRITABLE)?;
        Ok(stream)
    }

    /// Waits for data, at most for `timeout`, and reads one piece from every robot that has some, so that a robot that
    /// never pauses does not block the others. `on_event` gets the robot's index, its listener, and the event.
    ///
    /// # Errors
    /// If the operating system fails; a failed line is not an error.
    pub fn listen(
        &mut self,
        timeout: Duration,
        mut on_event: impl FnMut(usize, &Listener, Event<'_>),
    ) -> io::Result<()> {
        let timeout = if self.ready.is_empty() { timeout } else { Duration::ZERO };
        match self.poll.poll(&mut self.events, Some(timeout)) {
            Err(error) if error.kind() == ErrorKind::Interrupted => return Ok(()),
            result => result?,
        }
        for event in &self.events {
            let Token(number) = event.token();
            if !std::mem::replace(&mut self.robots[number].is_ready, true) {
                self.ready.push(number);
            }
            // The end of the line has no event of its own if it arrives together with the last bytes.
            self.robots[number].is_ending |= event.is_read_closed();
        }
        let (robots, buffer) = (&mut self.robots, &mut self.buffer);
        self.ready.retain(|&number| {
            let robot = &mut robots[number];
            robot.is_ready = robot.read(buffer, |listener, event| on_event(number, listener, event));
            robot.is_ready
        });
        Ok(())
    }

    /// The robots by index.
    pub fn robots(&self) -> &[Robot] {
        &self.robots
    }

    /// Totals of all robots. Cost: [`toposlam::wire::MapReplica::is_converged`] for each.
    pub fn totals(&self) -> Totals {
        let mut totals = Totals::default();
        for robot in &self.robots {
            match robot.line {
                Line::Opening(_) => totals.connecting += 1,
                Line::Open(_) => totals.connected += 1,
                Line::Ended(End::Closed) => totals.closed += 1,
                Line::Ended(End::Failed(_)) => totals.failed += 1,
            }
            let counters = robot.listener.counters();
            totals.converged += usize::from(robot.is_converged());
            totals.messages += u64::from(counters.messages);
            totals.bytes += robot.bytes;
            totals.places += robot.places;
            totals.lost += u64::from(counters.lost);
            totals.damaged += u64::from(counters.damaged());
            totals.unknown += u64::from(counters.unknown());
        }
        totals
    }
}

impl Line {
    /// Checks the result of the connection.
    fn settle(&mut self) {
        let Self::Opening(stream) = self else { return };
        let result = stream.take_error().and_then(|error| error.map_or(Ok(()), Err)).and_then(|()| stream.peer_addr());
        *self = match (result, std::mem::replace(self, Self::Ended(End::Closed))) {
            (Ok(_), Self::Opening(stream)) => Self::Open(stream),
            (Err(error), Self::Opening(stream)) if error.kind() == ErrorKind::NotConnected => Self::Opening(stream),
            (Err(error), _) => Self::Ended(End::Failed(error.kind())),
            (Ok(_), other) => other,
        };
    }
}

impl Robot {
    /// The name of the robot.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The state of the robot.
    pub const fn listener(&self) -> &Listener {
        &self.listener
    }

    /// Why the robot is no longer monitored; `None` while it is.
    pub const fn end(&self) -> Option<End> {
        match self.line {
            Line::Opening(_) | Line::Open(_) => None,
            Line::Ended(end) => Some(end),
        }
    }

    /// Whether the map is known to be complete; `false` before the first message.
    pub fn is_converged(&self) -> bool {
        self.listener.replica().is_converged()
    }

    /// Number of received bytes.
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Number of places that the robot detected while it was monitored.
    pub const fn places(&self) -> u64 {
        self.places
    }

    /// Reads a piece; returns whether there may be more.
    fn read(&mut self, buffer: &mut [u8], mut on_event: impl FnMut(&Listener, Event<'_>)) -> bool {
        self.line.settle();
        let Line::Open(stream) = &mut self.line else { return false };
        let end = match stream.read(buffer) {
            Ok(0) => End::Closed,
            Ok(count) => {
                self.bytes += count as u64;
                let places = &mut self.places;
                self.listener.feed(&buffer[..count], |listener, event| {
                    if let Event::Message(_, Message::Place { .. }) = event {
                        *places += 1;
                    }
                    on_event(listener, event);
                });
                return count == buffer.len() || self.is_ending || !SHORT_READ_EMPTIES;
            }
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock => return false,
                ErrorKind::Interrupted => return true,
                kind => End::Failed(kind),
            },
        };
        // Closing the line removes it from the poll.
        self.line = Line::Ended(end);
        false
    }
}

#[cfg(test)]
mod tests;
