//! Messages of a robot as text, one line each.
//!
//! ```
//! use toposlam::wire::Message;
//! use toposlam_link::event_text;
//!
//! let seen = Message::Place { place_index: 3, frame_index: 210, radius_mm: 1172, degree: Some(3) };
//! assert_eq!(event_text::message(&seen), "place 3: radius 1172 mm, 3 ways, in frame 210");
//! ```

use toposlam::drive::DriveState;
use toposlam::ring::Echo;
use toposlam::wire::{
    Arrival, Belief, Command, DecodeError, Evidence, Exploration, Factors, GoalStatus, Health, Hello, Info, Message,
    Outcome, Refusal, Remapped, Row, Setting, Velocity, VertexWays, Way, Worst,
};
use toposlam::{FaultKind, VertexSet};

use crate::listener::Event;
use crate::plural::count;
use crate::setting;

/// Wire units of a logarithm per nat.
const Q16: f64 = 65536.0;

/// One event as a line of text: the message, the number of frames lost before it, or the decoding error.
pub fn event(event: Event<'_>) -> String {
    match event {
        Event::Damaged(error) if is_unknown(error) => format!("unknown: {error}"),
        Event::Damaged(error) => format!("damaged: {error}"),
        Event::Message(header, received) => match header.arrival {
            Arrival::AfterGap { lost } => {
                format!("{} (after {})", message(received), count(lost, "lost frame", "lost frames"))
            }
            Arrival::Late => format!("{} (late, not counted)", message(received)),
            Arrival::Restart => format!("{} (the robot has restarted)", message(received)),
            Arrival::First | Arrival::InOrder => message(received),
        },
    }
}

/// Whether the frame is intact and of another version: it is not damaged.
pub const fn is_unknown(error: DecodeError) -> bool {
    matches!(error, DecodeError::UnknownVersion { .. } | DecodeError::UnknownMessage)
}

/// One message as a line of text.
pub fn message(message: &Message) -> String {
    match message {
        Message::Hello(hello) => introduction(hello),
        Message::Place { place_index, frame_index, radius_mm, degree } => {
            let ways = degree.map_or(String::new(), |degree| format!(", {}", count(degree, "way", "ways")));
            format!("place {place_index}: radius {radius_mm} mm{ways}, in frame {frame_index}")
        }
        Message::Map { vertices, edges, digest } => {
            format!(
                "map: {}, {}, digest {digest:08x}",
                count(*vertices, "vertex", "vertices"),
                count(*edges, "edge", "edges")
            )
        }
        Message::Vertex { vertex, radius_mm, visits } => {
            format!("vertex {vertex}: radius {radius_mm} mm, {}", count(*visits, "visit", "visits"))
        }
        Message::Edge { a, b, present: true } => format!("edge {a}-{b}"),
        Message::Edge { a, b, present: false } => format!("no edge {a}-{b} any more"),
        Message::Location(location) => format!("at vertex {} with place {}", location.vertex, location.place_index),
        Message::Evidence(evidence) => reasons(evidence),
        Message::Row(row) => whole_vertex(row),
        Message::Fault { kind, count } => {
            format!("fault {}: {}", fault_name(*kind), self::count(*count, "time", "times"))
        }
        Message::Health(health) => condition(health),
        Message::Ring { frame_index, echoes } => {
            let ranges: Vec<String> = echoes.iter().map(range).collect();
            format!("ring frame {frame_index}: {} mm", ranges.join(" "))
        }
        Message::Belief(belief) => probabilities(belief),
        Message::Remapped(remapped) => new_ids(remapped),
        Message::Worst(worst) => worst_explained(worst),
        Message::Reply(reply) => format!("reply to request {}: {}", reply.request, outcome(&reply.outcome)),
        Message::Velocity(velocity) => steering(velocity),
        Message::GoalStatus(GoalStatus { vertex, state }) => format!("goal vertex {vertex}: {state}"),
        Message::Ways(ways) => self::ways(ways),
        Message::Exploration(Exploration { frontiers, complete: true }) => {
            format!("exploration complete, {}", count(*frontiers, "frontier", "frontiers"))
        }
        Message::Exploration(Exploration { frontiers, complete: false }) => count(*frontiers, "frontier", "frontiers"),
        Message::Name { vertex, name } => format!("vertex {vertex} is named {name}"),
        Message::Named { vertices } => {
            let named: Vec<String> =
                VertexSet::from_bits(*vertices).iter().map(|vertex| u8::from(vertex).to_string()).collect();
            if named.is_empty() {
                "no vertex has a name".to_owned()
            } else {
                format!("vertices with a name: {}", named.join(" "))
            }
        }
        other => format!("{other:?}"),
    }
}

/// The outcome of a request.
pub fn outcome(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Done => "done".to_owned(),
        Outcome::Info(info) => self::info(info).join(", "),
        Outcome::Snapshot { total, offset, bytes } => {
            format!("{} bytes from byte {offset} of a snapshot of {total}", bytes.as_slice().len())
        }
        Outcome::Refused(refusal) => format!("refused: {refusal}"),
        Outcome::Settings { settings } => settings_text(settings.as_slice()).join(", "),
        other => format!("{other:?}"),
    }
}

