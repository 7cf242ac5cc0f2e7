//! The pieces that a snapshot is made of: places, counts, rows, paths, and what was told last.

use crate::RobustFilter;
use crate::filter::robust::hypothesis::NOWHERE;
use crate::filter::robust::record::{Entry, Record};
use crate::filter::robust::tally::{FADE_VISITS, Tally};
use crate::map::bits;
use crate::persist::snapshot::{Reader, SnapshotError, Writer};
use crate::{Fingerprint, Map, VertexId, VertexSet};

/// Two floats, two counts, seven degrees.
pub(super) const TALLY_BYTES: usize = 4 + 4 + 2 + 2 + 7;

/// One in the unit of probabilities.
const ONE_Q16: u32 = 1 << 16;

/// The most visits of a vertex in what left the record: every vertex fades, and all may have been merged into one. As many may
/// be in the record.
const MOST_VISITS: u16 = 32 * FADE_VISITS;

/// A mean may be off a label by its rounding.
const MOST_MEAN: f32 = Fingerprint::MAX.steps() as f32 + 1.0;

/// More than any sum of squared distances of so many labels, in steps².
const MOST_SCATTER: f32 = 1e12;

/// Bytes of the neighbours of one vertex.
pub(super) const fn row_bytes(vertices: usize) -> usize {
    if vertices <= 16 { 2 } else { 4 }
}

/// Bytes of a path of so many places: two places a byte as long as that is enough.
pub(super) const fn path_bytes(vertices: usize, places: usize) -> usize {
    if vertices <= 16 { places.div_ceil(2) } else { places }
}

pub(super) fn save_row<const V: usize>(writer: &mut Writer<'_>, row: u32) -> Result<(), SnapshotError> {
    if row_bytes(V) == 2 { writer.u16(row as u16) } else { writer.u32(row) }
}

/// Reads a row of a map with so many vertices.
#[inline(never)]
pub(super) fn read_row<const V: usize>(from: &mut Reader<'_>, vertices: u8) -> Result<u32, SnapshotError> {
    let row = if row_bytes(V) == 2 { from.u16()?.into() } else { from.u32()? };
    if u64::from(row) >> (vertices & 63) == 0 { Ok(row) } else { Err(SnapshotError::Contents) }
}

/// Checks that every edge leads both ways.
#[inline(never)]
pub(super) fn check_symmetry(rows: &[u32]) -> Result<(), SnapshotError> {
    let leads = |from: u8, to: u8| rows.get(usize::from(from)).is_some_and(|row| row >> (to & 31) & 1 == 1);
    let is_symmetric = (0_u8..).zip(rows).all(|(from, &row)| bits(row.into()).all(|to| leads(to, from)));
    if is_symmetric { Ok(()) } else { Err(SnapshotError::Contents) }
}

pub(super) fn save_path<const V: usize>(writer: &mut Writer<'_>, path: &[u8]) -> Result<(), SnapshotError> {
    if path_bytes(V, 2) == 2 {
        return writer.bytes(path);
    }
    for places in path.chunks(2) {
        writer.u8(places.iter().rev().fold(0, |packed, vertex| packed << 4 | vertex & 15))?;
    }
    Ok(())
}

/// Reads a path of so many places through so many vertices, place by place.
#[inline(never)]
pub(super) fn read_path<const V: usize>(
    from: &mut Reader<'_>,
    places: usize,
    vertices: u8,
    mut take: impl FnMut(usize, u8),
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
        if vertex >= vertices {
            return Err(SnapshotError::Contents);
        }
        take(index, vertex);
    }
    Ok(())
}

/// A finite float within some bounds.
#[inline(never)]
pub(super) fn bounded(value: f32, least: f32, most: f32) -> Result<f32, SnapshotError> {
    if value >= least && value <= most { Ok(value) } else { Err(SnapshotError::Contents) }
}

impl Tally {
    pub(super) fn save(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.f32(self.mean)?;
        writer.f32(self.scatter)?;
        writer.u16(self.visits)?;
        writer.u16(self.exits)?;
        writer.bytes(&self.degrees)
    }

    pub(super) fn read(from: &mut Reader<'_>) -> Result<Self, SnapshotError> {
        let mut tally = Self {
            mean: bounded(from.f32()?, -1.0, MOST_MEAN)?,
            scatter: bounded(from.f32()?, 0.0, MOST_SCATTER)?,
            visits: from.u16()?,
            exits: from.u16()?,
            ..Self::NONE
        };
        let degrees = from.bytes(tally.degrees.len())?;
        tally.degrees.iter_mut().zip(degrees).for_each(|(to, &count)| *to = count);
        // A vertex is not left more often than it is reached.
        if tally.visits > 2 * MOST_VISITS || tally.exits > tally.visits || tally.visits == 0 && tally != Self::NONE {
            return Err(SnapshotError::Contents);
        }
        Ok(tally)
    }
}

