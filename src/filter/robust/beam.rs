//! Growing the beam of the robust filter by one place.

use super::history::{ObservationHistory, PackedObservation};
use super::hypothesis::Hypothesis;
use super::model::Model;
use crate::filter::beam::{self, Candidate, Ranked as _};
use crate::map::VertexId;

/// Up to `N` hypotheses, of which no two have the same map and vertex of the robot.
pub(crate) type Beam<const N: usize, const V: usize, const T: usize> = beam::Beam<Hypothesis<V, T>, N>;

impl<const N: usize, const V: usize, const T: usize> Beam<N, V, T> {
    /// Adds the newest observation, number `index` of the history: the best `wanted` distinct predictions of all hypotheses
    /// become the hypotheses. When the map is `fixed` they differ in the vertex of the robot alone. Returns whether the best
    /// prediction had no room for its vertex. Cost: O(N · V) predictions.
    pub(crate) fn grow(
        &mut self,
        model: &Model,
        history: &ObservationHistory<T>,
        newest: (usize, PackedObservation),
        wanted: usize,
        fixed: bool,
    ) -> bool {
        let mut chosen = Candidate::none((0.0, VertexId::FIRST));
        let mut without_room = f32::NEG_INFINITY;
        for (slot, parent) in self.parents() {
            let has_other = parent.vertices > 1 || !fixed && parent.vertices > 0;
            let new_vertex = if fixed { None } else { Some(None) };
            for vertex in parent.vertices().map(Some).chain(new_vertex) {
                // No path stays at a vertex, unless there is no other.
                if has_other && vertex.is_some() && vertex == parent.at && !newest.1.starts_sequence() {
                    continue;
                }
                let (gain, key) = match vertex {
                    Some(vertex) if fixed => parent.localisation_gain(model, history, newest, vertex),
                    _ => parent.gain(model, history, newest, vertex),
                };
                let score = parent.score() + gain;
                match vertex.or(parent.next_vertex()) {
                    Some(vertex) => {
                        Candidate { score, key, parent: slot, choice: (gain, vertex) }.insert_into(&mut chosen, wanted);
                    }
                    None => without_room = without_room.max(score),
                }
            }
        }
        let lacks_room = chosen.as_slice().first().is_some_and(|best| without_room > best.score);
        self.replace(&mut chosen, |hypothesis, &(gain, vertex), _| {
            if fixed {
                hypothesis.localise(newest.0, vertex, gain);
            } else {
                hypothesis.extend(model, history, newest, vertex, gain);
            }
        });
        lacks_room
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{Observation, RobustConfig, Ways};
    use crate::place::Fingerprint;
    use std::collections::BTreeSet;

    const WANTED: usize = 6;

    fn check(beam: &Beam<6, 5, 32>) {
        let keys: BTreeSet<u32> = beam.iter().map(Hypothesis::key).collect();
        assert_eq!(keys.len(), beam.len(), "no two have the same map and place");
        assert!(beam.iter().is_sorted_by(|better, worse| better.score() >= worse.score()));
        let slots: BTreeSet<u8> = beam.slots_by_rank().iter().copied().collect();
        assert_eq!(slots.len(), 6, "every slot is ranked once: {:?}", beam.slots_by_rank());
    }

    #[test]
    fn hypotheses_are_distinct_ranked_and_have_the_evidence_that_a_recount_gives() {
        let mut model = Model::new();
        model.configure(&RobustConfig::DEFAULT);
        let mut history = ObservationHistory::<32>::new();
        let mut beam = Box::new(Beam::<6, 5, 32>::new());
        beam.clear();
        for index in 0..32 {
            let steps = 500 + 60 * (index as u16 * 7 % 4) + index as u16 % 5;
            let observation = Observation::new(Fingerprint::from_steps(steps).unwrap());
            history.push(&Observation {
                starts_sequence: index % 12 == 0,
                ways: Ways::from_count(2).ok(),
                ..observation
            });
            let observation = history.get(index).unwrap();
            beam.grow(&model, &history, (index, observation), WANTED, false);
            check(&beam);
            for rank in 0..beam.len() {
                // As a move does: another vertex for one place, which may give a map that is there already.
                let mut other = *beam.get(rank).unwrap();
                let (evidence, key) = (other.evidence, other.key());
                other.rebuild(&model, &history);
                assert!((other.evidence - evidence).abs() < 1e-2, "{} {evidence}", other.evidence);
                assert_eq!(other.key(), key);
                other.path[index / 2] = other.path[index / 3];
                other.rebuild(&model, &history);
                if other.vertices().all(|vertex| !other.is_edge(vertex, vertex)) {
                    beam.insert(&other, WANTED);
                }
                check(&beam);
            }
        }
        assert_eq!(beam.len(), WANTED);
    }

    #[test]
    fn a_hypothesis_with_the_same_map_is_replaced_only_by_a_better_one() {
        let mut beam = Box::new(Beam::<6, 5, 32>::new());
        beam.clear();
        let mut same = *beam.best().unwrap();
        assert!(!beam.insert(&same, WANTED));
        same.evidence = 1.0;
        assert!(beam.insert(&same, WANTED));
        assert_eq!((beam.len(), beam.best().map(Hypothesis::score)), (1, Some(1.0)));
        same.evidence = 0.5;
        assert!(!beam.insert(&same, WANTED));
        same.at = VertexId::new(1);
        assert!(beam.insert(&same, WANTED));
        assert_eq!(beam.len(), 2);
    }
}
