//! The robot's side of the line: it reports changes, receives requests, and transfers snapshots in chunks.

mod inbox;
mod reporter;
mod sent_map;
mod sent_ways;
mod staging;

pub use inbox::Inbox;
pub use reporter::{QueueFull, Reporter};
pub use staging::Staging;
