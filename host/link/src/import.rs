//! Maps from files: the JSON of `export`, and snapshots of the reference robot; and a map as a snapshot, so that a robot
//! localises on it.
//!
//! ```
//! use toposlam_link::export;
//! use toposlam_link::import;
//! use toposlam_link::layout::Layout;
//! use toposlam_link::topology::{TopologicalMap, Vertex};
//!
//! let vertex = |radius_mm| Vertex { radius_mm, visits: 3 };
//! let map = TopologicalMap { vertices: vec![vertex(900), vertex(1200)], edges: vec![(0, 1)], ways: Vec::new() };
//! let mut layout = Layout::new();
//! layout.arrange(&map);
//! assert_eq!(import::json(&export::json(&map, &layout, None))?, map);
//! # Ok::<(), toposlam_link::import::ImportError>(())
//! ```

use std::fmt;

use serde_json::Value;
use toposlam::persist::snapshot::{Resume, SnapshotError};
use toposlam::reference::{self, DARTS, FILTER, MAPPER, RobotMapper, SEED, SNAPSHOT_BYTES, VERTICES};
use toposlam::wire::{Way, WayId};
use toposlam::{DartMap, Fingerprint, Map, WAYS_MAX};

use crate::topology::{TopologicalMap, Vertex};

/// A whole turn, in the units of [`DartMap::add_way`] and in milliradians.
const TURN: u32 = 1 << 16;
const TURN_MRAD: u32 = 6283;
/// More visits do not make a label of a known map more certain.
const VISITS_MAX: u32 = 512;

/// Why a map was not read or not made a snapshot.
#[derive(Debug)]
pub enum ImportError {
    /// The text is not JSON.
    Json(serde_json::Error),
    /// The JSON is not a map; the text says why.
    NoMap(String),
    /// The bytes are not a snapshot of the reference robot.
    Snapshot(SnapshotError),
    /// The map has no ways, which a robot needs to localise on it.
    NoWays,
    /// The map has more vertices or ways than a robot has room for.
    TooLarge,
}

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Json(_) => f.write_str("not JSON"),
            Self::NoMap(why) => write!(f, "not a map of toposlam: {why}"),
            Self::Snapshot(_) => f.write_str("not a snapshot of the reference robot"),
            Self::NoWays => f.write_str("the map has no ways; only the maps of the ordered filter have them"),
            Self::TooLarge => {
                write!(f, "a robot's map has at most {VERTICES} vertices, {DARTS} ways, and {WAYS_MAX} at a vertex")
            }
        }
    }
}

impl std::error::Error for ImportError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Json(error) => Some(error),
            Self::Snapshot(error) => Some(error),
            Self::NoMap(_) | Self::NoWays | Self::TooLarge => None,
        }
    }
}

/// Reads the JSON of [`export::json`](crate::export::json). The drawing in it is ignored.
///
/// # Errors
/// [`ImportError::Json`], or [`ImportError::NoMap`] when a field is missing or contradicts another one.
pub fn json(text: &str) -> Result<TopologicalMap, ImportError> {
    let object: Value = serde_json::from_str(text).map_err(ImportError::Json)?;
    let no_map = |why: &str| ImportError::NoMap(why.to_owned());
    if object["format"] != "toposlam-map" || object["version"] != 1 {
        return Err(no_map("format is not toposlam-map, version 1"));
    }
    let vertices = object["vertices"].as_array().ok_or_else(|| no_map("vertices are missing"))?;
    let vertex = |(number, value): (usize, &Value)| {
        let radius_mm = u16::try_from(value["radius_mm"].as_u64()?).ok()?;
        let visits = u32::try_from(value["visits"].as_u64()?).ok()?;
        (value["vertex"] == number).then_some(Vertex { radius_mm, visits })
    };
    let vertices: Option<Vec<Vertex>> = vertices.iter().enumerate().map(vertex).collect();
    let vertices = vertices.ok_or_else(|| no_map("a vertex is invalid"))?;
    let edges: Vec<(u8, u8)> =
        serde_json::from_value(object["edges"].clone()).map_err(|error| ImportError::NoMap(error.to_string()))?;
    let ways: Vec<Vec<Way>> = match &object["ways"] {
        Value::Null => Vec::new(),
        ways => serde_json::from_value(ways.clone()).map_err(|error| ImportError::NoMap(error.to_string()))?,
    };
    let map = TopologicalMap { vertices, edges, ways };
    check(&map).map_err(no_map)?;
    Ok(map)
}

/// Whether vertices, edges and ways of a map agree.
fn check(map: &TopologicalMap) -> Result<(), &'static str> {
    let count = map.vertices.len();
    if count == 0 || count > VERTICES {
        return Err("there are no vertices, or more than 64");
    }
    if map.edges.iter().any(|&(a, b)| a > b || usize::from(b) >= count) {
        return Err("an edge is invalid");
    }
    if map.ways.is_empty() {
        return Ok(());
    }
    let in_order = |ways: &Vec<Way>| ways.is_sorted_by_key(|way| way.bearing_mrad);
    if map.ways.len() != count || !map.ways.iter().all(in_order) {
        return Err("the ways of a vertex are missing, or not in order");
    }
    let is_mutual = |(id, way): (WayId, &Way)| {
        let end = |end: WayId| end != id && map.way(end).is_some_and(|other| other.leads_to == Some(id));
        u32::from(way.bearing_mrad) < TURN_MRAD && way.leads_to.is_none_or(end)
    };
    if map.all_ways().all(is_mutual) { Ok(()) } else { Err("an edge has one end, or a bearing is not below 6283") }
}

