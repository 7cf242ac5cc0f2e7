//! The map as a drawing.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line as TextLine, Span};
use ratatui::widgets::Block;
use ratatui::widgets::canvas::{Canvas, Circle, Context, Line};

use super::labels::{Label, Placed, place};
use super::vertices::permille_at;
use super::{FAINT, HERE};
use crate::monitor::model::Model;
use toposlam_link::layout::Point;

/// Margin around the vertices, in units of about one edge length.
const MARGIN: f64 = 0.5;
/// Circle radius of the widest place, and the minimum radius.
const WIDEST: f64 = 0.22;
const LEAST: f64 = 0.08;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let block = Block::bordered().title("map: number, radius in mm; @ and yellow: the robot; green: frontiers");
    let inside = block.inner(area);
    let (x_bounds, y_bounds) = bounds(model.watch().points(), inside);
    let canvas = Canvas::default()
        .block(block)
        .marker(Marker::Braille)
        .x_bounds(x_bounds)
        .y_bounds(y_bounds)
        .paint(|context| paint(context, model));
    frame.render_widget(canvas, area);
    print_labels(frame, inside, (x_bounds, y_bounds), model);
}

/// Prints the labels over the drawing, those of the robot and of its possible vertices first.
fn print_labels(frame: &mut Frame<'_>, area: Rect, (x_bounds, y_bounds): ([f64; 2], [f64; 2]), model: &Model) {
    let cell = |value: f64, [least, most]: [f64; 2], cells: u16| {
        ((value - least) / (most - least) * f64::from(cells.saturating_sub(1))) as u16
    };
    let vertices = &model.watch().map().vertices;
    let mut numbers: Vec<usize> = (0..vertices.len().min(model.watch().points().len())).collect();
    numbers.sort_by_key(|&number| (!is_here(model, number), permille_at(model, number).is_none()));
    let texts: Vec<(Span<'static>, Vec<TextLine<'static>>)> =
        numbers.iter().map(|&number| label(model, number, vertices[number].radius_mm)).collect();
    let labels: Vec<Label> = numbers
        .iter()
        .zip(&texts)
        .map(|(&number, (name, details))| {
            let point = model.watch().points()[number];
            Label {
                column: area.x + cell(point.x, x_bounds, area.width),
                row: area.y + cell(-point.y, [-y_bounds[1], -y_bounds[0]], area.height),
                number_width: name.width() as u16,
                details: details.iter().map(|detail| detail.width() as u16).collect(),
            }
        })
        .collect();
    let buffer = frame.buffer_mut();
    for ((name, details), placed) in texts.into_iter().zip(place(&labels, area)) {
        let Some(Placed { column, row, detail }) = placed else { continue };
        let (after, _) = buffer.set_span(column, row, &name, area.right().saturating_sub(column));
        if let Some(detail) = detail {
            buffer.set_string(after, row, " ", Style::new());
            buffer.set_line(after + 1, row, &details[detail], area.right().saturating_sub(after + 1));
        }
    }
}

fn paint(context: &mut Context<'_>, model: &Model) {
    let points = model.watch().points();
    let map = model.watch().map();
    for edge in model.watch().layout().edges() {
        let [a, b] = edge.ends;
        let color = if is_worst(model, a, b) { Color::LightRed } else { Color::Gray };
        if let [at] = edge.points[..] {
            context.draw(&Circle { x: at.x, y: at.y + 0.3, radius: 0.3, color });
        }
        for ends in edge.points.windows(2) {
            context.draw(&Line::new(ends[0].x, ends[0].y, ends[1].x, ends[1].y, color));
        }
    }
    for stub in model.watch().layout().stubs() {
        context.draw(&Line::new(stub.from.x, stub.from.y, stub.to.x, stub.to.y, Color::Green));
    }
    context.layer();
    let widest_mm = map.vertices.iter().map(|vertex| vertex.radius_mm).max().unwrap_or(0).max(1);
    for (number, (vertex, point)) in map.vertices.iter().zip(points).enumerate() {
        let radius = LEAST + (WIDEST - LEAST) * f64::from(vertex.radius_mm) / f64::from(widest_mm);
        context.draw(&Circle { x: point.x, y: point.y, radius, color: color_of(model, number) });
    }
}

