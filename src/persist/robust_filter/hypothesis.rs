//! A hypothesis in a snapshot: its path and the marginalised statistics.

use super::parts::{NOWHERE, bounded, check_symmetry, read_path, read_row, save_path, save_row};
use crate::filter::robust::hypothesis::Hypothesis;
use crate::filter::robust::statistics::VertexStatistics;
use crate::map::{PerVertex, VertexId, VertexSet32};
use crate::persist::snapshot::{Reader, SnapshotError, Writer};

/// Vertices, the vertex before the history, whether anything was marginalised, and three floats.
pub(super) const FIXED_BYTES: usize = 3 + 3 * 4;
/// Vertices, starts and hints of the map while the filter only localises.
pub(super) const KEPT_BYTES: usize = 1 + 2 + 4;

/// Bound of every sum of logarithms.
const MOST_NATS: f32 = 1e9;

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// Writes the statistics of the map. While the filter only localises, the path does not determine them.
    pub(super) fn save_kept(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u8(self.vertices)?;
        writer.u16(self.starts)?;
        writer.f32(self.ln_hints)?;
        save_counts(writer, self.vertices, &self.statistics, &self.neighbours)
    }

    pub(super) fn read_kept(&mut self, from: &mut Reader<'_>) -> Result<(), SnapshotError> {
        self.vertices = from.u8()?;
        self.starts = from.u16()?;
        self.ln_hints = bounded(from.f32()?, -MOST_NATS, MOST_NATS)?;
        read_counts(from, self.vertices, &mut self.statistics, &mut self.neighbours)?;
        self.map_key = self.key_of_edges();
        Ok(())
    }

    /// Copies the statistics of the map from another hypothesis, while the filter only localises.
    pub(super) fn keep_map_of(&mut self, other: &Self) {
        self.starts = other.starts;
        self.ln_hints = other.ln_hints;
        self.statistics = other.statistics;
        self.neighbours = other.neighbours;
        self.map_key = other.map_key;
    }

    pub(super) fn save(&self, writer: &mut Writer<'_>, len: usize, localise_only: bool) -> Result<(), SnapshotError> {
        let has_marginalised = self.marginalised.values().iter().any(|statistics| statistics.visits > 0);
        writer.u8(self.vertices)?;
        writer.u8(self.before.map_or(NOWHERE, u8::from))?;
        writer.u8(has_marginalised.into())?;
        writer.f32(self.other_paths)?;
        writer.f32(self.decayed)?;
        if localise_only {
            writer.f32(self.evidence)?;
        }
        save_path::<V>(writer, self.path.get(..len).unwrap_or(&[]))?;
        if has_marginalised {
            save_counts(writer, self.vertices, &self.marginalised, &self.marginalised_neighbours)?;
        }
        Ok(())
    }

    /// Reads a saved hypothesis. While the filter only localises, the statistics of the map must be read first;
    /// otherwise [`Hypothesis::recount`] must follow.
    pub(super) fn read(&mut self, from: &mut Reader<'_>, len: usize, localise_only: bool) -> Result<(), SnapshotError> {
        let vertices = from.u8()?;
        let before = from.u8()?;
        let has_marginalised = from.u8()?;
        let is_before_known = before == NOWHERE || before < vertices;
        if usize::from(vertices) > V
            || localise_only && vertices != self.vertices
            || !is_before_known
            || has_marginalised > 1
        {
            return Err(SnapshotError::Contents);
        }
        self.vertices = vertices;
        self.before = VertexId::new(before);
        self.other_paths = bounded(from.f32()?, 0.0, MOST_NATS)?;
        self.decayed = bounded(from.f32()?, -MOST_NATS, MOST_NATS)?;
        if localise_only {
            self.evidence = bounded(from.f32()?, -MOST_NATS, MOST_NATS)?;
        }
        self.at = self.before;
        let mut visited = VertexSet32::EMPTY;
        read_path::<V>(from, len, vertices, |index, vertex| {
            self.set_vertex_of(index, vertex);
            self.at = Some(vertex);
            visited.insert(vertex);
        })?;
        self.marginalised.fill(VertexStatistics::NONE);
        self.marginalised_neighbours.fill(VertexSet32::EMPTY);
        if has_marginalised == 1 {
            read_counts(from, vertices, &mut self.marginalised, &mut self.marginalised_neighbours)?;
        }
        for (vertex, _) in self.marginalised.iter().filter(|(_, statistics)| statistics.visits > 0) {
            visited.insert(vertex);
        }
        // Every vertex has visits.
        if visited.len() == usize::from(vertices) { Ok(()) } else { Err(SnapshotError::Contents) }
    }
}

fn save_counts<const V: usize>(
    writer: &mut Writer<'_>,
    vertices: u8,
    statistics: &PerVertex<VertexStatistics, V>,
    neighbours: &PerVertex<VertexSet32, V>,
) -> Result<(), SnapshotError> {
    for (statistics, &neighbours) in statistics.values().iter().zip(neighbours.values()).take(vertices.into()) {
        statistics.save(writer)?;
        save_row::<V>(writer, neighbours)?;
    }
    Ok(())
}

fn read_counts<const V: usize>(
    from: &mut Reader<'_>,
    vertices: u8,
    statistics: &mut PerVertex<VertexStatistics, V>,
    neighbours: &mut PerVertex<VertexSet32, V>,
) -> Result<(), SnapshotError> {
    if usize::from(vertices) > V {
        return Err(SnapshotError::Contents);
    }
    statistics.fill(VertexStatistics::NONE);
    neighbours.fill(VertexSet32::EMPTY);
    for vertex in VertexId::first(vertices.into()) {
        statistics[vertex] = VertexStatistics::read(from)?;
        neighbours[vertex] = read_row::<V>(from, vertices)?;
    }
    check_symmetry(neighbours)
}
