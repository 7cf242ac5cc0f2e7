//! The `toposlam` command: one subcommand for each thing a person does with a robot or without one.

mod command;

use clap::{Parser, Subcommand};

/// Topological SLAM that fits in a microcontroller.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Let a simulated robot explore a floor plan, and map it on this computer.
    Simulate(command::simulate::Arguments),
    /// Let many simulated robots explore floor plans, and count right maps and journeys that arrive.
    Explore(command::explore::Arguments),
    /// Do the same as `simulate` with the firmware in an emulated STM32F405, and compare the maps bit for bit.
    Emulate(command::emulate::Arguments),
    /// Let a simulated robot live for hours with faults and an operator, and hold what it counts to what was done to it.
    Soak(command::soak::Arguments),
    /// Map a recording of ring ranges.
    Replay(command::replay::Arguments),
    /// Measure how often the maps of many random paths are right.
    Evaluate(command::evaluate::Arguments),
    /// Be a simulated robot at the other end of a TCP line.
    Robot(command::robot::Arguments),
    /// Keep what a robot on a line says in an MCAP file.
    Record(command::record::Arguments),
    /// Hear a recording of `record` again, or let others hear it.
    Play(command::play::Arguments),
    /// Watch a robot on a line live, and tell it what to do.
    Monitor(command::monitor::Arguments),
    /// Write a robot's map in a format of other programs.
    Export(command::export::Arguments),
    /// Listen to many robots at once, and say what that costs.
    Fleet(command::fleet::Arguments),
    /// Be many recorded robots at the other end of a TCP port.
    #[command(hide = true)]
    Robots(command::robots::Arguments),
    /// Tell an MQTT broker all that a robot on a line says.
    #[cfg(feature = "mqtt")]
    Publish(command::publish::Arguments),
    /// Show the live map of a robot on a line in browsers.
    Serve(command::serve::Arguments),
    /// Tell a robot on a line what to do.
    Command(command::console::Arguments),
}

fn main() -> anyhow::Result<()> {
    match Arguments::parse().task {
        Task::Simulate(arguments) => command::simulate::run(&arguments),
        Task::Explore(arguments) => command::explore::run(&arguments),
        Task::Emulate(arguments) => command::emulate::run(&arguments),
        Task::Soak(arguments) => command::soak::run(&arguments),
        Task::Replay(arguments) => command::replay::run(&arguments),
        Task::Evaluate(arguments) => command::evaluate::run(&arguments),
        Task::Robot(arguments) => command::robot::run(&arguments),
        Task::Record(arguments) => command::record::run(&arguments),
        Task::Play(arguments) => command::play::run(&arguments),
        Task::Monitor(arguments) => command::monitor::run(&arguments),
        Task::Export(arguments) => command::export::run(&arguments),
        Task::Fleet(arguments) => command::fleet::run(&arguments),
        Task::Robots(arguments) => command::robots::run(&arguments),
        #[cfg(feature = "mqtt")]
        Task::Publish(arguments) => command::publish::run(&arguments),
        Task::Serve(arguments) => command::serve::run(&arguments),
        Task::Command(arguments) => command::console::run(&arguments),
    }
}
