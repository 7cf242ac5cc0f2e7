//! The robot's side of the line: it reports what changes, takes in requests, and puts snapshots together that come in pieces.

mod inbox;
mod reporter;
mod staging;

pub use inbox::Inbox;
pub use reporter::{QueueFull, Reporter};
pub use staging::Staging;

pub(in crate::wire) use reporter::bit;
