//! The `toposlam` command: its subcommands.

// `outln!` and `errln!` do not panic when the output fails.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod command;

use std::io::{self, IsTerminal};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use toposlam_cli::{errln, output};

/// Topological SLAM that fits in a microcontroller.
#[derive(Parser)]
#[command(name = "toposlam", version, about)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Simulate a robot that explores a floor plan, and print and draw its map.
    Simulate(command::simulate::Arguments),
    /// Simulate many explorations, and count exact maps and reached goals.
    Explore(command::explore::Arguments),
    /// Run the firmware in an emulated STM32F405, and compare its map with that of `simulate` bit for bit.
    Emulate(command::emulate::Arguments),
    /// List and draw the places of a floor plan that a robot can distinguish.
    Plan(command::plan::Arguments),
    /// Simulate a robot for hours with injected faults and an operator, and check its fault counters.
    Soak(command::soak::Arguments),
    /// Map a CSV file of recorded ring ranges.
    Replay(command::replay::Arguments),
    /// Measure how often maps are exact, over random paths through known environments.
    Evaluate(command::evaluate::Arguments),
    /// Find the n-grams that distinguish places with equal labels, on random graphs without noise.
    Aliasing(command::aliasing::Arguments),
    /// Run a simulated robot that serves its line at a TCP port.
    Robot(command::robot::Arguments),
    /// Record the line of a robot in an MCAP file (feature `recording`).
    Record(command::record::Arguments),
    /// Play a recording back, or serve it as a robot (feature `recording`).
    Play(command::play::Arguments),
    /// Monitor and command a robot in the terminal.
    Monitor(command::monitor::Arguments),
    /// Export a robot's map as GraphML, DOT, GeoJSON, JSON or SVG.
    Export(command::export::Arguments),
    /// Merge the maps of two robots or two runs in one building.
    Merge(command::merge::Arguments),
    /// Monitor many robots in one thread, and measure the cost.
    Fleet(command::fleet::Arguments),
    /// Serve many recorded robots at one TCP port.
    #[command(hide = true)]
    Robots(command::robots::Arguments),
    /// Publish a robot's messages and map to an MQTT broker or a Zenoh router (features `mqtt`, `zenoh`).
    Publish(command::publish::Arguments),
    /// Serve a web page with a robot's live map.
    Serve(command::serve::Arguments),
    /// Send one command to a robot.
    Command(command::console::Arguments),
}

fn main() -> ExitCode {
    match parse().and_then(|arguments| arguments.map_or(Ok(()), |arguments| run(arguments.task))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if output::is_closed(&error) => ExitCode::SUCCESS,
        Err(error) => {
            errln!("Error: {error:?}");
            error.downcast_ref::<output::ExitError>().map_or(ExitCode::FAILURE, |error| error.code.into())
        }
    }
}

/// The arguments; `None` if they request the help or the version, which is printed.
fn parse() -> anyhow::Result<Option<Arguments>> {
    match Arguments::try_parse() {
        Ok(arguments) => Ok(Some(arguments)),
        Err(error) if error.use_stderr() => error.exit(),
        Err(help) => {
            // `clap` itself ignores an output that fails.
            let text = help.render();
            let text = if io::stdout().is_terminal() { text.ansi().to_string() } else { text.to_string() };
            output::write_bytes(text.as_bytes())?;
            Ok(None)
        }
    }
}

fn run(task: Task) -> anyhow::Result<()> {
    match task {
        Task::Simulate(arguments) => command::simulate::run(&arguments),
        Task::Explore(arguments) => command::explore::run(&arguments),
        Task::Emulate(arguments) => command::emulate::run(&arguments),
        Task::Plan(arguments) => command::plan::run(&arguments),
        Task::Soak(arguments) => command::soak::run(&arguments),
        Task::Replay(arguments) => command::replay::run(&arguments),
        Task::Evaluate(arguments) => command::evaluate::run(&arguments),
        Task::Aliasing(arguments) => command::aliasing::run(&arguments),
        Task::Robot(arguments) => command::robot::run(&arguments),
        Task::Record(arguments) => command::record::run(&arguments),
        Task::Play(arguments) => command::play::run(&arguments),
        Task::Monitor(arguments) => command::monitor::run(&arguments),
        Task::Export(arguments) => command::export::run(&arguments),
        Task::Merge(arguments) => command::merge::run(&arguments),
        Task::Fleet(arguments) => command::fleet::run(&arguments),
        Task::Robots(arguments) => command::robots::run(&arguments),
        Task::Publish(arguments) => command::publish::run(&arguments),
        Task::Serve(arguments) => command::serve::run(&arguments),
        Task::Command(arguments) => command::console::run(&arguments),
    }
}
