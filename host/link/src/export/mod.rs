//! Export of a map to GraphML, DOT, GeoJSON, JSON and SVG, each as a string.
//!
//! Each function takes a map, its drawing ([`Layout`](crate::layout::Layout)), and the robot's vertex if it is known. The
//! positions are only a drawing: a topological map has no coordinates.
//! `docs/export.md` describes the formats.
//!
//! ```
//! use toposlam_link::export;
//! use toposlam_link::layout::Layout;
//! use toposlam_link::topology::{TopologicalMap, Vertex};
//!
//! let place = |radius_mm| Vertex { radius_mm, visits: 3 };
//! let map = TopologicalMap { vertices: vec![place(900), place(1200)], edges: vec![(0, 1)], ..Default::default() };
//! let mut layout = Layout::new();
//! layout.arrange(&map);
//! let text = export::json(&map, &layout, Some(1));
//! assert!(text.contains("\"radius_mm\": 1200"));
//! ```

mod dot;
mod geojson;
mod graphml;
mod json;
pub mod marks;
mod svg;

pub use self::{dot::dot, geojson::geojson, graphml::graphml, json::json, svg::svg};

#[cfg(test)]
pub(crate) mod sample {
    use toposlam::wire::{Way, WayId};

    use crate::layout::Layout;
    use crate::topology::{TopologicalMap, Vertex};

    /// Two parallel edges, a loop and a frontier.
    pub(crate) fn with_ways() -> (TopologicalMap, Layout) {
        let way = |bearing_mrad, end: Option<(u8, u8)>, travel_frames| Way {
            bearing_mrad,
            leads_to: end.map(|(vertex, way)| WayId { vertex, way }),
            travel_frames,
        };
        let hall = vec![
            way(0, Some((1, 1)), Some(54)),
            way(1500, Some((1, 0)), None),
            way(3000, Some((0, 3)), Some(90)),
            way(4000, Some((0, 2)), Some(90)),
            way(5000, None, None),
        ];
        let corner = vec![way(100, Some((0, 1)), None), way(1600, Some((0, 0)), Some(54))];
        let vertices = [900, 1200].map(|radius_mm| Vertex { radius_mm, visits: 7 }).to_vec();
        let map =
            TopologicalMap { vertices, edges: vec![(0, 0), (0, 1)], ways: vec![hall, corner], ..Default::default() };
        let mut layout = Layout::new();
        layout.arrange(&map);
        (map, layout)
    }

    /// A triangle with a tail that ends in a self-loop.
    pub(crate) fn map() -> (TopologicalMap, Layout) {
        let radii_mm = [900, 1200, 640, 480];
        let vertices = radii_mm.map(|radius_mm| Vertex { radius_mm, visits: 7 }).to_vec();
        let map =
            TopologicalMap { vertices, edges: vec![(0, 1), (0, 2), (1, 2), (2, 3), (3, 3)], ..Default::default() };
        let mut layout = Layout::new();
        layout.arrange(&map);
        (map, layout)
    }
}
