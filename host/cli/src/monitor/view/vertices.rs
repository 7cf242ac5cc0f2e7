//! The map as a table.

use ratatui::Frame;
use ratatui::layout::{Constraint, Rect};
use ratatui::style::Style;
use ratatui::widgets::{Block, Row, Table};

use super::{FAINT, HERE};
use crate::monitor::model::Model;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let picture = model.watch().listener().replica();
    let here = picture.location().map(|location| usize::from(location.vertex));
    let neighbours = model.watch().map().neighbours();
    let has_names = !model.watch().map().names.is_empty();
    let rows = model.watch().map().vertices.iter().zip(&neighbours).enumerate().skip(model.scroll());
    let rows = rows.map(|(number, (vertex, neighbours))| {
        let neighbours: Vec<String> = neighbours.iter().map(usize::to_string).collect();
        let is_here = here == Some(number);
        let cells = [
            format!("{}{number}", if is_here { "@" } else { " " }),
            vertex.radius_mm.to_string(),
            vertex.visits.to_string(),
            permille_at(model, number).map_or(String::new(), |permille| permille.to_string()),
            neighbours.join(" "),
            frontiers(model, number),
        ];
        let name = model.watch().map().names.get(&(number as u8)).cloned();
        let cells = cells.into_iter().chain(has_names.then(|| name.unwrap_or_default()));
        Row::new(cells).style(if is_here { HERE } else { Style::new() })
    });
    let widths = [
        Constraint::Length(3),
        Constraint::Length(4),
        Constraint::Length(4),
        Constraint::Length(4),
        Constraint::Min(4),
        Constraint::Length(4),
    ];
    let widths = widths.into_iter().chain(has_names.then_some(Constraint::Max(16)));
    let titles = [" no", "mm", "seen", "‰", "edges to", "open"].into_iter().chain(has_names.then_some("name"));
    let table =
        Table::new(rows, widths).header(Row::new(titles).style(FAINT)).block(Block::bordered().title("vertices"));
    frame.render_widget(table, area);
}

/// The number of frontiers of a vertex, empty if there are none.
fn frontiers(model: &Model, number: usize) -> String {
    let count = model.watch().map().frontiers_of(number as u8).len();
    if count == 0 { String::new() } else { count.to_string() }
}

/// Probability that the robot is at a vertex, in thousandths, if received.
pub(super) fn permille_at(model: &Model, number: usize) -> Option<u16> {
    let belief = model.watch().listener().replica().belief()?;
    let place = belief.vertices.as_slice().iter().find(|place| usize::from(place.vertex) == number)?;
    Some(place.permille)
}
