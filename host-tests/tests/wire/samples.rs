//! A typical, a largest and an extreme message and request of every kind.

use toposlam::Fingerprint;
use toposlam::ring::Echo;
use toposlam::wire::{
    Belief, CHUNK_BYTES, Capacities, Chunk, Command, Echoes, Evidence, Exploration, Factors, GoalState, GoalStatus,
    Health, Hello, Info, List, Location, Message, Name, Outcome, Refusal, Remapped, Reply, Request, ResetCause, Row,
    SETTINGS_MAX, Setting, Velocity, Version, VertexProbability, VertexWays, Way, WayId, Worst,
};

/// A plausible message of every kind, in the order of their numbers; a reply of every kind.
pub(crate) fn typical() -> Vec<Message> {
    let capacities = Capacities {
        vertices: 16,
        hypotheses: 10,
        history: 400,
        ngram_length: 5,
        fingerprint_step_mm: Fingerprint::STEP_MM as u8,
        sonars: 16,
    };
    let mut ring = [Echo::Range { range_mm: 1480 }; 16];
    ring[3] = Echo::Silence;
    ring[7] = Echo::Dead;
    vec![
        Message::Hello(Hello { session: 0x5E55_1017, ..Hello::new(17, ResetCause::BrownOut, 1, capacities) }),
        Message::Place { place_index: 42, frame_index: 5310, radius_mm: 1172, degree: Some(3) },
        Message::Map { vertices: 11, edges: 13, digest: 0x8C3A_51F0 },
        Message::Vertex { vertex: 3, radius_mm: 1172, visits: 12 },
        Message::Edge { a: 3, b: 7, present: true },
        Message::Location(Location { place_index: 42, vertex: 3 }),
        evidence(Factors::Robust { ln_labels_q16: -13_107, ln_moves_q16: -42_000, ln_size_q16: -829_000 }),
        evidence(Factors::Paper { ln_label_q16: -13_107, ln_consistency_q16: -42_000, ln_size_q16: -829_000 }),
        evidence(Factors::Ordered { ln_labels_q16: -13_107, ln_moves_q16: -829_000 }),
        Message::Row(Row { vertex: 3, radius_mm: 1172, visits: 12, neighbours: 0b1010_0010 }),
        Message::Fault { kind: 2, count: 5 },
        Message::Health(Health {
            uptime_ms: 345_000,
            loop_count: 5310,
            stack_high_water_bytes: 3000,
            worst_turn_us: 9_800,
        }),
        Message::Ring { frame_index: 5310, echoes: Echoes::new(&ring) },
        Message::Belief(Belief {
            place_index: 42,
            map_permille: 815,
            vertices: List::new([(3, 962), (5, 31)].map(|(vertex, permille)| VertexProbability { vertex, permille })),
        }),
        Message::Remapped(Remapped { place_index: 42, vertices: List::new([0, 1, 255, 2, 3, 1]) }),
        Message::Worst(Worst {
            place_index: 42,
            distance_mm: 84,
            newest_age: 17,
            vertices: List::new([3, 7, 4, 7, 3]),
        }),
        reply(Outcome::Done),
        reply(Outcome::Info(Info {
            version: Version { major: 0, minor: 1, patch: 0 },
            boot: 17,
            reset_cause: ResetCause::BrownOut,
            uptime_ms: 345_000,
            paused: false,
            localise_only: true,
            goal: Some(3),
            stored_bytes: 2048,
            stored_places_ago: 7,
        })),
        reply(Outcome::Snapshot { total: 2048, offset: 64, bytes: Chunk::new(0..8) }),
        reply(Outcome::Refused(Refusal::UnknownVertex)),
        reply(Outcome::Settings {
            settings: List::new([Setting::NoiseMm(60), Setting::LeaveMm(300), Setting::SpeedPermille(1000)]),
        }),
        Message::Velocity(Velocity { frame_index: 5310, heading_mrad: -250, speed_permille: 700, state: 2 }),
        Message::GoalStatus(GoalStatus { vertex: 3, state: GoalState::Active }),
        Message::Ways(VertexWays {
            vertex: 3,
            ways: List::new([
                edge(80, (7, 2), Some(54)),
                edge(1650, (3, 2), None),
                edge(3220, (3, 1), None),
                frontier(4790),
            ]),
        }),
        Message::Exploration(Exploration { frontiers: 5, complete: false }),
        Message::Name { vertex: 3, name: name("kitchen") },
        Message::Named { vertices: 0b1010_0010 },
    ]
}

