//! One place on a robot's drive, and what its filter made of it.

use toposlam::Update;
use toposlam::place::Place;

/// What one place brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The place as the detector saw it.
    pub place: Place,
    /// What the filter made of it.
    pub update: Update,
    /// How many vertices the best map has now.
    pub vertices: u8,
    /// How many edges the best map has now.
    pub edges: usize,
}

impl std::fmt::Display for Step {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { place, update, vertices, edges } = self;
        write!(
            f,
            "place {:4}  frame {:6}  radius {:4} mm  vertex {:2}{}  map of {vertices:2} vertices, {edges:2} edges, {} mm",
            update.place_index,
            place.frame_index,
            place.fingerprint.radius_mm(),
            update.vertex,
            if update.is_new { " new" } else { "    " },
            update.consistency_mm,
        )
    }
}
