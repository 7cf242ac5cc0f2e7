//! Maps from the GeoJSON of `export`.

use serde_json::Value;
use toposlam::wire::WayId;

use super::{Draft, ImportError};
use crate::topology::{TopologicalMap, Vertex};

/// Whether JSON is GeoJSON.
pub(super) fn is_geojson(object: &Value) -> bool {
    object["type"] == "FeatureCollection"
}

/// The map in the GeoJSON of [`export::geojson`](crate::export::geojson). Coordinates and costs are ignored.
pub(super) fn geojson(object: &Value) -> Result<TopologicalMap, ImportError> {
    let features = object["features"].as_array().ok_or_else(|| ImportError::no_map("features are missing"))?;
    let mut draft = Draft::default();
    for feature in features {
        let (kind, properties) = (&feature["geometry"]["type"], &feature["properties"]);
        let read = match kind.as_str() {
            Some("Point") => vertex(properties, &mut draft),
            Some("LineString") => line(properties, &mut draft),
            _ => None,
        };
        let id = &properties["id"];
        read.ok_or_else(|| ImportError::NoMap(format!("feature {id} is no vertex and no edge of a map")))?;
    }
    draft.finish()
}

fn vertex(properties: &Value, draft: &mut Draft) -> Option<()> {
    let (id, metadata) = (byte(&properties["id"])?, &properties["metadata"]);
    let radius_mm = (metadata["radius_m"].as_f64()? * 1000.0).round();
    if !(0.0..=f64::from(u16::MAX)).contains(&radius_mm) {
        return None;
    }
    let label = Vertex { radius_mm: radius_mm as u16, visits: u32::try_from(metadata["visits"].as_u64()?).ok()? };
    let name = metadata["name"].as_str().map(str::to_owned);
    let bearings = match &metadata["bearings_mrad"] {
        Value::Null => None,
        bearings => Some(numbers(bearings)?),
    };
    let has_ways = bearings.is_some();
    draft.add_vertex(id, label, bearings, name);
    if has_ways && !metadata["self_loop_ways"].is_null() {
        let (ways, frames) = (numbers(&metadata["self_loop_ways"])?, numbers(&metadata["self_loop_frames"])?);
        let end = |way: u16| Some(WayId { vertex: id, way: u8::try_from(way).ok()? });
        for (ways, frames) in ways.chunks_exact(2).zip(frames) {
            draft.join([end(ways[0])?, end(ways[1])?], Some(frames).filter(|&frames| frames > 0));
        }
    } else if metadata["has_self_loop"] == true {
        draft.add_edge(id, id);
    }
    Some(())
}

fn line(properties: &Value, draft: &mut Draft) -> Option<()> {
    let (start, end, metadata) = (byte(&properties["startid"])?, byte(&properties["endid"])?, &properties["metadata"]);
    match (byte(&metadata["start_way"]), byte(&metadata["end_way"])) {
        (Some(a), Some(b)) => {
            let frames = metadata["travel_frames"].as_u64().and_then(|frames| u16::try_from(frames).ok());
            draft.join([WayId { vertex: start, way: a }, WayId { vertex: end, way: b }], frames);
        }
        _ => draft.add_edge(start, end),
    }
    Some(())
}

fn byte(value: &Value) -> Option<u8> {
    u8::try_from(value.as_u64()?).ok()
}

fn numbers(value: &Value) -> Option<Vec<u16>> {
    value.as_array()?.iter().map(|number| u16::try_from(number.as_u64()?).ok()).collect()
}
