//! `toposlam robots`: serve many recorded robots at one TCP port, for `toposlam fleet --simulate`.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::Args;
use toposlam_cli::fleet::cost::allow_many_connections;
use toposlam_cli::fleet::replay_server::{AtEnd, Pace, RecordedStream, ReplayServer};
use toposlam_cli::{errln, outln};

use super::drive::load_plan;

/// The recordings, each a plan and the seed of its drive.
const LIVES: [(&str, u64); 2] = [("office", 1), ("ring", 2)];
/// Interval of the send loop, shorter than a ring frame, so that the robots do not all send at once.
const TURN: Duration = Duration::from_millis(5);

/// Arguments of `toposlam robots`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Number of robots.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    count: u32,
    /// Address to listen at, HOST:PORT.
    #[arg(long, default_value = "127.0.0.1:7070")]
    listen: String,
    /// Speed, 0.01 to 1000 times real time; 0 for as fast as the robots are read.
    #[arg(long, default_value_t = 1.0, value_parser = pace)]
    speed: f64,
    /// Ring frames in the recording of each robot.
    #[arg(long, default_value_t = 6000, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
}

/// Parses a speed; 1 is real time and 0 unlimited.
pub(super) fn pace(text: &str) -> Result<f64, String> {
    if text == "0" { Ok(0.0) } else { super::robot::speed(text) }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    allow_many_connections().context("opening many connections")?;
    let mut streams = Vec::new();
    for (plan, seed) in LIVES {
        let recorded = RecordedStream::record(&load_plan(Path::new(plan), None)?, seed, arguments.frames as usize)?;
        errln!("recorded {plan}: {} ring frames, {} bytes", recorded.frames(), recorded.bytes());
        streams.push(recorded);
    }
    let pace = if arguments.speed == 0.0 { Pace::Unbounded } else { Pace::Times(arguments.speed) };
    let mut server = ReplayServer::bind(&arguments.listen, streams, arguments.count as usize, AtEnd::Restart)
        .with_context(|| format!("listening at {}", arguments.listen))?;
    outln!("{} robots listen at tcp:{}", arguments.count, server.address()?)?;
    let mut lived = Instant::now();
    while server.accepted() == 0 || server.connected() > 0 {
        let time = lived.elapsed();
        lived += time;
        if server.send(time, pace) == 0 || pace != Pace::Unbounded {
            std::thread::sleep(TURN.saturating_sub(lived.elapsed()));
        }
    }
    Ok(())
}
