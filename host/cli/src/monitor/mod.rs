//! Live view of a robot in a terminal: map, location, beliefs and their evidence, and a key for every command.
//!
//! | Module | Purpose |
//! |---|---|
//! | [`model`] | the displayed state; processes events of a [`link`](toposlam_link::link) and keys, and returns actions |
//! | [`view`] | draws the model on a ratatui frame, without changing it |
//! | [`headless`] | writes a line of text for each event instead |
//! | [`screen`] | the terminal, and the event loop for link, keys and frames |
//!
//! The model and the view need no terminal:
//!
//! ```
//! use std::time::Instant;
//!
//! use ratatui::{Terminal, backend::TestBackend};
//! use toposlam::wire::{Encoder, MAX_FRAME_BYTES, Message};
//! use toposlam_link::{link::LinkEvent, listener::Listener};
//! use toposlam_cli::monitor::{model::Model, view};
//!
//! let mut model = Model::new("tcp:robot:7070");
//! let (mut listener, mut frame) = (Listener::new(), [0; MAX_FRAME_BYTES]);
//! let edge = Message::Edge { a: 0, b: 1, present: true };
//! listener.feed(Encoder::new(0).encode(&edge, &mut frame)?, |listener, event| {
//!     model.apply(LinkEvent::received(listener, event), Instant::now());
//! });
//! model.settle(Instant::now());
//!
//! let mut terminal = Terminal::new(TestBackend::new(80, 24))?;
//! terminal.draw(|frame| view::draw(frame, &model))?;
//! assert!(terminal.backend().to_string().contains("2 vertices, 1 edge"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod headless;
pub mod model;
mod prompt;
pub mod screen;
pub mod view;

#[cfg(test)]
mod tests;
