//! The serial protocol: what the robot knows and what it can be told, as postcard messages in COBS frames (`docs/wire.md` is
//! the specification).
//!
//! ```text
//! robot: Filter, faults ─▶ Reporter ─Message▶ Encoder ─bytes▶ serial line
//! listener: serial line ─bytes▶ Decoder ─Message▶ Picture
//!
//! client: Request ─▶ Encoder ─bytes▶ serial line
//! robot: serial line ─bytes▶ Inbox ─Command▶ main loop ─Outcome▶ Inbox ─Reply▶ as a Message
//! ```
//!
//! A listener needs no back channel. Every message but [`Message::Renamed`] states a fact in absolute terms, and
//! the [`Reporter`] repeats the whole map in turn, so that a listener who joins late or loses frames converges; it
//! learns that it has from a digest of the map. A client repeats its [`Request`] until it hears the [`Reply`]. All of it is
//! `no_std` and neither blocks nor allocates.
//!
//! ```
//! use toposlam::wire::{Decoder, Encoder, MAX_FRAME_BYTES, Message, Picture, Progress};
//!
//! let mut buffer = [0; MAX_FRAME_BYTES];
//! let bytes = Encoder::default().encode(&Message::Edge { a: 0, b: 1, present: true }, &mut buffer)?;
//!
//! let mut picture = Picture::<64>::new();
//! if let Progress::Message { header, message, .. } = Decoder::new().feed(bytes) {
//!     picture.apply(header, &message);
//! }
//! assert_eq!(picture.neighbours(0), 0b10);
//! # Ok::<(), toposlam::wire::EncodeError>(())
//! ```

mod decoder;
mod digest;
mod frame;
mod listener;
mod messages;
mod robot;

pub use decoder::{Arrival, DecodeError, Decoder, DecoderCounters, Header, Progress};
pub use digest::{crc32, map_digest};
pub use frame::{EncodeError, Encoder, FRAME_VERSION, MAX_FRAME_BYTES};
pub use listener::Picture;
pub use messages::{
    Belief, CHUNK_BYTES, Capacities, Chunk, Command, Drive, Echoes, Evidence, Health, Hello, HelloError, Info, Journey,
    JourneyState, List, Location, Message, Outcome, PROTOCOL_VERSION, Payload, PlaceProbability, Refusal, Renamed,
    Reply, Request, ResetCause, Row, SCHEMA_HASH, Setting, Settings, Version, Worst,
};
pub use robot::{Inbox, QueueFull, Reporter, Staging};
