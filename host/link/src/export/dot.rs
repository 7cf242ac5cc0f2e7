//! DOT, for Graphviz. `neato -n` uses the given positions; `dot` and other engines compute their own layout.

use petgraph::dot::{Config, Dot};
use petgraph::graph::{EdgeReference, NodeIndex, UnGraph};

use crate::layout::Layout;
use crate::topology::{TopologicalMap, Vertex, WayEdge};

/// Approximate length of an edge, in Graphviz points (72 per inch).
const POINTS_PER_EDGE: f64 = 144.0;

/// The map as an undirected DOT graph: nodes `0`, `1`, … with `label`, `name` if it has one, `radius_mm`, `visits` and `pos`, and `ways` and
/// `frontiers` if the map has ways; edges then with `tail_way`, `head_way` and `travel_frames`. The robot's vertex has a double
/// rim.
pub fn dot(map: &TopologicalMap, layout: &Layout, here: Option<u8>) -> String {
    let graph = map.to_petgraph();
    let node = |_: &UnGraph<Vertex, Option<WayEdge>>, (node, vertex): (NodeIndex, &Vertex)| {
        let index = node.index();
        let Vertex { radius_mm, visits } = vertex;
        let text = quoted(&map.vertex_text(index as u8));
        let mut attributes = format!(
            "label = \"{text}\\n{:.2} m\" radius_mm = {radius_mm} visits = {visits}",
            f64::from(*radius_mm) / 1000.0
        );
        if let Some(name) = map.names.get(&(index as u8)) {
            attributes += &format!(" name = \"{}\"", quoted(name));
        }
        if let Some(ways) = map.ways.get(index) {
            let frontiers: Vec<String> = map.frontiers_of(index as u8).iter().map(u8::to_string).collect();
            attributes += &format!(" ways = {} frontiers = \"{}\"", ways.len(), frontiers.join(" "));
        }
        if let Some(point) = layout.points().get(index) {
            let (x, y) = (POINTS_PER_EDGE * point.x, POINTS_PER_EDGE * point.y);
            attributes += &format!(" pos = \"{x:.2},{y:.2}\"");
        }
        if here.map(usize::from) == Some(index) {
            attributes += " peripheries = 2";
        }
        attributes
    };
    let edge = |_: &UnGraph<Vertex, Option<WayEdge>>, edge: EdgeReference<'_, Option<WayEdge>>| {
        let Some(WayEdge { ends: [tail, head], travel_frames }) = edge.weight() else { return String::new() };
        let time = travel_frames.map_or_else(String::new, |frames| format!(" travel_frames = {frames}"));
        format!("tail_way = {} head_way = {}{time}", tail.way, head.way)
    };
    let config = [Config::NodeNoLabel, Config::EdgeNoLabel];
    format!("{:?}", Dot::with_attr_getters(&graph, &config, &edge, &node))
}

/// Text between quotation marks.
fn quoted(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn dot_has_every_vertex_with_its_position_and_every_edge() {
        let (map, layout) = sample::map();
        let text = dot(&map, &layout, Some(2));
        assert!(text.starts_with("graph {"), "{text}");
        assert_eq!((text.matches("pos = ").count(), text.matches(" -- ").count()), (4, 5));
        assert!(text.contains("label = \"2\\n0.64 m\" radius_mm = 640 visits = 7"), "{text}");
        assert!(text.contains("3 -- 3"), "{text}");
        assert_eq!(text.matches("peripheries = 2").count(), 1);
    }

    #[test]
    fn dot_has_ways_frontiers_parallel_edges_and_loops() {
        let (map, layout) = sample::with_ways();
        let text = dot(&map, &layout, None);
        assert!(text.contains("ways = 5 frontiers = \"4\""), "{text}");
        assert_eq!((text.matches("0 -- 1").count(), text.matches("0 -- 0").count()), (2, 1), "{text}");
        assert!(text.contains("tail_way = 0 head_way = 1 travel_frames = 54"), "{text}");
    }
}
