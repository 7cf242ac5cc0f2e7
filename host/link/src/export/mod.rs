//! Export of a map to GraphML, DOT, GeoJSON, JSON and SVG, each as a string.
//!
//! Each function takes a map, the position of each vertex in a drawing ([`Layout`](crate::layout::Layout)), and the
//! robot's vertex if it is known. The positions are only a drawing: a topological map has no coordinates.
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
//! let text = export::json(&map, layout.points(), Some(1));
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
    use crate::layout::{Layout, Point};
    use crate::topology::{TopologicalMap, Vertex};

    /// A triangle with a tail that ends in a self-loop.
    pub(crate) fn map() -> (TopologicalMap, Vec<Point>) {
        let radii_mm = [900, 1200, 640, 480];
        let vertices = radii_mm.map(|radius_mm| Vertex { radius_mm, visits: 7 }).to_vec();
        let map = TopologicalMap { vertices, edges: vec![(0, 1), (0, 2), (1, 2), (2, 3), (3, 3)], ways: Vec::new() };
        let mut layout = Layout::new();
        layout.arrange(&map);
        let points = layout.points().to_vec();
        (map, points)
    }
}
