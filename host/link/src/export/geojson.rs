//! GeoJSON in the format of a Nav2 (ROS 2) route graph: a point for each vertex, and a line for each direction of each
//! edge.

use serde_json::{Value, json};

use crate::layout::{Layout, Point};
use crate::topology::TopologicalMap;

/// The map as a `FeatureCollection` that Nav2's route server can load.
///
/// Points have `id` and `frame`; lines have `id`, `startid` and `endid`. Every feature has a unique `id`, as Nav2
/// requires. The `metadata` of a vertex is `radius_m`, `visits`, `robot_is_here` and `has_self_loop`, and if the map has ways
/// `ways`, their number, their `bearings_mrad`, and `frontiers`, the positions of those that nobody has driven; with self-loops
/// `self_loop_ways`, the two ways of each, and `self_loop_frames`, its travel time or 0. A vertex with a name has a `name`. The `metadata` of a line is then
/// `start_way`, `end_way` and, if it is known, `travel_frames`. Self-loops are not exported as lines. The coordinates are those
/// of the drawing, in metres, with edges about `edge_m` long; they are not positions in the building.
///
/// With `frame_mm`, how far the robot drives in a ring frame, a line whose travel time is known has a `cost`, its length in
/// metres, which Nav2 then does not compute from the coordinates.
pub fn geojson(map: &TopologicalMap, layout: &Layout, here: Option<u8>, edge_m: f64, frame_mm: Option<f64>) -> String {
    // Rounded to the millimetre.
    let position = |point: &Point| json!([point.x, point.y].map(|unit| (unit * edge_m * 1000.0).round() / 1000.0));
    let nodes = (0..).zip(map.vertices.iter().zip(layout.points())).map(|(vertex, (label, point))| {
        let mut metadata = json!({
            "radius_m": f64::from(label.radius_mm) / 1000.0,
            "visits": label.visits,
            "robot_is_here": here == Some(vertex),
            "has_self_loop": map.edges.contains(&(vertex, vertex)),
        });
        if let Some(ways) = map.ways.get(usize::from(vertex)) {
            metadata["ways"] = ways.len().into();
            metadata["bearings_mrad"] = ways.iter().map(|way| way.bearing_mrad).collect();
            metadata["frontiers"] = map.frontiers_of(vertex).into();
        }
        if let Some(name) = map.names.get(&vertex) {
            metadata["name"] = json!(name);
        }
        // They have no lines.
        let loops = || map.way_edges().filter(|edge| edge.ends.iter().all(|end| end.vertex == vertex));
        if loops().next().is_some() {
            metadata["self_loop_ways"] = loops().flat_map(|edge| edge.ends.map(|end| end.way)).collect();
            metadata["self_loop_frames"] = loops().map(|edge| edge.travel_frames.unwrap_or(0)).collect();
        }
        feature("Point", position(point), json!({"id": vertex, "frame": "map", "metadata": metadata}))
    });
    let mut lines = Vec::new();
    for (line, (_, edge)) in layout.edges().into_iter().zip(map.all_edges()) {
        let ([start, end], mut points) = (line.ends, line.points);
        let mut ways = edge.map(|edge| edge.ends.map(|end| end.way));
        if start == end {
            continue;
        }
        for (start, end) in [(start, end), (end, start)] {
            let id = map.vertices.len() + lines.len();
            let mut properties = json!({"id": id, "startid": start, "endid": end});
            if let Some([start_way, end_way]) = ways {
                properties["metadata"] = json!({"start_way": start_way, "end_way": end_way});
            }
            if let Some(frames) = edge.and_then(|edge| edge.travel_frames) {
                properties["metadata"]["travel_frames"] = frames.into();
                if let Some(frame_mm) = frame_mm {
                    properties["cost"] = (f64::from(frames) * frame_mm / 1000.0).into();
                    properties["overridable"] = false.into();
                }
            }
            lines.push(feature("LineString", points.iter().map(position).collect(), properties));
            points.reverse();
            ways = ways.map(|[start, end]| [end, start]);
        }
    }
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
        let (map, layout) = sample::map();
        let collection: Value = serde_json::from_str(&geojson(&map, &layout, Some(3), 5.0, None)).unwrap();
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

    #[test]
    fn parallel_edges_have_lines_of_their_own_with_bends() {
        let (map, layout) = sample::with_ways();
        let collection: Value = serde_json::from_str(&geojson(&map, &layout, None, 5.0, None)).unwrap();
        let features = collection["features"].as_array().unwrap();
        let lines: Vec<&Value> =
            features.iter().filter(|feature| feature["geometry"]["type"] == "LineString").collect();
        assert_eq!(lines.len(), 4);
        let metadata = |line: usize| &lines[line]["properties"]["metadata"];
        assert_eq!(*metadata(0), json!({"start_way": 0, "end_way": 1, "travel_frames": 54}));
        assert_eq!(*metadata(1), json!({"start_way": 1, "end_way": 0, "travel_frames": 54}));
        assert_eq!(*metadata(2), json!({"start_way": 1, "end_way": 0}));
        let points = |line: usize| lines[line]["geometry"]["coordinates"].as_array().unwrap().clone();
        assert_eq!((points(0).len(), points(2).len()), (2, 3));
        assert_eq!(points(2)[0], points(3)[2]);
        assert_eq!(features[0]["properties"]["metadata"]["frontiers"], json!([4]));
        assert_eq!(lines[0]["properties"]["cost"], Value::Null);
    }

    #[test]
    fn with_the_distance_of_a_frame_a_line_with_a_travel_time_costs_its_length() {
        let (map, layout) = sample::with_ways();
        let collection: Value = serde_json::from_str(&geojson(&map, &layout, None, 5.0, Some(30.0))).unwrap();
        let features = collection["features"].as_array().unwrap();
        let costs: Vec<&Value> = features[2..].iter().map(|line| &line["properties"]["cost"]).collect();
        assert_eq!(costs, [&json!(1.62), &json!(1.62), &Value::Null, &Value::Null]);
    }
}
