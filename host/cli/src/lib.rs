//! Components of the `toposlam` command: the emulated robot, the views of a robot on a line, and drawings.
//!
//! [`emulator`] runs the firmware in a simulated building. [`monitor`] shows a robot in a terminal, [`serve`] in
//! browsers, and `publish` (features `mqtt` and `zenoh`) publishes it to a broker; [`fleet`] monitors a thousand robots at
//! once. [`output`] is the standard output of all commands. [`picture`] draws a map over its floor plan, and [`progress`] a
//! progress bar.

// `outln!` and `errln!` do not panic when the output fails.
#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod emulator;
pub mod fleet;
pub mod monitor;
pub mod output;
pub mod picture;
pub mod progress;
#[cfg(any(feature = "mqtt", feature = "zenoh"))]
pub mod publish;
pub mod serve;

/// Compiles the code of the stream guide as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/stream.md")]
struct Stream;
