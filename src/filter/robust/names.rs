//! The numbers by which the world knows the vertices: they stay when another hypothesis becomes the best one.

use super::hypothesis::{Hypothesis, NOWHERE};
use super::record::Record;
use crate::{Map, VertexId};

/// The published numbers: 2 bytes a vertex and one a place.
#[derive(Clone, Debug)]
pub(crate) struct Names<const V: usize, const T: usize> {
    /// The published vertex of each observation of the record.
    pub(crate) path: [u8; T],
    /// For each vertex of the best hypothesis its published number.
    pub(crate) names: [u8; V],
    /// For each published number before the last update the number now; [`NOWHERE`] when it is gone.
    pub(crate) renamed: [u8; V],
    /// How many vertices were published before.
    pub(crate) vertices: u8,
}

impl<const V: usize, const T: usize> Names<V, T> {
    pub(crate) const fn new() -> Self {
        Self { path: [0; T], names: [0; V], renamed: [0; V], vertices: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.vertices = 0;
    }

    /// Begins with a known map, whose vertices are numbered as they are.
    pub(crate) fn begin_with(&mut self, vertices: u8) {
        self.vertices = vertices;
        for (number, (name, renamed)) in (0..).zip(self.names.iter_mut().zip(&mut self.renamed)) {
            (*name, *renamed) = (number, number);
        }
    }

    /// Keeps all numbers, for a map that is kept as it is.
    pub(crate) fn hold(&mut self, record: &Record<T>, best: &Hypothesis<V, T>) {
        self.vertices = best.vertices;
        for (number, renamed) in (0..).zip(&mut self.renamed) {
            *renamed = number;
        }
        self.trace(record, best);
    }

    fn trace(&mut self, record: &Record<T>, best: &Hypothesis<V, T>) {
        for (name, &vertex) in self.path.iter_mut().zip(&best.path).take(record.len()) {
            *name = self.names.get(usize::from(vertex)).copied().unwrap_or(0);
        }
    }

    /// Takes leave of the oldest observation.
    pub(crate) fn drop_oldest(&mut self) {
        self.path.copy_within(1.., 0);
    }

    pub(crate) fn name(&self, vertex: u8) -> u8 {
        self.names.get(usize::from(vertex)).copied().unwrap_or(0)
    }

    pub(crate) fn path(&self) -> &[u8; T] {
        &self.path
    }

    pub(crate) fn renamed(&self, before: VertexId) -> Option<VertexId> {
        let known = self.renamed.get(..usize::from(self.vertices))?;
        VertexId::new(*known.get(before.index())?)
    }

    /// Numbers the vertices of a hypothesis: those that most of the visits of a published vertex belong to keep its number,
    /// those that have no visits in the record that of the published vertex with the nearest label. `map` is what was
    /// published last. Cost: O(T + V³).
    pub(crate) fn follow(&mut self, record: &Record<T>, map: &Map<V>, best: &Hypothesis<V, T>) {
        let mut shared = [[0_u16; V]; V];
        // The newest observation was not published yet.
        let published = record.len().saturating_sub(1);
        for (&name, &vertex) in self.path.iter().zip(&best.path).take(published) {
            if let Some(count) = shared.get_mut(usize::from(vertex)).and_then(|row| row.get_mut(usize::from(name))) {
                *count = count.saturating_add(1);
            }
        }
        self.vertices = map.vertices().len() as u8;
        self.names = [NOWHERE; V];
        let mut taken = 0_u64;
        while let Some((vertex, name)) = self.most_shared(&shared, map, best, taken) {
            if let Some(slot) = self.names.get_mut(usize::from(vertex)) {
                *slot = name;
            }
            taken |= 1 << (name & 63);
        }
        // Numbers beyond the last are not kept, and new vertices get what is free.
        for name in self.names.iter_mut().take(usize::from(best.vertices)) {
            if *name >= best.vertices {
                *name = taken.trailing_ones() as u8;
                taken |= 1 << (*name & 63);
            }
        }
        let names = &self.names;
        for (before, renamed) in (0_u8..).zip(&mut self.renamed) {
            let heir = (0_u8..best.vertices).zip(&shared).max_by_key(|(vertex, row)| {
                let count = row.get(usize::from(before)).copied().unwrap_or(0);
                (count, core::cmp::Reverse(*vertex))
            });
            *renamed = match heir {
                Some((vertex, row)) if row.get(usize::from(before)).is_some_and(|&count| count > 0) => {
                    names.get(usize::from(vertex)).copied().unwrap_or(NOWHERE)
                }
                _ => NOWHERE,
            };
        }
        self.settle_unvisited(map, best);
        self.trace(record, best);
    }

    /// The pair of a vertex without a number and a number not yet taken that share most visits; numbers without visits
    /// in the record go to vertices without visits there, by label.
    fn most_shared(
        &self,
        shared: &[[u16; V]; V],
        map: &Map<V>,
        best: &Hypothesis<V, T>,
        taken: u64,
    ) -> Option<(u8, u8)> {
        let mut most: Option<(u16, u8, u8)> = None;
        for (vertex, row) in (0..best.vertices).zip(shared) {
            if self.names.get(usize::from(vertex)).is_some_and(|&name| name != NOWHERE) {
                continue;
            }
            for (name, &count) in (0..best.vertices.min(map.vertices().len() as u8)).zip(row) {
                if count > 0 && taken >> (name & 63) & 1 == 0 && most.is_none_or(|(largest, ..)| count > largest) {
                    most = Some((count, vertex, name));
                }
            }
        }
        if let Some((_, vertex, name)) = most {
            return Some((vertex, name));
        }
        let is_idle = |name: u8| shared.iter().all(|row| row.get(usize::from(name)).is_some_and(|&count| count == 0));
        let mut nearest: Option<(f32, u8, u8)> = None;
        for (vertex, row) in (0..best.vertices).zip(shared) {
            let is_named = self.names.get(usize::from(vertex)).is_some_and(|&name| name != NOWHERE);
            if is_named || row.iter().any(|&count| count > 0) || best.tally(vertex).visits < 2 {
                continue;
            }
            for name in (0..best.vertices.min(map.vertices().len() as u8))
                .filter(|&name| taken >> (name & 63) & 1 == 0 && is_idle(name))
            {
                let label =
                    VertexId::new(name).and_then(|name| map.label(name)).map_or(0.0, |label| f32::from(label.steps()));
                let off = (best.tally(vertex).mean() - label).abs();
                if nearest.is_none_or(|(least, ..)| off < least) {
                    nearest = Some((off, vertex, name));
                }
            }
        }
        nearest.map(|(_, vertex, name)| (vertex, name))
    }

    /// A published vertex without visits in the record is renamed only if a vertex of its number goes on.
    fn settle_unvisited(&mut self, map: &Map<V>, best: &Hypothesis<V, T>) {
        for before in 0..map.vertices().len() as u8 {
            let goes_on = self.names.iter().take(usize::from(best.vertices)).any(|&name| name == before);
            if let Some(renamed) = self.renamed.get_mut(usize::from(before))
                && *renamed == NOWHERE
                && goes_on
            {
                *renamed = before;
            }
        }
    }
}
