//! The vertex ids of the published map: a vertex keeps its id when another hypothesis becomes the best one.

use super::history::ObservationHistory;
use super::hypothesis::Hypothesis;
use crate::map::Map;
use crate::map::{PerVertex, VertexId, VertexSet};
use core::cmp::Reverse;

/// The published ids: 3 bytes a vertex and one an observation.
#[derive(Clone, Debug)]
pub(crate) struct VertexIds<const V: usize, const T: usize> {
    /// The published vertex of each observation of the history.
    pub(crate) path: [VertexId; T],
    /// The published id of each vertex of the best hypothesis.
    pub(crate) ids: PerVertex<VertexId, V>,
    /// The id after the last update for each id before it; `None` for a vertex that was removed.
    pub(crate) remapped: PerVertex<Option<VertexId>, V>,
    /// How many vertices the map before the last update had.
    pub(crate) vertices_before: u8,
}

/// How many observations each vertex of the best hypothesis shares with each published vertex.
type Shared<const V: usize> = PerVertex<PerVertex<u16, V>, V>;

impl<const V: usize, const T: usize> VertexIds<V, T> {
    pub(crate) const fn new() -> Self {
        Self {
            path: [VertexId::FIRST; T],
            ids: PerVertex::filled(VertexId::FIRST),
            remapped: PerVertex::filled(None),
            vertices_before: 0,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.vertices_before = 0;
    }

    /// Starts with a known map, whose vertices keep their numbers.
    pub(crate) fn start_with(&mut self, vertices: usize) {
        self.vertices_before = vertices as u8;
        self.ids.iter_mut().for_each(|(vertex, id)| *id = vertex);
        self.keep_all();
    }

    /// Keeps all ids, for a map that does not change.
    pub(crate) fn keep(&mut self, history: &ObservationHistory<T>, best: &Hypothesis<V, T>) {
        self.vertices_before = best.vertices;
        self.keep_all();
        self.publish_path(history, best);
    }

    fn keep_all(&mut self) {
        self.remapped.iter_mut().for_each(|(vertex, now)| *now = Some(vertex));
    }

    fn publish_path(&mut self, history: &ObservationHistory<T>, best: &Hypothesis<V, T>) {
        for (published, &vertex) in self.path.iter_mut().zip(&best.path).take(history.len()) {
            *published = self.ids[vertex];
        }
    }

    /// Drops the oldest observation.
    pub(crate) fn drop_oldest(&mut self) {
        self.path.copy_within(1.., 0);
    }

    /// The id after the last update of a vertex by its id before; `None` for a vertex that was removed.
    pub(crate) fn remapped(&self, before: VertexId) -> Option<VertexId> {
        if before.index() < usize::from(self.vertices_before) { self.remapped[before] } else { None }
    }

    /// Gives the vertices of a hypothesis their ids. A vertex takes the id of the published vertex that it shares most
    /// observations with; one without observations in the history that of the published vertex with the nearest label. `map`
    /// is what was published last. Cost: O(T + V³).
    pub(crate) fn update(&mut self, history: &ObservationHistory<T>, map: &Map<V>, best: &Hypothesis<V, T>) {
        let mut shared = Shared::<V>::filled(PerVertex::filled(0));
        // The newest observation is not published yet.
        let published = history.len().saturating_sub(1);
        for (&id, &vertex) in self.path.iter().zip(&best.path).take(published) {
            let count = &mut shared[vertex][id];
            *count = count.saturating_add(1);
        }
        self.vertices_before = map.vertices().len() as u8;
        let mut ids = PerVertex::<Option<VertexId>, V>::filled(None);
        let mut taken = VertexSet::EMPTY;
        while let Some((vertex, id)) = next_id(&ids, &shared, map, best, taken) {
            ids[vertex] = Some(id);
            taken.insert(id);
        }
        // New vertices take the ids that are free.
        for vertex in best.vertices() {
            self.ids[vertex] = ids[vertex].or(taken.first_missing()).unwrap_or(VertexId::FIRST);
            taken.insert(self.ids[vertex]);
        }
        for (before, remapped) in self.remapped.iter_mut() {
            let heir = best.vertices().max_by_key(|&vertex| (shared[vertex][before], Reverse(vertex)));
            *remapped = heir.filter(|&heir| shared[heir][before] > 0).map(|heir| self.ids[heir]);
        }
        // A published vertex without observations in the history is still there if its id is.
        for before in map.vertices() {
            if self.remapped[before].is_none() && best.vertices().any(|vertex| self.ids[vertex] == before) {
                self.remapped[before] = Some(before);
            }
        }
        self.publish_path(history, best);
    }
}

/// The vertex without an id and the id not taken yet that share most observations. If no two share any: the vertex and the id
/// without observations in the history whose labels are nearest.
fn next_id<const V: usize, const T: usize>(
    ids: &PerVertex<Option<VertexId>, V>,
    shared: &Shared<V>,
    map: &Map<V>,
    best: &Hypothesis<V, T>,
    taken: VertexSet,
) -> Option<(VertexId, VertexId)> {
    let open_vertices = || best.vertices().filter(|&vertex| ids[vertex].is_none());
    let open_ids = || best.vertices().take(map.vertices().len()).filter(|&id| !taken.contains(id));
    let mut most: Option<(u16, VertexId, VertexId)> = None;
    for vertex in open_vertices() {
        for id in open_ids() {
            let count = shared[vertex][id];
            if count > 0 && most.is_none_or(|(largest, ..)| count > largest) {
                most = Some((count, vertex, id));
            }
        }
    }
    if let Some((_, vertex, id)) = most {
        return Some((vertex, id));
    }
    let is_idle = |id: VertexId| shared.values().iter().all(|counts| counts[id] == 0);
    let mut nearest: Option<(f32, VertexId, VertexId)> = None;
    for vertex in open_vertices() {
        let is_visited = shared[vertex].values().iter().any(|&count| count > 0);
        if is_visited || best.statistics[vertex].visits < 2 {
            continue;
        }
        for id in open_ids().filter(|&id| is_idle(id)) {
            let off = (best.statistics[vertex].mean - f32::from(map.label_of(id).steps())).abs();
            if nearest.is_none_or(|(least, ..)| off < least) {
                nearest = Some((off, vertex, id));
            }
        }
    }
    nearest.map(|(_, vertex, id)| (vertex, id))
}
