//! The robot: everything between a ring frame and the wheels, the flash and the serial line, as one turn of the main loop.
//!
//! ```text
//! ring frame ─▶ Mapper ─▶ Drive ─▶ wheels
//!                 │  ▲
//!   messages ◀────┘  └──── commands
//! ```
//!
//! The firmware of every board and the simulations of a host run this same code. What differs from board to board is a
//! [`Board`]: a serial line, wheels, a clock, a watchdog and a store for snapshots.
//!
//! ```
//! use toposlam::reference::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES, SONARS};
//! use toposlam::ring::{Echo, RingFrame};
//! use toposlam::robot::{Board, SaveError};
//! use toposlam::{FaultCounters, drive::VelocityCommand, wire::QueueFull};
//!
//! /// A board without any hardware.
//! struct Bare;
//!
//! impl Board for Bare {
//!     fn receive(&mut self) -> Option<u8> {
//!         None
//!     }
//!     fn send(&mut self, _frame: &[u8]) -> Result<(), QueueFull> {
//!         Ok(())
//!     }
//!     fn follow(&mut self, _suggestion: VelocityCommand) {}
//!     fn feed_watchdog(&mut self) {}
//!     fn now_ms(&mut self) -> u32 {
//!         0
//!     }
//!     fn stack_high_water_bytes(&mut self) -> u32 {
//!         0
//!     }
//!     fn save(&mut self, _snapshot: &[u8]) -> Result<(), SaveError> {
//!         Err(SaveError::NoStore)
//!     }
//! }
//!
//! let mut buffer = [0; SNAPSHOT_BYTES];
//! let mut robot = Box::new(ReferenceRobot::new());
//! robot.start(&ROBOT, &mut buffer)?;
//! let frame = RingFrame { echoes: [Echo::Silence; SONARS] };
//! robot.turn(&frame, &FaultCounters::new(), &mut Bare);
//! assert_eq!(robot.mapper().map().vertices().len(), 0);
//! # Ok::<(), toposlam::ConfigError>(())
//! ```

mod board;
#[cfg(feature = "store")]
mod boot;
mod commands;
mod config;

pub use board::{Board, SaveError};
pub use config::RobotConfig;

use crate::checksum::CRC;
use crate::config_error::ConfigError;
use crate::drive::{Drive, Goal, GoalStatus, VelocityCommand};
use crate::fault::{FaultCounters, FaultKind};
use crate::filter::{Filter, Update};
use crate::mapper::Mapper;
use crate::persist::Persist;
use crate::persist::snapshot::{Resume, Snapshot, SnapshotError, SnapshotPolicy, Writer};
use crate::place::Place;
use crate::ring::RingFrame;
use crate::wire::{
    self, Echoes, Encoder, FilterSettings, Health, Inbox, MAX_FRAME_BYTES, Message, Names, QueueFull, Reporter, Staging,
};

/// How often the robot sends a `Hello`, in ring frames.
const FRAMES_PER_HELLO: u16 = 100;
/// How often the robot sends a `Health`, in turns of the loop.
const TURNS_PER_HEALTH: u32 = 256;
/// The most bytes that are read from the board in a turn. The inbox decodes fewer and drops the rest.
const RECEIVED_PER_TURN: usize = 1024;

/// The result of a turn: the place and the map update, if the frame completed a visit to a place.
pub type Seen = Option<(Place, Update)>;

/// A robot with a ring of `SONARS` sensors and a filter with maps of at most `V` vertices.
///
/// Const-constructed to zero, so that a `static` of it lies in `.bss`, and set up in place by [`Robot::start`]. Memory: the
/// mapper's and the drive's, 700 bytes, and the caller's buffer for snapshots. Each turn costs at most what one place or one
/// refinement step costs, and one command.
#[derive(Debug)]
pub struct Robot<'buffer, const SONARS: usize, const V: usize, F: Filter<V>> {
    config: RobotConfig<SONARS, F::Config>,
    mapper: Mapper<SONARS, V, F>,
    reporter: Reporter<V>,
    drive: Drive<V>,
    inbox: Inbox,
    staging: Staging<'buffer>,
    encoder: Encoder,
    faults: FaultCounters,
    paused: bool,
    localise_only: bool,
    /// The count of `DriveLost` when the mapper was last notified.
    times_lost: u32,
    /// The size of the newest stored snapshot, 0 if there is none, and the number of places since.
    stored_bytes: u16,
    places_since: u32,
    turns: u32,
    last_turn_ms: Option<u32>,
    worst_turn_ms: u32,
    /// The last goal status sent.
    sent_goal: (Goal, GoalStatus),
}

