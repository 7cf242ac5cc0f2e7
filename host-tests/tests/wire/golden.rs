//! One file of examples for whoever writes another decoder, `host-tests/golden/stream.jsonl`: every kind of message and request, and
//! damaged streams, each with what this library makes of it. `docs/stream.md` says what its lines hold.
//!
//! `WRITE_GOLDEN=1 cargo test -p toposlam-host-tests --test wire golden` writes it, without that it is compared.

use std::path::Path;

use serde_json::{Value, json};
use toposlam::FaultKind;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::ring::Echo;
use toposlam::wire::{
    Belief, Chunk, Command, DecoderCounters, Drive, Echoes, Encoder, Evidence, Hello, Info, Journey, JourneyState,
    List, Location, Message, Outcome, Picture, PlaceProbability, Refusal, Renamed, Reply, Request, ResetCause, Version,
    Worst, crc32,
};
use toposlam_host::exploration::Exploration;
use toposlam_host::json;
use toposlam_host::listener::{Event, Listener};
use toposlam_host::world::{Plan, RobotModel};

use super::damage::with_crc;
use super::samples::{largest, largest_requests, requests, typical};
use super::{frame, hear};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/stream.jsonl");
const EXPLORATION: &str = "an exploration";

#[test]
fn the_golden_file_says_what_this_library_makes_of_every_frame_and_stream() {
    let stored = std::fs::read_to_string(FILE).unwrap_or_default();
    let write = std::env::var_os("WRITE_GOLDEN").is_some();
    // The exploration itself is not compared: it changes with the drive and the filter, and the protocol does not.
    let exploration = if write { explore() } else { stored_exploration(&stored) };
    let records = records(&exploration);
    let text: String = records.iter().map(|record| format!("{record}\n")).collect();
    assert_the_streams_show_everything(&records);
    if write {
        std::fs::create_dir_all(Path::new(FILE).parent().unwrap()).unwrap();
        std::fs::write(FILE, text).unwrap();
        return;
    }
    for (number, (wanted, found)) in text.lines().zip(stored.lines()).enumerate() {
        assert_eq!(wanted, found, "line {} of {FILE}; WRITE_GOLDEN=1 writes it anew", number + 1);
    }
    assert_eq!(text.lines().count(), stored.lines().count(), "{FILE}; WRITE_GOLDEN=1 writes it anew");
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
    records.push(stream("one of every kind of damage", &every_damage()));
    records.push(stream("numbers that wrap", &wrapping()));
    records.push(stream("lists that are too long", &long_lists()));
    let renamed = renamed();
    records.push(stream("a map that shrinks and is renamed", &renamed.concat()));
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

/// A file in which something never happens would test nothing of it.
fn assert_the_streams_show_everything(records: &[Value]) {
    let streams: Vec<&Value> = records.iter().filter(|record| record["kind"] == "stream").collect();
    for counter in ["lost", "corrupt", "cut", "too_long", "unknown_version", "unknown_message"] {
        assert!(streams.iter().filter(|stream| stream["counters"][counter] != 0).count() > 1, "no {counter}");
    }
    assert_eq!(streams[0]["picture"]["is_converged"], true, "{}", streams[0]["picture"]);
    assert_eq!(streams[0]["picture"]["is_complete"], true);
    assert!(streams[0]["picture"]["edges"].as_array().unwrap().len() > 4, "{}", streams[0]["picture"]);
}

/// A message and its frame.
fn sent(message: &Message, sequence: u16) -> Value {
    let bytes = frame(&mut Encoder::new(sequence), message);
    let heard = hear(&bytes);
    let [(header, heard)] = heard.messages[..] else { panic!("{message:?} is heard as {heard:?}") };
    json!({"kind": "message", "frame": hex(&bytes), "event": json::event(Event::Message(header, &heard))})
}

/// A request and its frame.
fn asked((request, sequence): (Request, u16)) -> Value {
    let bytes = frame(&mut Encoder::new(sequence), &request);
    json!({"kind": "request", "frame": hex(&bytes), "sequence": sequence, "request": serde_json::to_value(request).unwrap()})
}

/// A stream, and all that a listener makes of it.
fn stream(name: &str, bytes: &[u8]) -> Value {
    let mut listener = Listener::new();
    let (mut events, mut converged, mut lines) = (0, 0, String::new());
    listener.feed(bytes, |listener, event| {
        events += 1;
        converged += u32::from(listener.picture().is_converged());
        lines += &format!("{}\n", json::event(event));
    });
    let DecoderCounters { messages, lost, corrupt, cut, too_long, unknown_version, unknown_message } =
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
            "unknown_version": unknown_version, "unknown_message": unknown_message,
        },
        "picture": picture_json(listener.picture()),
    })
}

