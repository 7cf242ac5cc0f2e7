//! SVG drawing of a map without a floor plan.

use svg::Document;
use svg::node::element::{Group, Line, Path, Rectangle, Title};

use super::marks::{self, Mark};
use crate::layout::{Layout, Point};
use crate::plural::count;
use crate::topology::TopologicalMap;

/// Approximate length of an edge, in units of the document.
const EDGE_MM: f64 = 2500.0;
const MARGIN_MM: f64 = 1100.0;

/// The map as an SVG document: each vertex with its number, its name and its radius. The robot's vertex has a blue rim. Loops and parallel edges
/// are curves, frontiers are dashed stubs.
pub fn svg(map: &TopologicalMap, layout: &Layout, here: Option<u8>) -> String {
    let marks: Vec<Mark> = map
        .vertices
        .iter()
        .zip(layout.points())
        .enumerate()
        .map(|(vertex, (label, point))| Mark {
            at: at(*point),
            radius_mm: label.radius_mm.into(),
            number: vertex.to_string(),
            name: map.names.get(&(vertex as u8)).cloned().unwrap_or_default(),
            is_here: here.map(usize::from) == Some(vertex),
        })
        .collect();
    let bends =
        layout.edges().into_iter().flat_map(|edge| edge.points).chain(layout.stubs().iter().map(|stub| stub.to));
    let all: Vec<(f64, f64)> = marks.iter().map(|mark| mark.at).chain(bends.map(at)).collect();
    let range = |of: fn(&(f64, f64)) -> f64| {
        let low = all.iter().map(of).reduce(f64::min).unwrap_or(0.0) - MARGIN_MM;
        (low, all.iter().map(of).reduce(f64::max).unwrap_or(0.0) + MARGIN_MM - low)
    };
    let ((left, width), (top, height)) = (range(|at| at.0), range(|at| at.1));
    let edges: Vec<(usize, usize)> = map.edges.iter().map(|&(a, b)| (a.into(), b.into())).collect();
    let lines = if map.ways.is_empty() { marks::edges(&marks, &edges) } else { curves(layout) };
    let background = Rectangle::new().set("x", left).set("y", top).set("width", width).set("height", height);
    let document = Document::new()
        .set("viewBox", (left, top, width, height))
        .set("width", width / 25.0)
        .set("height", height / 25.0)
        .set("font-family", "sans-serif")
        .add(Title::new(format!(
            "Map of {} and {}",
            count(map.vertices.len(), "vertex", "vertices"),
            count(map.all_edges().len(), "edge", "edges")
        )))
        .add(background.set("fill", "white"))
        .add(lines)
        .add(marks::dots(&marks));
    format!("{document}\n")
}

/// A point in the document. The y axis of SVG points down.
fn at(point: Point) -> (f64, f64) {
    (EDGE_MM * point.x, -EDGE_MM * point.y)
}

/// The edges, rounded at their bends, and the frontiers.
fn curves(layout: &Layout) -> Group {
    let mut group = Group::new().set("fill", "none").set("stroke", marks::MAP_COLOUR).set("stroke-width", 90);
    for edge in layout.edges() {
        group = group.add(Path::new().set("d", rounded(&edge.points)));
    }
    for stub in layout.stubs() {
        let ((x1, y1), (x2, y2)) = (at(stub.from), at(stub.to));
        let line = Line::new().set("x1", x1).set("y1", y1).set("x2", x2).set("y2", y2);
        group = group.add(line.set("stroke-dasharray", "120 90"));
    }
    group
}

/// The path through some points. Each bend is rounded within the half of the lines beside it.
fn rounded(points: &[Point]) -> String {
    let middle =
        |one: Point, other: Point| at(Point { x: f64::midpoint(one.x, other.x), y: f64::midpoint(one.y, other.y) });
    let (Some(&first), Some(&last)) = (points.first(), points.last()) else { return String::new() };
    let (x, y) = at(first);
    let mut path = format!("M {x:.0} {y:.0}");
    for bend in points.windows(3) {
        let ((x1, y1), (x, y), (x2, y2)) = (middle(bend[0], bend[1]), at(bend[1]), middle(bend[1], bend[2]));
        path += &format!(" L {x1:.0} {y1:.0} Q {x:.0} {y:.0} {x2:.0} {y2:.0}");
    }
    let (x, y) = at(last);
    path + &format!(" L {x:.0} {y:.0}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn svg_has_a_dot_per_vertex_a_line_per_edge_and_marks_the_robot() {
        let (map, layout) = sample::map();
        let text = svg(&map, &layout, Some(1));
        // Four dots, a self-loop and the robot's rim.
        assert_eq!((text.matches("<line").count(), text.matches("<circle").count()), (4, 6));
        assert_eq!(svg(&map, &layout, None).matches("<circle").count(), 5);
        assert!(text.contains("0.64 m"), "{text}");
    }

    #[test]
    fn svg_has_a_curve_per_edge_between_ways_and_a_stub_per_frontier() {
        let (map, layout) = sample::with_ways();
        let text = svg(&map, &layout, None);
        assert_eq!((text.matches("<path").count(), text.matches(" Q ").count()), (3, 3), "{text}");
        assert_eq!(text.matches("stroke-dasharray").count(), 1, "{text}");
        assert!(text.contains("2 vertices and 3 edges"), "{text}");
    }

    #[test]
    fn an_empty_map_gives_a_valid_svg() {
        assert!(!svg(&TopologicalMap::default(), &Layout::new(), None).contains("NaN"));
    }
}
