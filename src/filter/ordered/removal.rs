//! Removal: a repair that takes a part off the map of its source, and finds where the robot was instead.
//!
//! A single repair seldom folds what is on the map twice, because what follows from the fold contradicts the path of the source.
//! Without one of the two copies, the decoder leads the path over the other one.

use super::OrderedFilter;
use super::repair::below;
use crate::map::{NONE, VertexId, VertexSet};
use rand_xoshiro::Xoshiro128PlusPlus;

/// The work of one step: the number of arrivals at a place that are evaluated.
const ARRIVALS: u32 = 600;

/// The draft is started in the same step after at most this many.
const FEW_ARRIVALS: u32 = 100;

/// Of 16 removals, how many take an edge away; of 16 others, how many take away vertices that the robot visited for the first time
/// directly after another, and how many more these can be.
const EDGES: usize = 6;
const SEVERAL: usize = 8;
const MORE: usize = 4;

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// Takes an edge off the map of the source, or vertices that the record has shown first; of two that are drawn the one with
    /// fewer visits. Returns whether there is something to remove. Cost: O(D).
    pub(super) fn remove_some(&mut self, random: &mut Xoshiro128PlusPlus) -> bool {
        let map = &mut self.source.map;
        let mut removed = VertexSet::EMPTY;
        let mut parted = (NONE, NONE);
        if below(random, 16) < EDGES {
            let edges = map.edges().count();
            let Some(edge) = map.edges().nth(below(random, edges)) else { return false };
            map.part(edge.0);
            parted = edge;
        } else {
            let first = usize::from(self.base.map.vertices());
            let count = usize::from(map.vertices()).saturating_sub(first);
            if count < 3 {
                return false;
            }
            let (one, other) = (first + below(random, count), first + below(random, count));
            let visits = |vertex: usize| self.source.labels.get(vertex).map_or(0, |label| label.visits);
            let start = if visits(one) <= visits(other) { one } else { other };
            let more = if below(random, 16) < SEVERAL { 1 + below(random, MORE) } else { 0 };
            let end = (start + 1 + more).min(first + count);
            (start..end).filter_map(|vertex| VertexId::new(vertex as u8)).for_each(|vertex| removed.insert(vertex));
            for way in 0..map.darts() {
                if VertexId::new(map.vertex(way)).is_some_and(|vertex| removed.contains(vertex)) {
                    map.part(way);
                }
            }
        }
        self.decoder.start(removed, parted);
        self.repair.decode();
        true
    }

    /// Decodes the path of the source from a place on, in steps of bounded work. Returns whether the draft can be built in the same
    /// step.
    pub(super) fn continue_decoding(&mut self, from: usize) -> bool {
        let (next, arrivals) = self.decoder.run(&self.model, &self.record, &mut self.source, from, ARRIVALS);
        if next < self.record.len() {
            self.repair.decode_from(next);
            return false;
        }
        self.repair.build();
        self.start_draft();
        arrivals <= FEW_ARRIVALS
    }
}