fn picture_json(picture: &Picture<64>) -> Value {
    json!({
        "vertices": picture.vertices(),
        "rows": (0..picture.vertices()).map(|vertex| picture.row(vertex)).collect::<Vec<_>>(),
        "edges": picture.edges().collect::<Vec<_>>(),
        "is_converged": picture.is_converged(),
        "is_complete": picture.is_complete(),
        "hello": picture.hello(),
        "location": picture.location(),
        "evidence": picture.evidence(),
        "health": picture.health(),
        "belief": picture.belief(),
        "worst": picture.worst(),
        "journey": picture.journey(),
        "faults": FaultKind::ALL.map(|kind| picture.fault(kind)),
    })
}

/// The least of every number, no element of any list, the other end of what is signed, and every kind that is one byte.
fn extremes() -> Vec<Message> {
    let reply = |outcome| Message::Reply(Reply { request: 0, outcome });
    let evidence = |place_index, logarithm| {
        Message::Evidence(Evidence {
            place_index,
            consistency_mm: 0,
            ln_label_q16: logarithm,
            ln_consistency_q16: logarithm,
            ln_size_q16: logarithm,
            lead_q16: logarithm,
            distinct_hypotheses: 0,
        })
    };
    let drive =
        |state, value| Message::Drive(Drive { frame_index: 0x80, heading_mrad: value, speed_permille: value, state });
    let info = Info {
        version: Version { major: 0, minor: 0, patch: 0 },
        boot: 0,
        reset_cause: ResetCause::Unknown,
        uptime_ms: 0,
        paused: false,
        localise_only: false,
        going_to: None,
        stored_bytes: 0,
        stored_places_ago: 0,
    };
    let Message::Hello(hello) = typical()[0] else { panic!("the first sample is a Hello") };
    let ring = [Echo::Dead, Echo::Silence, Echo::Range { range_mm: 0 }, Echo::Range { range_mm: 0x7E }];
    let mut extremes = vec![
        Message::Place { place_index: 0, frame_index: 0, radius_mm: 0, degree: None },
        Message::Place { place_index: 0x7F, frame_index: 0x80, radius_mm: 0x3FFF, degree: Some(0) },
        Message::Map { vertices: 0, edges: 0, digest: 0 },
        Message::Edge { a: 0, b: 0, present: false },
        evidence(0, 0),
        evidence(0x1F_FFFF, i32::MAX),
        evidence(0x0FFF_FFFF, -1),
        Message::Health(Default::default()),
        Message::Ring { frame_index: 0, echoes: Echoes::EMPTY },
        Message::Ring { frame_index: 0, echoes: Echoes::new(&ring) },
        Message::Renamed(Renamed { place_index: 0, names: List::new([]) }),
        Message::Worst(Worst { place_index: 0, distance_mm: 0, newest_age: 0, vertices: List::new([]) }),
        reply(Outcome::Info(info)),
        reply(Outcome::Snapshot { total: 0, offset: 0, bytes: Chunk::new([]) }),
        drive(0, 0),
        drive(1, -1),
        drive(2, 1),
        drive(3, i16::MAX),
    ];
    extremes.extend(ResetCause::ALL.iter().map(|&reset_cause| Message::Hello(Hello { reset_cause, ..hello })));
    extremes.extend(Refusal::ALL.iter().map(|&refusal| reply(Outcome::Refused(refusal))));
    extremes.extend(JourneyState::ALL.iter().map(|&state| Message::Journey(Journey { vertex: 0, state })));
    extremes
}

fn extreme_requests() -> Vec<Request> {
    let commands = [
        Command::GetSnapshot { offset: 0 },
        Command::RestoreChunk { offset: 0, bytes: Chunk::new([]) },
        Command::LocaliseOnly { on: false },
        Command::GoTo { vertex: 0 },
        Command::Pause { on: false },
    ];
    commands.map(|command| Request { id: 0, command }).to_vec()
}

