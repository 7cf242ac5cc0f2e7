//! The line to a robot as a thread of its own: it opens the line, listens, tells the robot what it is told, and opens the
//! line again when it is cut.
//!
//! ```
//! use std::sync::mpsc::channel;
//!
//! use toposlam_link::broadcast::Broadcast;
//! use toposlam_link::link::{Link, News, Options, Source};
//!
//! let mut robot = Broadcast::bind("127.0.0.1:0")?;
//! let (sender, news) = channel();
//! let source = Source::named(&format!("tcp:{}", robot.address()?), 115_200);
//! let _link = Link::start(source, Options::default(), move |news| sender.send(news).is_ok());
//! assert!(matches!(news.recv()?, News::Connected));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::cell::{Cell, RefCell};
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};
use std::{fmt, thread};

use toposlam::wire::{Command, DecodeError, Header, Message, Outcome};

use crate::client::{Client, ClientError};
use crate::line::{self, Line};
use crate::listener::{Event, Listener};

/// Where the bytes of a robot come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A line that [`line::open`] opens: its name, and the speed of a serial port in baud.
    Line(String, u32),
    /// The standard input: bytes as a robot sends them. Nothing can be told to it, and its end is the end.
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

    /// A serial port that is opened again may reset its board, and a robot may well be silent: only TCP lines, which can be
    /// dead without either end hearing of it.
    fn can_die_silently(&self) -> bool {
        matches!(self, Self::Line(name, _) if name.starts_with("tcp:"))
    }
}

/// How patient a link is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// How long to wait before a line that was cut, or is not there yet, is opened again.
    pub retry: Duration,
    /// A TCP line on which nothing comes for so long is opened anew.
    pub silence: Duration,
    /// How long a reply is waited for before a request is sent again.
    pub reply: Duration,
    /// How often a request is sent.
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

/// What to do with the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Task {
    /// Send one command.
    Tell(Command),
    /// Take a snapshot and write it to a file; one that is there is replaced.
    Snapshot(PathBuf),
    /// Send the snapshot in a file and go on with its map.
    Restore(PathBuf),
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tell(Command::Info) => f.write_str("info"),
            Self::Tell(Command::GetMap) => f.write_str("get the map"),
            Self::Tell(Command::Reset) => f.write_str("reset"),
            Self::Tell(Command::SetConfig(setting)) => write!(f, "set {setting:?}"),
            Self::Tell(Command::LocaliseOnly { on: true }) => f.write_str("localise only"),
            Self::Tell(Command::LocaliseOnly { on: false }) => f.write_str("go on mapping"),
            Self::Tell(Command::GoTo { vertex }) => write!(f, "go to {vertex}"),
            Self::Tell(Command::Explore) => f.write_str("explore"),
            Self::Tell(Command::Pause { on: true }) => f.write_str("pause"),
            Self::Tell(Command::Pause { on: false }) => f.write_str("go on"),
            Self::Tell(other) => write!(f, "{other:?}"),
            Self::Snapshot(file) => write!(f, "snapshot to {}", file.display()),
            Self::Restore(file) => write!(f, "restore {}", file.display()),
        }
    }
}

/// What came of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The robot's own answer to a command, a refusal among them.
    Outcome(Outcome),
    /// So many bytes of a snapshot were written to the file.
    Written(usize),
    /// The robot goes on with a snapshot of so many bytes.
    Restored(usize),
}

/// Why a task was not done.
#[derive(Debug)]
pub enum TaskError {
    /// There is no line to the robot now.
    NotConnected,
    /// The file cannot be read or written.
    File(io::Error),
    /// The robot did not answer, or did not take the snapshot.
    Client(ClientError),
}

