//! SVG drawing of a map without a floor plan.

use svg::Document;
use svg::node::element::{Rectangle, Title};

use super::marks::{self, Mark};
use crate::layout::Point;
use crate::topology::TopologicalMap;

/// Approximate length of an edge, in units of the document.
const EDGE_MM: f64 = 2500.0;
const MARGIN_MM: f64 = 1100.0;

/// The map as an SVG document: each vertex with its number and radius. The robot's vertex has a blue rim.
pub fn svg(map: &TopologicalMap, points: &[Point], here: Option<u8>) -> String {
    // The y axis of SVG points down.
    let marks: Vec<Mark> = map
        .vertices
        .iter()
        .zip(points)
        .enumerate()
        .map(|(vertex, (label, point))| Mark {
            at: (EDGE_MM * point.x, -EDGE_MM * point.y),
            radius_mm: label.radius_mm.into(),
            name: vertex.to_string(),
            is_here: here.map(usize::from) == Some(vertex),
        })
        .collect();
    let range = |of: fn(&Mark) -> f64| {
        let low = marks.iter().map(of).reduce(f64::min).unwrap_or(0.0) - MARGIN_MM;
        (low, marks.iter().map(of).reduce(f64::max).unwrap_or(0.0) + MARGIN_MM - low)
    };
    let ((left, width), (top, height)) = (range(|mark| mark.at.0), range(|mark| mark.at.1));
    let edges: Vec<(usize, usize)> = map.edges.iter().map(|&(a, b)| (a.into(), b.into())).collect();
    let background = Rectangle::new().set("x", left).set("y", top).set("width", width).set("height", height);
    let document = Document::new()
        .set("viewBox", (left, top, width, height))
        .set("width", width / 25.0)
        .set("height", height / 25.0)
        .set("font-family", "sans-serif")
        .add(Title::new(format!("Map of {} vertices and {} edges", map.vertices.len(), map.edges.len())))
        .add(background.set("fill", "white"))
        .add(marks::edges(&marks, &edges))
        .add(marks::dots(&marks));
    format!("{document}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn svg_has_a_dot_per_vertex_a_line_per_edge_and_marks_the_robot() {
        let (map, points) = sample::map();
        let text = svg(&map, &points, Some(1));
        // Four dots, a self-loop and the robot's rim.
        assert_eq!((text.matches("<line").count(), text.matches("<circle").count()), (4, 6));
        assert_eq!(svg(&map, &points, None).matches("<circle").count(), 5);
        assert!(text.contains("0.64 m"), "{text}");
    }

    #[test]
    fn an_empty_map_gives_a_valid_svg() {
        assert!(!svg(&TopologicalMap::default(), &[], None).contains("NaN"));
    }
}
