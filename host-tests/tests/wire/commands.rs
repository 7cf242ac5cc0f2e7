//! Requests: every command there and back, over lines that lose and damage, and floods that must not touch the mapping.

use super::damage::with_crc;
use super::frame;
use super::robot::Random;
use super::samples::{largest_requests, requests, typical};
use proptest::prelude::*;
use std::cell::RefCell;
use std::io::{self, Read, Write};
use std::rc::Rc;
use std::time::Duration;
use toposlam::reference::{self, HYPOTHESES, RobotMapper, SONARS};
use toposlam::wire::{
    CHUNK_BYTES, Command, Encoder, Header, Inbox, Info, Message, Outcome, QueueFull, Refusal, Reply, Request,
    ResetCause, Setting, Settings, Staging, Version, map_digest,
};
use toposlam::{FaultCounters, FaultKind, RobustConfig};
use toposlam_host::client::{Client, ClientError};
use toposlam_host::world::{Plan, RobotModel, Simulation};

/// What a line of 115,200 baud brings in a ring frame of 130 ms.
const LINE_BYTES_PER_TURN: usize = 1500;
/// Turns after which the robot has found some places.
const TURNS: usize = 2000;

/// The main loop of a robot in small: ring frames, mapper and inbox. Its snapshots are bytes without a meaning.
struct FakeRobot {
    world: Simulation,
    mapper: Box<RobotMapper>,
    inbox: Inbox,
    staging: Staging<'static>,
    settings: Settings,
    encoder: Encoder,
    paused: bool,
    localise_only: bool,
    going_to: Option<u8>,
    executed: Vec<Command>,
    snapshots_taken: u8,
    restored: Vec<u8>,
    said: Vec<Message>,
}

impl FakeRobot {
    fn new() -> Self {
        let plan = Plan::built_in("office").unwrap();
        let mut mapper = Box::new(RobotMapper::new());
        mapper.start(&reference::MAPPER).unwrap();
        Self {
            world: Simulation::new(&plan, RobotModel::default(), 3).unwrap(),
            mapper,
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
            going_to: None,
            executed: Vec::new(),
            snapshots_taken: 0,
            restored: Vec::new(),
            said: Vec::new(),
        }
    }

