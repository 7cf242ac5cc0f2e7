//! The robot's beliefs and their evidence.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::{FAINT, HERE, boxed};
use crate::monitor::model::Model;
use toposlam_link::event_text::{distance, factors, nats};
use toposlam_link::plural::count;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let listener = model.watch().listener();
    let replica = listener.replica();
    let mut lines = Vec::new();
    if let Some(location) = replica.location() {
        lines.push(Line::from(vec![
            Span::from("at "),
            Span::styled(format!("vertex {}", model.watch().map().vertex_text(location.vertex)), HERE),
            Span::from(format!(" with place {}", location.place_index)),
        ]));
    }
    if let Some(belief) = replica.belief() {
        let vertices: Vec<String> =
            belief.vertices.as_slice().iter().map(|at| format!("{} {}‰", at.vertex, at.permille)).collect();
        lines.push(Line::from(format!("probably at {}", vertices.join(", "))));
        let rivals = 1000_u16.saturating_sub(belief.map_permille);
        let this = if belief.is_uncertain() { "uncertain" } else { "this map" };
        lines.push(Line::from(format!("{this} {}‰, its rivals {rivals}‰", belief.map_permille)));
    }
    if let Some(evidence) = replica.evidence() {
        lines.push(Line::from(format!("consistency {}", distance(evidence.consistency_mm))));
        lines.push(Line::from(format!("ln: {}", factors(&evidence.factors))));
        lines.push(Line::from(format!(
            "lead {:.2} nats, {}",
            nats(evidence.lead_q16),
            count(evidence.distinct_hypotheses, "hypothesis", "hypotheses")
        )));
    }
    if let Some(worst) = replica.worst() {
        let walk: Vec<String> = worst.vertices.as_slice().iter().map(u8::to_string).collect();
        let age = worst.newest_age;
        lines.push(Line::from(format!("worst {}: {}, {age} ago", distance(worst.distance_mm), walk.join("-"))));
    }
    if let Some(seen) = listener.sighting() {
        let ways = seen.degree.map_or(String::new(), |degree| format!(", {}", count(degree, "way", "ways")));
        lines.push(Line::from(format!("saw {} mm{ways}", seen.radius_mm)));
    }
    if lines.is_empty() {
        lines.push(Line::styled("no place yet", FAINT));
    }
    boxed(frame, area, "what it believes, and why", lines);
}
