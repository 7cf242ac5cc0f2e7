//! The parts of a snapshot: observations, statistics, edges, paths, and the last published result.

use crate::filter::RobustFilter;
use crate::filter::robust::confidence::Trials;
use crate::filter::robust::history::{ObservationHistory, PackedObservation};
use crate::filter::robust::statistics::{DECAY_VISITS, VertexStatistics};
use crate::map::{Map, VertexId};
use crate::map::{PerVertex, VertexSet32};
use crate::persist::snapshot::{Reader, SnapshotError, Writer};
use crate::place::Fingerprint;

/// No vertex.
pub(super) const NOWHERE: u8 = u8::MAX;

/// Two floats, two counts, seven degrees.
pub(super) const STATISTICS_BYTES: usize = 4 + 4 + 2 + 2 + 7;

/// Probability 1 in units of 2⁻¹⁶.
const ONE_Q16: u32 = 1 << 16;

/// The most marginalised visits of a vertex: each vertex decays, and all may have been merged into one. The history may contain as
/// many.
const MOST_VISITS: u16 = 32 * DECAY_VISITS;

/// Bound of a mean label: the largest label plus the rounding error of the mean.
const MOST_MEAN: f32 = Fingerprint::MAX.steps() as f32 + 1.0;

/// Upper bound of the sum of squared distances of the labels, in steps².
const MOST_SCATTER: f32 = 1e12;

/// Bytes of the neighbours of one vertex.
pub(super) const fn row_bytes(vertices: usize) -> usize {
    if vertices <= 16 { 2 } else { 4 }
}

/// Bytes of a path: two places per byte while the ids fit 4 bits.
pub(super) const fn path_bytes(vertices: usize, places: usize) -> usize {
    if vertices <= 16 { places.div_ceil(2) } else { places }
}

pub(super) fn save_row<const V: usize>(writer: &mut Writer<'_>, row: VertexSet32) -> Result<(), SnapshotError> {
    if row_bytes(V) == 2 { writer.u16(row.bits() as u16) } else { writer.u32(row.bits()) }
}

/// Reads the neighbours of a vertex of a map with `vertices` vertices.
#[inline(never)]
pub(super) fn read_row<const V: usize>(from: &mut Reader<'_>, vertices: u8) -> Result<VertexSet32, SnapshotError> {
    let row = VertexSet32::from_bits(if row_bytes(V) == 2 { from.u16()?.into() } else { from.u32()? });
    if (row - VertexSet32::first(vertices.into())).is_empty() { Ok(row) } else { Err(SnapshotError::Contents) }
}

/// Checks that the adjacency matrix is symmetric.
#[inline(never)]
pub(super) fn check_symmetry<const V: usize>(neighbours: &PerVertex<VertexSet32, V>) -> Result<(), SnapshotError> {
    let is_symmetric = neighbours.iter().all(|(from, set)| set.iter().all(|to| neighbours[to].contains(from)));
    if is_symmetric { Ok(()) } else { Err(SnapshotError::Contents) }
}

pub(super) fn save_path<const V: usize>(writer: &mut Writer<'_>, path: &[VertexId]) -> Result<(), SnapshotError> {
    if path_bytes(V, 2) == 2 {
        return path.iter().try_for_each(|&vertex| writer.u8(vertex.into()));
    }
    for places in path.chunks(2) {
        writer.u8(places.iter().rev().fold(0, |packed, &vertex| packed << 4 | u8::from(vertex) & 15))?;
    }
    Ok(())
}

/// Reads a path through a map with `vertices` vertices, place by place.
#[inline(never)]
pub(super) fn read_path<const V: usize>(
    from: &mut Reader<'_>,
    places: usize,
    vertices: u8,
    mut take: impl FnMut(usize, VertexId),
) -> Result<(), SnapshotError> {
    let packed = from.bytes(path_bytes(V, places))?;
    let in_byte = if path_bytes(V, 2) == 1 { 2 } else { 1 };
    for index in 0..places {
        let byte = packed.get(index / in_byte).copied().unwrap_or(0);
        let vertex = match (in_byte, index % 2) {
            (1, _) => byte,
            (_, 0) => byte & 15,
            _ => byte >> 4,
        };
        let vertex = VertexId::new(vertex).filter(|_| vertex < vertices).ok_or(SnapshotError::Contents)?;
        take(index, vertex);
    }
    Ok(())
}

/// Checks that a float is finite and within bounds.
#[inline(never)]
pub(super) fn bounded(value: f32, least: f32, most: f32) -> Result<f32, SnapshotError> {
    if value >= least && value <= most { Ok(value) } else { Err(SnapshotError::Contents) }
}

impl VertexStatistics {
    pub(super) fn save(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.f32(self.mean)?;
        writer.f32(self.scatter)?;
        writer.u16(self.visits)?;
        writer.u16(self.exits)?;
        writer.bytes(&self.degrees)
    }

    pub(super) fn read(from: &mut Reader<'_>) -> Result<Self, SnapshotError> {
        let mut statistics = Self {
            mean: bounded(from.f32()?, -1.0, MOST_MEAN)?,
            scatter: bounded(from.f32()?, 0.0, MOST_SCATTER)?,
            visits: from.u16()?,
            exits: from.u16()?,
            ..Self::NONE
        };
        let degrees = from.bytes(statistics.degrees.len())?;
        statistics.degrees.iter_mut().zip(degrees).for_each(|(to, &count)| *to = count);
        // A vertex is left at most as often as it is reached.
        if statistics.visits > 2 * MOST_VISITS
            || statistics.exits > statistics.visits
            || statistics.visits == 0 && statistics != Self::NONE
        {
            return Err(SnapshotError::Contents);
        }
        Ok(statistics)
    }
}

