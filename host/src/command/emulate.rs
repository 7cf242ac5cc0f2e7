//! `toposlam emulate`: the same drive as `simulate`, mapped by the firmware in an emulated STM32F405.

use std::{ops::ControlFlow, path::PathBuf, process::Command, sync::Mutex, time::Duration};

use anyhow::{Context, bail, ensure};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use toposlam::{
    FaultCounters, Update,
    reference::{self, RobotMapper},
    wire::{Decoder, Evidence, Location, Message, Picture, Progress, map_digest},
};
use toposlam_host::{
    emulator::Emulation,
    world::{RobotModel, Simulation},
};

use super::simulate::{load_plan, noise_factor};

/// Where `cargo firmware` puts the image.
const IMAGE: &str = "thumbv7em-none-eabihf/release/robot";

/// Arguments of `toposlam emulate`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Floor plan: ring, office, flat, or a file.
    #[arg(long, default_value = "office")]
    plan: String,
    /// Drive until this many places were detected.
    #[arg(long, default_value_t = 30)]
    places: usize,
    /// Seed of the drive and of every noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Every noise of the robot, multiplied by this.
    #[arg(long, default_value_t = 1.0, value_parser = noise_factor)]
    noise: f64,
    /// The firmware image; built with `cargo firmware` when it is not given.
    #[arg(long)]
    elf: Option<PathBuf>,
    /// The emulator.
    #[arg(long, default_value = "qemu-system-arm")]
    qemu: PathBuf,
    /// Give up after this many seconds.
    #[arg(long, default_value_t = 800)]
    timeout_s: u64,
}

/// This computer's repetition of what the firmware does.
struct Twin {
    mapper: RobotMapper,
    places: Vec<(u16, Update)>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let elf = match &arguments.elf {
        Some(elf) => elf.clone(),
        None => build_firmware()?,
    };
    let plan = load_plan(&arguments.plan)?;
    let model = RobotModel::default().with_noise(arguments.noise);
    let mut simulation = Simulation::new(&plan, model, arguments.seed)?;

    let mut twin = Twin { mapper: RobotMapper::new(), places: Vec::new() };
    twin.mapper.start(&reference::MAPPER)?;
    let twin = Mutex::new(twin);

    let progress = ProgressBar::new(arguments.places as u64)
        .with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} places, {elapsed}")?);
    let mut decoder = Decoder::new();
    let mut picture = Picture::<64>::new();
    let mut heard_places = Vec::new();

    let mut emulation = Emulation::new(elf);
    emulation.qemu = arguments.qemu.clone();
    emulation.timeout = Duration::from_secs(arguments.timeout_s);
    let outcome = emulation.run(
        || {
            let mut twin = twin.lock().ok()?;
            if twin.places.len() >= arguments.places {
                return None;
            }
            let (frame, _) = simulation.next()?;
            if let Some((place, update)) = twin.mapper.observe(&frame, &FaultCounters::new(), |_| Ok(())) {
                twin.places.push((place.fingerprint.radius_mm(), update));
            }
            Some(frame)
        },
        |bytes| {
            let mut rest = bytes;
            loop {
                rest = match decoder.feed(rest) {
                    Progress::NeedsMore => return ControlFlow::Continue(()),
                    Progress::Error { rest, .. } => rest,
                    Progress::Message { header, message, rest } => {
                        picture.apply(header, &message);
                        if let Message::Place { place_index, radius_mm, .. } = message {
                            heard_places.push((place_index, radius_mm));
                            progress.set_position(u64::from(place_index) + 1);
                        }
                        rest
                    }
                };
            }
        },
    )?;
    progress.finish_and_clear();

    let Ok(twin) = twin.into_inner() else { bail!("the repetition on this computer failed") };
    let counters = decoder.counters();
    let Some(health) = picture.health() else { bail!("the firmware never said how it is doing") };
    println!(
        "{}: {} places in {} frames, {:.1} s",
        arguments.plan,
        heard_places.len(),
        outcome.frames,
        outcome.seconds
    );
    println!("map: {} vertices, {} edges", picture.vertices(), picture.edges().count());
    println!("wire: {} messages, {} frames lost, {} corrupt", counters.messages, counters.lost, counters.corrupt);
    println!("sensor bus: {} bytes, {} rounds of the loop", outcome.bus_bytes, health.loop_count);
    if let Some(bytes) = outcome.stack_high_water_bytes {
        println!("stack_high_water_bytes: {bytes}");
    }

    let expected_places: Vec<_> = (0..).zip(twin.places.iter().map(|(radius_mm, _)| *radius_mm)).collect();
    ensure!(heard_places == expected_places, "the firmware detected other places than this computer");
    ensure!(picture.is_converged(), "the map heard over the wire is not complete");
    let same_map = (0..twin.mapper.map().vertices()).all(|vertex| {
        picture.row(vertex).is_some_and(|row| {
            let map = twin.mapper.map();
            map.label(vertex).map(|label| label.radius_mm()) == Some(row.radius_mm)
                && map.visits(vertex) == row.visits
                && map.neighbours(vertex) == row.neighbours
        })
    });
    ensure!(same_map && picture.vertices() == twin.mapper.map().vertices(), "the firmware's map is another one");
    if let Some((_, update)) = twin.places.last() {
        ensure!(picture.location() == Some(Location::from(update)), "the firmware believes to be elsewhere");
        ensure!(picture.evidence() == Some(Evidence::from(update)), "the firmware gives other evidence");
    }
    println!("the firmware's map is this computer's, bit for bit (digest {:08x})", map_digest(twin.mapper.map()));
    Ok(())
}

/// Builds the firmware from the working directory and says where it is.
fn build_firmware() -> anyhow::Result<PathBuf> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(["firmware", "--bin", "robot"])
        .status()
        .context("building the firmware with `cargo firmware`")?;
    ensure!(
        status.success(),
        "`cargo firmware` failed; it needs `rustup target add thumbv7em-none-eabihf` and the project's directory"
    );
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    Ok(target.join(IMAGE))
}
