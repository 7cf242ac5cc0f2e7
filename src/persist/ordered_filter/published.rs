//! The published map in a snapshot: labels, ids, ways, path and probabilities.

use super::NOWHERE;
use super::hypothesis::{is_way, map_bytes, read_path};
use crate::filter::OrderedFilter;
use crate::filter::beam::Ranked as _;
use crate::map::{VertexId, VertexSet};
use crate::persist::snapshot::{Reader, SnapshotError, Writer};
use crate::place::Fingerprint;

/// Probability 1 in units of 2⁻¹⁶.
const ONE_Q16: u32 = 1 << 16;
/// Label, visits, id, probability.
const VERTEX_BYTES: usize = 2 + 4 + 1 + 4;

/// The largest size of the published map.
pub(super) const fn bytes(vertices: usize, darts: usize, places: usize) -> usize {
    1 + vertices * VERTEX_BYTES + 4 + 1 + vertices + map_bytes(vertices, darts) + 1 + places
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    pub(super) fn save_published(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        let (map, ids) = (&self.map, &self.vertex_ids);
        writer.u8(map.vertices().len() as u8)?;
        for vertex in map.vertices() {
            writer.u16(map.label_of(vertex).steps())?;
            writer.u32(map.visits(vertex))?;
            writer.u8(ids.ids[vertex].into())?;
            writer.u32(self.belief_q16[vertex])?;
        }
        writer.u32(self.map_probability_q16)?;
        writer.u8(ids.vertices_before)?;
        for before in VertexId::first(ids.vertices_before.into()) {
            writer.u8(ids.remapped[before].map_or(NOWHERE, u8::from))?;
        }
        self.darts.save(writer)?;
        writer.u8(self.at)?;
        writer.bytes(self.path.get(..self.record.len()).unwrap_or(&[]))
    }

    /// Reads the published map; `kept` replaces the one that is published.
    #[inline(never)]
    pub(super) fn read_published(
        &mut self,
        from: &mut Reader<'_>,
        len: usize,
        kept: bool,
    ) -> Result<(), SnapshotError> {
        let vertices = from.u8()?;
        if usize::from(vertices) > V {
            return Err(SnapshotError::Contents);
        }
        let mut used = VertexSet::EMPTY;
        if kept {
            self.map.clear();
            self.belief_q16.fill(0);
        }
        for vertex in VertexId::first(vertices.into()) {
            let label = Fingerprint::from_steps(from.u16()?).ok_or(SnapshotError::Contents)?;
            let (visits, id, belief_q16) = (from.u32()?, from.u8()?, from.u32()?);
            if id >= vertices || belief_q16 > 2 * ONE_Q16 {
                return Err(SnapshotError::Contents);
            }
            let id = VertexId::new(id).ok_or(SnapshotError::Contents)?;
            used.insert(id);
            if kept {
                self.map.add_known_vertex(label, visits).map_err(|_| SnapshotError::Contents)?;
                self.vertex_ids.ids[vertex] = id;
                self.belief_q16[vertex] = belief_q16;
            }
        }
        let map_probability_q16 = from.u32()?;
        let vertices_before = from.u8()?;
        let remapped = from.bytes(vertices_before.into())?;
        let is_id = |&id: &u8| id == NOWHERE || usize::from(id) < V;
        // Every id is used once.
        if used.len() != usize::from(vertices)
            || map_probability_q16 > ONE_Q16
            || usize::from(vertices_before) > V
            || !remapped.iter().all(is_id)
        {
            return Err(SnapshotError::Contents);
        }
        self.draft.clear();
        self.draft.map.read(from)?;
        let (at, path) = (from.u8()?, from.bytes(len)?);
        let darts = self.draft.map.darts();
        read_path(path, darts, &mut self.draft.path)?;
        if self.draft.map.vertices() != vertices || !is_way(at, darts) {
            return Err(SnapshotError::Contents);
        }
        if kept {
            self.map_probability_q16 = map_probability_q16;
            self.vertex_ids.vertices_before = vertices_before;
            for (before, &id) in VertexId::first(V).zip(remapped) {
                self.vertex_ids.remapped[before] = VertexId::new(id);
            }
            self.darts.clone_from(&self.draft.map);
            self.path.clone_from(&self.draft.path);
            self.at = at;
            self.add_edges();
            self.find_worst();
        }
        Ok(())
    }
}
