//! What is known of a robot as JSON, in two parts: what a place changes, and what each ring frame changes.
//!
//! ```
//! use toposlam::wire::{Encoder, MAX_FRAME_BYTES, Message};
//! use toposlam_host::{layout::Layout, listener::Listener, serve::state};
//!
//! let mut listener = Listener::new();
//! let edge = Message::Edge { a: 0, b: 1, present: true };
//! listener.feed(Encoder::new(0).encode(&edge, &mut [0; MAX_FRAME_BYTES])?, |_, _| ());
//! let mut layout = Layout::new();
//! layout.arrange(&listener.map());
//! assert_eq!(state::map(&listener, &layout)["edges"], serde_json::json!([[0, 1]]));
//! # Ok::<(), toposlam::wire::EncodeError>(())
//! ```

use serde_json::{Value, json};
use toposlam::FaultKind;

use crate::layout::Layout;
use crate::listener::{Listener, Understanding};
use crate::{json, wording};

/// Both parts.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// What [`map`] gives, and what else is seldom news.
    pub map: Value,
    /// What [`live`] gives.
    pub live: Value,
}

/// The map where the layout draws it, where the robot may be, why it believes so, its journey, and its faults.
///
/// Distances are in millimetres, `null` when they are infinite; `x` and `y` count edges, `y` points up, `null` for a vertex that the
/// layout has not placed. What was not heard is `null`.
pub fn map(listener: &Listener, layout: &Layout) -> Value {
    let picture = listener.picture();
    let map = listener.map();
    let vertices: Vec<Value> = (0..)
        .zip(&map.vertices)
        .map(|(number, vertex): (usize, _)| {
            let point = layout.points().get(number);
            json!({
                "vertex": number,
                "x": point.map(|point| thousandths(point.x)),
                "y": point.map(|point| thousandths(point.y)),
                "radius_mm": vertex.radius_mm,
                "visits": vertex.visits,
            })
        })
        .collect();
    let evidence = picture.evidence();
    json!({
        "understanding": understanding(listener),
        "hello": picture.hello(),
        "vertices": vertices,
        "edges": map.edges,
        "converged": picture.is_converged(),
        "location": picture.location(),
        "belief": picture.belief(),
        "evidence": evidence.map(|evidence| json!({
            "place_index": evidence.place_index,
            "consistency_mm": finite_mm(evidence.consistency_mm),
            "lead_nats": thousandths(wording::nats(evidence.lead_q16)),
            "distinct_hypotheses": evidence.distinct_hypotheses,
        })),
        "worst": picture.worst().map(|worst| json!({
            "distance_mm": finite_mm(worst.distance_mm),
            "newest_age": worst.newest_age,
            "vertices": worst.vertices,
        })),
        "journey": picture.journey().map(|journey| json!({
            "vertex": journey.vertex,
            "state": journey.state.to_string(),
        })),
        "faults": faults(listener),
    })
}

/// The newest ring frame, what the drive does, and how well the robot is heard.
///
/// `damaged` counts pieces of the line that were no whole frame, `unknown` whole frames that mean nothing here.
pub fn live(listener: &Listener) -> Value {
    let counters = listener.counters();
    json!({
        "ring": listener.ring().map(|(frame_index, echoes)| json!({
            "frame_index": frame_index,
            "ranges_mm": json::ranges_mm(&echoes),
        })),
        "drive": listener.drive().map(|drive| json!({
            "frame_index": drive.frame_index,
            "heading_mrad": drive.heading_mrad,
            "speed_permille": drive.speed_permille,
            "doing": wording::drive_state(drive.state),
        })),
        "line": {
            "messages": counters.messages,
            "lost": counters.lost,
            "damaged": counters.corrupt.saturating_add(counters.cut).saturating_add(counters.too_long),
            "unknown": counters.unknown_version.saturating_add(counters.unknown_message),
        },
    })
}

fn understanding(listener: &Listener) -> Value {
    let understanding = listener.understanding();
    let level = match understanding {
        Understanding::Unknown => "unknown",
        Understanding::Whole => "whole",
        Understanding::Partly { .. } => "partly",
        Understanding::Not(_) => "not",
    };
    json!({"level": level, "text": understanding.to_string()})
}

fn faults(listener: &Listener) -> Vec<Value> {
    let counts = FaultKind::ALL.iter().map(|&kind| (kind, listener.picture().fault(kind)));
    counts
        .filter(|&(_, count)| count > 0)
        .map(|(kind, count)| json!({"kind": format!("{kind:?}"), "count": count}))
        .collect()
}

fn finite_mm(distance_mm: u16) -> Option<u16> {
    (distance_mm != u16::MAX).then_some(distance_mm)
}

/// Rounded: nobody sees more of it, and it is sent often.
fn thousandths(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}
