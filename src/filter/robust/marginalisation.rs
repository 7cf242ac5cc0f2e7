//! Observations that leave the history: their statistics stay, and decay in long runs.

use super::history::ObservationHistory;
use super::hypothesis::{Hypothesis, join};
use super::model::Model;
use super::statistics::VertexStatistics;
use crate::filter::beam::Ranked as _;
use crate::map::Map;
use crate::map::VertexSet32;

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// Starts with a known map and no observation. The labels count with a standard deviation.
    pub(super) fn start_with(&mut self, map: &Map<V>, deviation_steps: f32) {
        self.clear();
        self.vertices = map.vertices().len() as u8;
        for vertex in map.vertices() {
            let visits = map.visits(vertex).min(u32::from(u16::MAX)) as u16;
            self.marginalised[vertex] = VertexStatistics::known(map.label_of(vertex), visits, deviation_steps);
            // No path of this filter stays at a vertex, so it has no use for loops.
            let neighbours = map.neighbours(vertex).iter().filter(|&neighbour| neighbour != vertex);
            self.marginalised_neighbours[vertex] = neighbours.collect::<VertexSet32>();
        }
    }

    /// Moves the oldest observation from the history into the marginalised statistics. Returns whether statistics decayed: the
    /// hypothesis must then be [rebased](Hypothesis::rebase) when the history has dropped the observation.
    pub(super) fn marginalise_oldest(&mut self, history: &ObservationHistory<T>) -> bool {
        let (Some(oldest), Some(next), Some(vertex)) = (history.get(0), history.get(1), self.vertex_of(0)) else {
            return false;
        };
        if let Some(before) = self.before
            && !oldest.starts_sequence()
        {
            join(&mut self.marginalised_neighbours, before, vertex);
        }
        let statistics = &mut self.marginalised[vertex];
        statistics.include(oldest);
        if !next.starts_sequence() {
            statistics.exits = statistics.exits.saturating_add(1);
        }
        let has_decayed = statistics.decay();
        self.before = if next.starts_sequence() { None } else { Some(vertex) };
        self.path.copy_within(1.., 0);
        has_decayed
    }

    /// Recounts after marginalised statistics decayed. The evidence stays: the difference counts as decayed.
    pub(super) fn rebase(&mut self, model: &Model, history: &ObservationHistory<T>) {
        let before = self.evidence;
        self.recount(model, history);
        self.decayed += before - self.evidence;
        self.evidence = before;
    }

    /// Subtracts decayed evidence that all hypotheses have in common, so that sums stay small in long runs.
    pub(super) fn subtract_decayed(&mut self, common: f32) {
        self.decayed -= common;
        self.evidence -= common;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Fingerprint, Observation, RobustConfig, VertexId};

    #[test]
    fn marginalised_statistics_stay_with_their_vertex_when_vertices_are_renumbered() {
        let mut model = Model::new();
        model.configure(&RobustConfig::DEFAULT);
        let mut history = ObservationHistory::<8>::new();
        let mut hypothesis = Hypothesis::<4, 8>::UNUSED;
        hypothesis.clear();
        hypothesis.vertices = 3;
        // The first observation has no edge, because the second one starts a sequence.
        for (index, (vertex, steps)) in VertexId::first(3).zip([400, 500, 600]).enumerate() {
            let observation = Observation::new(Fingerprint::from_steps(steps).unwrap());
            history.push(&Observation { starts_sequence: index < 2, ..observation });
            hypothesis.set_vertex_of(index, vertex);
        }
        hypothesis.rebuild(&model, &history);
        hypothesis.marginalise_oldest(&history);
        history.drop_oldest();
        hypothesis.rebuild(&model, &history);
        let means: Vec<f32> = hypothesis.vertices().map(|vertex| hypothesis.statistics[vertex].mean).collect();
        assert_eq!(means, [500.0, 600.0, 400.0]);
    }
}