fn name(text: &str) -> Name {
    Name::new(text).expect("a valid name")
}

fn frontier(bearing_mrad: u16) -> Way {
    Way { bearing_mrad, leads_to: None, travel_frames: None }
}

fn edge(bearing_mrad: u16, (vertex, way): (u8, u8), travel_frames: Option<u16>) -> Way {
    Way { bearing_mrad, leads_to: Some(WayId { vertex, way }), travel_frames }
}

fn evidence(factors: Factors) -> Message {
    Message::Evidence(Evidence {
        place_index: 42,
        consistency_mm: 84,
        factors,
        lead_q16: 30_500,
        distinct_hypotheses: 6,
    })
}

fn reply(outcome: Outcome) -> Message {
    Message::Reply(Reply { request: 300, outcome })
}

/// A plausible request of every kind, in the order of their numbers; each setting in turn.
pub(crate) fn requests() -> Vec<Request> {
    let commands = [
        Command::Info,
        Command::GetMap,
        Command::GetSnapshot { offset: 64 },
        Command::RestoreBegin { length: 2048, crc: 0x8C3A_51F0 },
        Command::RestoreChunk { offset: 64, bytes: Chunk::new(0..8) },
        Command::RestoreCommit,
        Command::Reset,
    ];
    let settings = [
        Setting::NoiseMm(40),
        Setting::Hypotheses(8),
        Setting::Moves(2),
        Setting::WrongTurnPermille(20),
        Setting::WrongDegreePermille(100),
        Setting::EquidistanceMm(150),
        Setting::LeaveMm(300),
        Setting::SpeedPermille(700),
        Setting::SnapshotEveryPlaces(10),
    ];
    let later = [
        Command::LocaliseOnly { on: true },
        Command::GoTo { vertex: 3 },
        Command::Explore,
        Command::Pause { on: true },
        Command::GetSettings,
        Command::Name { vertex: 3, name: name("kitchen") },
    ];
    let commands = commands.into_iter().chain(settings.map(Command::SetConfig)).chain(later);
    (300..).zip(commands).map(|(id, command)| Request { id, command }).collect()
}

/// Every kind of request with the values that take the most bytes.
pub(crate) fn largest_requests() -> Vec<Request> {
    let widen = |command| match command {
        Command::GetSnapshot { .. } => Command::GetSnapshot { offset: u16::MAX },
        Command::RestoreBegin { .. } => Command::RestoreBegin { length: u16::MAX, crc: u32::MAX },
        Command::RestoreChunk { .. } => {
            Command::RestoreChunk { offset: u16::MAX, bytes: Chunk::new([u8::MAX; CHUNK_BYTES]) }
        }
        Command::SetConfig(setting) => Command::SetConfig(match setting {
            Setting::NoiseMm(_) => Setting::NoiseMm(u16::MAX),
            Setting::Hypotheses(_) => Setting::Hypotheses(u16::MAX),
            Setting::Moves(_) => Setting::Moves(u16::MAX),
            Setting::WrongTurnPermille(_) => Setting::WrongTurnPermille(u16::MAX),
            Setting::WrongDegreePermille(_) => Setting::WrongDegreePermille(u16::MAX),
            Setting::EquidistanceMm(_) => Setting::EquidistanceMm(u16::MAX),
            Setting::LeaveMm(_) => Setting::LeaveMm(u16::MAX),
            Setting::SpeedPermille(_) => Setting::SpeedPermille(u16::MAX),
            Setting::SnapshotEveryPlaces(_) => Setting::SnapshotEveryPlaces(u16::MAX),
            other => other,
        }),
        Command::GoTo { .. } => Command::GoTo { vertex: u8::MAX },
        Command::Name { .. } => Command::Name { vertex: u8::MAX, name: name("sixteen bytes ok") },
        other => other,
    };
    requests().into_iter().map(|Request { command, .. }| Request { id: u16::MAX, command: widen(command) }).collect()
}

