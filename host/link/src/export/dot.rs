//! DOT, for Graphviz. `neato -n` uses the given positions; `dot` and other engines compute their own layout.

use petgraph::dot::{Config, Dot};
use petgraph::graph::{NodeIndex, UnGraph};

use crate::layout::Point;
use crate::topology::{TopologicalMap, Vertex};

/// Approximate length of an edge, in Graphviz points (72 per inch).
const POINTS_PER_EDGE: f64 = 144.0;

/// The map as an undirected DOT graph: nodes `0`, `1`, … with `label`, `radius_mm`, `visits` and `pos`. The robot's
/// vertex has a double rim.
pub fn dot(map: &TopologicalMap, points: &[Point], here: Option<u8>) -> String {
    let graph = map.to_petgraph();
    let node = |_: &UnGraph<Vertex, ()>, (node, vertex): (NodeIndex, &Vertex)| {
        let index = node.index();
        let Vertex { radius_mm, visits } = vertex;
        let mut attributes = format!(
            "label = \"{index}\\n{:.2} m\" radius_mm = {radius_mm} visits = {visits}",
            f64::from(*radius_mm) / 1000.0
        );
        if let Some(point) = points.get(index) {
            let (x, y) = (POINTS_PER_EDGE * point.x, POINTS_PER_EDGE * point.y);
            attributes += &format!(" pos = \"{x:.2},{y:.2}\"");
        }
        if here.map(usize::from) == Some(index) {
            attributes += " peripheries = 2";
        }
        attributes
    };
    format!(
        "{:?}",
        Dot::with_attr_getters(&graph, &[Config::NodeNoLabel, Config::EdgeNoLabel], &|_, _| String::new(), &node)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn dot_has_every_vertex_with_its_position_and_every_edge() {
        let (map, points) = sample::map();
        let text = dot(&map, &points, Some(2));
        assert!(text.starts_with("graph {"), "{text}");
        assert_eq!((text.matches("pos = ").count(), text.matches(" -- ").count()), (4, 5));
        assert!(text.contains("label = \"2\\n0.64 m\" radius_mm = 640 visits = 7"), "{text}");
        assert!(text.contains("3 -- 3"), "{text}");
        assert_eq!(text.matches("peripheries = 2").count(), 1);
    }
}
