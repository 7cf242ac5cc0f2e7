//! The golden file for other decoders, `host-tests/golden/stream.jsonl`: every kind of message and request, and damaged
//! streams, each with the result of this library. `docs/stream.md` describes its lines.
//!
//! `WRITE_GOLDEN=1 cargo test -p toposlam-host-tests --test wire golden` writes it; without the variable the test
//! compares it.

use std::path::Path;

use serde_json::{Value, json};
use toposlam::FaultKind;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::wire::{DecoderCounters, Echoes, Encoder, MapReplica, Message, Request, crc32};
use toposlam_link::json;
use toposlam_link::listener::{Event, Listener};
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

use super::samples::{extreme_requests, extremes, largest, largest_requests, requests, typical};
use super::streams::{
    Draw, damage, every_damage, foreign_payloads, impossible_ways, long_lists, lossy, named, renamed, restarted,
    restarted_unheard, two_robots, version_5, wrapping,
};
use super::{decode, frame};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/stream.jsonl");
const EXPLORATION: &str = "an exploration";

#[test]
fn the_golden_file_matches_the_library() {
    let stored = std::fs::read_to_string(FILE).unwrap_or_default();
    let write = std::env::var_os("WRITE_GOLDEN").is_some();
    // The exploration itself is not compared: it depends on the drive and the filter, not on the protocol.
    let exploration = if write { explore() } else { stored_exploration(&stored) };
    let records = records(&exploration);
    let text: String = records.iter().map(|record| format!("{record}\n")).collect();
    assert_streams_cover_everything(&records);
    if write {
        std::fs::create_dir_all(Path::new(FILE).parent().unwrap()).unwrap();
        std::fs::write(FILE, text).unwrap();
        return;
    }
    for (number, (wanted, found)) in text.lines().zip(stored.lines()).enumerate() {
        assert_eq!(wanted, found, "line {} of {FILE} differs; WRITE_GOLDEN=1 updates it", number + 1);
    }
    assert_eq!(text.lines().count(), stored.lines().count(), "{FILE} has another length; WRITE_GOLDEN=1 updates it");
}

/// The lines of the file.
fn records(exploration: &[Vec<u8>]) -> Vec<Value> {
    let mut records: Vec<Value> = typical()
        .into_iter()
        .chain(largest())
        .chain(extremes())
        .zip(0..)
        .map(|(message, number)| sent(&message, number))
        .collect();
    records.extend(requests().into_iter().chain(largest_requests()).chain(extreme_requests()).zip(0..).map(asked));
    records.push(stream(EXPLORATION, &exploration.concat()));
    records.push(stream("an exploration of which frames are lost, repeated and overtaken", &lossy(exploration)));
    records.push(stream("a robot that restarts", &restarted(exploration)));
    records.push(stream(
        "a robot that restarts without a word",
        &exploration[..40].iter().chain(&exploration[..9]).flatten().copied().collect::<Vec<u8>>(),
    ));
    records.push(stream("a robot that restarts unheard, with a higher number", &restarted_unheard(exploration)));
    records.push(stream("two robots on one line", &two_robots(exploration)));
    records.push(stream("a Hello of version 5, and one of a later version", &version_5()));
    records.push(stream("one of every kind of damage", &every_damage()));
    records.push(stream("numbers that wrap", &wrapping()));
    records.push(stream("lists that are too long", &long_lists()));
    records.push(stream("ways that no map has", &impossible_ways().concat()));
    let renamed = renamed();
    records.push(stream("a map that shrinks and is renamed", &renamed.concat()));
    let named = named();
    records.push(stream("vertices with names", &named.concat()));
    records.push(stream("two vertices with names become one", &named[..7].concat()));
    records.push(stream("two vertices become one", &renamed[..15].concat()));
    for seed in 0..24 {
        let mut draw = Draw(seed);
        let from = draw.below(exploration.len() - 24);
        records.push(stream(&format!("damage {seed}"), &damage(exploration[from..from + 24].concat(), &mut draw)));
    }
    for seed in 0..24 {
        records.push(stream(&format!("foreign payloads {seed}"), &foreign_payloads(&mut Draw(1000 + seed))));
    }
    for (values, seed) in [4, 16, 64, 256].into_iter().zip(2000..) {
        let mut draw = Draw(seed);
        let noise: Vec<u8> = (0..600).map(|_| draw.below(values) as u8).collect();
        records.push(stream(&format!("noise of {values} values"), &noise));
    }
    records
}

/// Asserts that the streams cover every counter and a converged replica.
fn assert_streams_cover_everything(records: &[Value]) {
    let streams: Vec<&Value> = records.iter().filter(|record| record["kind"] == "stream").collect();
    for counter in ["lost", "corrupt", "cut", "too_long", "unknown_version", "unknown_message", "restarts"] {
        assert!(streams.iter().filter(|stream| stream["counters"][counter] != 0).count() > 1, "no {counter}");
    }
    assert_eq!(streams[0]["replica"]["is_converged"], true, "{}", streams[0]["replica"]);
    assert_eq!(streams[0]["replica"]["is_complete"], true);
    assert!(streams[0]["replica"]["edges"].as_array().unwrap().len() > 4, "{}", streams[0]["replica"]);
}

