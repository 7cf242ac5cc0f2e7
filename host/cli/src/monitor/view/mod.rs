//! Draws the model on a frame of any size, one file per pane. The view does not change the model.
//!
//! From 110 columns and 34 rows all panes are visible; from 60 and 14 the selected pane beside beliefs and robot; below
//! that only the selected pane.

mod beliefs;
mod help;
mod labels;
mod map;
mod ring;
mod robot;
mod vertices;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Wrap};

use super::model::{Model, Pane};
use toposlam_link::listener::Understanding;
use toposlam_link::plural::count;
use toposlam_link::watch::Connection;

/// Silence of a robot after which a warning is shown; it normally sends several messages per second.
const QUIET_SECONDS: f64 = 3.0;

const GOOD: Style = Style::new().fg(Color::Green);
const BAD: Style = Style::new().fg(Color::Red);
const FAINT: Style = Style::new().fg(Color::DarkGray);
const HERE: Style = Style::new().fg(Color::Yellow).add_modifier(Modifier::BOLD);
const ALARM: Style = Style::new().fg(Color::White).bg(Color::Red).add_modifier(Modifier::BOLD);
const WARNING: Style = Style::new().fg(Color::Black).bg(Color::Yellow);

/// Draws the model. Call [`Model::settle`] first.
pub fn draw(frame: &mut Frame<'_>, model: &Model) {
    let area = frame.area();
    let banners = banners(model, area.width);
    let heights = banners.iter().map(|(_, height)| *height).sum();
    let [header, above, body, footer] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(heights),
        Constraint::Min(0),
        Constraint::Length(1),
    ])
    .areas(area);
    frame.render_widget(heading(model), header);
    let rows = Layout::vertical(banners.iter().map(|(_, height)| Constraint::Length(*height))).split(above);
    for ((banner, _), row) in banners.into_iter().zip(rows.iter()) {
        frame.render_widget(banner, *row);
    }
    if model.helps() {
        help::draw(frame, body);
    } else {
        panes(frame, body, model);
    }
    frame.render_widget(hints(model), footer);
}

fn panes(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    if area.width >= 110 && area.height >= 32 {
        let [left, right] = Layout::horizontal([Constraint::Min(50), Constraint::Length(60)]).areas(area);
        let [map_area, log_area] = Layout::vertical([Constraint::Min(0), Constraint::Length(9)]).areas(left);
        let [upper, beliefs_area, robot_area] =
            Layout::vertical([Constraint::Min(10), Constraint::Length(10), Constraint::Length(9)]).areas(right);
        let [vertices_area, ring_area] =
            Layout::horizontal([Constraint::Percentage(50), Constraint::Percentage(50)]).areas(upper);
        map::draw(frame, map_area, model);
        log(frame, log_area, model);
        vertices::draw(frame, vertices_area, model);
        ring::draw(frame, ring_area, model);
        beliefs::draw(frame, beliefs_area, model);
        robot::draw(frame, robot_area, model);
    } else if area.width >= 60 && area.height >= 12 {
        let [upper, log_area] = Layout::vertical([Constraint::Min(0), Constraint::Length(4)]).areas(area);
        let [left, right] = Layout::horizontal([Constraint::Percentage(52), Constraint::Min(0)]).areas(upper);
        let [beliefs_area, robot_area] = Layout::vertical([Constraint::Length(10), Constraint::Min(0)]).areas(right);
        chosen(frame, left, model);
        beliefs::draw(frame, beliefs_area, model);
        robot::draw(frame, robot_area, model);
        log(frame, log_area, model);
    } else {
        chosen(frame, area, model);
    }
}

fn chosen(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    match model.pane() {
        Pane::Map => map::draw(frame, area, model),
        Pane::Vertices => vertices::draw(frame, area, model),
        Pane::Ring => ring::draw(frame, area, model),
        Pane::Robot => robot::draw(frame, area, model),
    }
}

fn heading(model: &Model) -> Line<'_> {
    let connection = match model.watch().connection() {
        Connection::Opening => Span::styled("opening", FAINT),
        Connection::Open => Span::styled("connected", GOOD),
        Connection::Lost(_) => Span::styled("no line", BAD),
        Connection::Ended => Span::styled("ended", FAINT),
    };
    let picture = model.watch().listener().replica();
    let map = model.watch().map();
    let whole = match (picture.vertices(), picture.is_converged()) {
        (0, _) => Span::styled("no map yet", FAINT),
        (_, true) => Span::styled("as the robot has it", GOOD),
        (_, false) => Span::styled("may lack something", Style::new().fg(Color::Yellow)),
    };
    let explored = picture.exploration().map_or_else(String::new, |exploration| {
        if exploration.complete { ", complete".to_owned() } else { format!(", {} open", exploration.frontiers) }
    });
    let (vertices, edges) = (map.vertices.len(), map.all_edges().len());
    let size = format!(" {}, {}{explored} ", count(vertices, "vertex", "vertices"), count(edges, "edge", "edges"));
    let name = if model.is_read_only() { "standard input" } else { model.watch().line() };
    Line::from(vec![Span::from(format!("{name} ")), connection, Span::from(size), whole])
}

/// Warnings at the top of the screen, each with its number of rows.
fn banners(model: &Model, width: u16) -> Vec<(Paragraph<'_>, u16)> {
    let mut texts = Vec::new();
    if let Connection::Lost(reason) = model.watch().connection() {
        texts.push((format!("no line: {reason}; trying again. What is shown is as it was."), ALARM));
    }
    let understanding = model.watch().listener().understanding();
    match understanding {
        Understanding::Unknown | Understanding::Whole => {}
        Understanding::Partly { .. } => texts.push((understanding.to_string(), WARNING)),
        Understanding::Not(_) | Understanding::Several => {
            texts.push((format!("DO NOT TRUST WHAT IS SHOWN: {understanding}"), ALARM))
        }
    }
    if *model.watch().connection() == Connection::Open
        && let Some(silence) = model.silence()
        && silence.as_secs_f64() >= QUIET_SECONDS
    {
        texts.push((format!("no data for {} s", silence.as_secs()), WARNING));
    }
    let rows = |text: &str| 1 + text.chars().count() as u16 / width.max(1);
    texts
        .into_iter()
        .map(|(text, style)| {
            let rows = rows(&text);
            (Paragraph::new(text).style(style).wrap(Wrap { trim: true }), rows)
        })
        .collect()
}

fn hints(model: &Model) -> Line<'_> {
    if let Some(prompt) = model.prompt() {
        return Line::from(vec![
            Span::styled(prompt.question(), HERE),
            Span::from(prompt.text()),
            Span::styled("_", Modifier::SLOW_BLINK),
            Span::styled("  (Enter, or Esc to leave it)", FAINT),
        ]);
    }
    if let Some(task) = model.waiting() {
        return Line::styled(format!("waiting for the robot: {task}"), HERE);
    }
    Line::styled("? keys  Tab next pane  g go to  e explore  p pause  c go on  i info  q quit", FAINT)
}

fn log(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let block = Block::bordered().title("what happened");
    let room = usize::from(block.inner(area).height);
    let log = model.log();
    let lines = log.iter().skip(log.len().saturating_sub(room));
    let lines: Vec<Line<'_>> =
        lines.map(|entry| Line::styled(&*entry.text, if entry.is_bad { BAD } else { Style::new() })).collect();
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

/// A paragraph in a box, with wrapped lines.
fn boxed(frame: &mut Frame<'_>, area: Rect, title: &str, lines: Vec<Line<'_>>) {
    let block = Block::bordered().title(title);
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: true }).block(block), area);
}
