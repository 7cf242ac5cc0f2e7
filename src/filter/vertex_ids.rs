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
    /// Whether the ids before the last update are not reported yet.
    is_pending: bool,
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
        Self {
            ids: PerVertex::filled(VertexId::FIRST),
            remapped: PerVertex::filled(None),
            vertices_before: 0,
            is_pending: false,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.vertices_before = 0;
        self.is_pending = false;
    }

    /// Starts with a known map, whose vertices keep their numbers.
    pub(crate) fn start_with(&mut self, vertices: usize) {
        self.ids.iter_mut().for_each(|(vertex, id)| *id = vertex);
        self.keep(vertices);
    }

    /// The next update is from the ids before the last one.
    pub(crate) fn defer(&mut self) {
        self.is_pending = true;
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

    /// Gives the vertices of the best hypothesis their ids. The first `kept` vertices are the same as at the last update, and keep
    /// theirs. Another one takes the id of the published vertex that it shares most observations with; one without observations in
    /// the history that of the published vertex with the nearest label.
    ///
    /// `map` is what was published last. `observations` are the published vertex and the vertex of the best hypothesis of each
    /// observation of the history, `T` at most; those without one of the two are left out. `label` is the mean label of a vertex
    /// in steps, `None` for one that was not visited twice. Cost: O(T · V + V³).
    pub(crate) fn update<const T: usize>(
        &mut self,
        map: &Map<V>,
        vertices: usize,
        kept: usize,
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
        let deferred = core::mem::take(&mut self.is_pending).then_some((self.remapped, self.vertices_before));
        let before = map.vertices().len();
        self.vertices_before = before as u8;
        let mut ids = PerVertex::<Option<VertexId>, V>::filled(None);
        let (mut taken, mut visited, mut busy) = (VertexSet::EMPTY, VertexSet::EMPTY, VertexSet::EMPTY);
        let kept = kept.min(before);
        for vertex in VertexId::first(kept) {
            let id = self.ids[vertex];
            visited.insert(vertex);
            busy.insert(id);
            if id.index() < vertices {
                ids[vertex] = Some(id);
                taken.insert(id);
            }
        }
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
        // The heirs, as vertices of the best hypothesis until they have their ids.
        for (before, remapped) in self.remapped.iter_mut() {
            let same = VertexId::first(kept).find(|&vertex| self.ids[vertex] == before);
            *remapped = same.or_else(|| shared.iter().find(|pair| pair.id == before).map(|pair| pair.vertex));
        }
        // New vertices take the ids that are free.
        for vertex in VertexId::first(vertices) {
            self.ids[vertex] = ids[vertex].or(taken.first_missing()).unwrap_or(VertexId::FIRST);
            taken.insert(self.ids[vertex]);
        }
        for (_, remapped) in self.remapped.iter_mut() {
            *remapped = remapped.map(|heir| self.ids[heir]);
        }
        // A published vertex without observations in the history is still there if its id is.
        for before in map.vertices() {
            if self.remapped[before].is_none() && before.index() < vertices {
                self.remapped[before] = Some(before);
            }
        }
        if let Some((earlier, vertices_before)) = deferred {
            let last = self.remapped;
            for (before, remapped) in self.remapped.iter_mut() {
                *remapped = earlier[before].and_then(|between| last[between]);
            }
            self.vertices_before = vertices_before;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::Fingerprint;

    fn vertex(number: u8) -> VertexId {
        VertexId::new(number).unwrap()
    }

    fn map(labels: &[u16]) -> Map<8> {
        let mut map = Map::new();
        for &steps in labels {
            map.add_known_vertex(Fingerprint::from_steps(steps).unwrap(), 3).unwrap();
        }
        map
    }

    #[test]
    fn vertices_that_left_the_history_keep_their_ids_whatever_their_labels() {
        let mut ids = VertexIds::<8>::new();
        ids.start_with(3);
        // The mean of vertex 0 is now nearer to what was published of vertex 1.
        let label = |vertex: VertexId| [Some(508.0), Some(501.0), Some(800.0)][vertex.index()];
        let visits = || [(vertex(2), vertex(2))].into_iter();
        ids.update::<4>(&map(&[500, 509, 800]), 3, 2, visits(), label);
        assert_eq!(VertexId::first(3).map(|vertex| ids.ids[vertex]).collect::<Vec<_>>(), [0, 1, 2].map(vertex));
        assert_eq!(ids.remapped(vertex(1)), Some(vertex(1)));
        ids.update::<4>(&map(&[500, 509, 800]), 3, 0, visits(), label);
        assert_eq!(ids.ids[vertex(0)], vertex(1), "without a kept vertex the nearest label decides");
    }

    #[test]
    fn a_deferred_update_is_reported_with_the_next_one() {
        let mut ids = VertexIds::<8>::new();
        ids.start_with(3);
        let label = |_| None;
        let published = map(&[500, 600, 700]);
        // Vertices 0 and 1 of three become one, then the last one of two becomes the first.
        let united = [(vertex(0), vertex(0)), (vertex(1), vertex(0)), (vertex(2), vertex(1))];
        ids.update::<4>(&published, 2, 0, united.into_iter(), label);
        let first = [0, 1, 2].map(|number| ids.remapped(vertex(number)));
        ids.defer();
        let same = [(vertex(0), vertex(0)), (vertex(1), vertex(1))];
        ids.update::<4>(&map(&[500, 700]), 2, 2, same.into_iter(), label);
        assert_eq!([0, 1, 2].map(|number| ids.remapped(vertex(number))), first);
    }
}
