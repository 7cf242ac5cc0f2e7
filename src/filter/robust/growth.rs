//! One more observation: the gain in evidence for each vertex that it may belong to.

use super::history::{ObservationHistory, PackedObservation};
use super::hypothesis::{Hypothesis, edge_key, join, keyed, ln};
use super::model::{LN_EDGE, LN_VERTEX, Model};
use super::statistics::VertexStatistics;
use crate::map::VertexId;

/// The cost of the assumption that the robot was kidnapped, while the filter only localises, in nats.
const KIDNAPPING_COST: f32 = 8.0;

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// The gain in evidence when the newest observation, number `index` of the history, belongs to a vertex, and the key of the
    /// hypothesis then. `None` stands for a new vertex. The gain is the sum of
    ///
    /// - the change of [`Model::label_evidence`] at the vertex;
    /// - the change of [`Model::exit_evidence`] at the vertex that the robot came from, and at the vertex if its degree or
    ///   the observed degrees change: a new edge rescales the likelihood of all past transitions;
    /// - the turn hint, [`Model::ln_turn`];
    /// - [`LN_EDGE`] for a new edge, [`LN_VERTEX`] for a new vertex;
    /// - the change of −ln K for each start of a sequence.
    ///
    /// Constant time.
    #[inline(never)]
    pub(super) fn gain(
        &self,
        model: &Model,
        history: &ObservationHistory<T>,
        (index, observation): (usize, PackedObservation),
        vertex: Option<VertexId>,
    ) -> (f32, u32) {
        let is_new = vertex.is_none();
        let vertices = self.vertices + u8::from(is_new);
        let from = if observation.starts_sequence() { None } else { self.at };
        let before = vertex.map_or(VertexStatistics::NONE, |vertex| self.statistics[vertex]);
        let degree_before = vertex.map_or(0, |vertex| self.degree(vertex));
        // A new vertex has the id after the last, even where there is no room for it.
        let at = vertex.or(VertexId::new(self.vertices));
        let mut after = before;
        after.include(observation);
        let mut gain = model.label_evidence(&after) - model.label_evidence(&before);
        let mut map_key = self.map_key;
        let mut degree_after = degree_before;
        if let Some(from) = from {
            let mut left = self.statistics[from];
            let exits_before = model.exit_evidence(&left, self.degree(from));
            left.exits = left.exits.saturating_add(1);
            let is_new_edge = vertex.is_none_or(|vertex| !self.is_edge(from, vertex));
            gain += model.exit_evidence(&left, self.degree(from) + u32::from(is_new_edge)) - exits_before;
            if is_new_edge {
                gain += LN_EDGE;
                degree_after += 1;
                map_key ^= at.map_or(0, |at| edge_key(from, at));
            }
            gain += self.ln_hint_at(model, history, index, observation, vertex);
            if is_new {
                gain -= f32::from(self.starts) * (ln(vertices) - ln(self.vertices));
            }
        } else {
            let starts = f32::from(self.starts);
            gain -= (starts + 1.0) * ln(vertices) - starts * ln(self.vertices.max(1));
        }
        if degree_after != degree_before || observation.degree() > 0 {
            gain += model.exit_evidence(&after, degree_after) - model.exit_evidence(&before, degree_before);
        }
        if is_new {
            gain += LN_VERTEX;
        }
        (gain, keyed(map_key, vertices, at))
    }

    /// As [`Hypothesis::gain`], while the filter only localises and the map does not change: how well the newest observation
    /// fits a vertex, and the cost of the transition. Where there is no edge the robot may have been kidnapped:
    /// `−ln K − 8`.
    #[inline(never)]
    pub(super) fn localisation_gain(
        &self,
        model: &Model,
        history: &ObservationHistory<T>,
        (index, observation): (usize, PackedObservation),
        vertex: VertexId,
    ) -> (f32, u32) {
        let before = self.statistics[vertex];
        let mut after = before;
        after.include(observation);
        let fit = model.label_evidence(&after) - model.label_evidence(&before)
            + model.ln_degree(observation.degree(), model.likely_degree(&before, self.degree(vertex)));
        let transition = match self.at {
            Some(from) if !observation.starts_sequence() => {
                if self.is_edge(from, vertex) {
                    let degree = model.likely_degree(&self.statistics[from], self.degree(from));
                    self.ln_hint(model, history, index, observation, vertex) - libm::logf(degree as f32)
                } else {
                    -ln(self.vertices) - KIDNAPPING_COST
                }
            }
            _ => -ln(self.vertices),
        };
        (fit + transition, keyed(self.map_key, self.vertices, Some(vertex)))
    }

    /// Adds the newest observation, number `index` of the history, to the path only: the filter localises.
    pub(super) fn localise(&mut self, index: usize, vertex: VertexId, gain: f32) {
        self.evidence += gain;
        self.set_vertex_of(index, vertex);
        self.at = Some(vertex);
    }

    /// Adds the newest observation, number `index` of the history, to a vertex, for a gain that was computed before. A new
    /// vertex has the id after the last.
    pub(super) fn extend(
        &mut self,
        model: &Model,
        history: &ObservationHistory<T>,
        (index, observation): (usize, PackedObservation),
        vertex: VertexId,
        gain: f32,
    ) {
        self.evidence += gain;
        if vertex.index() == usize::from(self.vertices) {
            self.vertices += 1;
        }
        match self.at {
            Some(from) if !observation.starts_sequence() => {
                self.ln_hints += self.ln_hint(model, history, index, observation, vertex);
                let exits = &mut self.statistics[from].exits;
                *exits = exits.saturating_add(1);
                if !self.is_edge(from, vertex) {
                    self.map_key ^= edge_key(from, vertex);
                    join(&mut self.neighbours, from, vertex);
                }
            }
            _ => self.starts = self.starts.saturating_add(1),
        }
        self.statistics[vertex].include(observation);
        self.set_vertex_of(index, vertex);
        self.at = Some(vertex);
    }

    /// ln P of the turn hint of observation `index` if it belongs to a vertex.
    pub(super) fn ln_hint(
        &self,
        model: &Model,
        history: &ObservationHistory<T>,
        index: usize,
        observation: PackedObservation,
        vertex: VertexId,
    ) -> f32 {
        self.ln_hint_at(model, history, index, observation, Some(vertex))
    }

    /// As [`Hypothesis::ln_hint`]; `None` stands for a new vertex.
    fn ln_hint_at(
        &self,
        model: &Model,
        history: &ObservationHistory<T>,
        index: usize,
        observation: PackedObservation,
        vertex: Option<VertexId>,
    ) -> f32 {
        let before = index.checked_sub(1).and_then(|before| history.get(before));
        if observation.starts_sequence() || before.is_some_and(PackedObservation::starts_sequence) {
            return 0.0;
        }
        let second_last = match index {
            0 => None,
            1 => self.before,
            _ => self.vertex_of(index - 2),
        };
        model.ln_turn(observation.exit(), second_last.is_some() && second_last == vertex)
    }
}
