//! Tasks for a robot at the other end of a link, and their results.

use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use toposlam::wire::{Command, Outcome};

use crate::client::{Client, ClientError};
use crate::line::Line;
use crate::listener::{Event, Listener};
use crate::setting;

/// The most tasks that wait on a link.
pub const TASKS: usize = 16;

/// A task for the robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Task {
    /// Send one command.
    Command(Command),
    /// Fetch a snapshot and write it to a file.
    Snapshot {
        /// The file.
        file: PathBuf,
        /// Whether an existing file is replaced.
        force: bool,
    },
    /// Send the snapshot in a file; the robot replaces its map and the settings of its filter with it.
    Restore(PathBuf),
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Command(Command::Info) => f.write_str("info"),
            Self::Command(Command::GetMap) => f.write_str("get the map"),
            Self::Command(Command::Reset) => f.write_str("reset"),
            Self::Command(Command::GetSettings) => f.write_str("settings"),
            Self::Command(Command::SetConfig(setting)) => write!(f, "set {}", setting::text(*setting)),
            Self::Command(Command::LocaliseOnly { on: true }) => f.write_str("localise only"),
            Self::Command(Command::LocaliseOnly { on: false }) => f.write_str("continue mapping"),
            Self::Command(Command::GoTo { vertex }) => write!(f, "go to {vertex}"),
            Self::Command(Command::Name { vertex, name }) if name.is_none() => write!(f, "clear the name of {vertex}"),
            Self::Command(Command::Name { vertex, name }) => write!(f, "name {vertex} {name}"),
            Self::Command(Command::Explore) => f.write_str("explore"),
            Self::Command(Command::Pause { on: true }) => f.write_str("pause"),
            Self::Command(Command::Pause { on: false }) => f.write_str("resume"),
            Self::Command(other) => write!(f, "{other:?}"),
            Self::Snapshot { file, .. } => write!(f, "snapshot to {}", file.display()),
            Self::Restore(file) => write!(f, "restore {}", file.display()),
        }
    }
}

/// The result of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The robot's reply to a command; a refusal is a reply.
    Outcome(Outcome),
    /// Number of bytes of the snapshot written to the file.
    Written(usize),
    /// The restored snapshot.
    Restored {
        /// Its number of bytes.
        bytes: usize,
        /// What it changed beside the map, in words; `None` if the robot does not report it.
        changes: Option<Vec<String>>,
    },
}

/// Why a task failed.
#[derive(Debug)]
pub enum TaskError {
    /// The line to the robot is not open.
    NotConnected,
    /// The file cannot be read or written.
    File(io::Error),
    /// The robot did not reply, or refused the snapshot.
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

/// Whether a path is a device, which is written to and not replaced.
fn is_device(file: &Path) -> bool {
    file.exists() && !file.is_file()
}

/// Performs a task.
pub(super) fn perform(
    client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>,
    task: &Task,
) -> Result<Answer, TaskError> {
    Ok(match task {
        Task::Command(command) => Answer::Outcome(client.request(*command)?),
        Task::Snapshot { file, force } => {
            let snapshot = client.snapshot()?;
            let mut options = File::options();
            let options = options.write(true).create(true).truncate(true).create_new(!force && !is_device(file));
            options.open(file)?.write_all(&snapshot)?;
            Answer::Written(snapshot.len())
        }
        Task::Restore(file) => {
            let snapshot = std::fs::read(file)?;
            let changes = match client.modes() {
                Ok(before) => Some(client.restore_and_compare(&snapshot, &before, false)?),
                Err(error @ ClientError::Line(_)) => return Err(error.into()),
                Err(_) => client.restore(&snapshot).map(|()| None)?,
            };
            Answer::Restored { bytes: snapshot.len(), changes }
        }
    })
}
