//! The replies of a robot to requests.

use serde::{Deserialize, Serialize};

use super::code::codes;
use super::{Chunk, List, ResetCause, SETTINGS_MAX, Setting};

/// The reply to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reply {
    /// The id of the request.
    pub request: u16,
    /// The outcome of the request.
    pub outcome: Outcome,
}

/// The outcome of a request. Append-only.
// The tag of `Done` is 0, so that a `static` robot is in `.bss`; the compiler's own choice depends on the variants.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
#[repr(u8)]
pub enum Outcome {
    /// The command was accepted.
    Done,
    /// The state of the robot.
    Info(Info),
    /// A chunk of a snapshot.
    Snapshot {
        /// The length of the whole snapshot in bytes.
        total: u16,
        /// The first byte of the chunk.
        offset: u16,
        /// Its bytes; none at the end of the snapshot.
        bytes: Chunk,
    },
    /// The command was refused; nothing has changed.
    Refused(Refusal),
    /// The settings of the robot.
    Settings {
        /// Those that the robot has, in the order of their numbers.
        settings: List<Setting, SETTINGS_MAX>,
    },
}

impl From<Refusal> for Outcome {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

impl From<Result<(), Refusal>> for Outcome {
    fn from(result: Result<(), Refusal>) -> Self {
        result.map_or_else(Self::Refused, |()| Self::Done)
    }
}

/// The state of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Info {
    /// The version of the library.
    pub version: Version,
    /// The number of this start; 0 if there is none.
    pub boot: u32,
    /// Why the robot started.
    pub reset_cause: ResetCause,
    /// Time since the start in milliseconds; it wraps.
    pub uptime_ms: u32,
    /// Whether the robot is paused.
    pub paused: bool,
    /// Whether the robot only localises.
    pub localise_only: bool,
    /// The goal, while the robot is on its way.
    pub goal: Option<u8>,
    /// The size of the newest stored snapshot in bytes; 0 if there is none.
    pub stored_bytes: u16,
    /// The number of places since that snapshot.
    pub stored_places_ago: u32,
}

/// The version of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// Raised by breaking changes.
    pub major: u8,
    /// Raised by additions.
    pub minor: u8,
    /// Raised by fixes.
    pub patch: u8,
}

impl Version {
    /// The version of this library.
    pub const LIBRARY: Self = Self {
        major: number(env!("CARGO_PKG_VERSION_MAJOR")),
        minor: number(env!("CARGO_PKG_VERSION_MINOR")),
        patch: number(env!("CARGO_PKG_VERSION_PATCH")),
    };
}

/// Parses a part of the version at compile time; a part above 255 does not compile.
const fn number(text: &str) -> u8 {
    match u8::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => panic!("a part of the version is not a number up to 255"),
    }
}

codes! {
    /// Why a request was refused.
    Refusal {
        /// A reason that this version does not know.
        Other => "the reason is unknown",
        /// The robot does not support the command.
        Unsupported = 1 => "this robot does not support the command",
        /// A value is out of its range.
        OutOfRange = 2 => "a value is out of its range",
        /// The map has no such vertex.
        UnknownVertex = 3 => "the map has no such vertex",
        /// No path of the map leads to the vertex.
        NoRoute = 4 => "no path of the map leads there",
        /// The robot cannot store snapshots.
        NoStore = 5 => "the robot cannot store snapshots",
        /// A command that must precede this one is missing.
        NotNow = 6 => "a command that must precede this one is missing",
        /// Bytes before the chunk, or before the end, are missing.
        MissingChunk = 7 => "bytes before it are missing",
        /// The snapshot is longer than the robot's buffer.
        TooLong = 8 => "the snapshot is longer than the robot's buffer",
        /// The CRC of the bytes received differs from the announced one.
        BadCrc = 9 => "the CRC differs from the announced one",
        /// The snapshot is intact but of another version or other capacities, or its contents are invalid.
        BadSnapshot = 10 => "the snapshot is of another version or other capacities, or invalid",
        /// Another operation must finish first.
        Busy = 11 => "another operation must finish first",
        /// A recording is played, and it takes no commands.
        Recording = 12 => "it is a recording, not a robot",
        /// The text is no name: too long, a number, or with characters that a name cannot have.
        BadName = 13 => "a name has 1 to 16 bytes of UTF-8, no control characters, no space at its ends, and is not a number",
        /// Another vertex has the name.
        NameTaken = 14 => "another vertex has this name",
    }
}

impl core::error::Error for Refusal {}
