//! Arbitrary bytes and requests to a robot, with turns of its main loop at arbitrary points between them.
#![no_main]

#[path = "commands/expected.rs"]
mod expected;

use std::sync::LazyLock;

use arbitrary::Arbitrary;
use expected::{Expected, Staged};
use libfuzzer_sys::fuzz_target;
use toposlam::RobustConfig;
use toposlam::persist::Persist;
use toposlam::persist::snapshot::Writer;
use toposlam::place::PlaceDetector;
use toposlam::reference::{PLACE, RING, SONARS};
use toposlam::wire::{
    Chunk, Command, Inbox, Info, Outcome, Refusal, Request, ResetCause, Setting, Settings, Staging, Version, crc32,
};
use toposlam::{FaultKind, Filter, RobustFilter};
use toposlam_fuzz::filters::{self, CONFIG, HYPOTHESES, Small};
use toposlam_fuzz::line::{Line, Piece, damage};

/// Room for a snapshot with most of the hypotheses; smaller than the largest announced length.
const STAGING_BYTES: usize = Small::SNAPSHOT_BYTES - 50;

/// The number of places observed before the first bytes arrive.
const PLACES: usize = 20;
/// The filter takes most of the time and is not under test.
const TURNS_PER_PLACE: usize = 4;

#[derive(Arbitrary, Debug)]
enum Step<'a> {
    /// A turn of the main loop.
    Turn,
    /// A request arrives.
    Ask { id: u8, told: Told<'a> },
    /// The last bytes are repeated.
    Again,
    /// A request with one changed byte arrives.
    Damaged { id: u8, told: Told<'a>, at: u8, with: u8 },
    /// Arbitrary bytes arrive.
    Line(Piece<'a>),
    /// The robot's own snapshot is sent back in chunks, one per turn, with changed bytes and a valid or invalid CRC.
    Restore { edits: Vec<(u16, u8)>, crc_error: u8, left_out: Option<u8> },
}

/// The commands with arbitrary values.
#[derive(Arbitrary, Clone, Copy, Debug)]
enum Told<'a> {
    Info,
    GetMap,
    GetSnapshot {
        offset: u16,
    },
    RestoreBegin {
        length: u16,
        crc: u32,
    },
    /// Announces the bytes that a following chunk at offset 0 may carry.
    RestoreOf {
        bytes: &'a [u8],
    },
    RestoreChunk {
        offset: u16,
        bytes: &'a [u8],
    },
    RestoreCommit,
    Reset,
    SetConfig {
        which: u8,
        value: u16,
    },
    LocaliseOnly {
        on: bool,
    },
    GoTo {
        vertex: u8,
    },
    Explore,
    Pause {
        on: bool,
    },
}

impl Told<'_> {
    fn command(self) -> Command {
        let chunk = |bytes: &[u8]| Chunk::new(bytes.iter().copied());
        match self {
            Self::Info => Command::Info,
            Self::GetMap => Command::GetMap,
            Self::GetSnapshot { offset } => Command::GetSnapshot { offset },
            Self::RestoreBegin { length, crc } => Command::RestoreBegin { length, crc },
            Self::RestoreOf { bytes } => Command::RestoreBegin { length: bytes.len() as u16, crc: crc32(bytes) },
            Self::RestoreChunk { offset, bytes } => Command::RestoreChunk { offset, bytes: chunk(bytes) },
            Self::RestoreCommit => Command::RestoreCommit,
            Self::Reset => Command::Reset,
            Self::SetConfig { which, value } => Command::SetConfig(setting(which, value)),
            Self::LocaliseOnly { on } => Command::LocaliseOnly { on },
            Self::GoTo { vertex } => Command::GoTo { vertex },
            Self::Explore => Command::Explore,
            Self::Pause { on } => Command::Pause { on },
        }
    }
}

fn setting(which: u8, value: u16) -> Setting {
    let make = [
        Setting::NoiseMm,
        Setting::Hypotheses,
        Setting::Moves,
        Setting::WrongTurnPermille,
        Setting::WrongDegreePermille,
        Setting::EquidistanceMm,
        Setting::LeaveMm,
        Setting::SpeedPermille,
        Setting::SnapshotEveryPlaces,
    ];
    make[usize::from(which) % make.len()](value)
}

