//! A recording holds exactly the received bytes, and stays readable after any interruption.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use foxglove::messages::{LaserScan, Log, SceneUpdate};
use prost::Message as _;
use toposlam::Filter;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::ring::Echo;
use toposlam::wire::{Echoes, Encoder, MAX_FRAME_BYTES, Message, map_digest};

use super::*;
use crate::listener::{Event, Listener};
use crate::topology::TopologicalMap;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

const SECOND_NS: u64 = 1_000_000_000;

/// The bytes of each turn of an exploration, and the robot's final map.
struct Drive {
    turns: Vec<Vec<u8>>,
    map: TopologicalMap,
    digest: u32,
}

static DRIVE: LazyLock<Drive> = LazyLock::new(drive);

fn drive() -> Drive {
    let plan = Plan::built_in("flat").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    let mut listener = Listener::new();
    let mut turns = Vec::new();
    while exploration.places() < 6 || !listener.replica().is_converged() {
        exploration.advance();
        turns.push(exploration.board().sent.clone());
        listener.feed(turns.last().unwrap(), |_, _| ());
    }
    let filter = exploration.robot().mapper().filter();
    Drive { map: TopologicalMap::of(filter), digest: map_digest(filter.map(), filter.darts()), turns }
}

fn recorded(turns: &[Vec<u8>]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut recorder = Recorder::new(&mut file).unwrap();
    for (bytes, turn) in turns.iter().zip(0..) {
        recorder.record(bytes, SECOND_NS + turn * SECOND_NS / 10).unwrap();
    }
    recorder.finish().unwrap();
    file
}

/// The state of a listener after each event.
fn events_of<'bytes>(pieces: impl Iterator<Item = &'bytes [u8]>) -> Vec<String> {
    let mut listener = Listener::new();
    let mut states = Vec::new();
    for piece in pieces {
        listener.feed(piece, |listener, event| states.push(format!("{event:?} {:?}", listener.replica())));
    }
    states
}

fn read(file: &[u8]) -> Vec<TimedFrame> {
    Recording::new(file).collect::<Result<_, _>>().unwrap()
}

/// The messages of a topic in the file.
fn on(file: &[u8], topic: Topic) -> Vec<Vec<u8>> {
    let messages = mcap::MessageStream::new(file).unwrap().map(Result::unwrap);
    messages.filter(|message| message.channel.topic == topic.name()).map(|message| message.data.into_owned()).collect()
}

fn encoded(messages: &[Message]) -> Vec<u8> {
    let mut encoder = Encoder::new(0);
    messages.iter().flat_map(|message| encoder.encode(message, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()).collect()
}

#[test]
fn a_recording_reproduces_the_live_state_after_each_message() {
    let drive = &DRIVE;
    let frames = read(&recorded(&drive.turns));
    let live = events_of(drive.turns.iter().map(Vec::as_slice));
    assert_eq!(events_of(frames.iter().map(|frame| &frame.bytes[..])), live);
    let mut listener = Listener::new();
    let mut digest = None;
    for frame in &frames {
        listener.feed(&frame.bytes, |_, event| {
            if let Event::Message(_, Message::Map { digest: sent, .. }) = event {
                digest = Some(*sent);
            }
        });
    }
    assert_eq!(listener.map(), drive.map);
    assert_eq!(digest, Some(drive.digest));
    assert!(drive.map.vertices.len() > 2);
}

#[test]
fn damaged_bytes_are_recorded_unchanged_with_the_end_time_of_their_frame() {
    let mut turns = DRIVE.turns.clone();
    for (turn, bytes) in turns.iter_mut().enumerate() {
        if turn % 7 == 0 && bytes.len() > 3 {
            bytes[2] ^= 0x55;
        }
        if turn % 11 == 0 {
            bytes.pop();
        }
    }
    turns.push(vec![0x55; 1000]);
    let frames = read(&recorded(&turns));
    let all: Vec<u8> = frames.iter().flat_map(|frame| frame.bytes.clone()).collect();
    assert!(all == turns.concat());
    assert_eq!(events_of(frames.iter().map(|frame| &frame.bytes[..])), events_of(std::iter::once(&all[..])));
    let mut came = turns.iter().zip(0..).flat_map(|(bytes, turn)| bytes.iter().map(move |_| turn));
    for frame in &frames {
        let turn: u64 = came.nth(frame.bytes.len() - 1).unwrap();
        assert_eq!(frame.time_ns, SECOND_NS + turn * SECOND_NS / 10);
    }
}

#[test]
fn a_truncated_file_yields_the_frames_before_the_cut() {
    let file = recorded(&DRIVE.turns[..300]);
    let whole = read(&file);
    let mut read_before = 0;
    for cut in (0..file.len()).step_by(211).chain([file.len() - 1]) {
        let mut recording = Recording::new(&file[..cut]);
        let frames: Vec<TimedFrame> = recording.by_ref().map(Result::unwrap).collect();
        assert!(recording.is_cut(), "{cut}");
        assert!(whole.starts_with(&frames), "{cut}");
        assert!(frames.len() >= read_before, "{cut}");
        read_before = frames.len();
    }
    assert_eq!(read_before, whole.len());
    let mut recording = Recording::new(&file[..]);
    recording.by_ref().for_each(drop);
    assert!(!recording.is_cut());
}

/// A file that fails after some time, as if the program had been killed.
struct Lost<'file>(&'file mut Vec<u8>);

