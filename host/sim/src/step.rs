//! A detected place and the filter's update for it.

use toposlam::Update;
use toposlam::place::Place;

use crate::world::ReportedHints;

/// One detected place and its effect on the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The place that the detector reported.
    pub place: Place,
    /// The hints of the drive.
    pub reported: ReportedHints,
    /// The filter's update for the place.
    pub update: Update,
    /// Whether the best map is uncertain after the update ([`toposlam::Filter::is_uncertain`]).
    pub is_uncertain: bool,
    /// Number of vertices of the best map after the update.
    pub vertices: u8,
    /// Number of edges of the best map after the update.
    pub edges: usize,
}

impl std::fmt::Display for Step {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { place, update, is_uncertain, vertices, edges, .. } = self;
        write!(
            f,
            "place {:4}  frame {:6}  radius {:4} mm  vertex {:2}{}  map of {vertices:2} vertices, {edges:2} edges, {} mm{}",
            update.place_index,
            place.frame_index,
            place.fingerprint.radius_mm(),
            update.vertex,
            if update.is_new { " new" } else { "    " },
            update.consistency_mm,
            if *is_uncertain { ", uncertain" } else { "" },
        )
    }
}
