//! The filter's belief: where the robot may be, how vertex ids changed, and which n-gram the map explains worst.

use serde::{Deserialize, Serialize};

use super::List;
use super::message::bit;
use crate::filter::{CERTAIN_Q16, Filter};
use crate::map::{VertexId, VertexSet};

/// The belief of the filter after a place: where the robot may be, and how probable the map is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Belief {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// The probability that the map is right, in thousandths.
    pub map_permille: u16,
    /// The most probable vertices, the most probable first. The rest up to 1000 belongs to other vertices.
    pub vertices: List<VertexProbability, 8>,
}

/// The probability that the robot is at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct VertexProbability {
    /// The vertex.
    pub vertex: u8,
    /// The probability in thousandths.
    pub permille: u16,
}

impl Belief {
    /// The belief of a filter after a place. Cost: O(8 · V).
    pub fn of<const V: usize>(filter: &impl Filter<V>, place_index: u32) -> Self {
        let mut most_probable = [VertexProbability::default(); 8];
        for vertex in filter.map().vertices() {
            let permille = permille(filter.vertex_probability_q16(vertex));
            let mut candidate = VertexProbability { vertex: vertex.into(), permille };
            // A vertex that is displaced goes behind those of its own probability.
            for slot in &mut most_probable {
                if candidate.permille > slot.permille {
                    core::mem::swap(slot, &mut candidate);
                }
            }
        }
        let vertices = List::new(most_probable.into_iter().take_while(|candidate| candidate.permille > 0));
        Self { place_index, map_permille: permille(filter.map_probability_q16()), vertices }
    }

    /// Whether the map is uncertain, as [`Filter::is_uncertain`].
    pub fn is_uncertain(&self) -> bool {
        self.map_permille < permille(CERTAIN_Q16)
    }

    /// Applies new vertex ids: removed vertices are left out, the probabilities of merged ones are added.
    pub(in crate::wire) fn remap(&mut self, remapped: &Remapped) {
        let mut vertices = [VertexProbability::default(); 8];
        let mut count = 0;
        for &VertexProbability { vertex, permille } in self.vertices.as_slice() {
            let Some(vertex) = remapped.now(vertex) else { continue };
            let known = vertices.iter().take(count).position(|entry| entry.vertex == vertex);
            if let Some(entry) = vertices.get_mut(known.unwrap_or(count)) {
                *entry = VertexProbability { vertex, permille: entry.permille.saturating_add(permille) };
                count += usize::from(known.is_none());
            }
        }
        self.vertices = List::new(vertices.into_iter().take(count));
    }
}

fn permille(probability_q16: u32) -> u16 {
    ((u64::from(probability_q16.min(1 << 16)) * 1000 + (1 << 15)) >> 16) as u16
}

/// The vertex ids changed: for each id before the update, the id after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Remapped {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// For vertex 0, 1, … before the update its id after it, 255 if the vertex was removed. Vertices beyond the list keep
    /// their ids. Vertices with the same new id were merged.
    pub vertices: List<u8, 64>,
}

impl Remapped {
    pub(in crate::wire) const REMOVED: u8 = u8::MAX;

    /// The id changes of a filter's last update among the first `vertices` ids; `None` if no id changed.
    pub fn of<const V: usize>(filter: &impl Filter<V>, vertices: u8, place_index: u32) -> Option<Self> {
        let mut before = VertexId::first(vertices.into());
        let last_changed = before.rfind(|&vertex| filter.remapped(vertex) != Some(vertex))?;
        let new_id = |vertex| filter.remapped(vertex).map_or(Self::REMOVED, u8::from);
        let new_ids = VertexId::first(last_changed.index() + 1).map(new_id);
        Some(Self { place_index, vertices: List::new(new_ids) })
    }

    /// The id of a vertex after the update, by its id before; `None` if it was removed.
    pub fn now(&self, before: u8) -> Option<u8> {
        match self.vertices.as_slice().get(usize::from(before)) {
            None => Some(before),
            Some(&Self::REMOVED) => None,
            Some(&now) => Some(now),
        }
    }

