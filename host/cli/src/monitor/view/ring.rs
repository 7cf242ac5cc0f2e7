//! The newest ring frame from above, with the heading of the drive; ahead is up.
//!
//! The protocol sends the number of sonars, but not their mounting. They are drawn at even spacing, the first straight
//! ahead, counter-clockwise, as in `RingGeometry::even`.

use std::f64::consts::{FRAC_PI_2, TAU};

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::text::Line as TextLine;
use ratatui::widgets::Block;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line, Points};
use toposlam::ring::Echo;

use super::{BAD, FAINT};
use crate::monitor::model::Model;

/// Minimum range at the rim; a farther echo increases it.
const LEAST_RANGE_MM: f64 = 500.0;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let echoes: Vec<Echo> =
        model.watch().listener().ring().map_or_else(Vec::new, |(_, echoes)| echoes.iter().collect());
    let range_mm = farthest_mm(&echoes);
    let title = match model.watch().listener().ring() {
        Some((index, _)) => format!("ring {index}, rim at {range_mm:.0} mm"),
        None => "heading; no ring frame yet".to_owned(),
    };
    let block = Block::bordered().title(title);
    let inside = block.inner(area);
    let (width, height) = (f64::from(inside.width.max(1)), 2.0 * f64::from(inside.height.max(1)));
    let reach = 1.15 * range_mm / width.min(height);
    let canvas = Canvas::default()
        .block(block)
        .marker(Marker::Braille)
        .x_bounds([-reach * width, reach * width])
        .y_bounds([-reach * height, reach * height])
        .paint(|context| paint(context, model, &echoes, range_mm));
    frame.render_widget(canvas, area);
}

fn paint(context: &mut Context<'_>, model: &Model, echoes: &[Echo], range_mm: f64) {
    context.draw(&Circle { x: 0.0, y: 0.0, radius: range_mm, color: Color::DarkGray });
    if let Some(drive) = model.watch().listener().velocity() {
        let (x, y) =
            towards(f64::from(drive.heading_mrad) / 1000.0, range_mm * f64::from(drive.speed_permille) / 1000.0);
        context.draw(&Line::new(0.0, 0.0, x, y, Color::Green));
    }
    let sonars = sonars(model, echoes.len());
    let bearing = |sonar: usize| TAU * sonar as f64 / sonars as f64;
    for (sonar, echo) in echoes.iter().enumerate() {
        if let Echo::Range { range_mm } = echo {
            let (x, y) = towards(bearing(sonar), f64::from(*range_mm));
            context.draw(&Line::new(0.0, 0.0, x, y, Color::Blue));
        }
    }
    context.layer();
    for (sonar, echo) in echoes.iter().enumerate() {
        match echo {
            Echo::Range { range_mm } => {
                let (x, y) = towards(bearing(sonar), f64::from(*range_mm));
                context.draw(&Points { coords: &[(x, y)], color: Color::White });
            }
            Echo::Silence => {
                let (x, y) = towards(bearing(sonar), range_mm);
                context.print(x, y, TextLine::styled("-", FAINT));
            }
            Echo::Dead => {
                let (x, y) = towards(bearing(sonar), range_mm);
                context.print(x, y, TextLine::styled("x", BAD));
            }
        }
    }
}

/// Number of sonars of the ring, if received.
fn sonars(model: &Model, echoes: usize) -> usize {
    let reported = model.watch().listener().replica().hello().map_or(0, |hello| usize::from(hello.capacities.sonars));
    reported.max(echoes).max(1)
}

fn farthest_mm(echoes: &[Echo]) -> f64 {
    let ranges = echoes.iter().filter_map(|echo| match echo {
        Echo::Range { range_mm } => Some(f64::from(*range_mm)),
        Echo::Silence | Echo::Dead => None,
    });
    ranges.fold(LEAST_RANGE_MM, f64::max)
}

/// A point at a bearing, counter-clockwise from ahead, and a distance; ahead is up.
fn towards(bearing: f64, distance: f64) -> (f64, f64) {
    let angle = bearing + FRAC_PI_2;
    (distance * angle.cos(), distance * angle.sin())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ahead_is_up_and_bearings_go_counter_clockwise() {
        let (x, y) = towards(0.0, 2.0);
        assert!(x.abs() < 1e-9 && (y - 2.0).abs() < 1e-9);
        let (x, y) = towards(FRAC_PI_2, 2.0);
        assert!((x + 2.0).abs() < 1e-9 && y.abs() < 1e-9, "a bearing of +90° is on the left");
    }
}
