//! GeoJSON in the format of a Nav2 (ROS 2) route graph: a point for each vertex, and a line for each direction of each
//! edge.

use serde_json::{Value, json};

use crate::layout::Point;
use crate::topology::TopologicalMap;

/// The map as a `FeatureCollection` that Nav2's route server can load.
///
/// Points have `id` and `frame`; lines have `id`, `startid` and `endid`. Every feature has a unique `id`, as Nav2
/// requires. The `metadata` of a vertex is `radius_m`, `visits`, `robot_is_here` and `has_self_loop`. Self-loops are
/// not exported as lines. The coordinates are those of the drawing, in metres, with edges about `edge_m` long; they are
/// not positions in the building.
pub fn geojson(map: &TopologicalMap, points: &[Point], here: Option<u8>, edge_m: f64) -> String {
    let position = |vertex: u8| {
        let point = points.get(usize::from(vertex)).copied().unwrap_or_default();
        // Rounded to the millimetre.
        json!([point.x, point.y].map(|unit| (unit * edge_m * 1000.0).round() / 1000.0))
    };
    let nodes = (0..).zip(&map.vertices).map(|(vertex, label)| {
        let properties = json!({
            "id": vertex,
            "frame": "map",
            "metadata": {
                "radius_m": f64::from(label.radius_mm) / 1000.0,
                "visits": label.visits,
                "robot_is_here": here == Some(vertex),
                "has_self_loop": map.edges.contains(&(vertex, vertex)),
            },
        });
        feature("Point", position(vertex), properties)
    });
    let ways = map.edges.iter().filter(|(a, b)| a != b).flat_map(|&(a, b)| [(a, b), (b, a)]);
    let lines = (map.vertices.len()..).zip(ways).map(|(id, (start, end))| {
        let properties = json!({"id": id, "startid": start, "endid": end});
        feature("LineString", json!([position(start), position(end)]), properties)
    });
    let collection = json!({
        "type": "FeatureCollection",
        "name": "graph",
        // As in Nav2's own files: the route server reads the coordinates as metres in this frame.
        "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}},
        "features": nodes.chain(lines).collect::<Vec<_>>(),
    });
    format!("{collection:#}\n")
}

fn feature(kind: &str, coordinates: Value, properties: Value) -> Value {
    json!({"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties})
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;
    use std::collections::BTreeSet;

    #[test]
    fn geojson_has_two_lines_per_edge_and_unique_ids() {
        let (map, points) = sample::map();
        let collection: Value = serde_json::from_str(&geojson(&map, &points, Some(3), 5.0)).unwrap();
        let features = collection["features"].as_array().unwrap();
        let of_kind =
            |kind: &str| features.iter().filter(|feature| feature["geometry"]["type"] == kind).collect::<Vec<_>>();
        let (nodes, lines) = (of_kind("Point"), of_kind("LineString"));
        assert_eq!((nodes.len(), lines.len()), (4, 8));
        let numbers: BTreeSet<u64> =
            features.iter().map(|feature| feature["properties"]["id"].as_u64().unwrap()).collect();
        assert_eq!(numbers.len(), features.len());
        for line in lines {
            let end = |name: &str| {
                nodes[line["properties"][name].as_u64().unwrap() as usize]["geometry"]["coordinates"].clone()
            };
            assert_eq!(line["geometry"]["coordinates"], json!([end("startid"), end("endid")]));
        }
        let metadata = |vertex: usize| &nodes[vertex]["properties"]["metadata"];
        assert_eq!(*metadata(3), json!({"radius_m": 0.48, "visits": 7, "robot_is_here": true, "has_self_loop": true}));
        assert_eq!(metadata(0)["robot_is_here"], false);
    }
}
