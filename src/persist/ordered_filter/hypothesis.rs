//! A hypothesis in a snapshot: its map with its ways, the labels, and the way by which the robot came to each place.

use super::NOWHERE;
use crate::filter::beam::Ranked as _;
use crate::filter::ordered::{OFF_MAP, OrderedHypothesis as Hypothesis, OrderedLabel as Label};
use crate::map::DartMap;
use crate::persist::snapshot::{Reader, SnapshotError, Writer};
use crate::place::Fingerprint;

/// Way, two parts of the evidence, key.
const FIXED_BYTES: usize = 1 + 3 * 4;
const LABEL_BYTES: usize = 4 + 4 + 2 + 1;
const WAY_BYTES: usize = 8;

/// Bound of every sum of logarithms.
const NATS_MAX: f32 = 1e9;
/// Bound of a mean label: the largest label plus the rounding error of the mean.
const MEAN_MAX: f32 = Fingerprint::MAX.steps() as f32 + 1.0;
/// Upper bound of the sum of squared distances of the labels, in steps².
const SCATTER_MAX: f32 = 1e12;

/// The largest size of a map with its ways.
pub(super) const fn map_bytes(vertices: usize, darts: usize) -> usize {
    2 + vertices + darts * WAY_BYTES
}

/// The largest size of a hypothesis.
pub(super) const fn bytes(vertices: usize, darts: usize, places: usize) -> usize {
    FIXED_BYTES + map_bytes(vertices, darts) + vertices * LABEL_BYTES + places
}

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    pub(super) fn save(&self, writer: &mut Writer<'_>, len: usize) -> Result<(), SnapshotError> {
        self.map.save(writer)?;
        for label in self.labels.iter().take(self.map.vertices().into()) {
            writer.f32(label.mean)?;
            writer.f32(label.scatter)?;
            writer.u16(label.visits)?;
            writer.u8(label.looks)?;
        }
        writer.u8(self.at)?;
        writer.f32(self.label_evidence)?;
        writer.f32(self.rest)?;
        writer.u32(self.map_key)?;
        writer.bytes(self.path.get(..len).unwrap_or(&[]))
    }

    pub(super) fn read(&mut self, from: &mut Reader<'_>, len: usize) -> Result<(), SnapshotError> {
        self.clear();
        self.map.read(from)?;
        for label in self.labels.iter_mut().take(self.map.vertices().into()) {
            *label = Label {
                mean: bounded(from.f32()?, -1.0, MEAN_MAX)?,
                scatter: bounded(from.f32()?, 0.0, SCATTER_MAX)?,
                visits: from.u16()?,
                looks: from.u8()?,
            };
        }
        self.at = from.u8()?;
        self.label_evidence = bounded(from.f32()?, -NATS_MAX, NATS_MAX)?;
        self.rest = bounded(from.f32()?, -NATS_MAX, NATS_MAX)?;
        self.map_key = from.u32()?;
        let darts = self.map.darts();
        read_path(from.bytes(len)?, darts, &mut self.path)?;
        if is_way(self.at, darts) { Ok(()) } else { Err(SnapshotError::Contents) }
    }
}

impl<const V: usize, const D: usize> DartMap<V, D> {
    /// Writes the ways of each vertex in counter-clockwise order.
    pub(super) fn save(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u8(self.vertices())?;
        writer.u8(self.darts())?;
        for vertex in 0..self.vertices() {
            let ways = self.ways(vertex);
            writer.u8(ways.len() as u8)?;
            for &way in ways {
                let (partner, bearing, seen, timed, ln_travel) = self.fields(way);
                writer.u8(way)?;
                writer.u8(partner)?;
                writer.u16(bearing)?;
                writer.u8(seen)?;
                writer.u8(timed)?;
                writer.u16(ln_travel)?;
            }
        }
        Ok(())
    }

    #[inline(never)]
    pub(super) fn read(&mut self, from: &mut Reader<'_>) -> Result<(), SnapshotError> {
        let (vertices, darts) = (from.u8()?, from.u8()?);
        if usize::from(darts) > D {
            return Err(SnapshotError::Contents);
        }
        self.start_with(darts);
        for _ in 0..vertices {
            let vertex = self.add_vertex().ok_or(SnapshotError::Contents)?;
            for _ in 0..from.u8()? {
                let (way, fields) = (from.u8()?, (from.u8()?, from.u16()?, from.u8()?, from.u8()?, from.u16()?));
                self.append_way(vertex, way, fields).ok_or(SnapshotError::Contents)?;
            }
        }
        if self.is_consistent() { Ok(()) } else { Err(SnapshotError::Contents) }
    }
}

/// Reads the way by which the robot came to each place.
pub(super) fn read_path(bytes: &[u8], darts: u8, path: &mut [u8]) -> Result<(), SnapshotError> {
    for (slot, &way) in path.iter_mut().zip(bytes) {
        if !is_way(way, darts) {
            return Err(SnapshotError::Contents);
        }
        *slot = way;
    }
    Ok(())
}

pub(super) fn is_way(way: u8, darts: u8) -> bool {
    way < darts || way == NOWHERE || way == OFF_MAP
}

fn bounded(value: f32, least: f32, most: f32) -> Result<f32, SnapshotError> {
    if value >= least && value <= most { Ok(value) } else { Err(SnapshotError::Contents) }
}
