//! What the robot keeps across restarts: snapshots of what it has learned, and the flash that holds them.

pub mod snapshot;
#[cfg(feature = "store")]
pub mod store;