fuzz_target!(|steps: Vec<Step<'_>>| {
    let mut buffer = [0; STAGING_BYTES];
    let mut robot = Robot::new(&mut buffer);
    let mut client = Client::default();
    for step in &steps {
        match step {
            Step::Turn => robot.turn(&std::mem::take(&mut client.under_way)),
            Step::Ask { id, told } => client.ask((*id).into(), told.command(), None),
            Step::Again => client.under_way.extend_from_slice(&client.last),
            Step::Damaged { id, told, at, with } => client.ask((*id).into(), told.command(), Some((*at, *with))),
            Step::Line(piece) => {
                client.last = client.line.carry(piece);
                client.under_way.extend_from_slice(&client.last);
            }
            Step::Restore { edits, crc_error, left_out } => {
                restore(&mut robot, &mut client, edits, (*crc_error).into(), left_out.map(usize::from));
            }
        }
    }
    robot.turn(&client.under_way);
});

fn restore(robot: &mut Robot<'_>, client: &mut Client, edits: &[(u16, u8)], crc_error: u32, left_out: Option<usize>) {
    let mut snapshot = filters::saved(&mut robot.filter);
    for &(at, byte) in edits {
        let length = snapshot.len();
        snapshot[usize::from(at) % length] = byte;
    }
    let begin = Command::RestoreBegin { length: snapshot.len() as u16, crc: crc32(&snapshot) ^ crc_error };
    let chunks = snapshot.chunks(64).enumerate().filter(|&(index, _)| Some(index) != left_out);
    let chunks = chunks.map(|(index, bytes)| Command::RestoreChunk {
        offset: 64 * index as u16,
        bytes: Chunk::new(bytes.iter().copied()),
    });
    for (command, id) in [begin].into_iter().chain(chunks).chain([Command::RestoreCommit]).zip(1000..) {
        client.ask(id, command, None);
        robot.turn(&std::mem::take(&mut client.under_way));
    }
}

/// The sender.
#[derive(Default)]
struct Client {
    line: Line,
    /// Bytes that the robot has not received.
    under_way: Vec<u8>,
    /// The last bytes sent.
    last: Vec<u8>,
}

impl Client {
    fn ask(&mut self, id: u16, command: Command, damaged: Option<(u8, u8)>) {
        self.last = self.line.say(&Request { id, command });
        if let Some((at, with)) = damaged {
            damage(&mut self.last, at, with);
        }
        self.under_way.extend_from_slice(&self.last);
    }
}

/// A minimal main loop and its expected behaviour.
struct Robot<'buffer> {
    inbox: Inbox,
    staging: Staging<'buffer>,
    settings: Settings<RobustConfig>,
    filter: Box<Small>,
    turns: usize,
    goal: Option<u8>,
    paused: bool,
    localise_only: bool,
    expected: Expected,
}

/// A robot that has observed some places.
static DRIVEN: LazyLock<Box<Small>> = LazyLock::new(|| filters::after(PLACES));

impl<'buffer> Robot<'buffer> {
    fn new(buffer: &'buffer mut [u8]) -> Self {
        Self {
            inbox: Inbox::new(),
            staging: Staging::new(buffer),
            settings: Settings { filter: CONFIG, place: PLACE, speed_permille: 1000, snapshot_every_places: 25 },
            filter: DRIVEN.clone(),
            turns: 0,
            goal: None,
            paused: false,
            localise_only: false,
            expected: Expected::default(),
        }
    }

    /// Runs one turn of the main loop with the bytes received since the last one.
    fn turn(&mut self, bytes: &[u8]) {
        let due = self.expected.receive(bytes);
        bytes.iter().for_each(|&byte| self.inbox.take(byte));
        let mut executed = None;
        let mut inbox = std::mem::take(&mut self.inbox);
        let reply = inbox.turn(|command| {
            let outcome = self.execute(command).unwrap_or_else(Outcome::Refused);
            executed = Some((*command, outcome));
            outcome
        });
        self.inbox = inbox;
        self.expected.judge(due, executed, reply.map(|reply| (reply.request, reply.outcome)));
        let faults = self.inbox.faults();
        assert_eq!(faults.count(FaultKind::WireCorrupt), self.expected.corrupt);
        assert_eq!(faults.count(FaultKind::CommandFlood), self.expected.flood);
        assert_eq!(faults.count(FaultKind::CommandRefused), self.expected.refused);
        if !self.paused && self.turns.is_multiple_of(TURNS_PER_PLACE) {
            let update = self.filter.observe(filters::walk(PLACES + self.turns / TURNS_PER_PLACE));
            filters::check(&self.filter, &update);
        }
        self.turns += 1;
    }

