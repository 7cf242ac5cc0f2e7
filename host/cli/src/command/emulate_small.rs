//! `toposlam emulate --robot small`: the small robot on an emulated Cortex-M0, and the same robot on the host beside it.
//!
//! Every message of the image must be equal to that of the host: places, map, ways, evidence and velocities.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, bail, ensure};
use toposlam::reference::small::{self, DARTS, Filter, HISTORY, HYPOTHESES, VERTICES};
use toposlam::wire::{Decoder, Hello, Message, Progress as Decoded};
use toposlam_cli::emulator::microbit::Microbit;
use toposlam_cli::outln;
use toposlam_cli::progress::Progress;
use toposlam_sim::exploration::Exploration;

use super::drive::{DriveArguments, Summary};
use super::machine::MachineArguments;

/// Path of the image below the target directory.
const IMAGE: &str = "microbit/thumbv6m-none-eabi/release/robot";
/// The workspace of the image.
const WORKSPACE: &str = "boards/microbit";
/// Instructions and the ticks that they take.
const INSTRUCTIONS: u64 = 125;
const TICKS: u64 = 128;
/// The processor's clock in kHz.
const CLOCK_KHZ: u64 = 16_000;

/// Bytes between stack and robot that must stay unused.
const STACK_RESERVE_BYTES: u64 = 256;
/// The RAM of the machine in bytes.
const RAM_BYTES: u64 = 16 * 1024;

/// Emulates the robot with a ring of `SONARS` sensors; `features` are those of its image.
pub(super) fn run<const SONARS: usize>(
    drive: &DriveArguments,
    places: usize,
    machine: &MachineArguments,
    features: &[&str],
) -> anyhow::Result<()> {
    let elf = match &machine.elf {
        Some(elf) => elf.clone(),
        None => build(features)?,
    };
    let (plan, model) = drive.world_for_ring(SONARS)?;
    let (seed, robot) = (drive.seed(), small::robot::<SONARS>());
    let mut exploration = Exploration::<VERTICES, Filter, SONARS>::with_robot(&plan, model, seed, &robot, &mut [])?;
    let timeout = Duration::from_secs(machine.timeout_s);
    let mut microbit = Microbit::<SONARS>::start(&machine.qemu, &elf, timeout)?;
    let mut lines = Lines::default();
    let progress = Progress::new("", places, "places");
    let mut messages = 0;
    while exploration.places() < places {
        exploration.board().sent.clear();
        let frame = exploration.frame();
        microbit.send(&frame, &[])?;
        if exploration.map(&frame).is_some()
            && let Some(step) = exploration.steps().last()
        {
            progress.println(step)?;
            progress.increment();
        }
        let board = exploration.board();
        let velocity = board.velocity;
        for expected in lines.host(&board.sent)? {
            let message = lines.firmware(&mut microbit)?;
            ensure!(is_same(&message, &expected), "the firmware sent {message:?}, but the simulation {expected:?}");
            messages += 1;
        }
        exploration.drive(velocity);
    }
    drop(progress);
    let printed = microbit.end()?;
    drive.summarise(&Summary::of(&plan, &exploration))?;
    print_figures(&printed)?;
    outln!(
        "capacities: {SONARS} sonars, {HYPOTHESES} hypotheses, {VERTICES} vertices, {DARTS} darts, {HISTORY} places"
    )?;
    outln!("all {messages} messages of the firmware and of the simulation are equal bit for bit")?;
    Ok(())
}

/// Whether two messages are equal. The reports of the board differ, time and stack, and the session id, which depends on the time.
fn is_same(firmware: &Message, simulation: &Message) -> bool {
    match (firmware, simulation) {
        (Message::Health(_), Message::Health(_)) => true,
        (Message::Hello(firmware), Message::Hello(simulation)) => {
            Hello { session: simulation.session, ..*firmware } == *simulation
        }
        _ => firmware == simulation,
    }
}

/// The decoders of both lines.
#[derive(Default)]
struct Lines {
    host: Decoder,
    firmware: Decoder,
    waiting: VecDeque<Message>,
}

impl Lines {
    /// The messages of the simulated robot.
    fn host(&mut self, bytes: &[u8]) -> anyhow::Result<Vec<Message>> {
        decoded(&mut self.host, bytes)
    }

    /// The next message of the emulated robot.
    fn firmware<const SONARS: usize>(&mut self, microbit: &mut Microbit<SONARS>) -> anyhow::Result<Message> {
        loop {
            if let Some(message) = self.waiting.pop_front() {
                return Ok(message);
            }
            self.waiting.extend(decoded(&mut self.firmware, &microbit.receive()?)?);
        }
    }
}

fn decoded(decoder: &mut Decoder, bytes: &[u8]) -> anyhow::Result<Vec<Message>> {
    let mut messages = Vec::new();
    let mut rest = bytes;
    loop {
        rest = match decoder.feed(rest) {
            Decoded::NeedsMore => return Ok(messages),
            Decoded::Error { error, .. } => bail!("a corrupt message: {error}"),
            Decoded::Message { message, rest, .. } => {
                messages.push(message);
                rest
            }
        };
    }
}

/// Prints the figures of the image, ticks as instructions, and as milliseconds if each took one cycle.
///
/// # Errors
/// If the stack may have grown into the robot.
fn print_figures(printed: &str) -> anyhow::Result<()> {
    let mut used_bytes = 0;
    for line in printed.lines() {
        let (name, number) = line.split_once(": ").with_context(|| format!("the image printed {line:?}"))?;
        let number: u64 = number.parse().with_context(|| format!("the image printed {line:?}"))?;
        match name.split_once("_ticks") {
            Some((what, which)) => {
                let instructions = number * INSTRUCTIONS / TICKS;
                outln!("{what}_instructions{which}: {instructions}")?;
                outln!("{what}_ms_at_16_mhz{which}: {}", instructions.div_ceil(CLOCK_KHZ))?;
            }
            None => {
                outln!("{name}: {number}")?;
                used_bytes += if name.ends_with("_bytes") { number } else { 0 };
            }
        }
    }
    outln!("ram_bytes: {used_bytes}")?;
    ensure!(used_bytes > 0 && used_bytes + STACK_RESERVE_BYTES < RAM_BYTES, "the stack may have grown into the robot");
    Ok(())
}

/// Builds the image from the working directory and returns its path.
fn build(features: &[&str]) -> anyhow::Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let target = std::path::absolute(target)?;
    let status = Command::new(cargo)
        .args(["build", "--release", "--locked"])
        .args(features)
        .current_dir(WORKSPACE)
        .env("CARGO_TARGET_DIR", target.join("microbit"))
        .status()
        .with_context(|| format!("building the image in {WORKSPACE}"))?;
    ensure!(
        status.success(),
        "the image was not built; it needs `rustup target add thumbv6m-none-eabi` and the project's directory"
    );
    Ok(target.join(IMAGE))
}
