//! Maps from files: JSON, GeoJSON and GraphML of `export`, and snapshots of the reference robot; and a map as a snapshot, so
//! that a robot localises on it.
//!
//! ```
//! use toposlam_link::export;
//! use toposlam_link::import;
//! use toposlam_link::layout::Layout;
//! use toposlam_link::topology::{TopologicalMap, Vertex};
//!
//! let vertex = |radius_mm| Vertex { radius_mm, visits: 3 };
//! let map = TopologicalMap { vertices: vec![vertex(900), vertex(1200)], edges: vec![(0, 1)], ..Default::default() };
//! let mut layout = Layout::new();
//! layout.arrange(&map);
//! assert_eq!(import::json(&export::json(&map, &layout, None))?, map);
//! # Ok::<(), toposlam_link::import::ImportError>(())
//! ```

mod geojson;
mod graphml;

pub use graphml::graphml;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde_json::Value;
use toposlam::persist::snapshot::{Resume, SnapshotError};
use toposlam::persist::snapshot::{Snapshot, Writer};
use toposlam::reference::{self, DARTS, FILTER, MAPPER, RobotMapper, SEED, SNAPSHOT_BYTES, VERTICES};
use toposlam::wire::{Name, Names, Way, WayId};
use toposlam::{DartMap, Fingerprint, Map, WAYS_MAX};

use crate::topology::{self, TopologicalMap, Vertex};

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
    /// The text is not XML.
    Xml(roxmltree::Error),
    /// The text is not a map; the reason.
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
            Self::Xml(_) => f.write_str("not XML"),
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
            Self::Xml(error) => Some(error),
            Self::Snapshot(error) => Some(error),
            Self::NoMap(_) | Self::NoWays | Self::TooLarge => None,
        }
    }
}

impl ImportError {
    fn no_map(why: &str) -> Self {
        Self::NoMap(why.to_owned())
    }
}

/// Reads the JSON of [`export::json`](crate::export::json), or the GeoJSON of [`export::geojson`](crate::export::geojson). The
/// drawing in it is ignored.
///
/// # Errors
/// [`ImportError::Json`], or [`ImportError::NoMap`] when a field is missing or contradicts another one.
pub fn json(text: &str) -> Result<TopologicalMap, ImportError> {
    let object: Value = serde_json::from_str(text).map_err(ImportError::Json)?;
    if geojson::is_geojson(&object) {
        return geojson::geojson(&object);
    }
    let no_map = ImportError::no_map;
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
    let mut names = BTreeMap::new();
    for (vertex, name) in (0..).zip(object["vertices"].as_array().into_iter().flatten().map(|vertex| &vertex["name"])) {
        if !name.is_null() {
            names.insert(vertex, name.as_str().ok_or_else(|| no_map("a name is not a text"))?.to_owned());
        }
    }
    checked(TopologicalMap { vertices, edges, ways, names })
}

/// A map, if its vertices, edges, ways and names agree.
fn checked(map: TopologicalMap) -> Result<TopologicalMap, ImportError> {
    check(&map).map_err(ImportError::no_map)?;
    names(&map)?;
    Ok(map)
}

/// The names of a map, as a robot holds them.
fn names(map: &TopologicalMap) -> Result<Names<VERTICES>, ImportError> {
    let mut names = Names::new();
    for (&vertex, name) in &map.names {
        let of_vertex = |why: String| ImportError::NoMap(format!("the name `{name}` of vertex {vertex}: {why}"));
        let name = Name::new(name).map_err(|error| of_vertex(error.to_string()))?;
        names.set(vertex, name).map_err(|error| of_vertex(error.to_string()))?;
    }
    Ok(names)
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

/// A map that is read vertex by vertex and edge by edge, in any order.
#[derive(Default)]
struct Draft {
    vertices: BTreeMap<u8, Vertex>,
    bearings: BTreeMap<u8, Vec<u16>>,
    names: BTreeMap<u8, String>,
    edges: BTreeSet<(u8, u8)>,
    /// Each edge by its first way; the two directions of an edge are one.
    joined: BTreeMap<WayId, (WayId, Option<u16>)>,
    /// Whether a vertex, or a way with two edges, was read twice.
    contradicts: bool,
}

impl Draft {
    fn add_vertex(&mut self, id: u8, label: Vertex, bearings_mrad: Option<Vec<u16>>, name: Option<String>) {
        self.contradicts |= self.vertices.insert(id, label).is_some();
        self.bearings.extend(bearings_mrad.map(|bearings| (id, bearings)));
        self.names.extend(name.filter(|name| !name.is_empty()).map(|name| (id, name)));
    }

    fn add_edge(&mut self, a: u8, b: u8) {
        self.edges.insert((a.min(b), a.max(b)));
    }

    fn join(&mut self, ends: [WayId; 2], travel_frames: Option<u16>) {
        self.add_edge(ends[0].vertex, ends[1].vertex);
        for (from, to) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            let before = self.joined.insert(from, (to, travel_frames));
            self.contradicts |= before.is_some_and(|before| before != (to, travel_frames));
        }
    }

    fn finish(mut self) -> Result<TopologicalMap, ImportError> {
        let count = self.vertices.len();
        if self.contradicts || !self.vertices.keys().copied().eq((0..=u8::MAX).take(count)) {
            return Err(ImportError::no_map("the vertices are not 0, 1, … once each, or a way leads to two ends"));
        }
        let has_ways = !self.bearings.is_empty();
        if !has_ways && !self.joined.is_empty() {
            return Err(ImportError::no_map("the edges have ways, but bearings_mrad is missing: export the map again"));
        }
        let mut ways: Vec<Vec<Way>> = Vec::new();
        for vertex in (0..=u8::MAX).take(if has_ways { count } else { 0 }) {
            let bearings = self.bearings.get(&vertex).into_iter().flatten();
            let way = |(way, &bearing_mrad): (u8, &u16)| {
                let end = self.joined.remove(&WayId { vertex, way });
                let (leads_to, travel_frames) = end.map_or((None, None), |(to, frames)| (Some(to), frames));
                Way { bearing_mrad, leads_to, travel_frames }
            };
            ways.push((0..).zip(bearings).map(way).collect());
        }
        if !self.joined.is_empty() {
            return Err(ImportError::no_map("an edge has a way that its vertex does not have"));
        }
        let Self { vertices, edges, names, .. } = self;
        checked(TopologicalMap {
            vertices: vertices.into_values().collect(),
            edges: edges.into_iter().collect(),
            ways,
            names,
        })
    }
}

