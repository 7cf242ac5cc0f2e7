//! A live view of a robot in browsers: a small web server with one page, which only shows and tells the robot nothing.
//!
//! | Part | Is |
//! |---|---|
//! | [`state`] | what is known of a robot as JSON, from a [`Watch`] |
//! | [`server`] | the page, the newest state, and the states as they come, for several browsers at once |
//!
//! A browser gets `/`, the page; `/map.json`, the newest state; and `/events`, the newest state and then each next one as
//! server-sent events. One that is slow misses states and sees the newest next; it holds up neither the robot's line nor the others.
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

/// News that may wait. When more come the line waits for this computer; it never waits for a browser.
const QUEUE: usize = 256;

/// Shows the robot on a line until the standard input has ended, if that is the line; a line that is cut is opened again.
///
/// `name` is the name of the line, `-` for the standard input; `baud` is the speed of a serial port.
pub fn follow(name: &str, baud: u32, options: Options, server: &Server) {
    let (sender, inbox) = sync_channel(QUEUE);
    let _link = Link::start(Source::named(name, baud), options, move |news| sender.send(news).is_ok());
    let mut watch = Watch::new(name);
    while let Ok(first) = inbox.recv() {
        watch.hear(first);
        inbox.try_iter().take(QUEUE).for_each(|news| watch.hear(news));
        server.publish(&State::of(&mut watch));
    }
}

#[cfg(test)]
mod tests;