impl<const T: usize> Record<T> {
    pub(super) fn save(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u16(self.len as u16)?;
        for (&steps, &hints) in self.steps.iter().zip(&self.hints).take(self.len) {
            writer.u16(steps)?;
            writer.u8(hints)?;
        }
        Ok(())
    }

    /// Reads so many places, and takes them over if they are to be `kept`.
    pub(super) fn read(&mut self, from: &mut Reader<'_>, len: usize, kept: bool) -> Result<(), SnapshotError> {
        for index in 0..len {
            let (steps, hints) = (from.u16()?, from.u8()?);
            if Fingerprint::from_steps(steps).is_none() || !Entry::is_possible(hints) {
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
    /// Writes what was told last: the map, the numbers of its vertices, the path, and what is believed of it.
    pub(super) fn save_told(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        let map = &self.map;
        writer.u8(map.vertices().len() as u8)?;
        for ((vertex, &name), &belief) in map.vertices().zip(&self.names.names).zip(&self.belief_q16) {
            writer.u16(map.label_of(vertex).steps())?;
            writer.u32(map.visits(vertex))?;
            save_row::<V>(writer, map.neighbours(vertex).bits() as u32)?;
            writer.u8(name)?;
            writer.u32(belief)?;
        }
        writer.u32(self.map_probability_q16)?;
        writer.u8(self.names.vertices)?;
        writer.bytes(self.names.renamed.get(..usize::from(self.names.vertices)).unwrap_or(&[]))?;
        save_path::<V>(writer, self.names.path.get(..self.record.len()).unwrap_or(&[]))
    }

    /// Reads what was told last after so many places, and takes it over if it is to be `kept`; tells how many vertices its
    /// map has.
    pub(super) fn read_told(&mut self, from: &mut Reader<'_>, len: usize, kept: bool) -> Result<u8, SnapshotError> {
        let vertices = from.u8()?;
        if usize::from(vertices) > V {
            return Err(SnapshotError::Contents);
        }
        let mut map = Map::<V>::new();
        let mut rows = [0_u32; V];
        let mut names = [NOWHERE; V];
        let mut beliefs = [0; V];
        let mut named = 0_u32;
        for (((_, row), name), belief) in (0..vertices).zip(&mut rows).zip(&mut names).zip(&mut beliefs) {
            let label = Fingerprint::from_steps(from.u16()?).ok_or(SnapshotError::Contents)?;
            map.add_known_vertex(label, from.u32()?).map_err(|_| SnapshotError::Contents)?;
            *row = read_row::<V>(from, vertices)?;
            *name = from.u8()?;
            *belief = from.u32()?;
            if *name >= vertices || *belief > 2 * ONE_Q16 {
                return Err(SnapshotError::Contents);
            }
            named |= 1 << (*name & 31);
        }
        check_symmetry(&rows)?;
        let map_probability = from.u32()?;
        let renamed_vertices = from.u8()?;
        let renamed = from.bytes(renamed_vertices.into())?;
        let is_number = |&number: &u8| number == NOWHERE || usize::from(number) < V;
        // As many bits as vertices: every number is given once.
        if named.count_ones() != vertices.into()
            || map_probability > ONE_Q16
            || usize::from(renamed_vertices) > V
            || !renamed.iter().all(is_number)
        {
            return Err(SnapshotError::Contents);
        }
        let path = &mut self.names.path;
        read_path::<V>(from, len, vertices, |index, vertex| {
            if kept && let Some(slot) = path.get_mut(index) {
                *slot = vertex;
            }
        })?;
        if kept {
            for (vertex, &row) in VertexId::first(vertices.into()).zip(&rows) {
                VertexSet::from_bits(u64::from(row)).iter().for_each(|neighbour| map.add_edge(vertex, neighbour));
            }
            self.map = map;
            self.names.names = names;
            self.names.vertices = renamed_vertices;
            self.names.renamed.iter_mut().zip(renamed).for_each(|(to, &number)| *to = number);
            self.belief_q16 = beliefs;
            self.map_probability_q16 = map_probability;
        }
        Ok(vertices)
    }
}
