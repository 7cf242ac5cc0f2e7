//! The robot: everything between a ring frame and the wheels, the flash and the serial line, as one turn of the main loop.
//!
//! ```text
//! ring frame ─▶ Mapper ─▶ Drive ─▶ wheels
//!                 │  ▲
//!   messages ◀────┘  └──── commands
//! ```
//!
//! The firmware of every board and the simulations of a host run this same code. What differs from board to board is a
//! [`Board`]: bytes in and out, wheels, a clock, a watchdog and somewhere to keep snapshots.
//!
//! ```
//! use toposlam::reference::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES, SONARS};
//! use toposlam::ring::{Echo, RingFrame};
//! use toposlam::robot::{Board, SaveError};
//! use toposlam::{FaultCounters, drive::VelocityCommand, wire::QueueFull};
//!
//! /// A board with nothing on it.
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

use crate::drive::{Drive, Goal, GoalStatus, VelocityCommand};
use crate::persist::Persist;
use crate::persist::snapshot::{Resume, Snapshot, SnapshotError, SnapshotPolicy, Writer};
use crate::place::Place;
use crate::ring::RingFrame;
use crate::wire::{self, Echoes, Encoder, Health, Inbox, MAX_FRAME_BYTES, Message, QueueFull, Reporter, Staging};
use crate::{ConfigError, FaultCounters, FaultKind, Mapper, RobustFilter, Update};

/// How often the robot sends a `Hello`, in ring frames.
const FRAMES_PER_HELLO: u16 = 100;
/// How often the robot says how it is doing, in turns of the loop.
const TURNS_PER_HEALTH: u32 = 256;
/// More bytes than the inbox looks at in a turn: what a receive buffer may hold.
const RECEIVED_PER_TURN: usize = 1024;

/// What a turn brought: the place that the robot has just been at, if at one.
pub type Seen = Option<(Place, Update)>;

/// A robot with a ring of `SONARS` and a filter of `N` hypotheses, maps of `V` vertices and a history of `HISTORY` places.
///
/// Const-constructed to zero, so that a `static` of it lies in `.bss`, and set up in place by [`Robot::start`]. Memory: the
/// mapper's and the drive's, 700 bytes, and the caller's buffer for snapshots. Each turn costs at most what one place or one
/// slice of polishing costs, and one command.
#[derive(Debug)]
pub struct Robot<'buffer, const SONARS: usize, const N: usize, const V: usize, const HISTORY: usize> {
    config: RobotConfig<SONARS>,
    mapper: Mapper<SONARS, V, RobustFilter<N, V, HISTORY>>,
    reporter: Reporter<V>,
    drive: Drive<V, HISTORY>,
    inbox: Inbox,
    staging: Staging<'buffer>,
    encoder: Encoder,
    faults: FaultCounters,
    paused: bool,
    localise_only: bool,
    /// How often the drive had lost its way when the mapper was last told.
    times_lost: u32,
    /// Places since the last snapshot that was kept, and its size; no bytes when there is none.
    stored_bytes: u16,
    places_since: u32,
    turns: u32,
    last_turn_ms: Option<u32>,
    worst_turn_ms: u32,
    /// What the listener was last told of the way to a vertex.
    told: (Goal, GoalStatus),
}

