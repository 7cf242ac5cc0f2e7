//! `toposlam emulate --faults`: the emulated firmware maps with injected faults on its sensor bus and its line.
//!
//! With faults, the firmware's input depends on the arrival time of each byte, so the host simulation cannot reproduce
//! it. Instead, the firmware's map is fetched as a snapshot and compared with the ground truth.

use std::{
    ops::ControlFlow,
    sync::{Mutex, mpsc},
    time::Duration,
};

use anyhow::{Context, bail, ensure};
use toposlam::drive::VelocityCommand;
use toposlam::persist::snapshot::Resume;
use toposlam::place::{Openings, Place};
use toposlam::reference::{SNAPSHOT_BYTES, SONARS};
use toposlam::ring::RingFrame;
use toposlam::wire::{Command, Encoder, MAX_FRAME_BYTES, Message, Outcome, Reply, Request};
use toposlam::{FaultCounters, FaultKind, Fingerprint};
use toposlam_cli::emulator::Emulation;
use toposlam_cli::outln;
use toposlam_cli::progress::Progress;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::injector::{FaultRates, LineInjector};

use super::drive::{DriveArguments, Summary};
use super::received::Received;

/// Maximum wait for a velocity command; then the world repeats its frame. A fault can start a frame on the sensor bus
/// that the firmware does not receive.
const PATIENCE: Duration = Duration::from_millis(300);
/// Maximum number of frames per requested place.
const FRAMES_PER_PLACE: u32 = 1000;
/// Frames without any sensor after the world's last one, enough for the transfer of the snapshot.
const BLIND_FRAMES: u64 = 5000;
/// Loop iterations of the firmware without a reply after which a request is sent again.
const PATIENCE_TURNS: u32 = 4;

/// The world and the ground truth.
struct Trial<'buffer> {
    exploration: Exploration<'buffer>,
    frames: u32,
    is_over: bool,
}

impl Trial<'_> {
    fn frame(&mut self) -> RingFrame<SONARS> {
        self.frames += 1;
        self.exploration.frame()
    }
}

