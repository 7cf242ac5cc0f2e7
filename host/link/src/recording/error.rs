//! Errors of recordings.

use std::{fmt, io};

use mcap::McapError;

/// Why a recording cannot be written or read.
#[derive(Debug)]
pub enum RecordingError {
    /// The file cannot be opened, written or read.
    File(io::Error),
    /// The file is not MCAP, or is damaged.
    Mcap(McapError),
    /// The file is valid MCAP, but contains no frames of a robot.
    NoFrames,
}

impl From<io::Error> for RecordingError {
    fn from(error: io::Error) -> Self {
        Self::File(error)
    }
}

impl From<McapError> for RecordingError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::Io(error) => Self::File(error),
            other => Self::Mcap(other),
        }
    }
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(_) => f.write_str("cannot access the recording"),
            Self::Mcap(_) => f.write_str("the recording is not an MCAP file, or is damaged"),
            Self::NoFrames => f.write_str("the MCAP file holds no frames of a toposlam robot"),
        }
    }
}

impl std::error::Error for RecordingError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::File(error) => Some(error),
            Self::Mcap(error) => Some(error),
            Self::NoFrames => None,
        }
    }
}
