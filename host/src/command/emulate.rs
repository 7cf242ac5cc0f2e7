//! `toposlam emulate`: the same drive as `simulate`, mapped by the firmware in an emulated STM32F405.

use std::{ops::ControlFlow, path::PathBuf, process::Command, sync::Mutex, time::Duration};

use anyhow::{Context, bail, ensure};
use clap::Args;
use toposlam::wire::{Decoder, Evidence, Location, Message, Picture, Progress};
use toposlam_host::emulator::Emulation;
use toposlam_host::mapping::FilterChoice;

use super::drive::{Drive, DriveArguments, Hints, progress_bar};

/// Where `cargo firmware` puts the image.
const IMAGE: &str = "thumbv7em-none-eabihf/release/robot";

/// Arguments of `toposlam emulate`.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    drive: DriveArguments,
    /// Drive until this many places were detected.
    #[arg(long, default_value_t = 30)]
    places: usize,
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

/// What the firmware said.
struct Heard {
    decoder: Decoder,
    picture: Picture<64>,
    places: Vec<(u32, u16)>,
}

impl Heard {
    /// Takes bytes of the line; calls `on_location` whenever the firmware says where the robot is.
    fn feed(&mut self, bytes: &[u8], mut on_location: impl FnMut(Location) -> ControlFlow<()>) -> ControlFlow<()> {
        let mut rest = bytes;
        loop {
            rest = match self.decoder.feed(rest) {
                Progress::NeedsMore => return ControlFlow::Continue(()),
                Progress::Error { rest, .. } => rest,
                Progress::Message { header, message, rest } => {
                    self.picture.apply(header, &message);
                    match message {
                        Message::Place { place_index, radius_mm, .. } => self.places.push((place_index, radius_mm)),
                        Message::Location(location) => on_location(location)?,
                        _ => {}
                    }
                    rest
                }
            };
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let elf = match &arguments.elf {
        Some(elf) => elf.clone(),
        None => build_firmware()?,
    };
    // The emulator asks for frames on one thread and hands on what it heard on another.
    // The firmware has no drive that could tell it of turns, so neither has this computer.
    let drive = Mutex::new(Drive::start(&arguments.drive, FilterChoice::Robust, Hints::None)?);
    let progress = progress_bar(arguments.places)?;
    let mut heard = Heard { decoder: Decoder::new(), picture: Picture::new(), places: Vec::new() };
    let mut printed = 0;
    let mut elsewhere = None;

    let mut emulation = Emulation::new(elf);
    emulation.qemu = arguments.qemu.clone();
    emulation.timeout = Duration::from_secs(arguments.timeout_s);
    let outcome = emulation.run(
        || {
            let mut drive = drive.lock().ok()?;
            if drive.mapping().steps().len() >= arguments.places {
                return None;
            }
            drive.advance().map(|(frame, _)| frame)
        },
        |bytes| {
            heard.feed(bytes, |location| {
                let Ok(drive) = drive.lock() else { return ControlFlow::Break(()) };
                let steps = drive.mapping().steps();
                let same = steps.get(location.place_index as usize).map(|step| Location::from(&step.update));
                if same != Some(location) {
                    elsewhere = Some(location);
                    return ControlFlow::Break(());
                }
                // The location is repeated; a place is printed once.
                for step in steps.iter().take(location.place_index as usize + 1).skip(printed) {
                    progress.suspend(|| println!("{step}"));
                    printed += 1;
                }
                progress.set_position(printed as u64);
                ControlFlow::Continue(())
            })
        },
    )?;
    progress.finish_and_clear();
    if let Some(Location { place_index, vertex }) = elsewhere {
        bail!("at place {place_index} the firmware believes to be at vertex {vertex}, and this computer does not");
    }

    let Ok(drive) = drive.into_inner() else { bail!("the repetition on this computer failed") };
    drive.summarise(&arguments.drive)?;
    let counters = heard.decoder.counters();
    let Some(health) = heard.picture.health() else { bail!("the firmware never said how it is doing") };
    println!("firmware: {} places in {} frames, {:.1} s", heard.places.len(), outcome.frames, outcome.seconds);
    println!("wire: {} messages, {} frames lost, {} corrupt", counters.messages, counters.lost, counters.corrupt);
    println!("sensor bus: {} bytes, {} rounds of the loop", outcome.bus_bytes, health.loop_count);
    if let Some(bytes) = outcome.stack_high_water_bytes {
        println!("stack_high_water_bytes: {bytes}");
    }
    compare(&drive, &heard)?;
    println!("the firmware's map is this computer's, bit for bit");
    Ok(())
}

/// Holds what the firmware said to this computer's repetition. The digest is part of a converged picture.
fn compare(drive: &Drive, heard: &Heard) -> anyhow::Result<()> {
    let (steps, map) = (drive.mapping().steps(), drive.mapping().map());
    let places = steps.iter().map(|step| (step.update.place_index, step.place.fingerprint.radius_mm()));
    ensure!(places.eq(heard.places.iter().copied()), "the firmware detected other places than this computer");
    ensure!(heard.picture.is_converged(), "the map heard over the wire is not complete");
    let same_rows = (0..map.vertices()).all(|vertex| {
        heard.picture.row(vertex).is_some_and(|row| {
            map.label(vertex).map(|label| label.radius_mm()) == Some(row.radius_mm)
                && map.visits(vertex) == row.visits
                && map.neighbours(vertex) == row.neighbours
        })
    });
    ensure!(same_rows && heard.picture.vertices() == map.vertices(), "the firmware's map is another one");
    if let Some(step) = steps.last() {
        let same_location = heard.picture.location() == Some(Location::from(&step.update));
        ensure!(same_location, "the firmware believes to be elsewhere");
        let same_evidence = heard.picture.evidence() == Some(Evidence::from(&step.update));
        ensure!(same_evidence, "the firmware gives other evidence");
        ensure!(heard.picture.belief() == drive.mapping().belief(), "the firmware gives other probabilities");
        ensure!(heard.picture.worst() == drive.mapping().worst(), "the firmware names another worst n-gram");
    }
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