impl<'buffer, const SONARS: usize, const V: usize, F> Robot<'buffer, SONARS, V, F>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    /// A robot that must be started with [`Robot::start`].
    pub const fn new() -> Self {
        Self {
            config: RobotConfig::UNSET,
            mapper: Mapper::new(),
            reporter: Reporter::new(),
            drive: Drive::new(),
            inbox: Inbox::new(),
            staging: Staging::without_buffer(),
            encoder: Encoder::new(0),
            faults: FaultCounters::new(),
            paused: false,
            localise_only: false,
            times_lost: 0,
            stored_bytes: 0,
            places_since: 0,
            turns: 0,
            last_turn_ms: None,
            worst_turn_ms: 0,
            sent_goal: commands::NO_GOAL,
        }
    }

    /// Starts with an empty map, exploring.
    ///
    /// `buffer` holds snapshots on their way to the flash or over the line. The `SNAPSHOT_BYTES` of the filter are
    /// room for every hypothesis. With an empty buffer the robot makes no snapshots.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of its range; the robot must then be started again.
    pub fn start(
        &mut self,
        config: &RobotConfig<SONARS, F::Config>,
        buffer: &'buffer mut [u8],
    ) -> Result<(), ConfigError> {
        self.mapper.start(&config.mapper)?;
        self.drive.start(config.drive, config.mapper.seed)?;
        self.config = *config;
        self.reporter.start(config.hello::<V, F>(), FRAMES_PER_HELLO);
        self.inbox = Inbox::new();
        self.staging = Staging::new(buffer);
        self.faults = FaultCounters::new();
        self.paused = false;
        self.localise_only = false;
        self.times_lost = 0;
        self.stored_bytes = 0;
        self.places_since = 0;
        self.turns = 0;
        self.last_turn_ms = None;
        self.worst_turn_ms = 0;
        self.sent_goal = commands::NO_GOAL;
        Ok(())
    }

    /// Runs one turn of the main loop: executes at most one command, maps the ring frame, drives, stores a snapshot if one is
    /// due, and feeds the watchdog. `ring_faults` are the faults of the ring's driver since the start.
    pub fn turn(&mut self, frame: &RingFrame<SONARS>, ring_faults: &FaultCounters, board: &mut impl Board) -> Seen {
        self.check_duration(board);
        if self.config.session == 0 {
            self.draw_session(frame, board);
        }
        self.poll_commands(board);
        let faults = self.loop_faults(ring_faults);
        let (seen, velocity) =
            if self.paused { self.pause(&faults, board) } else { self.map_and_drive(frame, &faults, board) };
        self.send_ring(frame, board);
        self.send_velocity(velocity, board);
        let is_due = |(_, update): &(Place, Update)| self.policy().is_due(update.place_index);
        if seen.as_ref().is_some_and(is_due) {
            // Erasing flash can take seconds; the robot must not drive blindly during that time.
            board.follow(VelocityCommand::STOP);
            self.save_snapshot(board);
            self.last_turn_ms = None;
        }
        board.follow(velocity);
        self.send_goal_status(board);
        if self.turns.is_multiple_of(TURNS_PER_HEALTH) {
            let health = Health {
                uptime_ms: board.now_ms(),
                loop_count: self.turns,
                stack_high_water_bytes: board.stack_high_water_bytes(),
                worst_turn_us: self.worst_turn_ms.saturating_mul(1000),
            };
            // A message without room is counted; a later one follows.
            let _ = self.send(&Message::Health(health), board);
        }
        self.turns = self.turns.wrapping_add(1);
        board.feed_watchdog();
        seen
    }

    /// Derives the session id from what differs between starts and robots: the noise of the first ring frame above all.
    #[inline(never)]
    fn draw_session(&mut self, frame: &RingFrame<SONARS>, board: &mut impl Board) {
        let mut digest = CRC.digest();
        digest.update(&self.config.boot.to_le_bytes());
        digest.update(&[self.config.reset_cause as u8]);
        digest.update(&self.config.mapper.seed.to_le_bytes());
        digest.update(&board.now_ms().to_le_bytes());
        for code in Echoes::new(&frame.echoes).codes() {
            digest.update(&code.to_le_bytes());
        }
        self.config.session = digest.finalize().max(1);
        self.reporter.set_session(self.config.session);
    }

    #[inline(never)]
    fn map_and_drive(
        &mut self,
        frame: &RingFrame<SONARS>,
        faults: &FaultCounters,
        board: &mut impl Board,
    ) -> (Seen, VelocityCommand) {
        let mut line = Line { encoder: &mut self.encoder, faults: &mut self.faults, board };
        let seen = self.mapper.observe(frame, self.drive.passage());
        self.reporter.report(&self.mapper, seen.as_ref(), faults, |message| line.send(message));
        let place = seen.as_ref().map(|(place, _)| place);
        let velocity = self.drive.advance(self.mapper.detector(), self.mapper.filter(), place);
        self.reporter.set_complete(self.drive.is_complete());
        if self.drive.holds_place() {
            self.mapper.hold_place();
        }
        if self.drive.is_stuck() {
            self.mapper.forget_sightings();
        }
        let times_lost = self.drive.faults().count(FaultKind::DriveLost);
        if times_lost != self.times_lost {
            self.times_lost = times_lost;
            self.mapper.kidnapped();
        }
        if seen.is_some() {
            self.places_since = self.places_since.saturating_add(1);
        }
        (seen, velocity)
    }

    /// A paused robot stands still and keeps sending.
    fn pause(&mut self, faults: &FaultCounters, board: &mut impl Board) -> (Seen, VelocityCommand) {
        let mut line = Line { encoder: &mut self.encoder, faults: &mut self.faults, board };
        self.reporter.report(&self.mapper, None, faults, |message| line.send(message));
        (None, VelocityCommand::STOP)
    }

    /// Writes a snapshot to the board's store.
    #[inline(never)]
    fn save_snapshot(&mut self, board: &mut impl Board) {
        let Self { mapper, reporter, staging, .. } = self;
        let taken = staging.take(|buffer| snapshot(mapper, reporter, buffer).ok());
        match taken.map(|()| board.save(staging.taken())) {
            Ok(Ok(())) => {
                self.stored_bytes = u16::try_from(self.staging.taken().len()).unwrap_or(u16::MAX);
                self.places_since = 0;
            }
            Ok(Err(SaveError::NoStore)) => {}
            Ok(Err(SaveError::Failed)) | Err(_) => self.faults.record(FaultKind::StoreFailed),
        }
    }

    /// Restores a snapshot, of this robot or of another one with the same capacities.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is invalid; the state does not change then, and the fault is counted.
    #[inline(never)]
    pub fn restore(&mut self, bytes: &[u8], resume: Resume) -> Result<(), SnapshotError> {
        let Self { mapper, reporter, drive, .. } = self;
        let restored = restore(mapper, reporter, drive, bytes, resume);
        match restored {
            Ok(()) => self.localise_only = self.mapper.filter().is_localise_only(),
            Err(_) => self.faults.record(FaultKind::SnapshotRejected),
        }
        restored
    }

    fn policy(&self) -> SnapshotPolicy {
        self.config.snapshot
    }

    fn check_duration(&mut self, board: &mut impl Board) {
        let now_ms = board.now_ms();
        if let Some(last_ms) = self.last_turn_ms {
            let turn_ms = now_ms.wrapping_sub(last_ms);
            self.worst_turn_ms = self.worst_turn_ms.max(turn_ms);
            if turn_ms > u32::from(self.config.turn_bound_ms) {
                self.faults.record(FaultKind::LoopLate);
            }
        }
        self.last_turn_ms = Some(now_ms);
    }

    #[inline(never)]
    fn send_ring(&mut self, frame: &RingFrame<SONARS>, board: &mut impl Board) {
        let ring = Message::Ring { frame_index: self.turns, echoes: Echoes::new(&frame.echoes) };
        let _ = self.send(&ring, board);
    }

    fn send_velocity(&mut self, velocity: VelocityCommand, board: &mut impl Board) {
        let drive = wire::Velocity {
            frame_index: self.turns,
            heading_mrad: velocity.heading_mrad,
            speed_permille: velocity.speed_permille.min(i16::MAX as u16) as i16,
            state: self.drive.state() as u8,
        };
        let _ = self.send(&Message::Velocity(drive), board);
    }

    fn send(&mut self, message: &Message, board: &mut impl Board) -> Result<(), QueueFull> {
        Line { encoder: &mut self.encoder, faults: &mut self.faults, board }.send(message)
    }

    /// The faults of all stages since the start. `ring_faults` are those of the ring's driver.
    pub fn faults(&self, ring_faults: &FaultCounters) -> FaultCounters {
        let mut faults = self.loop_faults(ring_faults);
        faults.add(&self.mapper.faults());
        faults
    }

    /// The faults of all stages but the mapper.
    fn loop_faults(&self, ring_faults: &FaultCounters) -> FaultCounters {
        let mut faults = *ring_faults;
        faults.add(&self.faults);
        faults.add(self.inbox.faults());
        faults.add(self.drive.faults());
        faults
    }

    /// Whether the robot is paused: it then ignores ring frames.
    pub const fn is_paused(&self) -> bool {
        self.paused
    }

    /// The stages from the ring frame to the map.
    pub const fn mapper(&self) -> &Mapper<SONARS, V, F> {
        &self.mapper
    }

    /// The drive.
    pub const fn drive(&self) -> &Drive<V> {
        &self.drive
    }
}

