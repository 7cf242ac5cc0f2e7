//! The line to a robot in a thread of its own: opens the line, receives events, executes tasks, and reopens a failed
//! line.
//!
//! ```
//! use std::sync::mpsc::channel;
//!
//! use toposlam_link::broadcast::Broadcast;
//! use toposlam_link::link::{Link, LinkEvent, Options, Source};
//!
//! let mut robot = Broadcast::bind("127.0.0.1:0")?;
//! let (sender, events) = channel();
//! let source = Source::named(&format!("tcp:{}", robot.address()?), 115_200);
//! let _link = Link::start(source, Options::default(), move |event| sender.send(event).is_ok());
//! assert!(matches!(events.recv()?, LinkEvent::Connected));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod task;

pub use task::{Answer, TASKS, Task, TaskError};

use std::cell::{Cell, RefCell};
use std::io::{self, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};
use std::{fmt, thread};

use toposlam::wire::{DecodeError, Header, Message};

use crate::client::{Client, ClientError};
use crate::line::{self, Line};
use crate::listener::{Event, Listener};
use task::perform;

/// Source of a robot's bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A line opened by [`line::open`]: its name, and the speed of a serial port in baud.
    Line(String, u32),
    /// The standard input: bytes as a robot sends them. Commands cannot be sent, and the link ends with the input.
    Input,
}

impl Source {
    /// `-` is the standard input; anything else is the name of a line.
    pub fn named(name: &str, baud: u32) -> Self {
        if name == "-" { Self::Input } else { Self::Line(name.to_owned(), baud) }
    }

    fn open(&self) -> anyhow::Result<Box<dyn Line>> {
        match self {
            Self::Line(name, baud) => line::open(name, *baud),
            Self::Input => Ok(Box::new(ReadOnly(io::stdin()))),
        }
    }

    /// Only a TCP connection can fail without notice to either end. Reopening a serial port may reset the board, and a
    /// robot may be silent.
    fn can_fail_silently(&self) -> bool {
        matches!(self, Self::Line(name, _) if name.starts_with("tcp:"))
    }
}

/// Timeouts of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Delay before a line that failed or does not exist is opened again.
    pub retry: Duration,
    /// A TCP line that is silent for this long is reopened.
    pub silence: Duration,
    /// Timeout of a reply; then the request is sent again.
    pub reply: Duration,
    /// Number of times a request is sent.
    pub attempts: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            retry: Duration::from_millis(500),
            silence: Duration::from_secs(10),
            reply: Duration::from_secs(1),
            attempts: 5,
        }
    }
}

/// An event of a link.
#[derive(Debug)]
pub enum LinkEvent {
    /// The line is open.
    Connected,
    /// The line failed or cannot be opened. The link retries; a repeated failure for the same reason is not reported.
    Disconnected(String),
    /// The standard input has ended; no event follows.
    Ended,
    /// `Ok`: a message; `Err`: a decoding error. Each with the state of the robot after it.
    Received(Result<(Header, Message), DecodeError>, Box<Listener>),
    /// The result of a task.
    TaskDone(Task, Result<Answer, TaskError>),
}

impl LinkEvent {
    /// An owned copy of a listener's event.
    pub fn received(listener: &Listener, event: Event<'_>) -> Self {
        let event = match event {
            Event::Message(header, message) => Ok((header, *message)),
            Event::Damaged(error) => Err(error),
        };
        Self::Received(event, Box::new(listener.clone()))
    }
}

/// Handle of a link. Dropping it ends the link.
#[derive(Debug)]
pub struct Link {
    tasks: SyncSender<Task>,
}

impl Link {
    /// Starts a link. The thread of the link calls `on_event` with each event until it returns `false`.
    pub fn start(source: Source, options: Options, on_event: impl FnMut(LinkEvent) -> bool + Send + 'static) -> Self {
        let (sender, tasks) = sync_channel(TASKS);
        thread::spawn(move || Worker { source, options, tasks, events: EventSink::new(on_event) }.run());
        Self { tasks: sender }
    }

    /// Queues a task; [`LinkEvent::TaskDone`] has its result. Tasks run one after the other. A task beyond [`TASKS`] is dropped.
    pub fn start_task(&self, task: Task) {
        // A link that has ended has already reported it.
        let _ = self.tasks.try_send(task);
    }
}

/// The thread of the link.
struct Worker<F> {
    source: Source,
    options: Options,
    tasks: Receiver<Task>,
    events: EventSink<F>,
}

/// The link was dropped, or the callback returned `false`.
struct Ended;

impl<F: FnMut(LinkEvent) -> bool> Worker<F> {
    fn run(self) {
        // The owner has ended the link.
        let _: Result<(), Ended> = self.reconnect_until_ended();
    }

