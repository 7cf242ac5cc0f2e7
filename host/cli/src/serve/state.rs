//! State of a robot as JSON, in two parts: one changes with each place, the other with each ring frame.
//!
//! ```
//! use toposlam_cli::serve::state::State;
//! use toposlam_link::{link::LinkEvent, watch::Watch};
//!
//! let mut watch = Watch::new("tcp:robot:7070");
//! watch.apply(LinkEvent::Connected);
//! let state = State::of(&mut watch);
//! assert_eq!(state.map["connection"]["state"], "open");
//! assert_eq!((state.map["edges"].to_string(), state.live["line"]["lost"].as_u64()), ("[]".to_owned(), Some(0)));
//! ```

use serde_json::{Value, json};
use toposlam::FaultKind;

use toposlam_link::layout::Point;
use toposlam_link::listener::{Listener, Understanding};
use toposlam_link::watch::{Connection, Watch};
use toposlam_link::{event_text, json};

/// Both parts of the state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The line and its connection, the map with its layout, the robot's possible vertices and the evidence for them,
    /// the status of its goal, and its faults.
    ///
    /// `vertices` have a `name`, `null` without one. `edges` are pairs of vertices. `lines` are the drawings of all edges, parallel ones and loops included: the two `vertices`,
    /// the positions of the two `ways` or `null`, and the points of the `line`; one point for a self-loop of a robot that knows
    /// edges only. `ways` are those of each vertex with the fields of `docs/wire.md`, `frontiers` those that nobody has driven, each
    /// with its drawing.
    ///
    /// Distances are in millimetres, `null` if infinite; `x` and `y` are in edge lengths, `y` points up. Values not yet
    /// received are `null`.
    pub map: Value,
    /// The newest ring frame, the state of the drive, and the counters of the line.
    ///
    /// `damaged` counts frames that failed to decode, `unknown` intact frames of an unknown version or message.
    pub live: Value,
}

impl State {
    /// The current state. Arranges the map.
    pub fn of(watch: &mut Watch) -> Self {
        watch.arrange();
        Self { map: map(watch), live: live(watch.listener()) }
    }
}

fn map(watch: &Watch) -> Value {
    let listener = watch.listener();
    let replica = listener.replica();
    let map = watch.map();
    let vertices: Vec<Value> = (0..)
        .zip(map.vertices.iter().zip(watch.points()))
        .map(|(number, (vertex, point)): (usize, _)| {
            json!({
                "vertex": number,
                "x": thousandths(point.x),
                "y": thousandths(point.y),
                "radius_mm": vertex.radius_mm,
                "visits": vertex.visits,
                "name": map.names.get(&(number as u8)),
            })
        })
        .collect();
    let at = |point: &Point| json!([thousandths(point.x), thousandths(point.y)]);
    let lines = watch.layout().edges().into_iter().map(|edge| {
        let line: Vec<Value> = edge.points.iter().map(at).collect();
        json!({"vertices": edge.ends, "ways": edge.ways.map(|ways| ways.map(|end| end.way)), "line": line})
    });
    let frontiers =
        watch.layout().stubs().iter().map(
            |stub| json!({"vertex": stub.way.vertex, "way": stub.way.way, "line": [at(&stub.from), at(&stub.to)]}),
        );
    let evidence = replica.evidence();
    json!({
        "line": watch.line(),
        "connection": connection(watch.connection()),
        "understanding": understanding(listener),
        "hello": replica.hello(),
        "vertices": vertices,
        "edges": map.edges,
        "lines": lines.collect::<Vec<_>>(),
        "ways": map.ways,
        "frontiers": frontiers.collect::<Vec<_>>(),
        "exploration": replica.exploration(),
        "converged": replica.is_converged(),
        "location": replica.location(),
        "belief": replica.belief(),
        "is_uncertain": replica.belief().map(|belief| belief.is_uncertain()),
        "evidence": evidence.map(|evidence| json!({
            "place_index": evidence.place_index,
            "consistency_mm": finite_mm(evidence.consistency_mm),
            "lead_nats": thousandths(event_text::nats(evidence.lead_q16)),
            "distinct_hypotheses": evidence.distinct_hypotheses,
        })),
        "worst": replica.worst().map(|worst| json!({
            "distance_mm": finite_mm(worst.distance_mm),
            "newest_age": worst.newest_age,
            "vertices": worst.vertices,
        })),
        "goal_status": replica.goal_status().map(|goal_status| json!({
            "vertex": goal_status.vertex,
            "state": goal_status.state.to_string(),
        })),
        "faults": faults(listener),
    })
}

fn live(listener: &Listener) -> Value {
    let counters = listener.counters();
    json!({
        "ring": listener.ring().map(|(frame_index, echoes)| json!({
            "frame_index": frame_index,
            "ranges_mm": json::ranges_mm(&echoes),
        })),
        "drive": listener.velocity().map(|drive| json!({
            "frame_index": drive.frame_index,
            "heading_mrad": drive.heading_mrad,
            "speed_permille": drive.speed_permille,
            "doing": event_text::drive_state(drive.state),
        })),
        "line": {
            "messages": counters.messages,
            "lost": counters.lost,
            "restarts": counters.restarts,
            "damaged": counters.damaged(),
            "unknown": counters.unknown(),
        },
    })
}

fn connection(connection: &Connection) -> Value {
    match connection {
        Connection::Opening => json!({"state": "opening"}),
        Connection::Open => json!({"state": "open"}),
        Connection::Lost(reason) => json!({"state": "cut", "reason": reason}),
        Connection::Ended => json!({"state": "ended"}),
    }
}

fn understanding(listener: &Listener) -> Value {
    let understanding = listener.understanding();
    let level = match understanding {
        Understanding::Unknown => "unknown",
        Understanding::Whole => "whole",
        Understanding::Partly { .. } => "partly",
        Understanding::Not(_) | Understanding::Several => "not",
    };
    json!({"level": level, "text": understanding.to_string()})
}

fn faults(listener: &Listener) -> Vec<Value> {
    let counts = FaultKind::ALL.iter().map(|&kind| (kind, listener.replica().fault(kind)));
    counts
        .filter(|&(_, count)| count > 0)
        .map(|(kind, count)| json!({"kind": format!("{kind:?}"), "count": count}))
        .collect()
}

fn finite_mm(distance_mm: u16) -> Option<u16> {
    (distance_mm != u16::MAX).then_some(distance_mm)
}

/// Rounded, because the state is sent often and more digits are not visible.
fn thousandths(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}
