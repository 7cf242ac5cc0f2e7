//! `toposlam emulate`: the exploration of `simulate`, with mapping and drive in the firmware on an emulated STM32F405, or the small
//! robot on an emulated Cortex-M0.

use std::{
    ops::ControlFlow,
    path::PathBuf,
    process::Command,
    sync::{Mutex, mpsc},
    time::Duration,
};

use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use toposlam::drive::VelocityCommand;
use toposlam::persist::Persist;
use toposlam::reference::{SONARS, ordered, paper, robust, small};
use toposlam::robot::RobotConfig;
use toposlam::wire::{Belief, Evidence, FilterSettings, Location, Message, VertexWays, Worst};
use toposlam::{Filter, VertexId};
use toposlam_cli::emulator::Emulation;
use toposlam_cli::outln;
use toposlam_cli::output::OutputError;
use toposlam_cli::progress::Progress;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::injector::FaultRates;

use super::drive::{DriveArguments, Summary, fault_rate};
use super::emulate_small;
use super::filter::FilterArgument;
use super::hardship;
use super::machine::MachineArguments;
use super::received::Received;

/// Directory of the images built by `cargo firmware`.
const IMAGES: &str = "thumbv7em-none-eabihf/firmware";
/// The filter of the reference robot, whose image is `robot`.
const REFERENCE: FilterArgument = FilterArgument::Ordered;

/// Arguments of `toposlam emulate`.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    drive: DriveArguments,
    /// Stop after this many detected places.
    #[arg(long, default_value_t = 30)]
    places: usize,
    /// The robot: that of the reference board, or the small one on a Cortex-M0 with 16 KiB of RAM (docs/small-robot.md).
    #[arg(long, value_enum, default_value_t = RobotArgument::Reference)]
    robot: RobotArgument,
    /// Filter of the firmware; each one has an image of its own.
    #[arg(long, value_enum, default_value_t = REFERENCE)]
    filter: FilterArgument,
    #[command(flatten)]
    machine: MachineArguments,
    /// Fault rate of the sensor bus and the line, 0 to 1: the probability that a bus transfer fails. Every other rate is proportional to
    /// it (docs/faults.md). With faults, the map is compared with the ground truth and not with that of `simulate`.
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = fault_rate)]
    faults: f64,
}

/// The robot that is emulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum RobotArgument {
    /// The reference robot.
    Reference,
    /// The small robot with a ring of eight sonars.
    Small,
    /// The small robot with a ring of sixteen.
    #[value(name = "small-16")]
    Small16,
}

/// Timeout of the firmware's velocity command.
const VELOCITY_TIMEOUT: Duration = Duration::from_secs(10);

/// The same robot simulated on the host, and its velocity command after each frame.
struct Repetition<'buffer, const V: usize, F: Filter<V>> {
    exploration: Exploration<'buffer, V, F>,
    velocities: Vec<VelocityCommand>,
    /// Why the standard output ended the run.
    unprinted: Option<OutputError>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.drive.check_files(&[])?;
    if arguments.robot != RobotArgument::Reference {
        ensure!(arguments.faults == 0.0, "faults are emulated with the reference robot only");
        ensure!(arguments.filter == REFERENCE, "the small robot has the ordered filter only");
        return match arguments.robot {
            RobotArgument::Small16 => emulate_small::run::<16>(
                &arguments.drive,
                arguments.places,
                &arguments.machine,
                &["--features", "ring-of-16"],
            ),
            _ => emulate_small::run::<{ small::SONARS }>(&arguments.drive, arguments.places, &arguments.machine, &[]),
        };
    }
    if arguments.faults > 0.0 {
        ensure!(arguments.filter == REFERENCE, "faults are emulated with the filter of the reference robot only");
        let rates = FaultRates::scaled(arguments.faults);
        return hardship::run(&arguments.drive, emulation(arguments, "robot")?, arguments.places, rates);
    }
    match arguments.filter {
        FilterArgument::Ordered => compare_with::<{ ordered::VERTICES }, ordered::Filter>(
            arguments,
            emulation(arguments, "robot")?,
            &ordered::ROBOT,
            &mut [0; ordered::SNAPSHOT_BYTES],
        ),
        FilterArgument::Robust => compare_with::<{ robust::VERTICES }, robust::Filter>(
            arguments,
            emulation(arguments, "robot_robust")?,
            &robust::ROBOT,
            &mut [0; robust::SNAPSHOT_BYTES],
        ),
        FilterArgument::Paper => compare_with::<{ paper::VERTICES }, paper::Filter>(
            arguments,
            emulation(arguments, "robot_paper")?,
            &paper::ROBOT,
            &mut [0; paper::SNAPSHOT_BYTES],
        ),
    }
}