impl<'buffer, const SONARS: usize, const N: usize, const V: usize, const HISTORY: usize>
    Robot<'buffer, SONARS, N, V, HISTORY>
{
    /// A robot that waits for [`Robot::start`].
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
            told: commands::NOTHING,
        }
    }

    /// Starts afresh: no map, exploring. `buffer` is for snapshots on their way to flash or across the line; one of
    /// [`RobustFilter::SNAPSHOT_BYTES`] and `HISTORY + 16` more has room for every hypothesis, and without one there are none.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of its range; the robot must then be started again.
    pub fn start(&mut self, config: &RobotConfig<SONARS>, buffer: &'buffer mut [u8]) -> Result<(), ConfigError> {
        self.mapper.start(&config.mapper)?;
        self.drive.start(config.drive, config.mapper.seed)?;
        self.config = *config;
        self.reporter.start(config.hello::<V, RobustFilter<N, V, HISTORY>>(), FRAMES_PER_HELLO);
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
        self.told = commands::NOTHING;
        Ok(())
    }

    /// One turn of the main loop: takes at most one command, maps the ring frame, drives on, keeps a snapshot when one is due,
    /// and feeds the watchdog. `ring_faults` are those of the ring's driver so far.
    pub fn turn(&mut self, frame: &RingFrame<SONARS>, ring_faults: &FaultCounters, board: &mut impl Board) -> Seen {
        self.watch_the_clock(board);
        self.obey(board);
        let faults = self.loop_faults(ring_faults);
        let (seen, velocity) =
            if self.paused { self.stand(&faults, board) } else { self.map_and_drive(frame, &faults, board) };
        self.tell_ring(frame, board);
        self.tell_drive(velocity, board);
        let is_due = |(_, update): &(Place, Update)| self.policy().is_due(update.place_index);
        if seen.as_ref().is_some_and(is_due) {
            // Erasing flash takes up to seconds; the robot must not drive blindly meanwhile.
            board.follow(VelocityCommand::STOP);
            self.keep_snapshot(board);
            self.last_turn_ms = None;
        }
        board.follow(velocity);
        self.tell_journey(board);
        if self.turns.is_multiple_of(TURNS_PER_HEALTH) {
            let health = Health {
                uptime_ms: board.now_ms(),
                loop_count: self.turns,
                stack_high_water_bytes: board.stack_high_water_bytes(),
                worst_turn_us: self.worst_turn_ms.saturating_mul(1000),
            };
            // A message that finds no room is counted; the next one comes.
            let _ = self.send(&Message::Health(health), board);
        }
        self.turns = self.turns.wrapping_add(1);
        board.feed_watchdog();
        seen
    }

    #[inline(never)]
    fn map_and_drive(
        &mut self,
        frame: &RingFrame<SONARS>,
        faults: &FaultCounters,
        board: &mut impl Board,
    ) -> (Seen, VelocityCommand) {
        let mut line = Line { encoder: &mut self.encoder, faults: &mut self.faults, board };
        let seen = self.mapper.observe(frame, self.drive.turn());
        self.reporter.report(&self.mapper, seen.as_ref(), faults, |message| line.send(message));
        let place = seen.as_ref().map(|(place, _)| place);
        let velocity = self.drive.advance(self.mapper.detector(), self.mapper.filter(), place);
        if self.drive.holds_place() {
            self.mapper.hold_place();
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

    /// A robot that is paused still says what it knows.
    fn stand(&mut self, faults: &FaultCounters, board: &mut impl Board) -> (Seen, VelocityCommand) {
        let mut line = Line { encoder: &mut self.encoder, faults: &mut self.faults, board };
        self.reporter.report(&self.mapper, None, faults, |message| line.send(message));
        (None, VelocityCommand::STOP)
    }

    /// Writes a snapshot of the drive and the mapper into the buffer, for the flash.
    #[inline(never)]
    fn keep_snapshot(&mut self, board: &mut impl Board) {
        let Self { mapper, drive, staging, .. } = self;
        let kept = staging.take(|buffer| snapshot(mapper, drive, buffer).ok()).map(|()| board.save(staging.taken()));
        match kept {
            Ok(Ok(())) => {
                self.stored_bytes = u16::try_from(self.staging.taken().len()).unwrap_or(u16::MAX);
                self.places_since = 0;
            }
            Ok(Err(SaveError::NoStore)) => {}
            Ok(Err(SaveError::Failed)) | Err(_) => self.faults.record(FaultKind::StoreFailed),
        }
    }

    /// Goes on with a snapshot, as of the last start or of another robot with the same capacities.
    ///
    /// # Errors
    /// [`SnapshotError`] says what is wrong with the bytes; nothing has changed then, and the fault is counted.
    #[inline(never)]
    pub fn restore(&mut self, bytes: &[u8], resume: Resume) -> Result<(), SnapshotError> {
        let Self { mapper, drive, .. } = self;
        let restored = restore(mapper, drive, bytes, resume);
        match restored {
            Ok(()) => self.localise_only = self.mapper.filter().is_localise_only(),
            Err(_) => self.faults.record(FaultKind::SnapshotRejected),
        }
        restored
    }

    fn policy(&self) -> SnapshotPolicy {
        self.config.snapshot
    }

    fn watch_the_clock(&mut self, board: &mut impl Board) {
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
    fn tell_ring(&mut self, frame: &RingFrame<SONARS>, board: &mut impl Board) {
        let ring = Message::Ring { frame_index: self.turns, echoes: Echoes::new(&frame.echoes) };
        let _ = self.send(&ring, board);
    }

    fn tell_drive(&mut self, velocity: VelocityCommand, board: &mut impl Board) {
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

    /// Every fault so far, of all stages. `ring_faults` are those of the ring's driver.
    pub fn faults(&self, ring_faults: &FaultCounters) -> FaultCounters {
        let mut faults = self.loop_faults(ring_faults);
        faults.add(self.mapper.detector().faults());
        faults.add(self.mapper.filter().faults());
        faults
    }

    /// Those that the mapper does not count itself.
    fn loop_faults(&self, ring_faults: &FaultCounters) -> FaultCounters {
        let mut faults = *ring_faults;
        faults.add(&self.faults);
        faults.add(self.inbox.faults());
        faults.add(self.drive.faults());
        faults
    }

    /// Whether the robot was told to pause: it then takes no ring frames.
    pub const fn is_paused(&self) -> bool {
        self.paused
    }

    /// All stages up to the map.
    pub const fn mapper(&self) -> &Mapper<SONARS, V, RobustFilter<N, V, HISTORY>> {
        &self.mapper
    }

    /// The drive.
    pub const fn drive(&self) -> &Drive<V, HISTORY> {
        &self.drive
    }
}

impl<const SONARS: usize, const N: usize, const V: usize, const HISTORY: usize> Default
    for Robot<'_, SONARS, N, V, HISTORY>
{
    fn default() -> Self {
        Self::new()
    }
}

/// Messages on their way to the board's queue.
struct Line<'a, BOARD> {
    encoder: &'a mut Encoder,
    faults: &'a mut FaultCounters,
    board: &'a mut BOARD,
}

impl<BOARD: Board> Line<'_, BOARD> {
    /// Queues a whole message, or drops it and counts that.
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

/// Writes a whole snapshot: the drive's section, then the mapper's in the remaining room.
fn snapshot<const SONARS: usize, const N: usize, const V: usize, const HISTORY: usize>(
    mapper: &mut Mapper<SONARS, V, RobustFilter<N, V, HISTORY>>,
    drive: &mut Drive<V, HISTORY>,
    buffer: &mut [u8],
) -> Result<usize, SnapshotError> {
    let mut writer = Writer::new(buffer)?;
    writer.stage(drive)?;
    mapper.save(&mut writer)?;
    writer.finish()
}

/// Restores a snapshot. One without the drive's section is of a robot that was driven by hand.
fn restore<const SONARS: usize, const N: usize, const V: usize, const HISTORY: usize>(
    mapper: &mut Mapper<SONARS, V, RobustFilter<N, V, HISTORY>>,
    drive: &mut Drive<V, HISTORY>,
    bytes: &[u8],
    resume: Resume,
) -> Result<(), SnapshotError> {
    let section = Snapshot::open(bytes)?.section(Drive::<V, HISTORY>::SECTION);
    if let Some(section) = section {
        drive.check(section)?;
    }
    mapper.restore(bytes, resume)?;
    match section {
        Some(section) => drive.restore(section)?,
        None => drive.resume(core::iter::empty()),
    }
    if resume == Resume::AtUnknownVertex {
        drive.kidnapped();
    }
    Ok(())
}
