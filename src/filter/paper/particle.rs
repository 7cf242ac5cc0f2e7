//! One particle: a map, the vertex of the robot, and the weight (Section III.A).

use crate::filter::PaperFactors;
use crate::map::{Map, VertexId};
use crate::place::Fingerprint;

/// One hypothesis: a map and the vertex of the robot.
#[derive(Clone, Copy, Debug)]
pub struct Particle<const V: usize> {
    /// The map.
    pub map: Map<V>,
    /// The vertex of the robot.
    pub at: VertexId,
    /// How many of the N draws chose this particle.
    pub multiplicity: u8,
    /// The index of the particle before the last observation from which this one was predicted.
    pub parent: u8,
    /// The distance of Eq. 2 in millimetres; `u16::MAX` when it is infinite.
    pub consistency_mm: u16,
    /// The factors of its weight.
    pub factors: PaperFactors,
}

impl<const V: usize> Particle<V> {
    pub(super) const NONE: Self = Self {
        map: Map::new(),
        at: VertexId::FIRST,
        multiplicity: 0,
        parent: 0,
        consistency_mm: 0,
        factors: PaperFactors::ONE,
    };
}

/// Predicts that the robot of a particle goes to a vertex, which may be a new one after the last: adds the edge if it is
/// missing, and the observation to the label of the vertex.
pub(super) fn predict<const V: usize>(
    predicted: &mut Map<V>,
    parent: &Particle<V>,
    vertex: VertexId,
    observation: Fingerprint,
) {
    *predicted = parent.map;
    if parent.map.contains(vertex) {
        predicted.observe(vertex, observation);
    } else {
        // The pool has no candidate for a vertex that a full map has no room for.
        let _ = predicted.add_vertex(observation);
    }
    if parent.map.contains(parent.at) {
        predicted.add_edge(parent.at, vertex);
    }
}