    /// One turn of the main loop with the bytes that came since the last one; gives the bytes that go out.
    fn turn(&mut self, bytes: &[u8]) -> Vec<u8> {
        let first = self.said.len();
        bytes.iter().for_each(|&byte| self.inbox.take(byte));
        // The closure needs the robot, and the robot holds the inbox.
        let mut inbox = std::mem::take(&mut self.inbox);
        let reply = inbox.turn(|command| self.execute(command).map_or_else(Outcome::Refused, |outcome| outcome));
        self.inbox = inbox;
        self.said.extend(reply.map(Message::Reply));
        if !self.paused {
            let (frame, truth) = self.world.next().expect("the drive never ends");
            let said = &mut self.said;
            self.mapper.observe(&frame, truth.turn, self.inbox.faults(), |message| {
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
            Command::GetMap => self.mapper.hurry(),
            Command::GetSnapshot { offset } => {
                if offset == 0 {
                    self.snapshots_taken = self.snapshots_taken.wrapping_add(1);
                    let snapshot = [self.snapshots_taken; 150];
                    self.staging.take(|buffer| {
                        buffer.get_mut(..150)?.copy_from_slice(&snapshot);
                        Some(150)
                    })?;
                }
                return self.staging.piece(offset);
            }
            Command::RestoreBegin { length, crc } => self.staging.begin(length, crc)?,
            Command::RestoreChunk { offset, bytes } => self.staging.chunk(offset, bytes.as_slice())?,
            Command::RestoreCommit => match self.staging.commit()? {
                [] => return Err(Refusal::BadSnapshot),
                bytes => self.restored = bytes.to_vec(),
            },
            Command::Reset => {
                let said = &mut self.said;
                let reset = self.mapper.reset(&reference::MAPPER, |message| {
                    said.push(*message);
                    Ok(())
                });
                reset.map_err(|_| Refusal::OutOfRange)?;
            }
            Command::SetConfig(setting) => self.settings = self.settings.with(setting, HYPOTHESES, SONARS)?,
            Command::LocaliseOnly { on } => self.localise_only = on,
            Command::GoTo { vertex } if vertex < self.mapper.map().vertices() => self.going_to = Some(vertex),
            Command::GoTo { .. } => return Err(Refusal::UnknownVertex),
            Command::Explore => self.going_to = None,
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
            going_to: self.going_to,
            stored_bytes: 0,
            stored_places_ago: 0,
        }
    }

    /// Everything that the mapping is made of, in every bit.
    fn mapping(&self) -> String {
        format!("{:?}{:?}", self.mapper.detector(), self.mapper.filter())
    }
}

/// What a line does to the bytes of one turn, in the given direction.
type Damage = Box<dyn FnMut(Direction, Vec<u8>) -> Vec<u8>>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    ToRobot,
    FromRobot,
}

/// The line to a fake robot. Each read is a turn of its main loop.
#[derive(Clone)]
struct FakeLine {
    robot: Rc<RefCell<FakeRobot>>,
    to_robot: Vec<u8>,
    from_robot: Vec<u8>,
    damage: Rc<RefCell<Damage>>,
}

impl Read for FakeLine {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.from_robot.is_empty() {
            let mut damage = self.damage.borrow_mut();
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

type FakeClient = Client<FakeLine, fn(Header, &Message)>;

/// A client of a fake robot, over a line that damages.
fn client(damage: Damage) -> (FakeClient, Rc<RefCell<FakeRobot>>) {
    let robot = Rc::new(RefCell::new(FakeRobot::new()));
    let damage = Rc::new(RefCell::new(damage));
    let line = FakeLine { robot: robot.clone(), to_robot: Vec::new(), from_robot: Vec::new(), damage };
    let mut client: FakeClient = Client::new(line, 65_530, |_, _| {});
    client.timeout = Duration::from_secs(5);
    (client, robot)
}

fn good_line() -> Damage {
    Box::new(|_, bytes| bytes)
}

#[test]
fn every_command_reaches_the_robot_as_it_was_given_and_its_outcome_comes_back() {
    let (mut client, robot) = client(good_line());
    for sent in [requests(), largest_requests()].concat() {
        let outcome = client.request(sent.command).unwrap();
        let robot = robot.borrow();
        assert_eq!(robot.executed.last(), Some(&sent.command));
        let replies = robot.said.iter().filter_map(|said| match said {
            Message::Reply(reply) => Some(reply.outcome),
            _ => None,
        });
        assert_eq!(replies.last(), Some(outcome));
    }
    assert_eq!(robot.borrow().executed.len(), 2 * requests().len(), "each once");
}

#[test]
fn what_is_set_is_what_the_robot_says_of_itself() {
    let (mut client, robot) = client(good_line());
    client.order(Command::LocaliseOnly { on: true }).unwrap();
    client.order(Command::Pause { on: true }).unwrap();
    let info = client.info().unwrap();
    assert_eq!((info.paused, info.localise_only, info.going_to), (true, true, None));
    assert_eq!((info.version, info.boot, info.reset_cause), (Version::LIBRARY, 17, ResetCause::BrownOut));
    client.order(Command::SetConfig(Setting::NoiseMm(77))).unwrap();
    assert_eq!(robot.borrow().settings.filter.noise_mm, 77);
    let refused = client.order(Command::SetConfig(Setting::NoiseMm(0)));
    assert!(matches!(refused, Err(ClientError::Refused(Refusal::OutOfRange))), "{refused:?}");
    assert_eq!(robot.borrow().settings.filter.noise_mm, 77);
}

#[test]
fn the_map_comes_when_it_is_asked_for() {
    let (mut client, robot) = client(good_line());
    for _ in 0..TURNS {
        robot.borrow_mut().turn(&[]);
    }
    let vertices = robot.borrow().mapper.map().vertices();
    assert!(vertices > 4, "{vertices} vertices");
    let turns = robot.borrow().said.len();
    let picture = client.map().unwrap();
    let robot = robot.borrow();
    assert!(picture.edges().eq(robot.mapper.map().edges()));
    assert_eq!(picture.vertices(), robot.mapper.map().vertices());
    assert!(robot.said.len() - turns < usize::from(vertices) + 20, "no more than the picture was sent");
    assert!(picture.hello().is_some());
}

#[test]
fn a_reset_robot_tells_that_every_vertex_is_gone() {
    let (mut client, robot) = client(good_line());
    for _ in 0..TURNS {
        robot.borrow_mut().turn(&[]);
    }
    client.map().unwrap();
    assert!(client.picture().vertices() > 4 && client.picture().location().is_some());
    client.order(Command::Reset).unwrap();
    client.info().unwrap();
    assert_eq!((client.picture().vertices(), client.picture().location()), (0, None));
    assert_eq!(client.map().unwrap().vertices(), robot.borrow().mapper.map().vertices());
}

#[test]
fn snapshots_cross_the_line_whole_both_ways() {
    let (mut client, robot) = client(good_line());
    assert_eq!(client.snapshot().unwrap(), [1; 150]);
    assert_eq!(client.snapshot().unwrap(), [2; 150], "each is taken anew");
    for length in [1, CHUNK_BYTES - 1, CHUNK_BYTES, CHUNK_BYTES + 1, 300] {
        let snapshot: Vec<u8> = (0..length).map(|byte| byte as u8).collect();
        client.restore(&snapshot).unwrap();
        assert_eq!(robot.borrow().restored, snapshot);
    }
    for (bad, refusal) in [(&[0; 301][..], Refusal::TooLong), (&[], Refusal::BadSnapshot)] {
        let refused = client.restore(bad);
        assert!(matches!(refused, Err(ClientError::Refused(why)) if why == refusal), "{refused:?}");
        assert_eq!(robot.borrow().restored.len(), 300, "what is refused changes nothing");
    }
}

#[test]
fn lost_requests_and_lost_replies_are_made_up_for_and_each_command_is_executed_once() {
    for lost in [Direction::ToRobot, Direction::FromRobot] {
        let mut random = Random(7);
        let (mut client, robot) =
            client(Box::new(
                move |direction, bytes| {
                    if direction == lost && random.happens(50) { Vec::new() } else { bytes }
                },
            ));
        client.timeout = Duration::from_millis(20);
        client.attempts = 100;
        let snapshot: Vec<u8> = (0..=255).collect();
        client.restore(&snapshot).unwrap();
        assert_eq!(robot.borrow().restored, snapshot);
        assert_eq!(client.snapshot().unwrap(), [1; 150], "taken once, however often asked for");
        assert_eq!(robot.borrow().executed.len(), 1 + 4 + 1 + 3, "{lost:?}");
        client.order(Command::Pause { on: true }).unwrap();
        client.order(Command::Pause { on: true }).unwrap();
        assert_eq!(robot.borrow().executed.len(), 11, "the same command under another number is another request");
    }
}

#[test]
fn a_robot_that_says_nothing_is_an_error() {
    let (mut client, _) = client(Box::new(|direction, bytes| match direction {
        Direction::ToRobot => bytes,
        Direction::FromRobot => Vec::new(),
    }));
    client.timeout = Duration::from_millis(2);
    assert!(matches!(client.info(), Err(ClientError::NoReply { attempts: 5 })));
}

/// What an inbox executes of some bytes, one turn after each zero.
fn executed(inbox: &mut Inbox, bytes: &[u8]) -> Vec<Command> {
    let mut executed = Vec::new();
    for &byte in bytes {
        inbox.take(byte);
        if byte == 0 {
            inbox.turn(|command| {
                executed.push(*command);
                Outcome::Done
            });
        }
    }
    executed
}

const AFTER: Request = Request { id: 9, command: Command::Pause { on: false } };

#[test]
fn a_request_that_is_cut_anywhere_is_not_executed_and_the_next_one_is() {
    for request in [requests(), largest_requests()].concat() {
        let whole = frame(&mut Encoder::new(0), &request);
        let after = frame(&mut Encoder::new(1), &AFTER);
        for length in 0..whole.len() - 1 {
            for cut in [&whole[..length], &whole[whole.len() - 1 - length..]] {
                let mut inbox = Inbox::new();
                // A client sends a zero before each frame.
                let bytes = [cut, &[0], &after].concat();
                assert_eq!(executed(&mut inbox, &bytes), [AFTER.command], "{request:?} cut to {length}");
                assert_eq!(inbox.faults().of(FaultKind::WireCorrupt), u32::from(!cut.iter().all(|&byte| byte == 0)));
            }
        }
    }
}

#[test]
fn a_request_with_any_byte_changed_is_not_executed_and_the_next_one_is() {
    for request in [requests(), largest_requests()].concat() {
        let whole = frame(&mut Encoder::new(0), &request);
        let after = frame(&mut Encoder::new(1), &AFTER);
        for place in 0..whole.len() {
            for flip in 1..=255 {
                let mut damaged = whole.clone();
                damaged[place] ^= flip;
                let heard = executed(&mut Inbox::new(), &[&damaged[..], &[0], &after].concat());
                // Without its closing zero the frame is closed by the next one, with a byte too many.
                assert_eq!(heard, [AFTER.command], "{request:?}, byte {place} ^ {flip}");
            }
        }
    }
}

#[test]
fn a_line_that_echoes_what_the_robot_says_gives_no_commands() {
    let mut inbox = Inbox::new();
    let messages = [typical(), super::samples::largest()].concat();
    for (number, message) in (1..).zip(&messages) {
        assert_eq!(executed(&mut inbox, &frame(&mut Encoder::new(0), message)), []);
        assert_eq!(inbox.faults().of(FaultKind::WireCorrupt), number);
    }
}

proptest! {
    #[test]
    fn an_intact_frame_of_any_payload_is_one_request_or_one_fault(payload in proptest::collection::vec(any::<u8>(), 0..103)) {
        let mut inbox = Inbox::new();
        let executed = executed(&mut inbox, &with_crc(&[&[0x81, 0, 0], &payload[..]].concat()));
        prop_assert_eq!(executed.len() as u32 + inbox.faults().of(FaultKind::WireCorrupt), 1);
    }
}

#[test]
fn a_turn_looks_at_a_bounded_number_of_bytes_and_executes_one_request() {
    let mut inbox = Inbox::new();
    let mut encoder = Encoder::new(0);
    let flood: Vec<u8> =
        (0..2000).flat_map(|id| frame(&mut encoder, &Request { id, command: Command::Explore })).collect();
    let per_frame = flood.len() / 2000;
    for turn in 1..=3 {
        flood.iter().for_each(|&byte| inbox.take(byte));
        let mut executions = 0;
        let reply = inbox.turn(|_| {
            executions += 1;
            Outcome::Done
        });
        assert!(executions <= 1 && reply.is_some());
        let looked_at = usize::from(Inbox::BYTES_PER_TURN) / per_frame + 1;
        let faults = inbox.faults().of(FaultKind::CommandFlood) + inbox.faults().of(FaultKind::WireCorrupt);
        assert!(faults as usize <= turn * (looked_at + 1), "{faults} faults: the rest was not looked at");
        assert!(inbox.faults().of(FaultKind::CommandFlood) > 0);
    }
    assert_eq!(inbox.turn(|_| unreachable!("nothing waits")), None);
    assert_eq!(executed(&mut inbox, &[&[0][..], &frame(&mut encoder, &AFTER)].concat()), [AFTER.command]);
}

#[test]
fn a_second_request_in_a_turn_is_dropped_and_the_same_one_again_is_not_a_second() {
    let mut inbox = Inbox::new();
    let first = Request { id: 1, command: Command::Info };
    for request in [first, first, Request { id: 2, command: Command::Info }] {
        frame(&mut Encoder::new(0), &request).iter().for_each(|&byte| inbox.take(byte));
    }
    assert_eq!(inbox.faults().of(FaultKind::CommandFlood), 1);
    let reply = |inbox: &mut Inbox| inbox.turn(|_| Outcome::Refused(Refusal::Busy));
    let expected = Some(Reply { request: 1, outcome: Outcome::Refused(Refusal::Busy) });
    assert_eq!(reply(&mut inbox), expected);
    assert_eq!(reply(&mut inbox), None);
    frame(&mut Encoder::new(0), &first).iter().for_each(|&byte| inbox.take(byte));
    assert_eq!(inbox.turn(|_| unreachable!("it was executed")), expected, "the same reply again");
    assert_eq!(inbox.faults().of(FaultKind::CommandRefused), 1, "it was refused once");
    // The same number with another command is another request.
    frame(&mut Encoder::new(0), &Request { id: 1, ..AFTER }).iter().for_each(|&byte| inbox.take(byte));
    assert_eq!(inbox.turn(|_| Outcome::Done), Some(Reply { request: 1, outcome: Outcome::Done }));
}

/// What a flood brings in each turn.
type Flood = Box<dyn FnMut(usize) -> Vec<u8>>;

fn floods() -> Vec<(&'static str, FaultKind, Flood)> {
    fn repeated(bytes: Vec<u8>) -> Flood {
        Box::new(move |count| bytes.iter().copied().cycle().take(count).collect())
    }
    let mut random = Random(3);
    let noise: Flood = Box::new(move |count| (0..count).map(|_| random.next() as u8).collect());
    let (mut id, mut encoder) = (0, Encoder::new(0));
    let mut flood_of = move |command: fn(u16) -> Command| -> Flood {
        let mut encoder = std::mem::take(&mut encoder);
        Box::new(move |count| {
            let mut bytes = Vec::new();
            while bytes.len() < count {
                id = u16::wrapping_add(id, 1);
                bytes.extend(frame(&mut encoder, &Request { id, command: command(id) }));
            }
            bytes
        })
    };
    let echo = typical().iter().flat_map(|message| frame(&mut Encoder::new(0), message)).collect();
    vec![
        ("noise", FaultKind::WireCorrupt, noise),
        ("shortest frames", FaultKind::WireCorrupt, repeated(vec![1, 0])),
        ("no zero", FaultKind::CommandFlood, repeated(vec![0xFF])),
        ("its own messages", FaultKind::WireCorrupt, repeated(echo)),
        ("valid requests", FaultKind::CommandFlood, flood_of(|_| Command::Info)),
        ("valid requests that are refused", FaultKind::CommandRefused, flood_of(|_| Command::GoTo { vertex: 255 })),
        ("snapshots", FaultKind::CommandFlood, flood_of(|_| Command::GetSnapshot { offset: 0 })),
    ]
}

/// What was said of the map and the places.
fn of_the_map(said: &[Message]) -> Vec<Message> {
    said.iter().filter(|message| !matches!(message, Message::Fault { .. } | Message::Reply(_))).copied().collect()
}

#[test]
fn a_flood_at_the_full_rate_of_the_line_leaves_the_mapping_bit_for_bit_as_it_is() {
    let mut calm = FakeRobot::new();
    for _ in 0..TURNS {
        calm.turn(&[]);
    }
    let (mapping, said) = (calm.mapping(), of_the_map(&calm.said));
    assert!(calm.mapper.map().vertices() > 4);
    for (what, kind, mut flood) in floods() {
        let mut robot = FakeRobot::new();
        for _ in 0..TURNS {
            robot.turn(&flood(LINE_BYTES_PER_TURN));
        }
        assert!(robot.inbox.faults().of(kind) > 0, "{what}: {:?}", robot.inbox.faults());
        assert!(robot.mapping() == mapping, "{what}");
        assert_eq!(map_digest(robot.mapper.map()), map_digest(calm.mapper.map()), "{what}");
        assert!(of_the_map(&robot.said) == said, "{what}");
        // The counts go out, and the next request is answered.
        let told = Message::Fault { kind: kind as u8, count: robot.inbox.faults().of(kind) };
        assert!(robot.said.iter().rev().take(40).any(|message| *message == told), "{what}: the last count is told");
        robot.turn(&[]);
        robot.turn(&[&[0][..], &frame(&mut Encoder::new(0), &AFTER)].concat());
        let answered = Message::Reply(Reply { request: AFTER.id, outcome: Outcome::Done });
        assert!(robot.said.contains(&answered), "{what}");
    }
}

#[test]
fn the_whole_picture_goes_out_in_a_quarter_of_the_ticks_and_then_at_the_usual_pace() {
    let mut random = Random(11);
    let mut robot = super::robot::Robot::<16>::new(1);
    while robot.filter.map.vertices() < 14 {
        robot.drive(&mut random);
        robot.place(&mut random);
    }
    robot.tick(&mut random);
    let usual = robot.tick(&mut random).len();
    robot.reporter.hurry();
    let lengths: Vec<usize> = (0..7).map(|_| robot.tick(&mut random).len()).collect();
    assert_eq!(usual, 1);
    // An introduction, 14 rows, the size, the location, the belief, and no fault.
    assert_eq!(lengths, [5, 4, 4, 4, 1, 1, 1]);
    // A queue that is full holds the rest of the round back.
    robot.reporter.hurry();
    let mut sent = 0;
    let calls = RefCell::new(0);
    while sent < 18 {
        robot.reporter.tick(&robot.filter.map, &FaultCounters::new(), |message| {
            *calls.borrow_mut() += 1;
            let is_taken = *calls.borrow() % 3 == 0;
            sent += usize::from(is_taken && !matches!(message, Message::Hello(_)));
            if is_taken { Ok(()) } else { Err(QueueFull) }
        });
        assert!(*calls.borrow() < 100);
    }
}