    fn reconnect_until_ended(&self) -> Result<(), Ended> {
        let mut client: Option<Client<Box<dyn Line>, _>> = None;
        let mut last_reason = String::new();
        loop {
            let reason = match self.source.open() {
                Ok(line) => {
                    last_reason.clear();
                    self.events.emit(LinkEvent::Connected)?;
                    let client = match &mut client {
                        Some(client) => {
                            client.reconnect(line);
                            client
                        }
                        none => none.insert(self.client_on(line)),
                    };
                    self.serve(client)?.to_string()
                }
                Err(error) => format!("{error:#}"),
            };
            if self.source == Source::Input {
                return self.events.emit(LinkEvent::Ended);
            }
            if reason != last_reason {
                self.events.emit(LinkEvent::Disconnected(reason.clone()))?;
                last_reason = reason;
            }
            self.refuse_tasks_until_retry()?;
        }
    }

    fn client_on(&self, line: Box<dyn Line>) -> Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)> {
        let on_event =
            |listener: &Listener, event: Event<'_>| self.events.emit_received(LinkEvent::received(listener, event));
        let mut client = Client::new(line, rand::random(), on_event);
        client.timeout = self.options.reply;
        client.attempts = self.options.attempts;
        client
    }

    /// Receives and executes tasks until the line fails; returns the reason.
    fn serve(
        &self,
        client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>,
    ) -> Result<LineFailure, Ended> {
        self.events.received_at.set(Instant::now());
        loop {
            match self.tasks.try_recv() {
                Ok(task) => {
                    let answer = perform(client, &task);
                    let failed = matches!(answer, Err(TaskError::Client(ClientError::Line(_))));
                    self.events.emit(LinkEvent::TaskDone(task, answer))?;
                    if failed {
                        return Ok(LineFailure::DuringTask);
                    }
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return Err(Ended),
            }
            match client.listen() {
                Ok(()) => {}
                Err(ClientError::Line(error)) if error.kind() == io::ErrorKind::UnexpectedEof => {
                    return Ok(LineFailure::Closed);
                }
                Err(ClientError::Line(error)) => return Ok(LineFailure::Failed(error.to_string())),
                Err(error) => return Ok(LineFailure::Failed(error.to_string())),
            }
            self.events.check()?;
            if self.source.can_fail_silently() && self.events.received_at.get().elapsed() > self.options.silence {
                return Ok(LineFailure::Silent(self.options.silence));
            }
        }
    }

    /// Waits before the next attempt; tasks that arrive meanwhile fail.
    fn refuse_tasks_until_retry(&self) -> Result<(), Ended> {
        let deadline = Instant::now() + self.options.retry;
        loop {
            match self.tasks.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(task) => self.events.emit(LinkEvent::TaskDone(task, Err(TaskError::NotConnected)))?,
                Err(RecvTimeoutError::Timeout) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => return Err(Ended),
            }
        }
    }
}

/// Why a line is no longer used.
enum LineFailure {
    Closed,
    Failed(String),
    DuringTask,
    Silent(Duration),
}

impl fmt::Display for LineFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed => f.write_str("the other end closed the line"),
            Self::Failed(error) => write!(f, "the line failed: {error}"),
            Self::DuringTask => f.write_str("the line failed during a task"),
            Self::Silent(time) => write!(f, "no data for {:.1} s", time.as_secs_f64()),
        }
    }
}

/// Passes events to the owner of the link; shared by the client's callback and the thread.
struct EventSink<F> {
    on_event: RefCell<F>,
    is_open: Cell<bool>,
    received_at: Cell<Instant>,
}

impl<F: FnMut(LinkEvent) -> bool> EventSink<F> {
    fn new(on_event: F) -> Self {
        Self { on_event: RefCell::new(on_event), is_open: Cell::new(true), received_at: Cell::new(Instant::now()) }
    }

    fn emit(&self, event: LinkEvent) -> Result<(), Ended> {
        if self.is_open.get() && !(self.on_event.borrow_mut())(event) {
            self.is_open.set(false);
        }
        self.check()
    }

    fn emit_received(&self, event: LinkEvent) {
        self.received_at.set(Instant::now());
        // The thread checks after each read whether the owner still exists.
        let _ = self.emit(event);
    }

    fn check(&self) -> Result<(), Ended> {
        if self.is_open.get() { Ok(()) } else { Err(Ended) }
    }
}

/// A line that cannot be written to.
struct ReadOnly<READ>(READ);

impl<READ: Read> Read for ReadOnly<READ> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl<READ> Write for ReadOnly<READ> {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::Unsupported.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests;