impl std::io::Write for Lost<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_killed_recording_loses_at_most_five_seconds() {
    let turns = &DRIVE.turns[..300];
    let mut file = Vec::new();
    let mut recorder = Recorder::new(Lost(&mut file)).unwrap();
    for (bytes, turn) in turns.iter().zip(0..) {
        recorder.record(bytes, turn * SECOND_NS / 10).unwrap();
    }
    std::mem::forget(recorder);
    let mut recording = Recording::new(&file[..]);
    let frames: Vec<TimedFrame> = recording.by_ref().map(Result::unwrap).collect();
    assert!(recording.is_cut());
    assert!(frames.last().unwrap().time_ns >= 299 * SECOND_NS / 10 - 5 * SECOND_NS);
}

#[test]
fn damage_within_a_file_is_an_error_not_the_end() {
    let mut file = recorded(&DRIVE.turns[..100]);
    let frame = &read(&file)[40].bytes;
    let at = file.windows(frame.len()).position(|window| window == frame).unwrap();
    file[at] ^= 1;
    let last = Recording::new(&file[..]).last().unwrap();
    assert!(matches!(last, Err(RecordingError::Mcap(mcap::McapError::BadChunkCrc { .. }))), "{last:?}");
}

#[test]
fn a_file_of_another_format_is_refused() {
    let text = Recording::new(&b"not a recording, but a text"[..]).next().unwrap();
    assert!(matches!(text, Err(RecordingError::Mcap(mcap::McapError::BadMagic))), "{text:?}");
    let mut foreign = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut foreign).unwrap();
    writer.add_channel(0, "/elsewhere", "json", &BTreeMap::new()).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let mut recording = Recording::new(&foreign.get_ref()[..]);
    assert!(matches!(recording.next(), Some(Err(RecordingError::NoFrames))));
    assert!(recording.next().is_none());
}

#[test]
fn viewer_topics_get_ring_frames_new_faults_and_map_changes() {
    let echoes = Echoes::new(&[Echo::Range { range_mm: 1500 }, Echo::Silence, Echo::Dead]);
    let fault = |count| Message::Fault { kind: 0, count };
    let messages = [
        fault(1),
        fault(1),
        Message::Ring { frame_index: 7, echoes },
        Message::Edge { a: 0, b: 1, present: true },
        fault(2),
    ];
    let mut file = Vec::new();
    let mut recorder = Recorder::new(&mut file).unwrap();
    let mut bytes = encoded(&messages);
    bytes[2] ^= 2;
    recorder.record(&bytes, 3 * SECOND_NS).unwrap();
    recorder.record(&[], 4 * SECOND_NS).unwrap();
    assert_eq!(recorder.finish().unwrap().frames, 5);

    let logs: Vec<String> = on(&file, Topic::Log).iter().map(|data| Log::decode(&data[..]).unwrap().message).collect();
    assert_eq!(logs, ["SonarSilent: 1 so far", "SonarSilent: 2 so far"]);
    let rings = on(&file, Topic::Ring);
    let scan = LaserScan::decode(&rings[0][..]).unwrap();
    assert_eq!((rings.len(), scan.ranges[0], scan.ranges[1]), (1, 1.5, f64::INFINITY));
    let maps = on(&file, Topic::Map);
    assert_eq!((maps.len(), on(&file, Topic::Vertices).len(), on(&file, Topic::Transform).len()), (1, 1, 1));
    assert_eq!(SceneUpdate::decode(&maps[0][..]).unwrap().entities[0].cylinders.len(), 2);
    let events: Vec<serde_json::Value> =
        on(&file, Topic::Events).iter().map(|data| serde_json::from_slice(data).unwrap()).collect();
    let names: Vec<&str> = events.iter().map(|event| event["event"].as_str().unwrap()).collect();
    assert_eq!(names, ["Damaged", "Fault", "Edge", "Fault"]);
}
