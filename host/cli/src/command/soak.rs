//! `toposlam soak`: simulate a robot for hours with injected faults and an operator.

use anyhow::ensure;
use clap::Args;
use std::path::PathBuf;
use toposlam_cli::outln;
use toposlam_eval::soak::{Soak, TURNS_PER_HOUR};
use toposlam_sim::injector::FaultRates;
use toposlam_sim::world::RobotModel;

use super::drive::{fault_rate, load_plan, noise_factor, start};

/// Arguments of `toposlam soak`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Floor plan: the name of a built-in plan, or a file (docs/plans.md).
    #[arg(long, default_value = "office")]
    plan: PathBuf,
    /// Start of the robot, in metres in the frame of the plan [default: the start of the plan, or its most open place].
    #[arg(long, value_name = "X,Y", value_parser = start, allow_hyphen_values = true)]
    start: Option<(f64, f64)>,
    /// Seed of the world, of all noise and of the faults.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Factor on every noise of the robot, 0 to 100.
    #[arg(long, default_value_t = 1.0, value_parser = noise_factor)]
    noise: f64,
    /// Simulated hours; the main loop runs 10 times per second.
    #[arg(long, default_value_t = 24)]
    hours: u64,
    /// Fault rate of the ring and the line, 0 to 1: the probability that a sonar echo is lost. Every other rate is proportional to it
    /// (docs/faults.md).
    #[arg(long, value_name = "RATE", default_value_t = 0.01, value_parser = fault_rate)]
    faults: f64,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let model = RobotModel::default().with_noise(arguments.noise);
    let rates = FaultRates::scaled(arguments.faults);
    let soak = Soak { model, rates, seed: arguments.seed, turns: arguments.hours.saturating_mul(TURNS_PER_HOUR) };
    let life = soak.run(&load_plan(&arguments.plan, arguments.start)?)?;
    for line in life.lines() {
        outln!("{line}")?;
    }
    let mistakes = life.mistakes();
    ensure!(mistakes.is_empty(), "{}", mistakes.join("; "));
    outln!("no place was lost, and every injected fault that can be counted was counted")?;
    Ok(())
}
