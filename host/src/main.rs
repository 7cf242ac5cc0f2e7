//! The `toposlam` command: one subcommand for each thing a person does with a robot or without one.

mod command;

use clap::{Parser, Subcommand};

/// Topological SLAM that fits in a microcontroller.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Drive a simulated robot through a floor plan and map it on this computer.
    Simulate(command::simulate::Arguments),
    /// Do the same with the firmware in an emulated STM32F405, and compare the maps bit for bit.
    Emulate(command::emulate::Arguments),
    /// Map a recording of ring ranges.
    Replay(command::replay::Arguments),
    /// Measure how often the maps of many random paths are right.
    Evaluate(command::evaluate::Arguments),
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().command {
        Command::Simulate(arguments) => command::simulate::run(&arguments),
        Command::Emulate(arguments) => command::emulate::run(&arguments),
        Command::Replay(arguments) => command::replay::run(&arguments),
        Command::Evaluate(arguments) => command::evaluate::run(&arguments),
    }
}
