//! From the evidence to the map: is every n-gram of the evidence near some walk of the map?

use super::{Consistency, evidence::Evidence, state_set::StateSet};
use crate::filter::NgramLength;
use crate::map::Map;

impl<const V: usize, const WORDS: usize, const INDICES: usize> Consistency<V, WORDS, INDICES> {
    /// Whether max over the evidence of min over the map's walks of Eq. 3 is at most `distance`.
    ///
    /// All n-grams are read at once: after label `k`, `reached[v]` holds those whose first `k + 1` labels some walk that
    /// ends at vertex `v` matches. Cost: O(n · edges · WORDS).
    pub(super) fn explains(
        &mut self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        distance: u16,
    ) -> bool {
        let labels = evidence.straight_labels(length);
        if labels == 0 {
            return true;
        }
        if self.witnesses.refute_ngrams(map, evidence, length, distance) {
            return false;
        }
        let [reached, next] = &mut self.reached;
        for vertex in map.vertices() {
            reached[vertex] = *self.readings.at(evidence, length, (vertex, map.label_of(vertex)), 0, distance);
        }
        for index in 1..labels {
            for vertex in map.vertices() {
                reached[vertex] = evidence.onward(&reached[vertex]);
            }
            for vertex in map.vertices() {
                let mut arriving = StateSet::EMPTY;
                for neighbour in map.neighbours(vertex).iter() {
                    arriving.insert_all(&reached[neighbour]);
                }
                let label = (vertex, map.label_of(vertex));
                next[vertex] = arriving.intersection(self.readings.at(evidence, length, label, index, distance));
            }
            core::mem::swap(reached, next);
        }
        let mut explained = StateSet::EMPTY;
        for vertex in map.vertices() {
            explained.insert_all(&reached[vertex]);
        }
        let missing = explained.first_missing(&evidence.ends(labels));
        if let Some(end) = missing {
            self.witnesses.remember_end(end as u16);
        }
        missing.is_none()
    }
}
