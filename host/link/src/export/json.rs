//! JSON in this project's own format, for scripts. `docs/map.schema.json` is its JSON Schema.

use serde_json::{Value, json};

use crate::layout::Point;
use crate::topology::TopologicalMap;

/// The map as a JSON object: `vertices` with `vertex`, `radius_mm`, `visits`, `x` and `y`; `edges` as pairs of
/// vertices; and `location`, the robot's vertex or null.
pub fn json(map: &TopologicalMap, points: &[Point], here: Option<u8>) -> String {
    let vertices = map.vertices.iter().zip(points).enumerate().map(|(vertex, (label, point))| {
        json!({"vertex": vertex, "radius_mm": label.radius_mm, "visits": label.visits, "x": point.x, "y": point.y})
    });
    let object = json!({
        "format": "toposlam-map",
        "version": 1,
        "vertices": vertices.collect::<Vec<Value>>(),
        "edges": map.edges,
        "location": here,
    });
    format!("{object:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn json_has_every_vertex_and_every_edge() {
        let (map, points) = sample::map();
        let object: Value = serde_json::from_str(&json(&map, &points, None)).unwrap();
        assert_eq!(object["edges"], json!([[0, 1], [0, 2], [1, 2], [2, 3], [3, 3]]));
        let vertex = json!({"vertex": 1, "radius_mm": 1200, "visits": 7, "x": points[1].x, "y": points[1].y});
        assert_eq!((&object["vertices"][1], &object["location"]), (&vertex, &Value::Null));
    }
}
