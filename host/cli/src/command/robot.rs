//! `toposlam robot`: a simulated robot that serves its line at a TCP port, for use without hardware.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::Args;
use toposlam::reference::{ROBOT, SNAPSHOT_BYTES};
use toposlam_cli::outln;
use toposlam_link::broadcast::Broadcast;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::RobotModel;

use super::drive::{load_plan, noise_factor, start};

/// Ring frames per second of robot time.
const FRAMES_PER_SECOND: f64 = 10.0;

/// Arguments of `toposlam robot`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Address to listen at, HOST:PORT; port 0 for any free port.
    #[arg(long, default_value = "127.0.0.1:7070")]
    listen: String,
    /// Floor plan: the name of a built-in plan, or a file (docs/plans.md).
    #[arg(long, default_value = "office")]
    plan: PathBuf,
    /// Start of the robot, in metres in the frame of the plan [default: the start of the plan, or its most open place].
    #[arg(long, value_name = "X,Y", value_parser = start, allow_hyphen_values = true)]
    start: Option<(f64, f64)>,
    /// Seed of the drive and of all noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Factor on every noise of the robot, 0 to 100.
    #[arg(long, default_value_t = 1.0, value_parser = noise_factor)]
    noise: f64,
    /// Speed, 0.01 to 1000 times real time.
    #[arg(long, default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Stop after this many places; 0 for never.
    #[arg(long, default_value_t = 0)]
    places: usize,
}

/// Parses a speed; 1 is real time.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().map_err(|error| format!("{error}"))?;
    if (0.01..=1000.0).contains(&speed) { Ok(speed) } else { Err("must be 0.01 to 1000".to_owned()) }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let plan = load_plan(&arguments.plan, arguments.start)?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let model = RobotModel::default().with_noise(arguments.noise);
    let config = ROBOT.with_session(rand::random::<u32>().max(1));
    let mut exploration: Exploration<'_> = Exploration::with_robot(&plan, model, arguments.seed, &config, &mut buffer)?;
    let mut broadcast =
        Broadcast::bind(&arguments.listen).with_context(|| format!("listening at {}", arguments.listen))?;
    outln!("a simulated robot listens at tcp:{}", broadcast.address()?)?;
    let frame_time = Duration::from_secs_f64(1.0 / (FRAMES_PER_SECOND * arguments.speed));
    let mut next_frame = Instant::now();
    while arguments.places == 0 || exploration.places() < arguments.places {
        exploration.advance();
        let board = exploration.board();
        let received = broadcast.exchange(&board.sent);
        board.received.extend(received);
        next_frame += frame_time;
        std::thread::sleep(next_frame.saturating_duration_since(Instant::now()));
    }
    Ok(())
}