/// Drives the emulated firmware until it has detected `places` places.
pub(super) fn run(
    arguments: &DriveArguments,
    mut emulation: Emulation,
    places: usize,
    rates: FaultRates,
) -> anyhow::Result<()> {
    let (plan, model) = arguments.world()?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let exploration = Exploration::start(&plan, model, arguments.seed(), &mut buffer)?;
    // The emulator requests frames on one thread and delivers messages on another.
    let trial = Mutex::new(Trial { exploration, frames: 0, is_over: false });
    let (tell_velocity, velocities) = mpsc::channel::<VelocityCommand>();
    let bar = Progress::new("", places, "places");
    let mut heard = Received::new();
    let mut line = LineInjector::new(rates, arguments.seed());
    let mut fetch = Fetch::new();
    let mut turns: u32 = 0;
    let mut last = None;
    let world = &trial;
    emulation.faults = rates;
    emulation.fault_seed = arguments.seed();
    emulation.blind_frames = BLIND_FRAMES;
    let most_frames = FRAMES_PER_PLACE.saturating_mul(places as u32);
    let outcome = emulation.run(
        move || {
            if last.is_some() {
                let Ok(velocity) = velocities.recv_timeout(PATIENCE) else { return last };
                let mut trial = world.lock().ok()?;
                trial.exploration.drive(velocity);
                // Firmware frames whose start no sensor received.
                while let Ok(velocity) = velocities.try_recv() {
                    trial.frame();
                    trial.exploration.drive(velocity);
                }
            }
            let mut trial = world.lock().ok()?;
            trial.is_over = trial.exploration.places() >= places || trial.frames >= most_frames;
            last = if trial.is_over { None } else { Some(trial.frame()) };
            last
        },
        |bytes, to_firmware| {
            heard.feed(bytes, |message| {
                let Ok(mut trial) = trial.lock() else { return ControlFlow::Break(()) };
                match message {
                    Message::Place { frame_index, radius_mm, degree, .. } => {
                        let Ok(fingerprint) = Fingerprint::from_radius_mm(radius_mm) else {
                            return ControlFlow::Break(());
                        };
                        // The frame counts of the firmware and of the world may differ.
                        let ago = turns.saturating_sub(frame_index);
                        let frame_index = trial.frames.saturating_sub(ago + 1);
                        trial.exploration.note(&Place {
                            fingerprint,
                            frame_index,
                            degree,
                            ways: Openings::NONE,
                            behind_mrad: 0,
                            spread_mm: 0,
                        });
                        bar.increment();
                    }
                    Message::Velocity(drive) => {
                        turns = drive.frame_index.wrapping_add(1);
                        let speed_permille = drive.speed_permille.unsigned_abs();
                        // The world may have ended already.
                        let _ =
                            tell_velocity.send(VelocityCommand { heading_mrad: drive.heading_mrad, speed_permille });
                        if trial.is_over {
                            fetch.turn(to_firmware);
                        } else {
                            let noise = line.noise();
                            to_firmware.extend(line.carry(&noise));
                        }
                    }
                    Message::Reply(reply) => {
                        fetch.hear(&reply);
                        if fetch.is_complete {
                            return ControlFlow::Break(());
                        }
                    }
                    _ => {}
                }
                ControlFlow::Continue(())
            })
        },
    )?;
    drop(bar);
    let Ok(Trial { mut exploration, .. }) = trial.into_inner() else { bail!("the world failed") };
    ensure!(fetch.is_complete, "the firmware's map did not arrive");
    exploration.robot_mut().restore(&fetch.snapshot, Resume::InPlace).context("the firmware's snapshot")?;
    let observed = exploration.robot().mapper().filter().observed();
    ensure!(observed as usize == exploration.places(), "the firmware has {observed} places and told other ones");
    let faults = FaultCounters::new();
    arguments.summarise(&Summary { faults, ..Summary::of(&plan, &exploration) })?;
    for kind in FaultKind::ALL.into_iter().filter(|kind| heard.replica.fault(*kind) > 0) {
        outln!("firmware's fault {kind:?}: {}", heard.replica.fault(kind))?;
    }
    outln!("sensor bus: {}", outcome.bridge)?;
    outln!("line to the firmware: {}", line.counts())?;
    outln!(
        "firmware: {} places in {} frames, {turns} rounds of the loop, {:.1} s",
        exploration.places(),
        outcome.frames,
        outcome.seconds
    )?;
    if let Some(bytes) = outcome.stack_high_water_bytes {
        outln!("stack_high_water_bytes: {bytes}")?;
    }
    outln!("the firmware went on in spite of every fault, and lost no place")?;
    Ok(())
}

/// Fetches a snapshot over the line, one chunk per iteration of the firmware's loop.
struct Fetch {
    encoder: Encoder,
    id: u16,
    waited: Option<u32>,
    snapshot: Vec<u8>,
    is_complete: bool,
}

impl Fetch {
    const fn new() -> Self {
        Self { encoder: Encoder::new(0), id: 0, waited: None, snapshot: Vec::new(), is_complete: false }
    }

    fn turn(&mut self, to_firmware: &mut Vec<u8>) {
        match &mut self.waited {
            Some(waited) if *waited < PATIENCE_TURNS => {
                *waited += 1;
                return;
            }
            _ => self.waited = Some(0),
        }
        let command = Command::GetSnapshot { offset: self.snapshot.len() as u16 };
        let mut frame = [0; MAX_FRAME_BYTES];
        // A buffer of this size is always sufficient. The leading zero byte terminates any noise.
        let frame = self.encoder.encode(&Request { id: self.id, command }, &mut frame).unwrap_or(&[]);
        to_firmware.push(0);
        to_firmware.extend_from_slice(frame);
    }

    fn hear(&mut self, reply: &Reply) {
        if reply.request != self.id || self.waited.is_none() {
            return;
        }
        self.waited = None;
        self.id += 1;
        if let Outcome::Snapshot { total, offset, bytes } = reply.outcome
            && usize::from(offset) == self.snapshot.len()
        {
            self.snapshot.extend(bytes.as_slice());
            self.is_complete = self.snapshot.len() >= usize::from(total);
        }
    }
}