/// A message and its frame.
fn sent(message: &Message, sequence: u16) -> Value {
    let bytes = frame(&mut Encoder::new(sequence), message);
    let decoded = decode(&bytes);
    let [(header, decoded)] = decoded.messages[..] else { panic!("{message:?} is decoded as {decoded:?}") };
    json!({"kind": "message", "frame": hex(&bytes), "event": json::event(Event::Message(header, &decoded))})
}

/// A request and its frame.
fn asked((request, sequence): (Request, u16)) -> Value {
    let bytes = frame(&mut Encoder::new(sequence), &request);
    json!({"kind": "request", "frame": hex(&bytes), "sequence": sequence, "request": serde_json::to_value(request).unwrap()})
}

/// A stream, and the listener's events, counters and replica.
fn stream(name: &str, bytes: &[u8]) -> Value {
    let mut listener = Listener::new();
    let (mut events, mut converged, mut lines) = (0, 0, String::new());
    listener.feed(bytes, |listener, event| {
        events += 1;
        converged += u32::from(listener.replica().is_converged());
        lines += &format!("{}\n", json::event(event));
    });
    let DecoderCounters { messages, lost, corrupt, cut, too_long, unknown_version, unknown_message, restarts } =
        listener.counters();
    json!({
        "kind": "stream",
        "name": name,
        "bytes": hex(bytes),
        "events": events,
        "events_crc32": crc32(lines.as_bytes()),
        "converged": converged,
        "counters": {
            "messages": messages, "lost": lost, "corrupt": corrupt, "cut": cut, "too_long": too_long,
            "unknown_version": unknown_version, "unknown_message": unknown_message, "restarts": restarts,
        },
        "replica": replica_json(listener.replica()),
    })
}

fn replica_json(replica: &MapReplica<64>) -> Value {
    json!({
        "vertices": replica.vertices(),
        "rows": (0..replica.vertices()).map(|vertex| replica.row(vertex)).collect::<Vec<_>>(),
        "edges": replica.edges().collect::<Vec<_>>(),
        "ways": (0..replica.vertices()).map(|vertex| replica.ways(vertex)).collect::<Vec<_>>(),
        "frontiers": replica.frontiers().collect::<Vec<_>>(),
        "is_converged": replica.is_converged(),
        "is_complete": replica.is_complete(),
        "hello": replica.hello(),
        "location": replica.location(),
        "evidence": replica.evidence(),
        "health": replica.health(),
        "belief": replica.belief(),
        "worst": replica.worst(),
        "goal_status": replica.goal_status(),
        "exploration": replica.exploration(),
        "names": replica.names().iter().map(|(vertex, name)| json!([vertex, name])).collect::<Vec<_>>(),
        "faults": FaultKind::ALL.map(|kind| replica.fault(kind)),
    })
}

/// The frames of a simulated robot's first places, without most messages between them, numbered without gaps.
fn explore() -> Vec<Vec<u8>> {
    let mut buffer = [0; SNAPSHOT_BYTES];
    let plan = Plan::built_in("office").unwrap();
    let mut exploration = Exploration::start(&plan, RobotModel::default().with_noise(2.0), 3, &mut buffer).unwrap();
    let (mut encoder, mut frames) = (Encoder::new(0), Vec::new());
    let mut listener = Listener::new();
    while exploration.places() < 24 || !listener.replica().is_converged() || !listener.replica().is_complete() {
        exploration.board().sent.clear();
        let ring = exploration.frame();
        let is_place = exploration.map(&ring).is_some();
        let velocity = exploration.board().velocity;
        exploration.drive(velocity);
        let turn = exploration.frames();
        let mut messages: Vec<Message> =
            decode(&exploration.board().sent).messages.into_iter().map(|(_, message)| message).collect();
        if turn % 400 == 0 {
            // Boards may send ring frames; the simulated robot does not.
            messages.push(Message::Ring { frame_index: turn as u32, echoes: Echoes::new(&ring.echoes) });
        }
        for message in messages {
            let is_shown = match message {
                Message::Velocity(_) => turn % 400 == 0,
                _ => is_place || turn % 32 < 2,
            };
            if is_shown || frames.is_empty() {
                frames.push(frame(&mut encoder, &message));
                listener.feed(&frames[frames.len() - 1], |_, _| ());
            }
        }
    }
    frames
}

/// The frames of the exploration in the golden file.
fn stored_exploration(stored: &str) -> Vec<Vec<u8>> {
    let records = stored.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let bytes = records
        .filter(|record| record["name"] == EXPLORATION)
        .find_map(|record| Some(bytes(record["bytes"].as_str()?)))
        .unwrap_or_else(|| panic!("{FILE} has no exploration; WRITE_GOLDEN=1 writes it"));
    bytes.split_inclusive(|&byte| byte == 0).map(<[u8]>::to_vec).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes(hex: &str) -> Vec<u8> {
    hex.as_bytes().chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}
