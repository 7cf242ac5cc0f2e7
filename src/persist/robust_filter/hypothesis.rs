//! A hypothesis in a snapshot: its path, and the counts of what left the record.

use super::parts::{bounded, check_symmetry, read_path, read_row, save_path, save_row};
use crate::filter::robust::hypothesis::{Hypothesis, NOWHERE};
use crate::filter::robust::tally::Tally;
use crate::persist::snapshot::{Reader, SnapshotError, Writer};

/// Vertices, the place before the record, whether anything left it, and three floats.
pub(super) const FIXED_BYTES: usize = 3 + 3 * 4;
/// Vertices, starts and hints of a map that is kept.
pub(super) const KEPT_BYTES: usize = 1 + 2 + 4;

/// No sum of logarithms is beyond this.
const MOST_NATS: f32 = 1e9;

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// Writes the counts of a map that is kept as it is while the filter only localises: they are not those of the path.
    pub(super) fn save_kept(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u8(self.vertices)?;
        writer.u16(self.starts)?;
        writer.f32(self.hints)?;
        save_counts(writer, self.vertices, &self.tallies, &self.neighbours)
    }

    pub(super) fn read_kept(&mut self, from: &mut Reader<'_>) -> Result<(), SnapshotError> {
        self.vertices = from.u8()?;
        self.starts = from.u16()?;
        self.hints = bounded(from.f32()?, -MOST_NATS, MOST_NATS)?;
        read_counts(from, self.vertices, &mut self.tallies, &mut self.neighbours)?;
        self.map_key = self.key_of_edges();
        Ok(())
    }

    /// Takes over the counts of a map that is kept as it is.
    pub(super) fn keep_map_of(&mut self, other: &Self) {
        self.starts = other.starts;
        self.hints = other.hints;
        self.tallies = other.tallies;
        self.neighbours = other.neighbours;
        self.map_key = other.map_key;
    }

    pub(super) fn save(&self, writer: &mut Writer<'_>, len: usize, localise_only: bool) -> Result<(), SnapshotError> {
        let has_settled = self.settled.iter().any(|tally| tally.visits > 0);
        writer.u8(self.vertices)?;
        writer.u8(self.before)?;
        writer.u8(has_settled.into())?;
        writer.f32(self.surplus)?;
        writer.f32(self.faded)?;
        if localise_only {
            writer.f32(self.evidence)?;
        }
        save_path::<V>(writer, self.path.get(..len).unwrap_or(&[]))?;
        if has_settled {
            save_counts(writer, self.vertices, &self.settled, &self.settled_neighbours)?;
        }
        Ok(())
    }

    /// Reads what was saved. While the filter only localises, the counts of the kept map must have been read; else they are to
    /// be [counted anew](Hypothesis::recount).
    pub(super) fn read(&mut self, from: &mut Reader<'_>, len: usize, localise_only: bool) -> Result<(), SnapshotError> {
        let vertices = from.u8()?;
        self.before = from.u8()?;
        let has_settled = from.u8()?;
        let is_before_known = self.before == NOWHERE || self.before < vertices;
        if usize::from(vertices) > V
            || localise_only && vertices != self.vertices
            || !is_before_known
            || has_settled > 1
        {
            return Err(SnapshotError::Contents);
        }
        self.vertices = vertices;
        self.surplus = bounded(from.f32()?, 0.0, MOST_NATS)?;
        self.faded = bounded(from.f32()?, -MOST_NATS, MOST_NATS)?;
        if localise_only {
            self.evidence = bounded(from.f32()?, -MOST_NATS, MOST_NATS)?;
        }
        self.place = self.before;
        let mut visited = 0_u32;
        let (path, place) = (&mut self.path, &mut self.place);
        read_path::<V>(from, len, vertices, |index, vertex| {
            if let Some(slot) = path.get_mut(index) {
                *slot = vertex;
            }
            *place = vertex;
            visited |= 1 << (vertex & 31);
        })?;
        self.settled.fill(Tally::NONE);
        self.settled_neighbours.fill(0);
        if has_settled == 1 {
            read_counts(from, vertices, &mut self.settled, &mut self.settled_neighbours)?;
        }
        for (vertex, settled) in (0_u8..).zip(&self.settled) {
            visited |= u32::from(settled.visits > 0) << (vertex & 31);
        }
        // A vertex that was never visited is none.
        if visited.count_ones() == vertices.into() { Ok(()) } else { Err(SnapshotError::Contents) }
    }
}

fn save_counts<const V: usize>(
    writer: &mut Writer<'_>,
    vertices: u8,
    tallies: &[Tally; V],
    rows: &[u32; V],
) -> Result<(), SnapshotError> {
    for (tally, &row) in tallies.iter().zip(rows).take(vertices.into()) {
        tally.save(writer)?;
        save_row::<V>(writer, row)?;
    }
    Ok(())
}

fn read_counts<const V: usize>(
    from: &mut Reader<'_>,
    vertices: u8,
    tallies: &mut [Tally; V],
    rows: &mut [u32; V],
) -> Result<(), SnapshotError> {
    if usize::from(vertices) > V {
        return Err(SnapshotError::Contents);
    }
    tallies.fill(Tally::NONE);
    rows.fill(0);
    for (tally, row) in tallies.iter_mut().zip(rows.iter_mut()).take(vertices.into()) {
        *tally = Tally::read(from)?;
        *row = read_row::<V>(from, vertices)?;
    }
    check_symmetry(rows)
}
