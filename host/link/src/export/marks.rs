//! Vertices and edges of a map as SVG elements, for any background. One unit of the document is 1 mm.

use svg::node::element::{Circle, Group, Line, Text};

/// Colour of the map.
pub const MAP_COLOUR: &str = "#b3261e";
/// Colour of the robot.
pub const ROBOT_COLOUR: &str = "#0b57d0";
/// Radius of a vertex.
pub const DOT_MM: f64 = 330.0;

/// A vertex in the document, whose y axis points down.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Position of the centre.
    pub at: (f64, f64),
    /// Radius of its fingerprint.
    pub radius_mm: f64,
    /// Text on the vertex.
    pub number: String,
    /// Text above the vertex; empty without a name.
    pub name: String,
    /// Whether the robot is at this vertex.
    pub is_here: bool,
}

/// Draws the edges, given as indices of vertices. A self-loop is a circle; an edge to an unknown vertex is omitted.
pub fn edges(marks: &[Mark], edges: &[(usize, usize)]) -> Group {
    let mut group = Group::new().set("fill", "none").set("stroke", MAP_COLOUR).set("stroke-width", 90);
    for &(from, to) in edges {
        let (Some(start), Some(end)) = (marks.get(from), marks.get(to)) else { continue };
        let ((x1, y1), (x2, y2)) = (start.at, end.at);
        group = if from == to {
            let angle = widest_gap(marks, edges, from);
            let (x, y) = (x1 + DOT_MM * angle.cos(), y1 + DOT_MM * angle.sin());
            group.add(Circle::new().set("cx", x).set("cy", y).set("r", DOT_MM))
        } else {
            group.add(Line::new().set("x1", x1).set("y1", y1).set("x2", x2).set("y2", y2))
        };
    }
    group
}

/// Direction of the bisector of the widest gap between a vertex's edges; up if it has none.
fn widest_gap(marks: &[Mark], edges: &[(usize, usize)], vertex: usize) -> f64 {
    let ends = edges.iter().filter_map(|&(a, b)| match (a == vertex, b == vertex) {
        (true, false) => marks.get(b),
        (false, true) => marks.get(a),
        _ => None,
    });
    let (x, y) = marks[vertex].at;
    let mut angles: Vec<f64> = ends.map(|mark| (mark.at.1 - y).atan2(mark.at.0 - x)).collect();
    angles.sort_by(f64::total_cmp);
    let Some(&first) = angles.first() else { return -std::f64::consts::FRAC_PI_2 };
    angles.push(first + std::f64::consts::TAU);
    let gap = angles.windows(2).max_by(|one, other| (one[1] - one[0]).total_cmp(&(other[1] - other[0])));
    gap.map_or(first, |gap| 0.5 * (gap[0] + gap[1]))
}

/// Draws the vertices, each with its text and radius.
pub fn dots(marks: &[Mark]) -> Group {
    let mut group = Group::new().set("text-anchor", "middle");
    for mark in marks {
        let (x, y) = mark.at;
        let dot = Circle::new().set("cx", x).set("cy", y).set("r", DOT_MM).set("fill", MAP_COLOUR);
        if mark.is_here {
            let rim = Circle::new().set("cx", x).set("cy", y).set("r", 1.4 * DOT_MM).set("fill", "none");
            group = group.add(rim.set("stroke", ROBOT_COLOUR).set("stroke-width", 0.3 * DOT_MM));
        }
        let radius = words(&format!("{:.2} m", mark.radius_mm / 1000.0), x, y + DOT_MM + 320.0, 300.0);
        group = group
            .add(dot)
            .add(words(&mark.number, x, y + 130.0, 380.0).set("fill", "white"))
            // A white outline keeps the text legible over the edges.
            .add(radius.set("stroke", "white").set("stroke-width", 90).set("paint-order", "stroke"));
        if !mark.name.is_empty() {
            let name = words(&mark.name, x, y - DOT_MM - 170.0, 340.0);
            group = group.add(name.set("stroke", "white").set("stroke-width", 90).set("paint-order", "stroke"));
        }
    }
    group
}

/// One line of text.
pub fn words(words: &str, x: f64, y: f64, size_mm: f64) -> Text {
    Text::new(words).set("x", x).set("y", y).set("font-size", size_mm).set("fill", "#222222")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_self_loop_lies_in_the_widest_gap_between_edges() {
        let mark =
            |x, y| Mark { at: (x, y), radius_mm: 1.0, number: String::new(), name: String::new(), is_here: false };
        let marks = [mark(0.0, 0.0), mark(9.0, 0.0), mark(0.0, 9.0), mark(0.0, -9.0)];
        let gap = widest_gap(&marks, &[(0, 0), (0, 1), (0, 2), (0, 3)], 0);
        assert!((gap.cos() + 1.0).abs() < 1e-9, "{gap}");
        assert_eq!(widest_gap(&marks, &[(1, 1)], 1), -std::f64::consts::FRAC_PI_2);
    }
}
