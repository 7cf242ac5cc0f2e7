//! The host's end of a robot's serial line.
//!
//! [`mod@line`] opens a line and [`broadcast`] is a robot's end of one. [`listener`] turns bytes into events, [`client`] sends requests,
//! [`topology`] is the robot's map as plain data and [`layout`] where to draw it. [`export`] writes the map for other programs, and
//! `recording` (feature `recording`) records everything. [`link`] keeps a line open from a thread of its own and [`watch`] the newest of what
//! it brought. [`event_text`] and [`mod@json`] say an event in words and as JSON; [`mod@setting`] names the robot's settings.

pub mod broadcast;
pub mod client;
pub mod event_text;
pub mod export;
pub mod json;
pub mod layout;
pub mod line;
pub mod link;
pub mod listener;
#[cfg(feature = "recording")]
pub mod recording;
pub mod setting;
pub mod topology;
pub mod watch;
