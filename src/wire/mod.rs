//! The serial protocol: what the robot knows, as postcard messages in COBS frames (`docs/wire.md` is the specification).
//!
//! ```text
//! robot: Filter, faults ─▶ Reporter ─Message▶ Encoder ─bytes▶ serial line
//! listener: serial line ─bytes▶ Decoder ─Message▶ Picture
//! ```
//!
//! There is no back channel. Every message but [`Message::Renamed`] states a fact in absolute terms, and
//! the [`Reporter`] repeats the whole map in turn, so that a listener who joins late or loses frames converges; it
//! learns that it has from a digest of the map. All of it is `no_std` and neither blocks nor allocates.
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

mod belief;
mod decoder;
mod digest;
mod echoes;
mod frame;
mod list;
mod message;
mod picture;
mod reporter;

pub use belief::{Belief, PlaceProbability, Renamed, Worst};
pub use decoder::{Arrival, DecodeError, Decoder, DecoderCounters, Header, Progress};
pub use digest::map_digest;
pub use echoes::Echoes;
pub use frame::{EncodeError, Encoder, FRAME_VERSION, MAX_FRAME_BYTES};
pub use list::List;
pub use message::{
    Capacities, Evidence, Health, Hello, HelloError, Location, Message, PROTOCOL_VERSION, Row, SCHEMA_HASH,
};
pub use picture::Picture;
pub use reporter::{QueueFull, Reporter};