impl fmt::Display for TaskError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConnected => f.write_str("the robot is not connected"),
            Self::File(error) => write!(f, "the file: {error}"),
            Self::Client(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for TaskError {}

impl From<ClientError> for TaskError {
    fn from(error: ClientError) -> Self {
        Self::Client(error)
    }
}

impl From<io::Error> for TaskError {
    fn from(error: io::Error) -> Self {
        Self::File(error)
    }
}

/// What happens on a link.
#[derive(Debug)]
pub enum News {
    /// The line is open.
    Connected,
    /// The line was cut, or cannot be opened. It is tried again until it can, and this is not repeated for the same reason.
    Disconnected(String),
    /// The standard input has ended, and nothing more will come.
    Ended,
    /// Something came of the bytes of the robot: `Ok` a message, `Err` a damage; and all that is known of the robot since then.
    Heard(Result<(Header, Message), DecodeError>, Box<Listener>),
    /// What came of a task.
    Answered(Task, Result<Answer, TaskError>),
}

impl News {
    /// An event of a listener, to be kept.
    pub fn heard(listener: &Listener, event: Event<'_>) -> Self {
        let event = match event {
            Event::Message(header, message) => Ok((header, *message)),
            Event::Damaged(error) => Err(error),
        };
        Self::Heard(event, Box::new(listener.clone()))
    }
}

/// The near end of a link. When it is dropped the link ends.
#[derive(Debug)]
pub struct Link {
    tasks: Sender<Task>,
}

impl Link {
    /// Starts a link. All that happens goes to `tell`, in the link's thread, until that says that nobody listens any more.
    pub fn start(source: Source, options: Options, tell: impl FnMut(News) -> bool + Send + 'static) -> Self {
        let (sender, tasks) = channel();
        thread::spawn(move || Far { source, options, tasks, tell: Teller::new(tell) }.run());
        Self { tasks: sender }
    }

    /// Has the link do something; [`News::Answered`] says what came of it. Tasks are done one after the other.
    pub fn start_task(&self, task: Task) {
        // A link that has ended has said so.
        let _ = self.tasks.send(task);
    }
}

/// The far end, in its thread.
struct Far<TELL> {
    source: Source,
    options: Options,
    tasks: Receiver<Task>,
    tell: Teller<TELL>,
}

/// Nobody listens any more.
struct Alone;

impl<TELL: FnMut(News) -> bool> Far<TELL> {
    fn run(self) {
        // Whoever ended it needs no more news.
        let _: Result<(), Alone> = self.connect_again_and_again();
    }

    fn connect_again_and_again(&self) -> Result<(), Alone> {
        let mut client: Option<Client<Box<dyn Line>, _>> = None;
        let mut last_reason = String::new();
        loop {
            let reason = match self.source.open() {
                Ok(line) => {
                    last_reason.clear();
                    self.tell.say(News::Connected)?;
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
                return self.tell.say(News::Ended);
            }
            if reason != last_reason {
                self.tell.say(News::Disconnected(reason.clone()))?;
                last_reason = reason;
            }
            self.refuse_meanwhile()?;
        }
    }

    fn client_on(&self, line: Box<dyn Line>) -> Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)> {
        let heard = |listener: &Listener, event: Event<'_>| self.tell.hear(News::heard(listener, event));
        let mut client = Client::new(line, rand::random(), heard);
        client.timeout = self.options.reply;
        client.attempts = self.options.attempts;
        client
    }

    /// Listens and does tasks until the line is cut; says why it was.
    fn serve(&self, client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>) -> Result<Cut, Alone> {
        self.tell.heard_at.set(Instant::now());
        loop {
            match self.tasks.try_recv() {
                Ok(task) => {
                    let answer = perform(client, &task);
                    let failed = matches!(answer, Err(TaskError::Client(ClientError::Line(_))));
                    self.tell.say(News::Answered(task, answer))?;
                    if failed {
                        return Ok(Cut::WhileTelling);
                    }
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return Err(Alone),
            }
            match client.listen() {
                Ok(()) => {}
                Err(ClientError::Line(error)) if error.kind() == io::ErrorKind::UnexpectedEof => {
                    return Ok(Cut::Closed);
                }
                Err(ClientError::Line(error)) => return Ok(Cut::Failed(error.to_string())),
                Err(error) => return Ok(Cut::Failed(error.to_string())),
            }
            self.tell.check()?;
            if self.source.can_die_silently() && self.tell.heard_at.get().elapsed() > self.options.silence {
                return Ok(Cut::Silent(self.options.silence));
            }
        }
    }

    /// Waits before the next attempt; what is to be told meanwhile cannot be.
    fn refuse_meanwhile(&self) -> Result<(), Alone> {
        let deadline = Instant::now() + self.options.retry;
        loop {
            match self.tasks.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(task) => self.tell.say(News::Answered(task, Err(TaskError::NotConnected)))?,
                Err(RecvTimeoutError::Timeout) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => return Err(Alone),
            }
        }
    }
}

/// Why a line is not used any more.
enum Cut {
    Closed,
    Failed(String),
    WhileTelling,
    Silent(Duration),
}

impl fmt::Display for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed => f.write_str("the other end closed the line"),
            Self::Failed(error) => write!(f, "the line failed: {error}"),
            Self::WhileTelling => f.write_str("the line failed while the robot was told something"),
            Self::Silent(time) => write!(f, "nothing was heard for {:.1} s", time.as_secs_f64()),
        }
    }
}

fn perform(
    client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>,
    task: &Task,
) -> Result<Answer, TaskError> {
    Ok(match task {
        Task::Tell(command) => Answer::Outcome(client.request(*command)?),
        Task::Snapshot(file) => {
            let snapshot = client.snapshot()?;
            std::fs::write(file, &snapshot)?;
            Answer::Written(snapshot.len())
        }
        Task::Restore(file) => {
            let snapshot = std::fs::read(file)?;
            client.restore(&snapshot)?;
            Answer::Restored(snapshot.len())
        }
    })
}

/// Hands out news; the client's callback and the link share it.
struct Teller<TELL> {
    tell: RefCell<TELL>,
    listened_to: Cell<bool>,
    heard_at: Cell<Instant>,
}

impl<TELL: FnMut(News) -> bool> Teller<TELL> {
    fn new(tell: TELL) -> Self {
        Self { tell: RefCell::new(tell), listened_to: Cell::new(true), heard_at: Cell::new(Instant::now()) }
    }

    fn say(&self, news: News) -> Result<(), Alone> {
        if self.listened_to.get() && !(self.tell.borrow_mut())(news) {
            self.listened_to.set(false);
        }
        self.check()
    }

    fn hear(&self, news: News) {
        self.heard_at.set(Instant::now());
        // The link looks after each read whether anyone listens.
        let _ = self.say(news);
    }

    fn check(&self) -> Result<(), Alone> {
        if self.listened_to.get() { Ok(()) } else { Err(Alone) }
    }
}

/// A line that nothing can be said on.
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