/// Every kind with the values that take the most bytes.
pub(crate) fn largest() -> Vec<Message> {
    const BYTE: u8 = u8::MAX;
    const SHORT: u16 = u16::MAX;
    const WORD: u32 = u32::MAX;
    let capacities = Capacities {
        vertices: BYTE,
        hypotheses: SHORT,
        history: SHORT,
        ngram_length: BYTE,
        fingerprint_step_mm: BYTE,
        sonars: BYTE,
    };
    vec![
        Message::Hello(Hello {
            protocol_version: SHORT,
            schema_hash: !0,
            boot: WORD,
            reset_cause: ResetCause::LowPower,
            seed: !0,
            capacities,
            session: WORD,
        }),
        Message::Place { place_index: WORD, frame_index: WORD, radius_mm: SHORT, degree: Some(BYTE) },
        Message::Map { vertices: BYTE, edges: SHORT, digest: WORD },
        Message::Vertex { vertex: BYTE, radius_mm: SHORT, visits: WORD },
        Message::Edge { a: BYTE, b: BYTE, present: true },
        Message::Location(Location { place_index: WORD, vertex: BYTE }),
        largest_evidence(Factors::Robust { ln_labels_q16: i32::MIN, ln_moves_q16: i32::MIN, ln_size_q16: i32::MIN }),
        largest_evidence(Factors::Paper {
            ln_label_q16: i32::MIN,
            ln_consistency_q16: i32::MIN,
            ln_size_q16: i32::MIN,
        }),
        largest_evidence(Factors::Ordered { ln_labels_q16: i32::MIN, ln_moves_q16: i32::MIN }),
        Message::Row(Row { vertex: BYTE, radius_mm: SHORT, visits: WORD, neighbours: !0 }),
        Message::Fault { kind: BYTE, count: WORD },
        Message::Health(Health {
            uptime_ms: WORD,
            loop_count: WORD,
            stack_high_water_bytes: WORD,
            worst_turn_us: WORD,
        }),
        Message::Ring { frame_index: WORD, echoes: Echoes::new(&[Echo::Range { range_mm: SHORT }; Echoes::MAX]) },
        Message::Belief(Belief {
            place_index: WORD,
            map_permille: SHORT,
            vertices: List::new([VertexProbability { vertex: BYTE, permille: SHORT }; 8]),
        }),
        Message::Remapped(Remapped { place_index: WORD, vertices: List::new([BYTE; 64]) }),
        Message::Worst(Worst {
            place_index: WORD,
            distance_mm: SHORT,
            newest_age: SHORT,
            vertices: List::new([BYTE; 7]),
        }),
        largest_reply(Outcome::Done),
        largest_reply(Outcome::Info(Info {
            version: Version { major: BYTE, minor: BYTE, patch: BYTE },
            boot: WORD,
            reset_cause: ResetCause::LowPower,
            uptime_ms: WORD,
            paused: true,
            localise_only: true,
            goal: Some(BYTE),
            stored_bytes: SHORT,
            stored_places_ago: WORD,
        })),
        largest_reply(Outcome::Snapshot { total: SHORT, offset: SHORT, bytes: Chunk::new([BYTE; CHUNK_BYTES]) }),
        largest_reply(Outcome::Refused(Refusal::Busy)),
        largest_reply(Outcome::Settings { settings: List::new([Setting::SnapshotEveryPlaces(SHORT); SETTINGS_MAX]) }),
        Message::Velocity(Velocity {
            frame_index: WORD,
            heading_mrad: i16::MIN,
            speed_permille: i16::MIN,
            state: BYTE,
        }),
        Message::GoalStatus(GoalStatus { vertex: BYTE, state: GoalState::Replaced }),
        Message::Ways(VertexWays { vertex: 63, ways: List::new([edge(6282, (62, 6), Some(SHORT)); 7]) }),
        Message::Exploration(Exploration { frontiers: BYTE, complete: true }),
        Message::Name { vertex: BYTE, name: name("sixteen bytes ok") },
        Message::Named { vertices: !0 },
    ]
}