/// The map of a snapshot of the reference robot or of its mapper.
///
/// # Errors
/// [`ImportError::Snapshot`] for other bytes.
pub fn snapshot(bytes: &[u8]) -> Result<TopologicalMap, ImportError> {
    let mut mapper = mapper();
    mapper.restore(bytes, Resume::AtUnknownVertex).map_err(ImportError::Snapshot)?;
    Ok(TopologicalMap::of(mapper.filter()))
}

/// A snapshot with which the reference robot localises on a map, from any vertex: `toposlam command LINE restore FILE`.
///
/// # Errors
/// [`ImportError::NoWays`] and [`ImportError::TooLarge`].
pub fn known_map(map: &TopologicalMap) -> Result<Vec<u8>, ImportError> {
    if map.ways.is_empty() {
        return Err(ImportError::NoWays);
    }
    let mut labels = Map::<VERTICES>::new();
    let mut ids = Vec::new();
    for vertex in &map.vertices {
        let label = Fingerprint::from_radius_mm(vertex.radius_mm)
            .map_err(|_| ImportError::NoMap(format!("no place has a radius of {} mm", vertex.radius_mm)))?;
        let id = labels.add_vertex(label).map_err(|_| ImportError::TooLarge)?;
        (1..vertex.visits.clamp(1, VISITS_MAX)).for_each(|_| labels.observe(id, label));
        ids.push(id);
    }
    for &(a, b) in &map.edges {
        labels.add_edge(ids[usize::from(a)], ids[usize::from(b)]);
    }
    let darts = darts(map).ok_or(ImportError::TooLarge)?;
    let mut mapper = mapper();
    let filter: &mut reference::Filter = mapper.filter_mut();
    filter.start_with_map(FILTER, SEED, &labels, &darts).map_err(|error| ImportError::NoMap(error.to_string()))?;
    filter.set_localise_only(true);
    let mut buffer = vec![0; SNAPSHOT_BYTES];
    let length = mapper.snapshot(&mut buffer).map_err(ImportError::Snapshot)?;
    buffer.truncate(length);
    Ok(buffer)
}

/// The ways of a map; `None` without room.
fn darts(map: &TopologicalMap) -> Option<DartMap<VERTICES, DARTS>> {
    let mut darts = DartMap::EMPTY;
    let mut numbers: Vec<Vec<u8>> = Vec::new();
    for ways in &map.ways {
        let vertex = darts.add_vertex()?;
        let bearing = |way: &Way| (u32::from(way.bearing_mrad) * TURN).div_ceil(TURN_MRAD) as u16;
        numbers.push(ways.iter().map(|way| darts.add_way(vertex, bearing(way))).collect::<Option<_>>()?);
    }
    for edge in map.way_edges() {
        let [a, b] = edge.ends.map(|end| numbers[usize::from(end.vertex)][usize::from(end.way)]);
        darts.join(a, b);
        if let Some(frames) = edge.travel_frames {
            // In units of 2⁻¹².
            darts.time(a, (f64::from(frames.max(1)).ln() * 4096.0).round() as u16);
        }
    }
    Some(darts)
}

fn mapper() -> Box<RobotMapper> {
    let mut mapper = Box::new(RobotMapper::new());
    // The settings of the reference robot are valid.
    let started = mapper.start(&MAPPER);
    debug_assert!(started.is_ok());
    mapper
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export;
    use crate::export::sample;

    #[test]
    fn json_of_any_export_is_read_back() {
        for (map, layout) in [sample::map(), sample::with_ways()] {
            assert_eq!(json(&export::json(&map, &layout, Some(0))).unwrap(), map);
        }
    }

    #[test]
    fn json_that_contradicts_itself_is_refused() {
        let (map, layout) = sample::with_ways();
        let good: Value = serde_json::from_str(&export::json(&map, &layout, None)).unwrap();
        let refused = |pointer: &str, value: Value| {
            let mut object = good.clone();
            *object.pointer_mut(pointer).unwrap() = value;
            matches!(json(&object.to_string()), Err(ImportError::NoMap(_)))
        };
        assert!(refused("/version", 2.into()));
        assert!(refused("/vertices/0/vertex", 1.into()));
        assert!(refused("/edges/1/1", 2.into()));
        assert!(refused("/ways/0/0/bearing_mrad", 6283.into()));
        assert!(refused("/ways/0/0/leads_to", serde_json::json!({"vertex": 1, "way": 0})));
        assert!(refused("/vertices", Value::Array(Vec::new())));
        assert!(matches!(json("map"), Err(ImportError::Json(_))));
    }

    #[test]
    fn a_known_map_is_the_map_of_its_snapshot() {
        let (map, _) = sample::with_ways();
        let restored = snapshot(&known_map(&map).unwrap()).unwrap();
        assert_eq!((&restored.edges, restored.ways.len()), (&map.edges, 2));
        for ((_, way), (_, expected)) in restored.all_ways().zip(map.all_ways()) {
            assert_eq!(way.leads_to, expected.leads_to);
            assert!(way.bearing_mrad.abs_diff(expected.bearing_mrad) <= 1);
            let travel = way.travel_frames.zip(expected.travel_frames);
            assert!(travel.is_none_or(|(frames, expected)| frames.abs_diff(expected) <= 1));
            assert_eq!(way.travel_frames.is_some(), expected.travel_frames.is_some());
        }
        assert!(matches!(known_map(&sample::map().0), Err(ImportError::NoWays)));
        assert!(matches!(snapshot(b"no snapshot"), Err(ImportError::Snapshot(_))));
    }
}
