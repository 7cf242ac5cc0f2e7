//! Recordings of a robot's line as MCAP files, for replay and for the viewers Foxglove and Rerun.
//!
//! A recording holds every received byte, damaged ones included, and the time of arrival of each frame. It also holds
//! the decoded data as standard messages for viewers; `docs/recording.md` lists the topics.
//!
//! ```
//! use toposlam::wire::{Encoder, MAX_FRAME_BYTES, Message};
//! use toposlam_link::{listener::Listener, recording::{Recorder, Recording}};
//!
//! let mut buffer = [0; MAX_FRAME_BYTES];
//! let edge = Encoder::new(0).encode(&Message::Edge { a: 0, b: 1, present: true }, &mut buffer)?;
//!
//! let mut file = Vec::new();
//! let mut recorder = Recorder::new(&mut file)?;
//! recorder.record(edge, 1_000_000_000)?;
//! recorder.finish()?;
//!
//! let mut listener = Listener::new();
//! for frame in Recording::new(&file[..]) {
//!     listener.feed(&frame?.bytes, |_, _| ());
//! }
//! assert_eq!(listener.map().edges, [(0, 1)]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod drawing;
mod error;
mod reader;
mod recorder;
mod ros2;
mod scene;
#[cfg(test)]
mod tests;
mod topics;

use std::path::Path;

pub use error::RecordingError;
pub use reader::{Recording, TimedFrame};
pub use recorder::{Recorder, Summary};
pub use ros2::Ros2Bag;
pub use scene::{MAP_FRAME, METRES_PER_EDGE, ROBOT_FRAME};
pub use topics::Topic;

/// The bytes of each frame of a recording, in order of arrival. Their concatenation is the received stream.
///
/// # Errors
/// If the file cannot be opened; then each item as [`Recording`]'s.
pub fn frames(path: &Path) -> Result<impl Iterator<Item = Result<Vec<u8>, RecordingError>> + use<>, RecordingError> {
    Ok(Recording::open(path)?.map(|frame| frame.map(|frame| frame.bytes)))
}