/// The frames of a simulated robot's first places, without most of what it says between them, numbered without gaps.
fn explore() -> Vec<Vec<u8>> {
    let mut buffer = [0; SNAPSHOT_BYTES];
    let plan = Plan::built_in("office").unwrap();
    let mut exploration = Exploration::start(&plan, RobotModel::default().with_noise(2.0), 3, &mut buffer).unwrap();
    let (mut encoder, mut frames) = (Encoder::new(0), Vec::new());
    let mut listener = Listener::new();
    while exploration.places() < 12 || !listener.picture().is_converged() || !listener.picture().is_complete() {
        exploration.board().sent.clear();
        let ring = exploration.frame();
        let is_place = exploration.map(&ring).is_some();
        let suggestion = exploration.board().suggestion;
        exploration.drive(suggestion);
        let turn = exploration.frames();
        let mut messages: Vec<Message> =
            hear(&exploration.board().sent).messages.into_iter().map(|(_, message)| message).collect();
        if turn % 400 == 0 {
            // No board sends them; some may.
            messages.push(Message::Ring { frame_index: turn as u32, echoes: Echoes::new(&ring.echoes) });
        }
        for message in messages {
            let is_shown = match message {
                Message::Drive(_) => turn % 400 == 0,
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

/// The frames of the exploration that the file holds.
fn stored_exploration(stored: &str) -> Vec<Vec<u8>> {
    let records = stored.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let bytes = records
        .filter(|record| record["name"] == EXPLORATION)
        .find_map(|record| Some(bytes(record["bytes"].as_str()?)))
        .unwrap_or_else(|| panic!("{FILE} holds no exploration; WRITE_GOLDEN=1 writes it"));
    bytes.split_inclusive(|&byte| byte == 0).map(<[u8]>::to_vec).collect()
}

fn lossy(frames: &[Vec<u8>]) -> Vec<u8> {
    let mut draw = Draw(7);
    let mut bytes = vec![0];
    let mut overtaken: &[u8] = &[];
    for (number, frame) in frames.iter().enumerate() {
        // The last round comes whole.
        match if number + 40 > frames.len() { 9 } else { draw.below(20) } {
            0 => {}
            1 => bytes.extend([&frame[..], frame].concat()),
            2 => overtaken = frame,
            _ => bytes.extend([&frame[..], std::mem::take(&mut overtaken)].concat()),
        }
    }
    bytes
}

/// The same robot twice, the second time as its next start and not from its first frame.
fn restarted(frames: &[Vec<u8>]) -> Vec<u8> {
    let Message::Hello(hello) = hear(&frames[0]).messages[0].1 else { panic!("a robot introduces itself first") };
    let again = Message::Hello(Hello { boot: hello.boot.wrapping_add(1), reset_cause: ResetCause::Watchdog, ..hello });
    [&frames[..60].concat()[..], &[0], &frame(&mut Encoder::new(0), &again), &frames[1..30].concat()].concat()
}

fn every_damage() -> Vec<u8> {
    let edge = |sequence, b| frame(&mut Encoder::new(sequence), &Message::Edge { a: 1, b, present: true });
    let request = frame(&mut Encoder::new(3), &requests()[0]);
    let mut corrupt = edge(1, 3);
    corrupt[3] ^= 0x40;
    [
        &edge(0, 2)[..],
        &corrupt,
        &edge(2, 4)[..6],
        &[0, 0, 0],
        &[1; 2],
        &[0],
        &[0xFF; 120],
        &[0],
        &with_crc(&[2, 3, 0, 4, 1, 2, 1]),
        &request,
        // After a gap a message that is not known here is not taken for received, in order it is.
        &with_crc(&[1, 9, 0, 0x7F]),
        &edge(4, 5),
        &with_crc(&[1, 5, 0, 4, 1, 2, 1, 9]),
        &with_crc(&[1, 6, 0, 4, 1, 2]),
        &with_crc(&[1, 7, 0, 4, 1, 2, 2]),
        &with_crc(&[1]),
        &edge(8, 6),
        &edge(8, 7),
        &edge(9, 63),
        &edge(10, 64),
    ]
    .concat()
}

fn wrapping() -> Vec<u8> {
    let edge = Message::Edge { a: 0, b: 1, present: true };
    let numbers = [65500, 65535, 0, 65535, 40, 65535, 32_807, 32_806, 32_743, 32_744, 65511, 65510, 32_742, 65510];
    numbers.iter().flat_map(|&number| frame(&mut Encoder::new(number), &edge)).collect()
}

/// Each list with one element more than it can have, and a number of elements beyond all bounds.
fn long_lists() -> Vec<u8> {
    let list = |head: &[u8], count: u8, element: &[u8]| {
        let body = [&[1, 0, 0], head, &[count], &element.repeat(count.into())].concat();
        with_crc(&body)
    };
    [
        list(&[10, 0], 33, &[5]),
        list(&[11, 0, 0], 9, &[1, 1]),
        list(&[12, 0], 65, &[1]),
        list(&[13, 0, 0, 0], 8, &[1]),
        list(&[14, 0, 2, 0, 0], 65, &[1]),
        with_crc(&[1, 0, 0, 12, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 1]),
        with_crc(&[1, 0, 0, 12, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 3]),
        // A varint may be longer than it has to be, and names no value beyond its type.
        with_crc(&[1, 0, 0, 12, 0x80, 0x80, 0, 0x81, 0, 7]),
        with_crc(&[1, 1, 0, 12, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0]),
        with_crc(&[1, 2, 0, 12, 0xFF, 0xFF, 0xFF, 0xFF, 0x1F, 0]),
        with_crc(&[1, 2, 0, 12, 0x80, 0x80, 0x80, 0x80, 0x80, 0, 0]),
    ]
    .concat()
}

/// The frames of a small map, whose vertices get new numbers again and again.
fn renamed() -> Vec<Vec<u8>> {
    let canonical: [&[u8]; 3] =
        [&[2], &[232, 3, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0], &[232, 3, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]];
    let map = Message::Map { vertices: 2, edges: 1, digest: crc32(&canonical.concat()) };
    let vertex = |vertex| Message::Vertex { vertex, radius_mm: 1000, visits: 1 };
    let names = |names: &[u8]| Message::Renamed(Renamed { place_index: 2, names: List::new(names.iter().copied()) });
    let place = |(vertex, permille)| PlaceProbability { vertex, permille };
    let messages = [
        vertex(0),
        vertex(1),
        Message::Edge { a: 0, b: 1, present: true },
        Message::Edge { a: 1, b: 5, present: true },
        vertex(5),
        map,
        // What is gone does not come back with its number.
        vertex(5),
        map,
        names(&[0, 1]),
        map,
        Message::Belief(Belief {
            place_index: 2,
            map_permille: 500,
            places: List::new([(1, 600), (0, 300), (2, 70)].map(place)),
        }),
        Message::Location(Location { place_index: 2, vertex: 1 }),
        Message::Journey(Journey { vertex: 0, state: JourneyState::Underway }),
        Message::Worst(Worst { place_index: 2, distance_mm: 9, newest_age: 1, vertices: List::new([0, 1, 0]) }),
        names(&[2, 2, 0]),
        names(&[0, 1, 255, 4]),
        names(&[]),
        Message::Edge { a: 0, b: 3, present: true },
        Message::Edge { a: 3, b: 3, present: true },
        names(&[64, 1, 2, 63]),
        names(&[200]),
    ];
    let mut encoder = Encoder::new(0);
    messages.iter().map(|message| frame(&mut encoder, message)).collect()
}

/// Some bytes changed, left out, doubled or put in.
fn damage(mut bytes: Vec<u8>, draw: &mut Draw) -> Vec<u8> {
    for _ in 0..5 {
        let place = draw.below(bytes.len());
        let byte = draw.byte();
        match draw.below(6) {
            0 => bytes[place] ^= byte | 1,
            1 => bytes[place] = 0,
            2 => drop(bytes.remove(place)),
            3 => bytes.insert(place, byte),
            4 => {
                let end = (place + draw.below(60)).min(bytes.len());
                drop(bytes.drain(place..end));
            }
            _ => {
                let end = (place + draw.below(140)).min(bytes.len());
                let again = bytes[place..end].to_vec();
                bytes.splice(place..place, again);
            }
        }
    }
    bytes
}

/// Intact frames that are near to those of messages.
fn foreign_payloads(draw: &mut Draw) -> Vec<u8> {
    let messages: Vec<Message> = typical().into_iter().chain(largest()).chain(extremes()).collect();
    let mut bytes = Vec::new();
    for sequence in 0..20u16 {
        let message = messages[draw.below(messages.len())];
        let mut body = unpacked(&frame(&mut Encoder::new(sequence), &message));
        for _ in 0..draw.below(4) {
            // Rarely in the header.
            let place = if draw.below(12) == 0 { draw.below(3) } else { 3 + draw.below(body.len() - 3) };
            let byte = draw.byte();
            match draw.below(5) {
                0 => body[place] = byte,
                1 => body[place] ^= 0x80,
                2 => body[place] = [0, 1, 2, 0x7F, 0x80, 0xFF][draw.below(6)],
                3 if body.len() > 4 => drop(body.remove(place)),
                _ => body.insert(place, byte),
            }
        }
        bytes.extend(with_crc(&body));
    }
    bytes
}

/// Header and payload of a frame.
fn unpacked(frame: &[u8]) -> Vec<u8> {
    let (mut raw, mut code) = (frame[..frame.len() - 1].to_vec(), 0);
    while let Some(slot) = raw.get_mut(code) {
        code += usize::from(std::mem::take(slot));
    }
    raw[1..raw.len() - 4].to_vec()
}

/// Numbers at random that are the same everywhere: SplitMix64.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    fn byte(&mut self) -> u8 {
        self.next() as u8
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn bytes(hex: &str) -> Vec<u8> {
    hex.as_bytes().chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}
