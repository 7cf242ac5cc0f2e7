//! The vertex ids of the published map: a vertex keeps its id when another hypothesis becomes the best one.

use crate::map::{Map, PerVertex, VertexId, VertexSet};
use crate::top_k::insertion_sort;
use core::cmp::Reverse;

/// The published ids: 3 bytes a vertex.
#[derive(Clone, Debug)]
pub(crate) struct VertexIds<const V: usize> {
    /// The published id of each vertex of the best hypothesis.
    pub(crate) ids: PerVertex<VertexId, V>,
    /// The id after the last update for each id before it; `None` for a vertex that was removed.
    pub(crate) remapped: PerVertex<Option<VertexId>, V>,
    /// How many vertices the map before the last update had.
    pub(crate) vertices_before: u8,
}

/// A vertex of the best hypothesis, a published vertex, and how many observations both have.
#[derive(Clone, Copy)]
struct Shared {
    vertex: VertexId,
    id: VertexId,
    observations: u16,
}

impl<const V: usize> VertexIds<V> {
    pub(crate) const fn new() -> Self {
        Self { ids: PerVertex::filled(VertexId::FIRST), remapped: PerVertex::filled(None), vertices_before: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.vertices_before = 0;
    }

    /// Starts with a known map, whose vertices keep their numbers.
    pub(crate) fn start_with(&mut self, vertices: usize) {
        self.ids.iter_mut().for_each(|(vertex, id)| *id = vertex);
        self.keep(vertices);
    }

    /// Keeps all ids, for a map of `vertices` vertices that does not change.
    pub(crate) fn keep(&mut self, vertices: usize) {
        self.vertices_before = vertices as u8;
        self.remapped.iter_mut().for_each(|(vertex, now)| *now = Some(vertex));
    }

    /// The id after the last update of a vertex by its id before; `None` for a vertex that was removed.
    pub(crate) fn remapped(&self, before: VertexId) -> Option<VertexId> {
        if before.index() < usize::from(self.vertices_before) { self.remapped[before] } else { None }
    }

    /// Gives the vertices of the best hypothesis their ids. A vertex takes the id of the published vertex that it shares most
    /// observations with; one without observations in the history that of the published vertex with the nearest label.
    ///
    /// `map` is what was published last. `observations` are the published vertex and the vertex of the best hypothesis of each
    /// observation of the history, `T` at most; those without one of the two are left out. `label` is the mean label of a vertex
    /// in steps, `None` for one that was not visited twice. Cost: O(T · V + V³).
    pub(crate) fn update<const T: usize>(
        &mut self,
        map: &Map<V>,
        vertices: usize,
        observations: impl Iterator<Item = (VertexId, VertexId)>,
        label: impl Fn(VertexId) -> Option<f32>,
    ) {
        let mut shared = [Shared { vertex: VertexId::FIRST, id: VertexId::FIRST, observations: 0 }; T];
        let mut pairs = 0;
        for (id, vertex) in observations {
            let known = shared.iter().take(pairs).position(|pair| pair.vertex == vertex && pair.id == id);
            if let Some(pair) = shared.get_mut(known.unwrap_or(pairs)) {
                let observations = pair.observations.saturating_add(1);
                *pair = Shared { vertex, id, observations };
                pairs += usize::from(known.is_none());
            }
        }
        let shared = shared.get_mut(..pairs).unwrap_or(&mut []);
        insertion_sort(shared, |one, other| {
            let rank = |pair: &Shared| (Reverse(pair.observations), pair.vertex, pair.id);
            rank(one) <= rank(other)
        });
        let before = map.vertices().len();
        self.vertices_before = before as u8;
        let mut ids = PerVertex::<Option<VertexId>, V>::filled(None);
        let (mut taken, mut visited, mut busy) = (VertexSet::EMPTY, VertexSet::EMPTY, VertexSet::EMPTY);
        for pair in shared.iter() {
            visited.insert(pair.vertex);
            busy.insert(pair.id);
            // Ids have no gaps.
            if pair.id.index() < vertices && ids[pair.vertex].is_none() && !taken.contains(pair.id) {
                ids[pair.vertex] = Some(pair.id);
                taken.insert(pair.id);
            }
        }
        let idle_ids = || VertexId::first(before.min(vertices)).filter(|&id| !busy.contains(id));
        while let Some((vertex, id)) =
            nearest(&ids, map, vertices, visited, idle_ids().filter(|&id| !taken.contains(id)), &label)
        {
            ids[vertex] = Some(id);
            taken.insert(id);
        }
        // New vertices take the ids that are free.
        for vertex in VertexId::first(vertices) {
            self.ids[vertex] = ids[vertex].or(taken.first_missing()).unwrap_or(VertexId::FIRST);
            taken.insert(self.ids[vertex]);
        }
        for (before, remapped) in self.remapped.iter_mut() {
            let heir = shared.iter().find(|pair| pair.id == before);
            *remapped = heir.map(|heir| self.ids[heir.vertex]);
        }
        // A published vertex without observations in the history is still there if its id is.
        for before in map.vertices() {
            if self.remapped[before].is_none() && before.index() < vertices {
                self.remapped[before] = Some(before);
            }
        }
    }
}

/// The vertex and the id without observations in the history whose labels are nearest, of those that have no id and are no id yet.
fn nearest<const V: usize>(
    ids: &PerVertex<Option<VertexId>, V>,
    map: &Map<V>,
    vertices: usize,
    visited: VertexSet,
    idle_ids: impl Iterator<Item = VertexId> + Clone,
    label: impl Fn(VertexId) -> Option<f32>,
) -> Option<(VertexId, VertexId)> {
    let mut nearest: Option<(f32, VertexId, VertexId)> = None;
    for vertex in VertexId::first(vertices).filter(|&vertex| ids[vertex].is_none() && !visited.contains(vertex)) {
        let Some(mean) = label(vertex) else { continue };
        for id in idle_ids.clone() {
            let off = (mean - f32::from(map.label_of(id).steps())).abs();
            if nearest.is_none_or(|(least, ..)| off < least) {
                nearest = Some((off, vertex, id));
            }
        }
    }
    nearest.map(|(_, vertex, id)| (vertex, id))
}
