//! GraphML, for networkx, yEd, Gephi and others. Written by hand: the GraphML crates support only text attributes.

use std::fmt::Write;

use crate::layout::Layout;
use crate::topology::{TopologicalMap, WayEdge};

/// Attributes of the nodes and their types.
const KEYS: [(&str, &str); 5] =
    [("radius_mm", "int"), ("visits", "long"), ("x", "double"), ("y", "double"), ("robot_is_here", "boolean")];
/// Further ones of a map with ways.
const WAY_KEYS: [(&str, &str); 3] = [("ways", "int"), ("frontiers", "string"), ("bearings_mrad", "string")];
/// Attributes of the edges of a map with ways.
const EDGE_KEYS: [(&str, &str); 3] = [("source_way", "int"), ("target_way", "int"), ("travel_frames", "int")];

/// The map as GraphML: an undirected graph with nodes `0`, `1`, … and their attributes `radius_mm`, `visits`, `x`, `y`
/// and `robot_is_here`, and `name` if it has one. If the map has ways, nodes have `ways`, their number, `frontiers`, the positions
/// of those that nobody has driven, and `bearings_mrad`; edges have `source_way`, `target_way` and `travel_frames`.
pub fn graphml(map: &TopologicalMap, layout: &Layout, here: Option<u8>) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<graphml xmlns=\"http://graphml.graphdrawing.org/xmlns\">\n",
    );
    let way_keys = if map.ways.is_empty() { 0 } else { WAY_KEYS.len() };
    for (name, kind) in KEYS.iter().chain(&WAY_KEYS[..way_keys]) {
        let _ = writeln!(text, "  <key id=\"{name}\" for=\"node\" attr.name=\"{name}\" attr.type=\"{kind}\"/>");
    }
    for (name, kind) in EDGE_KEYS.iter().filter(|_| way_keys > 0) {
        let _ = writeln!(text, "  <key id=\"{name}\" for=\"edge\" attr.name=\"{name}\" attr.type=\"{kind}\"/>");
    }
    if !map.names.is_empty() {
        text += "  <key id=\"name\" for=\"node\" attr.name=\"name\" attr.type=\"string\"/>\n";
    }
    text += "  <graph id=\"map\" edgedefault=\"undirected\">\n";
    for ((index, vertex), point) in map.vertices.iter().enumerate().zip(layout.points()) {
        let is_here = here.map(usize::from) == Some(index);
        let mut values = vec![
            vertex.radius_mm.to_string(),
            vertex.visits.to_string(),
            point.x.to_string(),
            point.y.to_string(),
            is_here.to_string(),
        ];
        if let Some(ways) = map.ways.get(index) {
            let frontiers: Vec<String> = map.frontiers_of(index as u8).iter().map(u8::to_string).collect();
            let bearings: Vec<String> = ways.iter().map(|way| way.bearing_mrad.to_string()).collect();
            values.extend([ways.len().to_string(), frontiers.join(" "), bearings.join(" ")]);
        }
        let _ = write!(text, "    <node id=\"{index}\">");
        for ((name, _), value) in KEYS.iter().chain(&WAY_KEYS).zip(values) {
            let _ = write!(text, "<data key=\"{name}\">{value}</data>");
        }
        if let Some(name) = map.names.get(&(index as u8)) {
            let _ = write!(text, "<data key=\"name\">{}</data>", escaped(name));
        }
        text += "</node>\n";
    }
    for ([a, b], edge) in map.all_edges() {
        let Some(WayEdge { ends: [source, target], travel_frames }) = edge else {
            let _ = writeln!(text, "    <edge source=\"{a}\" target=\"{b}\"/>");
            continue;
        };
        let values = [Some(source.way.into()), Some(target.way.into()), travel_frames];
        let _ = write!(text, "    <edge source=\"{a}\" target=\"{b}\">");
        for ((name, _), value) in EDGE_KEYS.iter().zip(values) {
            if let Some(value) = value {
                let _ = write!(text, "<data key=\"{name}\">{value}</data>");
            }
        }
        text += "</edge>\n";
    }
    text + "  </graph>\n</graphml>\n"
}

/// Text in an element.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn graphml_has_every_vertex_with_its_label_and_every_edge() {
        let (map, layout) = sample::map();
        let text = graphml(&map, &layout, Some(2));
        assert_eq!((text.matches("<node ").count(), text.matches("<edge ").count()), (4, 5));
        assert!(text.contains("<data key=\"radius_mm\">640</data><data key=\"visits\">7</data>"), "{text}");
        assert!(text.contains("<edge source=\"3\" target=\"3\"/>"), "{text}");
        assert_eq!(text.matches("robot_is_here\">true").count(), 1);
        assert_eq!(graphml(&map, &layout, None).matches("robot_is_here\">true").count(), 0);
        assert!(!text.contains("way"), "{text}");
    }

    #[test]
    fn graphml_has_ways_frontiers_parallel_edges_and_loops() {
        let (map, layout) = sample::with_ways();
        let text = graphml(&map, &layout, None);
        assert!(text.contains("<data key=\"ways\">5</data><data key=\"frontiers\">4</data>"), "{text}");
        assert_eq!(text.matches("<edge source=\"0\" target=\"1\">").count(), 2, "{text}");
        assert_eq!(text.matches("<edge source=\"0\" target=\"0\">").count(), 1, "{text}");
        let edge =
            "<data key=\"source_way\">0</data><data key=\"target_way\">1</data><data key=\"travel_frames\">54</data>";
        assert!(text.contains(edge), "{text}");
    }
}