    fn execute(&mut self, command: &Command) -> Result<Outcome, Refusal> {
        match *command {
            Command::Info => return Ok(Outcome::Info(self.info())),
            Command::GetMap => {}
            Command::GetSnapshot { offset } => return self.piece(offset),
            Command::RestoreBegin { length, crc } => {
                let begun = self.staging.begin(length, crc);
                assert_eq!(begun, self.expected.staged.begin(length, crc));
                begun?;
            }
            Command::RestoreChunk { offset, bytes } => {
                let taken = self.staging.chunk(offset, bytes.as_slice());
                assert_eq!(taken, self.expected.staged.chunk(offset, bytes.as_slice()));
                taken?;
            }
            Command::RestoreCommit => self.commit()?,
            Command::Reset => {
                self.filter.start(self.settings.filter, 3).map_err(|_| Refusal::OutOfRange)?;
                self.localise_only = false;
            }
            Command::SetConfig(setting) => self.set(setting)?,
            Command::LocaliseOnly { on } => {
                self.localise_only = on;
                self.filter.set_localise_only(on);
            }
            Command::GoTo { vertex } if usize::from(vertex) < self.filter.map().vertices().len() => {
                self.goal = Some(vertex)
            }
            Command::GoTo { .. } => return Err(Refusal::UnknownVertex),
            Command::Explore => self.goal = None,
            Command::Pause { on } => self.paused = on,
            _ => return Err(Refusal::Unsupported),
        }
        Ok(Outcome::Done)
    }

    fn piece(&mut self, offset: u16) -> Result<Outcome, Refusal> {
        if offset == 0 {
            let filter = &mut self.filter;
            let taken = self.staging.take(|buffer| {
                let mut writer = Writer::new(buffer).ok()?;
                writer.stage(filter.as_mut()).ok()?;
                writer.finish().ok()
            });
            self.expected.staged = Staged::Nothing;
            taken?;
            self.expected.staged = Staged::Outgoing;
        }
        let piece = self.staging.outgoing_chunk(offset);
        match (&piece, &self.expected.staged) {
            (Ok(Outcome::Snapshot { total, offset: at, bytes }), Staged::Outgoing) => {
                let rest = usize::from(total - offset);
                assert_eq!((*at, bytes.as_slice().len()), (offset, rest.min(64)));
            }
            (Err(Refusal::OutOfRange), Staged::Outgoing) => {}
            (Err(Refusal::NotNow), Staged::Nothing | Staged::Incoming { .. }) => {}
            (piece, staged) => panic!("{piece:?} of {staged:?}"),
        }
        piece
    }

    fn commit(&mut self) -> Result<(), Refusal> {
        let committed = self.staging.commit();
        assert_eq!(committed, self.expected.staged.commit());
        let section = filters::contents(committed?).map_err(|_| Refusal::BadSnapshot)?;
        let before = filters::saved(&mut self.filter);
        match self.filter.restore(section) {
            Ok(()) => {
                // The snapshot includes settings, with up to 255 moves at a place.
                if filters::moves(&mut self.filter) > 3 {
                    self.filter = DRIVEN.clone();
                }
                Ok(())
            }
            Err(_) => {
                assert_eq!(filters::saved(&mut self.filter), before, "a refused snapshot changes nothing");
                Err(Refusal::BadSnapshot)
            }
        }
    }

    fn set(&mut self, setting: Setting) -> Result<(), Refusal> {
        let settings = self.settings.with(setting, HYPOTHESES, SONARS)?;
        assert_eq!(RobustFilter::<4, 8, 40>::new().start(settings.filter, 1), Ok(()));
        assert_eq!(PlaceDetector::new().start(settings.place, RING), Ok(()));
        assert!((1..=1000).contains(&settings.speed_permille));
        // More moves are valid, but would take most of the fuzzing time.
        if settings.filter.moves <= 3 {
            self.settings = settings;
        }
        Ok(())
    }

    fn info(&self) -> Info {
        Info {
            version: Version::LIBRARY,
            boot: 17,
            reset_cause: ResetCause::PowerOn,
            uptime_ms: 1000,
            paused: self.paused,
            localise_only: self.localise_only,
            goal: self.goal,
            stored_bytes: 0,
            stored_places_ago: 0,
        }
    }
}