/// The emulation of an image, which is built unless one was given.
fn emulation(arguments: &Arguments, image: &str) -> anyhow::Result<Emulation> {
    let elf = match &arguments.machine.elf {
        Some(elf) => elf.clone(),
        None => build_firmware(image)?,
    };
    let mut emulation = Emulation::new(elf);
    emulation.qemu = arguments.machine.qemu.clone();
    emulation.timeout = Duration::from_secs(arguments.machine.timeout_s);
    Ok(emulation)
}

/// Runs the firmware, and the same robot on the host beside it; compares them message by message.
fn compare_with<const V: usize, F>(
    arguments: &Arguments,
    emulation: Emulation,
    robot: &RobotConfig<SONARS, F::Config>,
    buffer: &mut [u8],
) -> anyhow::Result<()>
where
    F: Filter<V, Config: FilterSettings + Send> + Persist + Send,
{
    let (plan, model) = arguments.drive.world()?;
    // The emulator requests frames on one thread and delivers messages on another.
    let repetition = Mutex::new(Repetition {
        exploration: Exploration::<V, F>::with_robot(&plan, model, arguments.drive.seed(), robot, buffer)?,
        velocities: Vec::new(),
        unprinted: None,
    });
    let (tell_velocity, velocities) = mpsc::channel::<VelocityCommand>();
    let progress = Progress::new("", arguments.places, "places");
    let mut received = Received::new();
    let mut elsewhere = None;
    let mut frames = 0;
    let (repeated, bar) = (&repetition, &progress);

    let outcome = emulation.run(
        move || {
            if frames > 0 {
                // The robot moves by the firmware's velocity command after the last frame.
                let velocity = velocities.recv_timeout(VELOCITY_TIMEOUT).ok()?;
                repeated.lock().ok()?.exploration.drive(velocity);
            }
            let mut repetition = repeated.lock().ok()?;
            if repetition.exploration.places() >= arguments.places {
                return None;
            }
            frames += 1;
            let frame = repetition.exploration.frame();
            if repetition.exploration.map(&frame).is_some()
                && let Some(step) = repetition.exploration.steps().last()
            {
                let printed = bar.println(step);
                repetition.unprinted = printed.err();
                bar.increment();
            }
            if repetition.unprinted.is_some() {
                return None;
            }
            let velocity = repetition.exploration.board().velocity;
            repetition.velocities.push(velocity);
            Some(frame)
        },
        |bytes, _| {
            received.feed(bytes, |message| {
                let Ok(repetition) = repetition.lock() else { return ControlFlow::Break(()) };
                let is_same = match message {
                    Message::Velocity(drive) => {
                        let speed_permille = drive.speed_permille.unsigned_abs();
                        let velocity = VelocityCommand { heading_mrad: drive.heading_mrad, speed_permille };
                        // The world may have ended already.
                        let _ = tell_velocity.send(velocity);
                        let expected = repetition.velocities.get(drive.frame_index as usize);
                        expected.is_none_or(|expected| *expected == velocity)
                    }
                    Message::Location(location) => {
                        let step = repetition.exploration.steps().get(location.place_index as usize);
                        step.is_none_or(|step| Location::from(&step.update) == location)
                    }
                    _ => true,
                };
                if is_same {
                    return ControlFlow::Continue(());
                }
                elsewhere = Some(message);
                ControlFlow::Break(())
            })
        },
    )?;
    drop(progress);
    let Ok(Repetition { exploration, unprinted, .. }) = repetition.into_inner() else { bail!("the simulation failed") };
    if let Some(error) = unprinted {
        return Err(error.into());
    }
    if let Some(message) = elsewhere {
        bail!("the firmware sent {message:?}, which differs from the simulation");
    }
    arguments.drive.summarise(&Summary::of(&plan, &exploration))?;
    let counters = received.decoder.counters();
    let Some(health) = received.replica.health() else { bail!("the firmware sent no Health message") };
    outln!("firmware: {} places in {} frames, {:.1} s", received.places.len(), outcome.frames, outcome.seconds)?;
    outln!("wire: {} messages, {} frames lost, {} corrupt", counters.messages, counters.lost, counters.corrupt)?;
    outln!("sensor bus: {} bytes, {} rounds of the loop", outcome.bus_bytes, health.loop_count)?;
    if let Some(bytes) = outcome.stack_high_water_bytes {
        outln!("stack_high_water_bytes: {bytes}")?;
    }
    compare(&exploration, &received)?;
    outln!("drive and map of the firmware and of the simulation are equal bit for bit")?;
    Ok(())
}

