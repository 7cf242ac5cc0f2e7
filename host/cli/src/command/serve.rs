//! `toposlam serve`: show the live map of a robot in browsers.

use anyhow::Context;
use clap::Args;
use toposlam_cli::serve::follow;
use toposlam_cli::serve::server::{Options, Server};
use toposlam_cli::serve::state::State;
use toposlam_cli::{errln, outln};
use toposlam_link::link;
use toposlam_link::watch::Watch;

/// Arguments of `toposlam serve`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Serial port of the robot, tcp:HOST:PORT, or - for the bytes of its line on the standard input.
    line: String,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
    /// Address to serve the page at, HOST:PORT; port 0 for any free port.
    #[arg(long, default_value = "127.0.0.1:8080")]
    listen: String,
    /// Host name that browsers may use besides the addresses of this computer and localhost; may be repeated.
    #[arg(long = "name", value_name = "NAME")]
    names: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { line, baud, listen, names } = arguments;
    let options = Options { names: names.clone(), ..Options::default() };
    let server = Server::bind(listen, options, &State::of(&mut Watch::new(line)))
        .with_context(|| format!("serving at {listen}"))?;
    let address = server.address();
    if !address.ip().to_canonical().is_loopback() {
        errln!("warning: whoever reaches {address} sees the robot's map: there is no password and no encryption");
    }
    if address.ip().is_unspecified() {
        outln!("the map is at http://localhost:{}/", address.port())?;
    } else {
        outln!("the map is at http://{address}/")?;
    }
    follow(line, *baud, link::Options::default(), &server);
    errln!("the input has ended; the page stays until this program is stopped");
    loop {
        std::thread::park();
    }
}
