//! A minimal main loop that executes commands, and a line to it that a test can damage.

use super::frame;
use std::cell::RefCell;
use std::io::{self, Read, Write};
use std::rc::Rc;
use toposlam::RobustConfig;
use toposlam::reference::robust::{self, HYPOTHESES, RobotMapper, VERTICES};
use toposlam::reference::{self, SONARS};
use toposlam::wire::{
    Capacities, Command, Encoder, Hello, Inbox, Info, Message, Outcome, Refusal, Reporter, ResetCause, Settings,
    Staging, Version,
};
use toposlam_sim::world::{Plan, RobotModel, Simulation};

/// Turns after which the robot has found some places.
pub(crate) const TURNS: usize = 2000;

/// A minimal main loop: ring frames, mapper and inbox. Its snapshots are arbitrary bytes.
pub(crate) struct FakeRobot {
    world: Simulation,
    pub(crate) mapper: Box<RobotMapper>,
    reporter: Reporter<VERTICES>,
    pub(crate) inbox: Inbox,
    staging: Staging<'static>,
    pub(crate) settings: Settings<RobustConfig>,
    encoder: Encoder,
    paused: bool,
    localise_only: bool,
    goal: Option<u8>,
    pub(crate) executed: Vec<Command>,
    snapshots_taken: u8,
    pub(crate) restored: Vec<u8>,
    pub(crate) said: Vec<Message>,
}

impl FakeRobot {
    pub(crate) fn new() -> Self {
        let plan = Plan::built_in("office").unwrap();
        let mut mapper = Box::new(RobotMapper::new());
        mapper.start(&robust::MAPPER).unwrap();
        let mut reporter = Reporter::new();
        reporter.start(hello(), 100);
        Self {
            world: Simulation::new(&plan, RobotModel::default(), 3).unwrap(),
            mapper,
            reporter,
            inbox: Inbox::new(),
            staging: Staging::new(Box::leak(Box::new([0; 300]))),
            settings: Settings {
                filter: RobustConfig::DEFAULT,
                place: reference::PLACE,
                speed_permille: 1000,
                snapshot_every_places: 10,
            },
            encoder: Encoder::new(0),
            paused: false,
            localise_only: false,
            goal: None,
            executed: Vec::new(),
            snapshots_taken: 0,
            restored: Vec::new(),
            said: Vec::new(),
        }
    }

    /// Runs one turn of the main loop with the bytes received since the last one; returns the transmitted bytes.
    pub(crate) fn turn(&mut self, bytes: &[u8]) -> Vec<u8> {
        let first = self.said.len();
        bytes.iter().for_each(|&byte| self.inbox.take(byte));
        // The closure needs the robot, and the robot holds the inbox.
        let mut inbox = std::mem::take(&mut self.inbox);
        let reply = inbox.turn(|command| self.execute(command).unwrap_or_else(Outcome::Refused));
        self.inbox = inbox;
        self.said.extend(reply.map(Message::Reply));
        if !self.paused {
            let (frame, truth) = self.world.next().expect("the drive never ends");
            let said = &mut self.said;
            let seen = self.mapper.observe(&frame, truth.passage());
            self.reporter.report(&self.mapper, seen.as_ref(), self.inbox.faults(), |message| {
                said.push(*message);
                Ok(())
            });
        }
        let encoder = &mut self.encoder;
        self.said.iter().skip(first).flat_map(|message| frame(encoder, message)).collect()
    }

    fn execute(&mut self, command: &Command) -> Result<Outcome, Refusal> {
        self.executed.push(*command);
        match *command {
            Command::Info => return Ok(Outcome::Info(self.info())),
            Command::GetMap => self.reporter.send_full(),
            Command::GetSnapshot { offset } => {
                if offset == 0 {
                    self.snapshots_taken = self.snapshots_taken.wrapping_add(1);
                    let snapshot = [self.snapshots_taken; 150];
                    self.staging.take(|buffer| {
                        buffer.get_mut(..150)?.copy_from_slice(&snapshot);
                        Some(150)
                    })?;
                }
                return self.staging.outgoing_chunk(offset);
            }
            Command::RestoreBegin { length, crc } => self.staging.begin(length, crc)?,
            Command::RestoreChunk { offset, bytes } => self.staging.chunk(offset, bytes.as_slice())?,
            Command::RestoreCommit => match self.staging.commit()? {
                [] => return Err(Refusal::BadSnapshot),
                bytes => self.restored = bytes.to_vec(),
            },
            Command::Reset => {
                let said = &mut self.said;
                self.reporter.forget(|message| {
                    said.push(*message);
                    Ok(())
                });
                self.mapper.start(&robust::MAPPER).map_err(|_| Refusal::OutOfRange)?;
                self.reporter.start(hello(), 100);
            }
            Command::SetConfig(setting) => self.settings = self.settings.with(setting, HYPOTHESES, SONARS)?,
            Command::LocaliseOnly { on } => self.localise_only = on,
            Command::GoTo { vertex } if usize::from(vertex) < self.mapper.map().vertices().len() => {
                self.goal = Some(vertex)
            }
            Command::GoTo { .. } => return Err(Refusal::UnknownVertex),
            Command::Explore => self.goal = None,
            Command::Pause { on } => self.paused = on,
            _ => return Err(Refusal::Unsupported),
        }
        Ok(Outcome::Done)
    }

    fn info(&self) -> Info {
        Info {
            version: Version::LIBRARY,
            boot: 17,
            reset_cause: ResetCause::BrownOut,
            uptime_ms: 1000,
            paused: self.paused,
            localise_only: self.localise_only,
            goal: self.goal,
            stored_bytes: 0,
            stored_places_ago: 0,
        }
    }

    /// The whole state of the mapper, bit for bit.
    pub(crate) fn mapping(&self) -> String {
        format!("{:?}{:?}", self.mapper.detector(), self.mapper.filter())
    }
}

fn hello() -> Hello {
    let capacities = Capacities::of_mapper::<SONARS, VERTICES, robust::Filter>(&robust::MAPPER);
    Hello::new(0, ResetCause::Unknown, reference::SEED, capacities)
}

/// Damages the bytes of one turn in the given direction.
pub(crate) type Damage = Box<dyn FnMut(Direction, Vec<u8>) -> Vec<u8>>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    ToRobot,
    FromRobot,
}

/// The line to a fake robot. Each read is a turn of its main loop.
pub(crate) struct FakeLine {
    robot: Rc<RefCell<FakeRobot>>,
    to_robot: Vec<u8>,
    from_robot: Vec<u8>,
    damage: Damage,
}

impl Read for FakeLine {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.from_robot.is_empty() {
            let damage = &mut self.damage;
            let bytes = damage(Direction::ToRobot, std::mem::take(&mut self.to_robot));
            self.from_robot = damage(Direction::FromRobot, self.robot.borrow_mut().turn(&bytes));
        }
        if self.from_robot.is_empty() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        let count = buffer.len().min(self.from_robot.len());
        buffer[..count].copy_from_slice(&self.from_robot[..count]);
        self.from_robot.drain(..count);
        Ok(count)
    }
}

impl Write for FakeLine {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.to_robot.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl FakeLine {
    pub(crate) fn new(damage: Damage) -> Self {
        let robot = Rc::new(RefCell::new(FakeRobot::new()));
        Self { robot, to_robot: Vec::new(), from_robot: Vec::new(), damage }
    }

    pub(crate) fn robot(&self) -> Rc<RefCell<FakeRobot>> {
        self.robot.clone()
    }
}
