//! The messages of the robot, the requests of a client, and their parts.

mod belief;
mod code;
mod command;
mod echoes;
mod evidence;
mod list;
mod message;
mod name;
mod navigation;
mod payload;
mod reply;
mod setting;
mod ways;

pub use belief::{Belief, Remapped, VertexProbability, Worst};
pub use command::{CHUNK_BYTES, Chunk, Command, Request};
pub use echoes::Echoes;
pub use evidence::{Evidence, Factors};
pub use list::List;
pub use message::{
    Capacities, Health, Hello, HelloError, Location, Message, PROTOCOL_VERSION, ResetCause, Row, SCHEMA_HASH,
};
pub use name::{NAME_BYTES, Name, NameError};
pub use navigation::{GoalState, GoalStatus, Velocity};
pub use payload::{Clock, Payload, Start};
pub use reply::{Info, Outcome, Refusal, Reply, Version};
pub use setting::{FilterSettings, SETTINGS_MAX, Setting, Settings};
pub use ways::{Exploration, VertexWays, Way, WayId};

pub(in crate::wire) use message::bit;
