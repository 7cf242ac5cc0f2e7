//! JSON in this project's own format, for scripts. `docs/map.schema.json` is its JSON Schema.

use serde_json::{Value, json};

use crate::layout::{Layout, Point};
use crate::topology::TopologicalMap;

/// The map as a JSON object: `vertices` with `vertex`, `radius_mm`, `visits`, `x`, `y` and, if it has one, its `name`; `edges` as pairs of
/// vertices; `location`, the robot's vertex or null; and if the map has ways `ways`, those of each vertex, `way_edges`, each with
/// `ends`, `travel_frames` and `line`, and `frontiers`, each with `vertex`, `way` and `line`.
pub fn json(map: &TopologicalMap, layout: &Layout, here: Option<u8>) -> String {
    let vertices = map.vertices.iter().zip(layout.points()).enumerate().map(|(vertex, (label, point))| {
        let mut object =
            json!({"vertex": vertex, "radius_mm": label.radius_mm, "visits": label.visits, "x": point.x, "y": point.y});
        if let Some(name) = map.names.get(&(vertex as u8)) {
            object["name"] = json!(name);
        }
        object
    });
    let mut object = json!({
        "format": "toposlam-map",
        "version": 1,
        "vertices": vertices.collect::<Vec<Value>>(),
        "edges": map.edges,
        "location": here,
    });
    if !map.ways.is_empty() {
        let line = |points: &[Point]| points.iter().map(|point| json!([point.x, point.y])).collect::<Vec<Value>>();
        let edges = layout.edges().into_iter().zip(map.way_edges()).map(|(drawn, edge)| {
            json!({"ends": edge.ends, "travel_frames": edge.travel_frames, "line": line(&drawn.points)})
        });
        let frontiers = layout
            .stubs()
            .iter()
            .map(|stub| json!({"vertex": stub.way.vertex, "way": stub.way.way, "line": line(&[stub.from, stub.to])}));
        object["ways"] = json!(map.ways);
        object["way_edges"] = edges.collect();
        object["frontiers"] = frontiers.collect();
    }
    format!("{object:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn json_has_every_vertex_and_every_edge() {
        let (map, layout) = sample::map();
        let points = layout.points();
        let object: Value = serde_json::from_str(&json(&map, &layout, None)).unwrap();
        assert_eq!(object["edges"], json!([[0, 1], [0, 2], [1, 2], [2, 3], [3, 3]]));
        let vertex = json!({"vertex": 1, "radius_mm": 1200, "visits": 7, "x": points[1].x, "y": points[1].y});
        assert_eq!((&object["vertices"][1], &object["location"]), (&vertex, &Value::Null));
    }

    #[test]
    fn json_has_ways_their_edges_and_frontiers() {
        let (map, layout) = sample::with_ways();
        let object: Value = serde_json::from_str(&json(&map, &layout, None)).unwrap();
        let edge = json!({"bearing_mrad": 0, "leads_to": {"vertex": 1, "way": 1}, "travel_frames": 54});
        let frontier = json!({"bearing_mrad": 5000, "leads_to": null, "travel_frames": null});
        assert_eq!((&object["ways"][0][0], &object["ways"][0][4]), (&edge, &frontier));
        let lengths: Vec<usize> =
            object["way_edges"].as_array().unwrap().iter().map(|edge| edge["line"].as_array().unwrap().len()).collect();
        assert_eq!(lengths, [2, 3, 4]);
        assert_eq!(object["way_edges"][2]["ends"], json!([{"vertex": 0, "way": 2}, {"vertex": 0, "way": 3}]));
        assert_eq!(object["frontiers"][0]["way"], 4);
    }
}