/// The number of a vertex, and its details, the longest first.
fn label(model: &Model, number: usize, radius_mm: u16) -> (Span<'static>, Vec<TextLine<'static>>) {
    let color = color_of(model, number);
    let is_here = is_here(model, number);
    let name = format!("{}{number}", if is_here { "@" } else { "" });
    let style = if is_here { HERE } else { Style::new().fg(color) };
    let radius = Span::styled(radius_mm.to_string(), FAINT);
    let permille =
        permille_at(model, number).map(|permille| Span::styled(format!("{permille}‰"), Style::new().fg(color)));
    let named = model.watch().map().names.get(&(number as u8)).map(|name| Span::styled(name.clone(), style));
    let both = permille.clone().map(|permille| vec![radius.clone(), Span::raw(" "), permille]);
    let shortest = permille.unwrap_or(radius);
    let details: Vec<Vec<Span<'_>>> = both.into_iter().chain([vec![shortest]]).collect();
    let with_name = named.iter().flat_map(|name| {
        let before = |detail: &Vec<Span<'static>>| [vec![name.clone(), Span::raw(" ")], detail.clone()].concat();
        details.iter().map(before).chain([vec![name.clone()]]).collect::<Vec<_>>()
    });
    let details = with_name.chain(details.iter().cloned()).map(TextLine::from);
    (Span::styled(name, style), details.collect())
}

fn color_of(model: &Model, number: usize) -> Color {
    let target = model.watch().listener().replica().goal_status().map(|goal_status| usize::from(goal_status.vertex));
    if is_here(model, number) {
        Color::Yellow
    } else if permille_at(model, number).is_some() {
        Color::Cyan
    } else if target == Some(number) {
        Color::Magenta
    } else {
        Color::White
    }
}

fn is_here(model: &Model, number: usize) -> bool {
    model.watch().listener().replica().location().is_some_and(|location| usize::from(location.vertex) == number)
}

/// Whether the walk that explains the worst n-gram uses this edge.
fn is_worst(model: &Model, a: u8, b: u8) -> bool {
    let Some(worst) = model.watch().listener().replica().worst() else { return false };
    worst.vertices.as_slice().windows(2).any(|step| *step == [a, b] || *step == [b, a])
}

/// The visible part of the plane: contains all points and keeps circles round, as a cell is twice as high as wide.
fn bounds(points: &[Point], area: Rect) -> ([f64; 2], [f64; 2]) {
    let (width, height) = (f64::from(area.width.max(1)), 2.0 * f64::from(area.height.max(1)));
    let range = |of: fn(&Point) -> f64| {
        let least = points.iter().map(of).fold(f64::INFINITY, f64::min);
        let most = points.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        if least <= most { (f64::midpoint(least, most), most - least) } else { (0.0, 0.0) }
    };
    let ((x, wide), (y, high)) = (range(|point| point.x), range(|point| point.y));
    // The labels are to the right of their vertices.
    let per_cell = ((wide + 2.0 * MARGIN) / (width - 10.0).max(1.0)).max((high + 2.0 * MARGIN) / height);
    let centre = x + 4.0 * per_cell;
    (
        [centre - per_cell * width / 2.0, centre + per_cell * width / 2.0],
        [y - per_cell * height / 2.0, y + per_cell * height / 2.0],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_points_are_visible_and_circles_are_round() {
        let points = [Point { x: -3.0, y: 1.0 }, Point { x: 2.0, y: 9.0 }];
        for (width, height) in [(46, 15), (100, 10), (20, 60), (1, 1), (0, 0)] {
            let ([left, right], [bottom, top]) = bounds(&points, Rect::new(0, 0, width, height));
            for point in points {
                assert!((left..right).contains(&point.x) || width < 12, "{width} × {height}");
                assert!((bottom..top).contains(&point.y), "{width} × {height}");
            }
            let (across, up) = ((right - left) / f64::from(width.max(1)), (top - bottom) / f64::from(height.max(1)));
            assert!((up / across - 2.0).abs() < 1e-9, "{width} × {height}");
        }
        let ([left, right], _) = bounds(&[], Rect::new(0, 0, 40, 20));
        assert!(left < 0.0 && right > 0.0);
    }
}