impl<const SONARS: usize, const V: usize, F> Default for Robot<'_, SONARS, V, F>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    fn default() -> Self {
        Self::new()
    }
}

/// Encodes messages for the board's queue.
struct Line<'a, BOARD> {
    encoder: &'a mut Encoder,
    faults: &'a mut FaultCounters,
    board: &'a mut BOARD,
}

impl<BOARD: Board> Line<'_, BOARD> {
    /// Queues a whole message, or drops and counts it.
    fn send(&mut self, message: &Message) -> Result<(), QueueFull> {
        let mut bytes = [0; MAX_FRAME_BYTES];
        let frame = self.encoder.encode(message, &mut bytes).map_err(|_| QueueFull)?;
        let sent = self.board.send(frame);
        if sent.is_err() {
            self.faults.record(FaultKind::WireFull);
        }
        sent
    }
}

/// Writes a whole snapshot. The mapper uses the room that the names leave.
fn snapshot<const SONARS: usize, const V: usize, F: Filter<V> + Persist>(
    mapper: &mut Mapper<SONARS, V, F>,
    reporter: &Reporter<V>,
    buffer: &mut [u8],
) -> Result<usize, SnapshotError> {
    let mut writer = Writer::new(buffer)?;
    if reporter.names().vertices() != 0 {
        reporter.names().save(&mut writer)?;
    }
    mapper.save(&mut writer)?;
    writer.finish()
}

/// Restores a snapshot; the drive explores from there.
fn restore<const SONARS: usize, const V: usize, F: Filter<V> + Persist>(
    mapper: &mut Mapper<SONARS, V, F>,
    reporter: &mut Reporter<V>,
    drive: &mut Drive<V>,
    bytes: &[u8],
    resume: Resume,
) -> Result<(), SnapshotError> {
    let snapshot = Snapshot::open(bytes)?;
    Names::<V>::check(&snapshot)?;
    mapper.restore(bytes, resume)?;
    let vertices = mapper.map().vertices().len();
    reporter.change_names(|names| names.restore(&snapshot, vertices))?;
    drive.resume();
    if resume == Resume::AtUnknownVertex {
        drive.kidnapped();
    }
    Ok(())
}
