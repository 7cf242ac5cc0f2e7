//! GraphML, for networkx, yEd, Gephi and others. Written by hand: the GraphML crates support only text attributes.

use std::fmt::Write;

use crate::layout::Point;
use crate::topology::TopologicalMap;

/// Attributes of the nodes and their types.
const KEYS: [(&str, &str); 5] =
    [("radius_mm", "int"), ("visits", "long"), ("x", "double"), ("y", "double"), ("robot_is_here", "boolean")];

/// The map as GraphML: an undirected graph with nodes `0`, `1`, … and their attributes `radius_mm`, `visits`, `x`, `y`
/// and `robot_is_here`.
pub fn graphml(map: &TopologicalMap, points: &[Point], here: Option<u8>) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<graphml xmlns=\"http://graphml.graphdrawing.org/xmlns\">\n",
    );
    for (name, kind) in KEYS {
        let _ = writeln!(text, "  <key id=\"{name}\" for=\"node\" attr.name=\"{name}\" attr.type=\"{kind}\"/>");
    }
    text += "  <graph id=\"map\" edgedefault=\"undirected\">\n";
    for ((index, vertex), point) in map.vertices.iter().enumerate().zip(points) {
        let is_here = here.map(usize::from) == Some(index);
        let values = [
            vertex.radius_mm.to_string(),
            vertex.visits.to_string(),
            point.x.to_string(),
            point.y.to_string(),
            is_here.to_string(),
        ];
        let _ = write!(text, "    <node id=\"{index}\">");
        for ((name, _), value) in KEYS.iter().zip(values) {
            let _ = write!(text, "<data key=\"{name}\">{value}</data>");
        }
        text += "</node>\n";
    }
    for (a, b) in &map.edges {
        let _ = writeln!(text, "    <edge source=\"{a}\" target=\"{b}\"/>");
    }
    text + "  </graph>\n</graphml>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn graphml_has_every_vertex_with_its_label_and_every_edge() {
        let (map, points) = sample::map();
        let text = graphml(&map, &points, Some(2));
        assert_eq!((text.matches("<node ").count(), text.matches("<edge ").count()), (4, 5));
        assert!(text.contains("<data key=\"radius_mm\">640</data><data key=\"visits\">7</data>"), "{text}");
        assert!(text.contains("<edge source=\"3\" target=\"3\"/>"), "{text}");
        assert_eq!(text.matches("robot_is_here\">true").count(), 1);
        assert_eq!(graphml(&map, &points, None).matches("robot_is_here\">true").count(), 0);
    }
}