/// Each setting by name.
pub fn settings_text(settings: &[Setting]) -> Vec<String> {
    settings.iter().map(|&setting| setting::text(setting)).collect()
}

/// Why a robot refuses a command. A setting out of range is named with its range.
pub fn refusal(command: &Command, refusal: Refusal) -> String {
    match (command, refusal) {
        (Command::SetConfig(setting), Refusal::OutOfRange) => setting::out_of_range(*setting),
        _ => refusal.to_string(),
    }
}

/// Version, settings and state of the robot, in a few lines.
pub fn info(info: &Info) -> Vec<String> {
    let version = info.version;
    let mapping = if info.localise_only { "keeps the map and localises" } else { "maps" };
    let mut lines = vec![
        format!("toposlam {}.{}.{}", version.major, version.minor, version.patch),
        if info.boot == 0 {
            format!("started: {}", info.reset_cause)
        } else {
            format!("start {}: {}", info.boot, info.reset_cause)
        },
        format!("up for {:.1} s", seconds(info.uptime_ms)),
        format!("{}{mapping}", if info.paused { "paused; otherwise it " } else { "" }),
    ];
    lines.extend(info.goal.map(|vertex| format!("driving to vertex {vertex}")));
    lines.push(match info.stored_bytes {
        0 => "no snapshot stored".to_owned(),
        bytes => format!("snapshot of {bytes} bytes stored {} ago", count(info.stored_places_ago, "place", "places")),
    });
    lines
}

/// Name of a kind of fault, or its number if it is unknown.
pub fn fault_name(kind: u8) -> String {
    FaultKind::ALL.get(usize::from(kind)).map_or_else(|| format!("kind {kind}"), |kind| format!("{kind:?}"))
}

/// Description of the state of the drive, given its number.
pub fn drive_state(state: u8) -> &'static str {
    const STATES: [(DriveState, &str); 7] = [
        (DriveState::FollowEdge, "follows an edge"),
        (DriveState::Approach, "homes in on a place"),
        (DriveState::ChooseExit, "looks for the ways out"),
        (DriveState::TurnToExit, "turns to its way"),
        (DriveState::Depart, "leaves a place"),
        (DriveState::Stopped, "stands"),
        (DriveState::Recover, "turns to where there is room"),
    ];
    STATES.iter().find(|&&(known, _)| known as u8 == state).map_or("does something unknown here", |&(_, text)| text)
}

/// A distance in millimetres; the largest number means infinity.
pub fn distance(distance_mm: u16) -> String {
    if distance_mm == u16::MAX { "infinite".to_owned() } else { format!("{distance_mm} mm") }
}

/// A wire logarithm in nats.
pub fn nats(ln_q16: i32) -> f64 {
    f64::from(ln_q16) / Q16
}

/// A wire time in seconds.
pub fn seconds(time_ms: u32) -> f64 {
    f64::from(time_ms) / 1000.0
}

/// What distinguishes this start of the robot from others.
pub fn start(hello: &Hello) -> String {
    let Hello { boot, session, reset_cause, seed, .. } = hello;
    let number = (*boot != 0).then(|| format!("start {boot}"));
    let session = (*session != 0).then(|| format!("session {session:08x}"));
    let names: Vec<String> = number.into_iter().chain(session).collect();
    format!("{} ({reset_cause}), seed {seed}", if names.is_empty() { "started".to_owned() } else { names.join(", ") })
}

/// How often the robot restarted within a stream, and the map that is left of it; `None` if it did not.
pub fn restarts(restarts: u32) -> Option<String> {
    let times = count(restarts, "restart", "restarts");
    (restarts > 0).then(|| format!("{times} of the robot; the map is that of the last start"))
}

fn introduction(hello: &Hello) -> String {
    let rooms = hello.capacities;
    format!(
        "hello: protocol version {}, schema {:#018x}, {}, room for {} vertices, {} hypotheses, \
         {} places, {} sonars",
        hello.protocol_version,
        hello.schema_hash,
        start(hello),
        rooms.vertices,
        rooms.hypotheses,
        rooms.history,
        rooms.sonars
    )
}

/// The factors of a weight by name, as logarithms in nats.
pub fn factors(factors: &Factors) -> String {
    match *factors {
        Factors::Robust { ln_labels_q16, ln_moves_q16, ln_size_q16 } => {
            format!("labels {:.2}, moves {:.2}, size {:.2}", nats(ln_labels_q16), nats(ln_moves_q16), nats(ln_size_q16))
        }
        Factors::Paper { ln_label_q16, ln_consistency_q16, ln_size_q16 } => format!(
            "Eq. 7 {:.2}, Eq. 8 {:.2}, Eq. 9 {:.2}",
            nats(ln_label_q16),
            nats(ln_consistency_q16),
            nats(ln_size_q16)
        ),
        Factors::Ordered { ln_labels_q16, ln_moves_q16 } => {
            format!("labels {:.2}, moves {:.2}", nats(ln_labels_q16), nats(ln_moves_q16))
        }
        other => format!("{other:?}"),
    }
}