/// Compares the messages of the firmware with the simulation.
fn compare<const V: usize, F>(exploration: &Exploration<'_, V, F>, received: &Received) -> anyhow::Result<()>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    let (steps, mapper) = (exploration.steps(), exploration.robot().mapper());
    let map = mapper.map();
    let places = steps.iter().map(|step| (step.update.place_index, step.place.fingerprint.radius_mm()));
    ensure!(places.eq(received.places.iter().copied()), "the firmware detected other places than the simulation");
    ensure!(received.replica.is_converged(), "the map received over the wire is incomplete");
    let same_rows = map.vertices().all(|vertex| {
        received.replica.row(vertex.into()).is_some_and(|row| {
            map.label(vertex).map(|label| label.radius_mm()) == Some(row.radius_mm)
                && map.visits(vertex) == row.visits
                && map.neighbours(vertex).bits() == row.neighbours
        })
    });
    let same_size = usize::from(received.replica.vertices()) == map.vertices().len();
    ensure!(same_rows && same_size, "the map of the firmware differs");
    if let Some(darts) = mapper.filter().darts() {
        let has_ways =
            |vertex: VertexId| VertexWays::of(darts, vertex).ways.as_slice() == received.replica.ways(vertex.into());
        ensure!(map.vertices().all(has_ways), "the ways of the firmware's map differ");
    }
    if let Some(step) = steps.last() {
        let (filter, place_index) = (mapper.filter(), step.update.place_index);
        ensure!(
            received.replica.location() == Some(Location::from(&step.update)),
            "the firmware reports another vertex"
        );
        ensure!(
            received.replica.evidence() == Some(Evidence::from(&step.update)),
            "the firmware reports other evidence"
        );
        let belief = Some(Belief::of(filter, place_index));
        ensure!(received.replica.belief() == belief, "the firmware reports other probabilities");
        let worst = Some(Worst::of(filter, place_index));
        ensure!(received.replica.worst() == worst, "the firmware reports another worst n-gram");
    }
    Ok(())
}

/// Builds an image of the firmware from the working directory and returns its path.
fn build_firmware(image: &str) -> anyhow::Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(["firmware", "--bin", image])
        .status()
        .context("building the firmware with `cargo firmware`")?;
    ensure!(
        status.success(),
        "`cargo firmware` failed; it needs `rustup target add thumbv7em-none-eabihf` and the project's directory"
    );
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    Ok(target.join(IMAGES).join(image))
}
