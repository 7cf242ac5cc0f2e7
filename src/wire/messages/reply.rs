//! What a robot answers to a request.

use serde::{Deserialize, Serialize};

use super::code::codes;
use super::{Chunk, ResetCause};

/// The answer to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reply {
    /// The number of the request.
    pub request: u16,
    /// What came of it.
    pub outcome: Outcome,
}

/// What came of a request. Append-only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Outcome {
    /// It is done, or under way.
    Done,
    /// Which robot this is and what it does.
    Info(Info),
    /// A piece of a snapshot.
    Snapshot {
        /// How many bytes the whole snapshot has.
        total: u16,
        /// The first byte of the piece.
        offset: u16,
        /// Its bytes; none beyond the end.
        bytes: Chunk,
    },
    /// It was not done, and everything is as it was.
    Refused(Refusal),
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

/// Which robot this is and what it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Info {
    /// The version of the library: major, minor, patch.
    pub version: Version,
    /// The number of this start; 0 when the robot has none.
    pub boot: u32,
    /// Why it started.
    pub reset_cause: ResetCause,
    /// Time since the start in milliseconds; it wraps.
    pub uptime_ms: u32,
    /// Whether it was told to stand still.
    pub paused: bool,
    /// Whether it keeps the map as it is.
    pub localise_only: bool,
    /// The vertex it was told to go to and has not reached.
    pub going_to: Option<u8>,
    /// The size of the newest snapshot that outlasts a loss of power, in bytes; 0 when there is none.
    pub stored_bytes: u16,
    /// How many places were observed since that snapshot was taken.
    pub stored_places_ago: u32,
}

/// The version of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// It grows with what breaks a program.
    pub major: u8,
    /// It grows with what is added.
    pub minor: u8,
    /// It grows with what is mended.
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

/// A part of the version, read at compile time; one beyond 255 does not compile.
const fn number(text: &str) -> u8 {
    match u8::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => panic!("a part of the version is no number up to 255"),
    }
}

codes! {
    /// Why a request was refused.
    Refusal {
        /// A reason that is not known here.
        Other => "for a reason that is not known here",
        /// The robot has no part that could do it.
        Unsupported = 1 => "this robot has no part that could do it",
        /// A value is out of its range.
        OutOfRange = 2 => "a value is out of its range",
        /// The map has no such vertex.
        UnknownVertex = 3 => "the map has no such vertex",
        /// No way through the map leads there.
        NoRoute = 4 => "no way through the map leads there",
        /// There is nowhere to keep a snapshot.
        NoStore = 5 => "there is nowhere to keep a snapshot",
        /// What has to come before it has not come.
        NotNow = 6 => "what has to come before it has not come",
        /// Bytes before the piece, or before the end, were not received.
        MissingChunk = 7 => "bytes before it were not received",
        /// The snapshot is longer than the robot has room for.
        TooLong = 8 => "the snapshot is longer than the robot has room for",
        /// The bytes received are not those whose CRC was told.
        BadCrc = 9 => "the bytes received are not those that were announced",
        /// The snapshot is intact but of another version or other capacities, or contradicts itself.
        BadSnapshot = 10 => "the snapshot does not fit this robot or contradicts itself",
        /// The robot is doing something that must end first.
        Busy = 11 => "something else must end first",
    }
}

impl core::error::Error for Refusal {}