fn ways(ways: &VertexWays) -> String {
    let way = |way: &Way| {
        let bearing = (f64::from(way.bearing_mrad) / 1000.0).to_degrees();
        let time =
            way.travel_frames.map_or_else(String::new, |frames| format!(" in {}", count(frames, "frame", "frames")));
        match way.leads_to {
            Some(end) => format!("{bearing:.0}° to {}.{}{time}", end.vertex, end.way),
            None => format!("{bearing:.0}° frontier"),
        }
    };
    let list: Vec<String> = ways.ways.as_slice().iter().map(way).collect();
    format!("ways of vertex {}: {}", ways.vertex, if list.is_empty() { "none".to_owned() } else { list.join(", ") })
}

fn reasons(evidence: &Evidence) -> String {
    format!(
        "evidence of place {}: consistency {}, {}, lead {:.2} nats, {}",
        evidence.place_index,
        distance(evidence.consistency_mm),
        factors(&evidence.factors),
        nats(evidence.lead_q16),
        count(evidence.distinct_hypotheses, "hypothesis", "hypotheses")
    )
}

fn whole_vertex(row: &Row) -> String {
    let neighbours: Vec<String> =
        (0..64).filter(|vertex| row.neighbours >> vertex & 1 == 1).map(|vertex: u8| vertex.to_string()).collect();
    format!(
        "vertex {}: radius {} mm, {}, neighbours {}",
        row.vertex,
        row.radius_mm,
        count(row.visits, "visit", "visits"),
        neighbours.join(" ")
    )
}

fn condition(health: &Health) -> String {
    format!(
        "health: up for {:.1} s, {}, stack {} bytes, longest turn {} us",
        seconds(health.uptime_ms),
        count(health.loop_count, "turn", "turns"),
        health.stack_high_water_bytes,
        health.worst_turn_us
    )
}

fn range(echo: Echo) -> String {
    match echo {
        Echo::Range { range_mm } => range_mm.to_string(),
        Echo::Silence => "silence".to_owned(),
        Echo::Dead => "dead".to_owned(),
    }
}

fn probabilities(belief: &Belief) -> String {
    let vertices = belief.vertices.as_slice().iter();
    let vertices: Vec<String> = vertices.map(|at| format!("{} {}‰", at.vertex, at.permille)).collect();
    format!(
        "belief after place {}: this map {}‰{}, at vertex {}",
        belief.place_index,
        belief.map_permille,
        if belief.is_uncertain() { " (uncertain)" } else { "" },
        vertices.join(", ")
    )
}

fn new_ids(remapped: &Remapped) -> String {
    let changes: Vec<String> = (0..)
        .zip(remapped.vertices.as_slice())
        .filter_map(|(before, _)| match remapped.now(before) {
            Some(now) if now == before => None,
            Some(now) => Some(format!("{before} is {now}")),
            None => Some(format!("{before} is removed")),
        })
        .collect();
    format!("vertices remapped with place {}: {}", remapped.place_index, changes.join(", "))
}

fn worst_explained(worst: &Worst) -> String {
    let walk: Vec<String> = worst.vertices.as_slice().iter().map(u8::to_string).collect();
    format!(
        "worst explained: {} from walk {}, {} ago",
        distance(worst.distance_mm),
        walk.join("-"),
        count(worst.newest_age, "place", "places")
    )
}

fn steering(drive: &Velocity) -> String {
    format!(
        "drive in frame {}: heading {} mrad, speed {}‰, {}",
        drive.frame_index,
        drive.heading_mrad,
        drive.speed_permille,
        drive_state(drive.state)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::wire::{DecodeError, Header, List};

    #[test]
    fn lost_and_damaged_frames_are_reported() {
        let edge = Message::Edge { a: 0, b: 1, present: false };
        let header = Header { sequence: 1, arrival: Arrival::AfterGap { lost: 4 } };
        assert_eq!(event(Event::Message(header, &edge)), "no edge 0-1 any more (after 4 lost frames)");
        assert_eq!(event(Event::Damaged(DecodeError::Cut)), "damaged: the frame ends too early");
    }

    #[test]
    fn remapped_vertices_are_shown_with_their_ids_before_and_after() {
        let remapped = Remapped { place_index: 2, vertices: List::new([0, 2, 255]) };
        assert_eq!(message(&Message::Remapped(remapped)), "vertices remapped with place 2: 1 is 2, 2 is removed");
    }

    #[test]
    fn unknown_kinds_are_shown_as_numbers() {
        assert_eq!(message(&Message::Fault { kind: 14, count: 2 }), "fault DriveLost: 2 times");
        assert_eq!(message(&Message::Fault { kind: 200, count: 2 }), "fault kind 200: 2 times");
        assert_eq!(drive_state(DriveState::Approach as u8), "homes in on a place");
        assert_eq!(drive_state(99), "does something unknown here");
    }
}
