//! The map, as it is at one time.

use pyo3::prelude::*;
use toposlam_link::export;
use toposlam_link::layout::Layout;
use toposlam_link::topology::TopologicalMap;

use crate::number::invalid;

/// The length of an edge in GeoJSON, in metres, as `toposlam export` has it.
const EDGE_M: f64 = 5.0;

/// A vertex of a map.
///
/// radius_mm: mean radius of its places.
/// visits: number of places in the mean.
#[pyclass(frozen, eq, get_all, module = "toposlam")]
#[derive(Clone, PartialEq)]
pub(crate) struct Vertex {
    radius_mm: u16,
    visits: u32,
}

#[pymethods]
impl Vertex {
    fn __repr__(&self) -> String {
        format!("<Vertex of radius {} mm, {} visits>", self.radius_mm, self.visits)
    }
}

/// A way of a vertex.
///
/// bearing_mrad: mean bearing; only differences between the ways of one vertex have a meaning.
/// leads_to: vertex and way at the other end of the edge, or None for a frontier, a way that nobody has driven.
/// travel_frames: mean travel time of the edge in ring frames, if it is known.
#[pyclass(frozen, eq, get_all, module = "toposlam")]
#[derive(Clone, PartialEq)]
pub(crate) struct Way {
    bearing_mrad: u16,
    leads_to: Option<(u8, u8)>,
    travel_frames: Option<u16>,
}

#[pymethods]
impl Way {
    fn __repr__(&self) -> String {
        let end =
            self.leads_to.map_or("a frontier".to_owned(), |(vertex, way)| format!("to way {way} of vertex {vertex}"));
        format!("<Way at {} mrad, {end}>", self.bearing_mrad)
    }
}

/// A copy of the best map of a filter. A notebook shows its drawing.
#[pyclass(frozen, eq, module = "toposlam")]
#[derive(Clone, PartialEq)]
pub(crate) struct Map {
    topology: TopologicalMap,
    /// The vertex of the robot, if any place was observed.
    location: Option<u8>,
}

impl Map {
    pub(crate) fn new(topology: TopologicalMap, location: Option<u8>) -> Self {
        Self { topology, location }
    }
}

#[pymethods]
impl Map {
    /// Vertex 0, 1, …
    #[getter]
    fn vertices(&self) -> Vec<Vertex> {
        let vertices = self.topology.vertices.iter();
        vertices.map(|vertex| Vertex { radius_mm: vertex.radius_mm, visits: vertex.visits }).collect()
    }

    /// Each pair of vertices that an edge joins, the smaller first; equal ends are a loop.
    #[getter]
    fn edges(&self) -> Vec<(u8, u8)> {
        self.topology.edges.clone()
    }

    /// The ways of each vertex in counter-clockwise order; empty if the filter knows edges only.
    #[getter]
    fn ways(&self) -> Vec<Vec<Way>> {
        let way = |way: &toposlam::wire::Way| Way {
            bearing_mrad: way.bearing_mrad,
            leads_to: way.leads_to.map(|end| (end.vertex, end.way)),
            travel_frames: way.travel_frames,
        };
        self.topology.ways.iter().map(|ways| ways.iter().map(way).collect()).collect()
    }

    /// Vertex and way of each frontier, a way that nobody has driven.
    #[getter]
    fn frontiers(&self) -> Vec<(u8, u8)> {
        self.topology.frontiers().map(|frontier| (frontier.vertex, frontier.way)).collect()
    }

    /// The vertex of the robot, or None before the first place.
    #[getter]
    fn location(&self) -> Option<u8> {
        self.location
    }

    /// The digest of the map, as the robot sends it (docs/wire.md).
    #[getter]
    fn digest(&self) -> u32 {
        self.topology.digest()
    }

    /// The map as text for other programs: "dot", "geojson", "graphml", "json" or "svg" (docs/export.md).
    fn export(&self, format: &str) -> PyResult<String> {
        let Self { topology, location } = self;
        let mut layout = Layout::new();
        layout.arrange(topology);
        match format {
            "dot" => Ok(export::dot(topology, &layout, *location)),
            "geojson" => Ok(export::geojson(topology, &layout, *location, EDGE_M, None)),
            "graphml" => Ok(export::graphml(topology, &layout, *location)),
            "json" => Ok(export::json(topology, &layout, *location)),
            "svg" => Ok(export::svg(topology, &layout, *location)),
            _ => Err(invalid(format!("format is {format:?}, but must be one of dot, geojson, graphml, json, svg"))),
        }
    }

    /// The drawing that a notebook shows.
    fn _repr_svg_(&self) -> PyResult<String> {
        self.export("svg")
    }

    fn __repr__(&self) -> String {
        format!("<Map of {} vertices and {} edges>", self.topology.vertices.len(), self.topology.all_edges().len())
    }
}
