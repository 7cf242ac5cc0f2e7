//! `toposlam monitor`: monitor and command a robot in the terminal.

use std::io::stdout;
use std::ops::ControlFlow;
use std::time::Duration;

use anyhow::ensure;
use clap::Args;
use toposlam_cli::monitor::headless::{self, Form, Limits};
use toposlam_cli::monitor::screen;
use toposlam_link::link::Options;

/// Arguments of `toposlam monitor`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Serial port of the robot, tcp:HOST:PORT, or - for the bytes of its line on the standard input.
    line: String,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
    /// Print a line for each event instead of drawing.
    #[arg(long)]
    headless: bool,
    /// Print each event as a JSON object.
    #[arg(long, requires = "headless")]
    json: bool,
    /// Stop after this many messages and damaged frames.
    #[arg(long, requires = "headless")]
    events: Option<u64>,
    /// Stop after this many seconds.
    #[arg(long, requires = "headless")]
    seconds: Option<f64>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let (line, baud, options) = (&arguments.line, arguments.baud, Options::default());
    if !arguments.headless {
        return screen::run(line, baud, options, |_| ControlFlow::Continue(()));
    }
    let time = arguments.seconds.map(Duration::try_from_secs_f64).transpose()?;
    ensure!(arguments.events != Some(0), "--events must be at least 1");
    let form = if arguments.json { Form::Json } else { Form::Words };
    headless::run(line, baud, options, form, Limits { events: arguments.events, time }, stdout().lock())
}