fn largest_evidence(factors: Factors) -> Message {
    Message::Evidence(Evidence {
        place_index: u32::MAX,
        consistency_mm: u16::MAX,
        factors,
        lead_q16: i32::MAX,
        distinct_hypotheses: u16::MAX,
    })
}

fn largest_reply(outcome: Outcome) -> Message {
    Message::Reply(Reply { request: u16::MAX, outcome })
}

/// Empty lists, the minimum of unsigned numbers, the other extreme of signed ones, and every one-byte enum variant.
pub(crate) fn extremes() -> Vec<Message> {
    let reply = |outcome| Message::Reply(Reply { request: 0, outcome });
    let robust = |place_index, logarithm| {
        Message::Evidence(Evidence {
            place_index,
            consistency_mm: 0,
            factors: Factors::Robust { ln_labels_q16: logarithm, ln_moves_q16: logarithm, ln_size_q16: logarithm },
            lead_q16: logarithm,
            distinct_hypotheses: 0,
        })
    };
    let drive = |state, value| {
        Message::Velocity(Velocity { frame_index: 0x80, heading_mrad: value, speed_permille: value, state })
    };
    let info = Info {
        version: Version { major: 0, minor: 0, patch: 0 },
        boot: 0,
        reset_cause: ResetCause::Unknown,
        uptime_ms: 0,
        paused: false,
        localise_only: false,
        goal: None,
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
        robust(0, 0),
        robust(0x1F_FFFF, i32::MAX),
        robust(0x0FFF_FFFF, -1),
        Message::Health(Default::default()),
        Message::Ring { frame_index: 0, echoes: Echoes::EMPTY },
        Message::Ring { frame_index: 0, echoes: Echoes::new(&ring) },
        Message::Remapped(Remapped { place_index: 0, vertices: List::new([]) }),
        Message::Worst(Worst { place_index: 0, distance_mm: 0, newest_age: 0, vertices: List::new([]) }),
        reply(Outcome::Info(info)),
        reply(Outcome::Settings { settings: List::new([]) }),
        reply(Outcome::Snapshot { total: 0, offset: 0, bytes: Chunk::new([]) }),
        drive(0, 0),
        drive(1, -1),
        drive(2, 1),
        drive(3, i16::MAX),
        evidence(Factors::Ordered { ln_labels_q16: 0, ln_moves_q16: 0 }),
        Message::Ways(VertexWays { vertex: 0, ways: List::new([]) }),
        Message::Ways(VertexWays { vertex: 0, ways: List::new([edge(0, (0, 1), Some(1)), edge(0, (0, 0), Some(1))]) }),
        Message::Exploration(Exploration { frontiers: 0, complete: false }),
        Message::Name { vertex: 0, name: Name::NONE },
        Message::Named { vertices: 0 },
    ];
    extremes.extend(ResetCause::ALL.iter().map(|&reset_cause| Message::Hello(Hello { reset_cause, ..hello })));
    extremes.extend(Refusal::ALL.iter().map(|&refusal| reply(Outcome::Refused(refusal))));
    extremes.extend(GoalState::ALL.iter().map(|&state| Message::GoalStatus(GoalStatus { vertex: 0, state })));
    extremes
}

pub(crate) fn extreme_requests() -> Vec<Request> {
    let commands = [
        Command::GetSnapshot { offset: 0 },
        Command::RestoreChunk { offset: 0, bytes: Chunk::new([]) },
        Command::LocaliseOnly { on: false },
        Command::GoTo { vertex: 0 },
        Command::Pause { on: false },
        Command::Name { vertex: 0, name: Name::NONE },
    ];
    commands.map(|command| Request { id: 0, command }).to_vec()
}