impl<const T: usize> ObservationHistory<T> {
    pub(super) fn save(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u16(self.len as u16)?;
        for (&steps, &hints) in self.steps.iter().zip(&self.hints).take(self.len) {
            writer.u16(steps)?;
            writer.u8(hints)?;
        }
        Ok(())
    }

    /// Reads the places; stores them if `kept`.
    pub(super) fn read(&mut self, from: &mut Reader<'_>, len: usize, kept: bool) -> Result<(), SnapshotError> {
        for index in 0..len {
            let (steps, hints) = (from.u16()?, from.u8()?);
            if Fingerprint::from_steps(steps).is_none() || !PackedObservation::is_possible(hints) {
                return Err(SnapshotError::Contents);
            }
            if kept && let (Some(to_steps), Some(to_hints)) = (self.steps.get_mut(index), self.hints.get_mut(index)) {
                (*to_steps, *to_hints) = (steps, hints);
            }
        }
        if kept {
            self.len = len;
        }
        Ok(())
    }
}

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// Writes the last published result: the map, the ids of its vertices, the path, and the belief.
    pub(super) fn save_told(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        let map = &self.map;
        writer.u8(map.vertices().len() as u8)?;
        for vertex in map.vertices() {
            writer.u16(map.label_of(vertex).steps())?;
            writer.u32(map.visits(vertex))?;
            save_row::<V>(writer, map.neighbours(vertex).iter().collect())?;
            writer.u8(self.vertex_ids.ids[vertex].into())?;
            writer.u32(self.belief_q16[vertex])?;
        }
        writer.u32(self.map_probability_q16)?;
        let Trials { places, found, missed } = self.trials;
        writer.u16(places)?;
        writer.u8(found)?;
        writer.u8(missed)?;
        let ids = &self.vertex_ids;
        writer.u8(ids.vertices_before)?;
        for before in VertexId::first(ids.vertices_before.into()) {
            writer.u8(ids.remapped[before].map_or(NOWHERE, u8::from))?;
        }
        save_path::<V>(writer, self.published_path.get(..self.history.len()).unwrap_or(&[]))
    }

    /// Reads the last published result; stores it if `kept`. Returns the number of vertices of its map.
    pub(super) fn read_told(&mut self, from: &mut Reader<'_>, len: usize, kept: bool) -> Result<u8, SnapshotError> {
        let vertices = from.u8()?;
        if usize::from(vertices) > V {
            return Err(SnapshotError::Contents);
        }
        let mut map = Map::<V>::new();
        let mut neighbours = PerVertex::<VertexSet32, V>::filled(VertexSet32::EMPTY);
        let mut ids = PerVertex::<VertexId, V>::filled(VertexId::FIRST);
        let mut belief_q16 = PerVertex::<u32, V>::filled(0);
        let mut used = VertexSet32::EMPTY;
        for vertex in VertexId::first(vertices.into()) {
            let label = Fingerprint::from_steps(from.u16()?).ok_or(SnapshotError::Contents)?;
            map.add_known_vertex(label, from.u32()?).map_err(|_| SnapshotError::Contents)?;
            neighbours[vertex] = read_row::<V>(from, vertices)?;
            let id = from.u8()?;
            belief_q16[vertex] = from.u32()?;
            if id >= vertices || belief_q16[vertex] > 2 * ONE_Q16 {
                return Err(SnapshotError::Contents);
            }
            ids[vertex] = VertexId::new(id).ok_or(SnapshotError::Contents)?;
            used.insert(ids[vertex]);
        }
        check_symmetry(&neighbours)?;
        let map_probability = from.u32()?;
        let trials = Trials { places: from.u16()?, found: from.u8()?, missed: from.u8()? };
        let vertices_before = from.u8()?;
        let remapped = from.bytes(vertices_before.into())?;
        let is_id = |&id: &u8| id == NOWHERE || usize::from(id) < V;
        // Every id is used once.
        if used.len() != usize::from(vertices)
            || map_probability > ONE_Q16
            || usize::from(vertices_before) > V
            || !remapped.iter().all(is_id)
        {
            return Err(SnapshotError::Contents);
        }
        let path = &mut self.published_path;
        read_path::<V>(from, len, vertices, |index, vertex| {
            if kept && let Some(slot) = path.get_mut(index) {
                *slot = vertex;
            }
        })?;
        if kept {
            for vertex in VertexId::first(vertices.into()) {
                neighbours[vertex].iter().for_each(|neighbour| map.add_edge(vertex, neighbour));
            }
            self.map = map;
            self.vertex_ids.ids = ids;
            self.vertex_ids.vertices_before = vertices_before;
            for (before, &id) in VertexId::first(V).zip(remapped) {
                self.vertex_ids.remapped[before] = VertexId::new(id);
            }
            self.belief_q16 = belief_q16;
            self.map_probability_q16 = map_probability;
            self.trials = trials;
        }
        Ok(vertices)
    }
}
