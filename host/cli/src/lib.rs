//! What the `toposlam` command is made of: the emulated robot, the views of a robot on a line, and pictures.
//!
//! [`emulator`] runs the firmware with the frames of a simulated building. [`monitor`] shows a robot in a terminal, [`serve`] in
//! browsers, `publish` (feature `mqtt`) on an MQTT broker; [`fleet`] listens to a thousand robots at once. [`picture`] draws a map over
//! its floor plan, and [`progress`] a bar.

pub mod emulator;
pub mod fleet;
pub mod monitor;
pub mod picture;
pub mod progress;
#[cfg(feature = "mqtt")]
pub mod publish;
pub mod serve;

/// The code in the guide to the stream is compiled as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/stream.md")]
struct Stream;
