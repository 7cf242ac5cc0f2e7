//! What crosses the line: the messages of the robot, the requests of a client, and their parts.

mod belief;
mod code;
mod command;
mod drive;
mod echoes;
mod list;
mod message;
mod payload;
mod reply;
mod setting;

pub use belief::{Belief, PlaceProbability, Renamed, Worst};
pub use command::{CHUNK_BYTES, Chunk, Command, Request};
pub use drive::{Drive, Journey, JourneyState};
pub use echoes::Echoes;
pub use list::List;
pub use message::{
    Capacities, Evidence, Health, Hello, HelloError, Location, Message, PROTOCOL_VERSION, ResetCause, Row, SCHEMA_HASH,
};
pub use payload::Payload;
pub use reply::{Info, Outcome, Refusal, Reply, Version};
pub use setting::{Setting, Settings};
