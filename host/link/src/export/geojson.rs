//! GeoJSON in the shape of a route graph of Nav2, the navigation of ROS 2: a point for each vertex, a line for each way of each edge.

use serde_json::{Value, json};

use crate::layout::Point;
use crate::topology::TopologicalMap;

/// The map as a `FeatureCollection` that the route server of Nav2 loads.
///
/// Points have `id` and `frame`, lines `id`, `startid` and `endid`; no two features have the same `id`, which Nav2 demands. What is known
/// of a vertex is in its `metadata`: `radius_m`, `visits`, `robot_is_here` and `has_self_loop`. A self-loop is no line, as
/// it leads nowhere. The coordinates are the picture's, in metres when an edge is about `edge_m` long: a drawing, not positions in a
/// building.
pub fn geojson(map: &TopologicalMap, points: &[Point], here: Option<u8>, edge_m: f64) -> String {
    let position = |vertex: u8| {
        let point = points.get(usize::from(vertex)).copied().unwrap_or_default();
        // To the millimetre.
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
        // As in Nav2's own files; its server takes the coordinates as metres of the frame.
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
    fn every_edge_is_a_line_each_way_between_points_and_all_have_numbers_of_their_own() {
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
