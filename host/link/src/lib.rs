//! The host's end of a robot's serial line.
//!
//! [`mod@line`] opens a line; [`broadcast`] is the robot's end of one, and [`playback`] plays a recording as a robot.
//! [`listener`] decodes bytes into events, [`client`] sends requests, [`topology`] holds the map as plain data, and
//! [`layout`] computes positions for drawing it. [`export`] writes the map in other formats, [`mod@import`] reads it from
//! files, [`mod@merge`] merges two maps, and `recording` (feature `recording`) records the line. [`link`] keeps a line open
//! in its own thread, and [`watch`] keeps the newest state of a link. [`event_text`] and [`mod@json`] format an event as
//! text and as JSON; [`mod@setting`] names the robot's settings, and [`plural`] counts
//! things.

pub mod broadcast;
pub mod client;
pub mod event_text;
pub mod export;
pub mod import;
pub mod json;
pub mod layout;
pub mod line;
pub mod link;
pub mod listener;
pub mod merge;
pub mod playback;
pub mod plural;
#[cfg(feature = "recording")]
pub mod recording;
pub mod setting;
pub mod topology;
pub mod watch;