/// The map of a snapshot of the reference robot or of its mapper.
///
/// # Errors
/// [`ImportError::Snapshot`] for other bytes.
pub fn snapshot(bytes: &[u8]) -> Result<TopologicalMap, ImportError> {
    let mut mapper = mapper();
    mapper.restore(bytes, Resume::AtUnknownVertex).map_err(ImportError::Snapshot)?;
    let mut map = TopologicalMap::of(mapper.filter());
    let mut names = Names::<VERTICES>::new();
    let read = Snapshot::open(bytes).and_then(|snapshot| names.restore(&snapshot, map.vertices.len()));
    read.map_err(ImportError::Snapshot)?;
    map.names = topology::names(&names);
    Ok(map)
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
    let mut writer = Writer::new(&mut buffer).map_err(ImportError::Snapshot)?;
    let names = names(map)?;
    if !map.names.is_empty() {
        names.save(&mut writer).map_err(ImportError::Snapshot)?;
    }
    mapper.save(&mut writer).map_err(ImportError::Snapshot)?;
    let length = writer.finish().map_err(ImportError::Snapshot)?;
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
    use crate::layout::Layout;

    fn samples() -> [(TopologicalMap, Layout); 2] {
        [sample::map(), sample::with_ways()].map(|(mut map, layout)| {
            map.names = BTreeMap::from([(1, "a \"<&>\\ b".to_owned()), (0, "Küche".to_owned())]);
            (map, layout)
        })
    }

    #[test]
    fn every_export_with_ways_and_names_is_read_back() {
        for (map, layout) in samples() {
            assert_eq!(json(&export::json(&map, &layout, Some(0))).unwrap(), map);
            assert_eq!(json(&export::geojson(&map, &layout, Some(0), 5.0, Some(30.0))).unwrap(), map);
            assert_eq!(graphml(&export::graphml(&map, &layout, Some(0))).unwrap(), map);
        }
    }

    #[test]
    fn graphml_is_read_after_another_program_has_numbered_its_keys() {
        let (map, layout) = sample::with_ways();
        let mut text = export::graphml(&map, &layout, None);
        for (number, key) in
            ["radius_mm", "visits", "bearings_mrad", "source_way", "target_way", "travel_frames"].iter().enumerate()
        {
            text = text.replace(&format!("id=\"{key}\""), &format!("id=\"d{number}\""));
            text = text.replace(&format!("key=\"{key}\""), &format!("key=\"d{number}\""));
        }
        assert_eq!(graphml(&text).unwrap(), map);
    }

    #[test]
    fn graphml_and_geojson_that_contradict_themselves_are_refused() {
        let (map, layout) = sample::with_ways();
        let good = export::graphml(&map, &layout, None);
        for (from, to) in [
            ("node id=\"1\"", "node id=\"2\""),
            ("<data key=\"radius_mm\">900</data>", ""),
            ("<data key=\"source_way\">0</data>", "<data key=\"source_way\">6</data>"),
            ("<data key=\"source_way\">0</data>", "<data key=\"source_way\">1</data>"),
            ("target=\"1\"", "target=\"x\""),
            ("\"bearings_mrad\">0 ", "\"bearings_mrad\">6283 "),
        ] {
            assert!(good.contains(from), "{from}: {good}");
            assert!(matches!(graphml(&good.replacen(from, to, 1)), Err(ImportError::NoMap(_))), "{from}");
        }
        assert!(matches!(graphml("<svg/>"), Err(ImportError::NoMap(_))));
        assert!(matches!(graphml("<svg"), Err(ImportError::Xml(_))));
        let good: Value = serde_json::from_str(&export::geojson(&map, &layout, None, 5.0, None)).unwrap();
        for (pointer, value) in [
            ("/features/0/properties/id", Value::from(1)),
            ("/features/0/properties/metadata/radius_m", Value::Null),
            ("/features/2/properties/metadata/start_way", Value::from(1)),
            ("/features/2/properties/startid", Value::from(7)),
            ("/features", Value::Null),
        ] {
            let mut object = good.clone();
            *object.pointer_mut(pointer).unwrap() = value;
            assert!(matches!(json(&object.to_string()), Err(ImportError::NoMap(_))), "{pointer}");
        }
    }

    #[test]
    fn names_that_a_robot_refuses_are_refused_with_the_reason() {
        for (names, why) in [
            (vec![(0, "a name of 17 byte")], "16 bytes"),
            (vec![(0, "3")], "number"),
            (vec![(0, "hall"), (1, "hall")], "another vertex"),
        ] {
            let (mut map, layout) = sample::with_ways();
            map.names = names.into_iter().map(|(vertex, name)| (vertex, name.to_owned())).collect();
            let error = json(&export::json(&map, &layout, None)).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
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
        let [_, (map, _)] = samples();
        let restored = snapshot(&known_map(&map).unwrap()).unwrap();
        assert_eq!((&restored.edges, restored.ways.len()), (&map.edges, 2));
        assert_eq!(restored.names, map.names);
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
