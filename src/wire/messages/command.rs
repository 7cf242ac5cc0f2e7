//! The commands to a robot. Append-only within a frame version (`docs/wire.md`, Stability).

use serde::{Deserialize, Serialize};

use super::{List, Name, Setting};

/// The most bytes of a snapshot in one request or reply.
pub const CHUNK_BYTES: usize = 64;

/// A chunk of a snapshot.
pub type Chunk = List<u8, CHUNK_BYTES>;

/// A command with an id, which its reply repeats. A client that receives no reply sends the same request again; the robot
/// executes it once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    /// The id of the request, different from that of the previous request.
    pub id: u16,
    /// The command.
    pub command: Command,
}

/// A command to a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Command {
    /// Requests the state of the robot; the outcome is [`Outcome::Info`](super::Outcome::Info).
    Info,
    /// Requests the whole map, beginning with a `Hello`.
    GetMap,
    /// Requests a chunk of a snapshot; the outcome is [`Outcome::Snapshot`](super::Outcome::Snapshot).
    GetSnapshot {
        /// The first byte of the chunk. Offset 0 takes a new snapshot; other chunks are of the snapshot taken last.
        offset: u16,
    },
    /// Starts the transfer of a snapshot to be restored. Chunks sent before are dropped.
    RestoreBegin {
        /// The length of the snapshot in bytes.
        length: u16,
        /// The CRC-32 ISO-HDLC of all its bytes.
        crc: u32,
    },
    /// Transfers a chunk of the snapshot to be restored. Chunks come in order; a chunk may be repeated.
    RestoreChunk {
        /// The first byte of the chunk.
        offset: u16,
        /// Its bytes.
        bytes: Chunk,
    },
    /// Restores the snapshot that was transferred. If it is refused, nothing changes.
    RestoreCommit,
    /// Clears the map and starts again.
    Reset,
    /// Changes one setting.
    SetConfig(Setting),
    /// Switches between localisation in the present map and mapping.
    LocaliseOnly {
        /// Whether the robot only localises.
        on: bool,
    },
    /// Sends the robot to a vertex; [`Message::GoalStatus`](super::Message::GoalStatus) reports the progress.
    GoTo {
        /// The vertex.
        vertex: u8,
    },
    /// Makes the robot explore.
    Explore,
    /// Pauses or resumes the robot. A paused robot stands still and ignores its sensors.
    Pause {
        /// Whether the robot pauses.
        on: bool,
    },
    /// Requests the settings; the outcome is [`Outcome::Settings`](super::Outcome::Settings).
    GetSettings,
    /// Names a vertex. Its former name is replaced.
    Name {
        /// The vertex.
        vertex: u8,
        /// The name, which no other vertex has; [`Name::NONE`] clears the name.
        name: Name,
    },
}
