//! The state of the robot and of its line.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::Line;
use toposlam::FaultKind;

use super::{BAD, FAINT, GOOD, boxed};
use crate::monitor::model::Model;
use toposlam_link::event_text::{self, drive_state, seconds};

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let listener = model.watch().listener();
    let picture = listener.replica();
    let map = model.watch().map();
    let mut lines = Vec::new();
    if let Some(drive) = listener.velocity() {
        let heading_deg = (f64::from(drive.heading_mrad) / 1000.0).to_degrees();
        let speed = drive.speed_permille;
        lines.push(Line::from(format!("heading {heading_deg:.0}°, {speed}‰: {}", drive_state(drive.state))));
    }
    if let Some(goal_status) = picture.goal_status() {
        lines.push(Line::from(format!("goal vertex {}: {}", map.vertex_text(goal_status.vertex), goal_status.state)));
    }
    lines.extend(reported(model));
    lines.push(faults(model));
    lines.push(received(model));
    if let Some(health) = picture.health() {
        lines.push(Line::from(format!(
            "up {:.0} s, {} turns, stack {} B, longest {} ms",
            seconds(health.uptime_ms),
            health.loop_count,
            health.stack_high_water_bytes,
            health.worst_turn_us / 1000
        )));
    }
    lines.push(match picture.hello() {
        Some(hello) => Line::from(event_text::start(&hello)),
        None => Line::styled(listener.understanding().to_string(), FAINT),
    });
    boxed(frame, area, "what it does", lines);
}

fn reported(model: &Model) -> Option<Line<'static>> {
    let reported = model.reported();
    let paused = reported.paused.map(|on| if on { "paused" } else { "not paused" });
    let mapping = reported.localise_only.map(|on| if on { "localises only" } else { "maps" });
    let stored = reported.info.map(|info| match info.stored_bytes {
        0 => "no snapshot stored".to_owned(),
        bytes => format!("{bytes} B stored"),
    });
    let words: Vec<String> = paused.into_iter().chain(mapping).map(str::to_owned).chain(stored).collect();
    (!words.is_empty()).then(|| Line::from(words.join(", ")))
}

fn faults(model: &Model) -> Line<'static> {
    let picture = model.watch().listener().replica();
    let counts = FaultKind::ALL.iter().map(|&kind| (kind, picture.fault(kind))).filter(|&(_, count)| count > 0);
    let named: Vec<String> = counts.map(|(kind, count)| format!("{kind:?} {count}")).collect();
    if named.is_empty() { Line::styled("no faults", GOOD) } else { Line::styled(named.join(", "), BAD) }
}

fn received(model: &Model) -> Line<'static> {
    let counters = model.watch().listener().counters();
    let unknown = counters.unknown();
    let damaged = counters.damaged();
    let style = if counters.lost > 0 || unknown > 0 || damaged > 0 { BAD } else { Style::new() };
    let text = format!(
        "{} frames, {} lost, {} corrupt, {} cut, {} too long, {unknown} unknown",
        counters.messages, counters.lost, counters.corrupt, counters.cut, counters.too_long
    );
    Line::styled(text, style)
}
