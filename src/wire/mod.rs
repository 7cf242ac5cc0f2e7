//! The serial protocol: postcard messages in COBS frames. `docs/wire.md` is the specification.
//!
//! ```text
//! robot:    Mapper, faults ─▶ Reporter ─Message▶ Encoder ─bytes▶ serial line
//! listener: serial line ─bytes▶ Decoder ─Message▶ MapReplica
//!
//! client:   Request ─▶ Encoder ─bytes▶ serial line
//! robot:    serial line ─bytes▶ Inbox ─Command▶ main loop ─Outcome▶ Inbox ─Reply▶ Encoder
//! ```
//!
//! A listener needs no back channel. Every message but [`Message::Remapped`] gives absolute values, and the [`Reporter`]
//! repeats the whole map in turn. So a listener that joins late or loses frames converges, and the digest of the map shows
//! that it has. A client repeats its [`Request`] until it receives the [`Reply`]. Nothing here blocks or allocates.
//!
//! ```
//! use toposlam::wire::{Decoder, Encoder, MAX_FRAME_BYTES, MapReplica, Message, Progress};
//!
//! let mut buffer = [0; MAX_FRAME_BYTES];
//! let bytes = Encoder::default().encode(&Message::Edge { a: 0, b: 1, present: true }, &mut buffer)?;
//!
//! let mut replica = MapReplica::<64>::new();
//! if let Progress::Message { header, message, .. } = Decoder::new().feed(bytes) {
//!     replica.apply(header, &message);
//! }
//! assert_eq!(replica.neighbours(0), 0b10);
//! # Ok::<(), toposlam::wire::EncodeError>(())
//! ```

mod decoder;
mod decoder_counters;
mod digest;
mod frame;
mod listener;
mod messages;
mod names;
mod robot;

pub use decoder::{Arrival, DecodeError, Decoder, Header, Progress};
pub use decoder_counters::DecoderCounters;
pub use digest::{crc32, map_digest};
pub use frame::{EncodeError, Encoder, FRAME_VERSION, MAX_FRAME_BYTES};
pub use listener::MapReplica;
pub use messages::{
    Belief, CHUNK_BYTES, Capacities, Chunk, Clock, Command, Echoes, Evidence, Exploration, Factors, FilterSettings,
    GoalState, GoalStatus, Health, Hello, HelloError, Info, List, Location, Message, NAME_BYTES, Name, NameError,
    Outcome, PROTOCOL_VERSION, Payload, Refusal, Remapped, Reply, Request, ResetCause, Row, SCHEMA_HASH, SETTINGS_MAX,
    Setting, Settings, Start, Velocity, Version, VertexProbability, VertexWays, Way, WayId, Worst,
};
pub use names::Names;
pub use robot::{Inbox, QueueFull, Reporter, Staging};
