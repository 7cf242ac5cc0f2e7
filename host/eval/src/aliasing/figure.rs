//! The figure of the study: for each kind of graph, the n that an environment needs over its share of aliased places, and the nodes
//! that the search expands over the number of places.

use super::{LENGTHS, Outcome, Report, Row};
use crate::chart::{self, INK, colour, line, scale, words};
use std::collections::BTreeSet;
use svg::node::element::{Circle, Group, Path, path::Data};

const PANEL: (f64, f64) = (300.0, 220.0);
const LEFT: f64 = 62.0;
const GAP: f64 = 70.0;
const HEAD: f64 = 76.0;
const BELOW: f64 = 60.0;
/// The decades of the axis of nodes.
const DECADES: [&str; 6] = ["1", "10", "10²", "10³", "10⁴", "10⁵"];

/// Draws the figure.
pub fn draw(report: &Report) -> String {
    let kinds: Vec<&str> = {
        let mut seen = BTreeSet::new();
        report.rows.iter().map(|row| row.kind.as_str()).filter(|kind| seen.insert(*kind)).collect()
    };
    let sizes: Vec<usize> = report.rows.iter().map(|row| row.places).collect::<BTreeSet<_>>().into_iter().collect();
    let (width, height) = (LEFT + kinds.len() as f64 * (PANEL.0 + GAP), HEAD + 2.0 * (PANEL.1 + BELOW) + 10.0);
    let title = "n-grams that tell aliased places apart";
    let mut document = chart::page((width, height), title, (LEFT, 26.0), 16.0);
    for (number, size) in sizes.iter().enumerate() {
        let x = LEFT + 400.0 + 90.0 * number as f64;
        document = document
            .add(Circle::new().set("cx", x).set("cy", 21.0).set("r", 4.0).set("fill", colour(number)))
            .add(words(&format!("{size} places"), x + 9.0, 25.0, 12.0));
    }
    for (column, kind) in kinds.iter().enumerate() {
        let left = LEFT + column as f64 * (PANEL.0 + GAP);
        let rows: Vec<&Row> = report.rows.iter().filter(|row| row.kind == *kind).collect();
        let at = |top: f64| format!("translate({left:.0} {top:.0})");
        document = document
            .add(words(kind, left, HEAD - 10.0, 14.0).set("font-weight", "bold"))
            .add(lengths(&rows, &sizes).set("transform", at(HEAD)))
            .add(nodes(&rows, &sizes).set("transform", at(HEAD + PANEL.1 + BELOW)));
    }
    document.to_string()
}

/// The needed n over the share of aliased places. The line above the largest n holds the environments for which none suffices.
fn lengths(rows: &[&Row], sizes: &[usize]) -> Group {
    let (width, height) = PANEL;
    let (least, most) = (*LENGTHS.start(), *LENGTHS.end());
    let lines = (most - least + 2) as f64;
    let y = |line: f64| height - height * (line + 0.5) / lines;
    let mut panel = Group::new();
    for length in least..=most + 1 {
        let name = if length > most { format!("> {most}") } else { length.to_string() };
        panel = scale(panel, width, &name, y((length - least) as f64));
    }
    for row in rows {
        let number = sizes.iter().position(|&size| size == row.places).unwrap_or(0);
        // The sizes lie beside each other.
        let offset = 0.7 * ((number as f64 + 0.5) / sizes.len() as f64 - 0.5);
        for Outcome { aliased, length, .. } in &row.results {
            let line = length.unwrap_or(most + 1) - least;
            panel = panel.add(point(width * aliased, y(line as f64 + offset), number));
        }
    }
    for percent in [0, 25, 50, 75, 100] {
        let at = width * f64::from(percent) / 100.0;
        panel = panel
            .add(line((at, height), (at, height + 5.0), INK))
            .add(words(&format!("{percent} %"), at, height + 19.0, 12.0).set("text-anchor", "middle"));
    }
    with_axes(panel, "aliased places", "n that suffices")
}

/// The expanded nodes over the number of places, and their median.
fn nodes(rows: &[&Row], sizes: &[usize]) -> Group {
    let (width, height) = PANEL;
    let y = |nodes: u64| height - height * (nodes.max(1) as f64).log10() / (DECADES.len() - 1) as f64;
    let x = |number: usize| width * (number as f64 + 0.5) / sizes.len() as f64;
    let mut panel = Group::new();
    for (decade, name) in (0..).zip(DECADES) {
        panel = scale(panel, width, name, y(10_u64.pow(decade)));
    }
    let mut medians = Vec::new();
    for row in rows {
        let number = sizes.iter().position(|&size| size == row.places).unwrap_or(0);
        let mut nodes: Vec<u64> = row.results.iter().map(|result| result.nodes).collect();
        nodes.sort_unstable();
        for (rank, &nodes) in nodes.iter().enumerate() {
            let offset = 0.5 * width / sizes.len() as f64 * ((rank as f64 + 0.5) / row.results.len() as f64 - 0.5);
            panel = panel.add(point(x(number) + offset, y(nodes), number));
        }
        medians.extend(nodes.get(nodes.len() / 2).map(|&median| (x(number), y(median))));
        let name = words(&row.places.to_string(), x(number), height + 19.0, 12.0);
        panel = panel.add(name.set("text-anchor", "middle"));
    }
    if let Some((&first, rest)) = medians.split_first() {
        let data = rest.iter().fold(Data::new().move_to(first), |data, &point| data.line_to(point));
        panel = panel.add(Path::new().set("d", data).set("fill", "none").set("stroke", INK).set("stroke-width", 1.5));
    }
    with_axes(panel, "places", "nodes of the search")
}

/// The point of an environment.
fn point(x: f64, y: f64, size: usize) -> Circle {
    Circle::new()
        .set("cx", format!("{x:.1}"))
        .set("cy", format!("{y:.1}"))
        .set("r", 2.4)
        .set("fill", colour(size))
        .set("fill-opacity", 0.55)
}

/// A panel with its axes and their names.
fn with_axes(panel: Group, horizontal: &str, vertical: &str) -> Group {
    let (width, height) = PANEL;
    panel
        .add(line((0.0, height), (width, height), INK))
        .add(words(horizontal, width / 2.0, height + 37.0, 13.0).set("text-anchor", "middle"))
        .add(words(vertical, -height / 2.0, -44.0, 13.0).set("text-anchor", "middle").set("transform", "rotate(-90)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_has_two_panels_for_each_kind_and_a_point_for_each_environment_in_both() {
        let outcome = |aliased, length, nodes| Outcome {
            aliased,
            degree: 2.0,
            distinguishable: 4,
            length,
            right: true,
            ended: false,
            nodes,
        };
        let row = |kind: &str, places| Row {
            kind: kind.into(),
            places,
            results: vec![outcome(0.5, Some(3), 20), outcome(1.0, None, 400)],
        };
        let report = Report { rows: vec![row("planar", 4), row("planar", 9), row("grid", 4)] };
        let picture = draw(&report);
        assert_eq!(picture.matches("<circle").count(), 2 + 2 * 6);
        assert_eq!(picture.matches("n that suffices").count(), 2);
        assert!(picture.contains("> 7") || picture.contains("&gt; 7"), "{picture}");
    }
}