    /// Applies the new ids to the labels and rows of a map. `unlabelled` is the label of a vertex without one. `labelled` is the set of vertices with a known label; the result is
    /// the same set after the update. Merged vertices keep the first label and all edges; ids from `V` on are dropped.
    pub(in crate::wire) fn apply<T: Copy, const V: usize>(
        &self,
        labels: &mut [T; V],
        unlabelled: T,
        neighbours: &mut [u64; V],
        labelled: u64,
    ) -> u64 {
        let (labels_before, neighbours_before) = (*labels, *neighbours);
        *labels = [unlabelled; V];
        *neighbours = [0; V];
        let mut labelled_now = 0;
        for ((before, label), row) in (0..).zip(labels_before).zip(neighbours_before) {
            let Some(now) = self.now(before) else { continue };
            let Some(slot) = neighbours.get_mut(usize::from(now)) else { continue };
            let neighbours_now = VertexSet::from_bits(row)
                .iter()
                .filter_map(|other| self.now(other.into()))
                .filter(|&now| usize::from(now) < V);
            *slot |= neighbours_now.fold(0, |row, other| row | bit(other));
            if labelled & bit(before) != 0
                && labelled_now & bit(now) == 0
                && let Some(slot) = labels.get_mut(usize::from(now))
            {
                *slot = label;
                labelled_now |= bit(now);
            }
        }
        labelled_now
    }

    /// Applies the new ids to what is known of the ways of each vertex. Merged vertices keep the ways of the first; ids from `V`
    /// on are dropped. `rename` applies the new ids within the ways of one vertex.
    pub(in crate::wire) fn apply_to_ways<T: Copy, const V: usize>(
        &self,
        ways: &mut [T; V],
        unknown: T,
        rename: impl Fn(&mut T),
    ) {
        let before = *ways;
        *ways = [unknown; V];
        let mut known = 0;
        for (vertex, mut of_vertex) in (0..).zip(before) {
            let Some(now) = self.now(vertex).filter(|&now| known & bit(now) == 0) else { continue };
            if let Some(slot) = ways.get_mut(usize::from(now)) {
                rename(&mut of_vertex);
                *slot = of_vertex;
                known |= bit(now);
            }
        }
    }

    /// The number of vertices after the update, without vertices that it added.
    pub(in crate::wire) fn count(&self, before: u8) -> u8 {
        (0..before).filter_map(|vertex| self.now(vertex)).map(|now| now.saturating_add(1)).max().unwrap_or(0)
    }
}

/// The n-gram of the history with the largest distance to the map (the directed half of Eq. 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Worst {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// Its distance to the nearest walk of the map in millimetres; 65535 if the map has no walk of its length.
    pub distance_mm: u16,
    /// How many places ago its newest label was observed; 0 for the newest place.
    pub newest_age: u16,
    /// The vertices of the nearest walk, the oldest first; empty if only the distance is known.
    pub vertices: List<u8, 7>,
}

impl Worst {
    /// The worst n-gram of a filter after a place.
    pub fn of<const V: usize>(filter: &impl Filter<V>, place_index: u32) -> Self {
        let worst = filter.worst();
        let vertices = List::new(worst.walk().iter().map(|&vertex| vertex.into()));
        Self { place_index, distance_mm: worst.distance_mm, newest_age: worst.newest_age, vertices }
    }

    /// The same n-gram under the new vertex ids; `None` if a vertex of the walk was removed.
    pub(in crate::wire) fn remapped(self, remapped: &Remapped) -> Option<Self> {
        let walk = self.vertices.as_slice();
        let vertices = List::new(walk.iter().filter_map(|&vertex| remapped.now(vertex)));
        (vertices.as_slice().len() == walk.len()).then_some(Self { vertices, ..self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_is_more_probably_wrong_than_right_is_uncertain() {
        let belief = |map_permille| Belief { place_index: 0, map_permille, vertices: List::new([]) };
        assert!([0, 499].into_iter().all(|permille| belief(permille).is_uncertain()));
        assert!(![500, 1000].into_iter().any(|permille| belief(permille).is_uncertain()));
    }
}
