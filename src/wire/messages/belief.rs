//! What the filter believes, in a form for the wire: where the robot may be, what became of the vertices, and what the
//! map explains worst.

use serde::{Deserialize, Serialize};

use super::List;
use crate::wire::robot::bit;
use crate::{Filter, VertexId, VertexSet};

/// Where the robot may be, and how far the map itself is to be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Belief {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// The probability that the map is right, relative to its rivals, in thousandths.
    pub map_permille: u16,
    /// The most probable vertices, the most probable first; what is missing to 1000 is elsewhere.
    pub places: List<PlaceProbability, 8>,
}

/// How probable it is that the robot is at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlaceProbability {
    /// The number of the vertex.
    pub vertex: u8,
    /// The probability in thousandths.
    pub permille: u16,
}

impl Belief {
    /// What a filter believes after a place.
    pub fn of<const V: usize>(filter: &impl Filter<V>, place_index: u32) -> Self {
        let mut places = [PlaceProbability::default(); 8];
        for vertex in filter.map().vertices() {
            let mut place =
                PlaceProbability { vertex: vertex.into(), permille: permille(filter.place_probability_q16(vertex)) };
            for slot in &mut places {
                if place.permille > slot.permille {
                    core::mem::swap(slot, &mut place);
                }
            }
        }
        let places = List::new(places.into_iter().take_while(|place| place.permille > 0));
        Self { place_index, map_permille: permille(filter.map_probability_q16()), places }
    }

    /// The same belief under new numbers: a vertex that is gone is left out, and those that are one now are added up.
    pub(in crate::wire) fn rename(&mut self, renamed: &Renamed) {
        let mut places = [PlaceProbability::default(); 8];
        let mut count = 0;
        for &PlaceProbability { vertex, permille } in self.places.as_slice() {
            let Some(vertex) = renamed.now(vertex) else { continue };
            let held = places.iter().take(count).position(|place| place.vertex == vertex);
            if let Some(place) = places.get_mut(held.unwrap_or(count)) {
                *place = PlaceProbability { vertex, permille: place.permille.saturating_add(permille) };
                count += usize::from(held.is_none());
            }
        }
        self.places = List::new(places.into_iter().take(count));
    }
}

fn permille(probability_q16: u32) -> u16 {
    ((u64::from(probability_q16.min(1 << 16)) * 1000 + (1 << 15)) >> 16) as u16
}

/// The number of each vertex after an update, for each number before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Renamed {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// For vertex 0, 1, … before the update its number now, 255 when it is gone; later vertices keep their numbers. Two
    /// with the same number were merged.
    pub names: List<u8, 64>,
}

impl Renamed {
    pub(in crate::wire) const GONE: u8 = u8::MAX;

    /// What the last update of a filter did to the numbers of the first so many vertices; `None` when all kept theirs.
    pub fn of<const V: usize>(filter: &impl Filter<V>, vertices: u8, place_index: u32) -> Option<Self> {
        let before = VertexId::first(vertices.into());
        let last = before.rev().find(|&vertex| filter.renamed(vertex) != Some(vertex))?;
        let now = |vertex| filter.renamed(vertex).map_or(Self::GONE, u8::from);
        let names = VertexId::first(last.index() + 1).map(now);
        Some(Self { place_index, names: List::new(names) })
    }

    /// The number now of a vertex by its number before; `None` when it is gone.
    pub fn now(&self, before: u8) -> Option<u8> {
        match self.names.as_slice().get(usize::from(before)) {
            None => Some(before),
            Some(&Self::GONE) => None,
            Some(&now) => Some(now),
        }
    }

    /// Renumbers the vertices of a map, labels and rows; `labelled` are the vertices whose label is known, before and now.
    /// Of vertices that are one now, the first one's label stays, and the edges of all; a vertex beyond `V` is left out.
    pub(in crate::wire) fn apply<const V: usize>(
        &self,
        labels: &mut [(u16, u32); V],
        neighbours: &mut [u64; V],
        labelled: u64,
    ) -> u64 {
        let (labels_before, neighbours_before) = (*labels, *neighbours);
        *labels = [(0, 0); V];
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

    /// How many vertices there are now, if there were so many before and none was added.
    pub(in crate::wire) fn vertices(&self, before: u8) -> u8 {
        (0..before).filter_map(|vertex| self.now(vertex)).map(|now| now.saturating_add(1)).max().unwrap_or(0)
    }
}

/// What the map explains worst: the n-gram of the history that is farthest from every walk of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Worst {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// How far it is from the nearest walk, in millimetres; 65535 when there is none.
    pub distance_mm: u16,
    /// How many places ago its newest label was observed; 0 for the newest place.
    pub newest_age: u16,
    /// The vertices of the nearest walk, the oldest first; empty when only the distance is known.
    pub vertices: List<u8, 7>,
}

impl Worst {
    /// What the map of a filter explains worst after a place.
    pub fn of<const V: usize>(filter: &impl Filter<V>, place_index: u32) -> Self {
        let worst = filter.worst();
        let vertices = List::new(worst.walk().iter().map(|&vertex| vertex.into()));
        Self { place_index, distance_mm: worst.distance_mm, newest_age: worst.newest_age, vertices }
    }

    /// The same under new numbers; `None` when a vertex of the walk is gone.
    pub(in crate::wire) fn renamed(self, renamed: &Renamed) -> Option<Self> {
        let walk = self.vertices.as_slice();
        let vertices = List::new(walk.iter().filter_map(|&vertex| renamed.now(vertex)));
        (vertices.as_slice().len() == walk.len()).then_some(Self { vertices, ..self })
    }
}
