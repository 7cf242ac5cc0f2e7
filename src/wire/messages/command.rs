//! What a robot can be told. Append-only: a variant is never changed, moved or removed once released (`docs/wire.md`,
//! Stability).

use serde::{Deserialize, Serialize};

use super::{List, Setting};

/// The most bytes of a snapshot that one request or reply carries.
pub const CHUNK_BYTES: usize = 64;

/// A piece of a snapshot.
pub type Chunk = List<u8, CHUNK_BYTES>;

/// A command with a number, by which its reply is known. A client that hears no reply sends the same request again, and the
/// robot executes it once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    /// The number of the request; it differs from that of the request before.
    pub id: u16,
    /// What to do.
    pub command: Command,
}

/// What a robot is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Command {
    /// Say which robot this is and what it does; the reply is [`Outcome::Info`](super::Outcome::Info).
    Info,
    /// Send the whole rolling picture at once, introduction included.
    GetMap,
    /// Send a piece of a snapshot; the reply is [`Outcome::Snapshot`](super::Outcome::Snapshot).
    GetSnapshot {
        /// The first byte of the piece. With 0 a snapshot is taken; other pieces are of the one that was taken last.
        offset: u16,
    },
    /// Get ready for a snapshot to be restored; what was sent before is dropped.
    RestoreBegin {
        /// How many bytes it has.
        length: u16,
        /// CRC-32 ISO-HDLC of all its bytes.
        crc: u32,
    },
    /// Take a piece of the snapshot to be restored. Pieces come in order; a piece may come again.
    RestoreChunk {
        /// The first byte of the piece.
        offset: u16,
        /// Its bytes.
        bytes: Chunk,
    },
    /// Go on with the map of the snapshot that was sent. When that is refused, everything stays as it was.
    RestoreCommit,
    /// Forget the map and start anew.
    Reset,
    /// Go on with another setting.
    SetConfig(Setting),
    /// Keep the map as it is and only tell where the robot is, or go on mapping.
    LocaliseOnly {
        /// Whether the map is kept.
        on: bool,
    },
    /// Drive to a vertex of the map; [`Message::Journey`](super::Message::Journey) tells how that goes.
    GoTo {
        /// The number of the vertex.
        vertex: u8,
    },
    /// Go on exploring.
    Explore,
    /// Stand still and observe nothing, or go on.
    Pause {
        /// Whether to stand still.
        on: bool,
    },
}
