//! Web server with a live view of a robot, read-only, on one page.
//!
//! | Module | Purpose |
//! |---|---|
//! | [`state`] | the state of a robot as JSON, from a [`Watch`] |
//! | [`server`] | the page, the newest state, and a stream of states, for several browsers |
//!
//! `/` is the page, `/map.json` the newest state, and `/events` a stream of server-sent events: the newest state, then
//! each new one. A slow browser skips states; it delays neither the robot's line nor other browsers.
//!
//! ```
//! use std::io::{Read, Write};
//! use std::net::TcpStream;
//!
//! use toposlam_cli::serve::{server::{Options, Server}, state::State};
//! use toposlam_link::watch::Watch;
//!
//! let server = Server::bind("127.0.0.1:0", Options::default(), &State::of(&mut Watch::new("tcp:robot:7070")))?;
//! let mut browser = TcpStream::connect(server.address())?;
//! write!(browser, "GET /map.json HTTP/1.1\r\nHost: {}\r\n\r\n", server.address())?;
//! let mut answer = String::new();
//! browser.read_to_string(&mut answer)?;
//! assert!(answer.starts_with("HTTP/1.1 200 OK\r\n") && answer.contains(r#""line":"tcp:robot:7070""#));
//! # Ok::<(), std::io::Error>(())
//! ```

mod http;
mod newest;
pub mod server;
pub mod state;

use std::sync::mpsc::sync_channel;

use self::server::Server;
use self::state::State;
use toposlam_link::link::{Link, Options, Source};
use toposlam_link::watch::Watch;

/// Maximum number of queued events. When the queue is full, the link waits for this thread, which never waits for a
/// browser.
const QUEUE: usize = 256;

/// Serves the state of the robot on a line. Reopens a failed line; returns only at the end of the standard input.
///
/// `name` is the name of the line, `-` for the standard input; `baud` is the speed of a serial port.
pub fn follow(name: &str, baud: u32, options: Options, server: &Server) {
    let (sender, inbox) = sync_channel(QUEUE);
    let _link = Link::start(Source::named(name, baud), options, move |event| sender.send(event).is_ok());
    let mut watch = Watch::new(name);
    while let Ok(first) = inbox.recv() {
        watch.apply(first);
        inbox.try_iter().take(QUEUE).for_each(|event| watch.apply(event));
        server.publish(&State::of(&mut watch));
    }
}

#[cfg(test)]
mod tests;
