//! What the filter publishes after a place: the best map with its vertex ids, the robot's place, and probabilities.

use super::OrderedFilter;
use super::choice::UNSEEN;
use super::hypothesis::Hypothesis;
use crate::filter::beam::Ranked as _;
use crate::filter::worst_ngram::worst_ngram;
use crate::filter::{OrderedFactors, Update, WeightFactors};
use crate::map::{DartId, NONE, VertexId};
use crate::place::Fingerprint;

/// 1 in the unit of probabilities.
const ONE_Q16: f32 = 65536.0;

/// The largest lead that is published, in nats.
const LEAD_MAX: f32 = 15.0;

/// Hypotheses that are this much less likely do not count, in nats.
const NEGLIGIBLE: f32 = -11.0;

/// An n-gram that is farther from the map than this many standard deviations of a label is not explained by noise.
const EXPLAINED_DEVIATIONS: f32 = 5.0;

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// Publishes the best map.
    pub(super) fn publish(&mut self) -> Update {
        let Some(best) = self.beam.best() else { return Update::NONE };
        let vertices = best.map.vertices();
        let vertex_of = |dart: u8| VertexId::new(best.map.vertex(dart));
        // The newest observation is not published yet.
        let published = self.record.len().saturating_sub(1);
        let pair = |(&before, &now): (&u8, &u8)| Some((VertexId::new(self.darts.vertex(before))?, vertex_of(now)?));
        let observations = self.path.iter().zip(&best.path).take(published).filter_map(pair);
        let label =
            |vertex: VertexId| Some(best.label(vertex.into())).filter(|held| held.visits >= 2).map(|held| held.mean);
        if self.is_localise_only() {
            self.vertex_ids.keep(vertices.into());
        } else {
            self.vertex_ids.update::<T>(
                &self.map,
                vertices.into(),
                self.base.map.vertices().into(),
                observations,
                label,
            );
        }
        let ids = &self.vertex_ids.ids;
        self.map.clear();
        for id in VertexId::first(vertices.into()) {
            let vertex = VertexId::first(vertices.into()).find(|&vertex| ids[vertex] == id).unwrap_or(VertexId::FIRST);
            let label = best.label(vertex.into());
            // A map of the same capacity has room for every vertex.
            let _ = self.map.add_known_vertex(label.fingerprint(), label.visits.into());
        }
        self.darts.renumber_from(&best.map, |vertex| VertexId::new(vertex).map_or(NONE, |vertex| ids[vertex].into()));
        self.path.iter_mut().zip(&best.path).take(self.record.len()).for_each(|(slot, &dart)| *slot = dart);
        self.at = best.at;
        self.add_edges();
        self.publish_probabilities()
    }

    /// Adds the edges of the published ways to the published map.
    pub(crate) fn add_edges(&mut self) {
        for (a, b) in self.darts.view().edges() {
            if let (Some(a), Some(b)) = (self.darts.view().vertex(a), self.darts.view().vertex(b)) {
                self.map.add_edge(a, b);
            }
        }
    }

    /// Finds the n-gram that the published map explains worst.
    pub(crate) fn find_worst(&mut self) {
        let place = |index| {
            let entry = self.record.get(index);
            let vertex = self.path.get(index).and_then(|&dart| VertexId::new(self.darts.vertex(dart)));
            Some((entry.steps, entry.starts(), vertex))
        };
        self.worst = worst_ngram::<V, T>(self.record.len(), &self.map, place);
    }

    /// Publishes the belief, the probability of the map, and the n-gram that it explains worst.
    fn publish_probabilities(&mut self) -> Update {
        self.find_worst();
        let Some(best) = self.beam.best() else { return Update::NONE };
        let ids = &self.vertex_ids.ids;
        let (mut same, mut all) = (0.0, 0.0);
        let mut rival = f32::NEG_INFINITY;
        let mut belief = [0.0; V];
        for hypothesis in self.beam.iter() {
            let behind = hypothesis.score() - best.score();
            if hypothesis.map_key != best.map_key {
                rival = rival.max(behind);
            }
            if behind < NEGLIGIBLE {
                continue;
            }
            let weight = libm::expf(behind.min(0.0));
            all += weight;
            if hypothesis.map_key == best.map_key {
                same += weight;
            }
            // Vertices without edges are not part of the key of a map, so the other one may have more of them.
            let vertex = VertexId::new(best.counterpart(hypothesis, self.record.len()))
                .filter(|&vertex| u8::from(vertex) < best.map.vertices());
            if let Some(slot) = vertex.and_then(|vertex| belief.get_mut(ids[vertex].index())) {
                *slot += weight;
            }
        }
        self.belief_q16.iter_mut().zip(belief).for_each(|((_, slot), weight)| *slot = (weight / all * ONE_Q16) as u32);
        self.map_probability_q16 = (same / all * ONE_Q16) as u32;
        // A place that is not on the map counts for the newest one that is.
        let at = (0..self.record.len()).rev().map(|index| best.came_by(index)).find(|&dart| dart < UNSEEN);
        let vertex = at.map_or(NONE, |at| best.map.vertex(at));
        let (labels, moves) = (best.label_evidence, best.rest);
        let lead_q16 = q16((-rival).clamp(-LEAD_MAX, LEAD_MAX));
        Update {
            place_index: self.observed.wrapping_sub(1),
            vertex: VertexId::new(vertex).map_or(VertexId::FIRST, |vertex| ids[vertex]),
            is_new: best.is_on_map() && best.label(vertex).visits == 1,
            consistency_mm: self.worst.distance_mm,
            factors: WeightFactors::Ordered(OrderedFactors { ln_labels_q16: q16(labels), ln_moves_q16: q16(moves) }),
            lead_q16,
            distinct: self.beam.len() as u8,
        }
    }

    /// The way by which the robot came to each of the newest `T` places on the best map, the oldest first; `None` where that is
    /// unknown.
    pub fn path(&self) -> impl ExactSizeIterator<Item = Option<DartId>> + '_ {
        self.path.iter().take(self.record.len()).map(|&dart| DartId::new(dart))
    }

    /// The score of the best hypothesis in nats.
    pub fn score(&self) -> f32 {
        self.beam.best().map_or(0.0, Hypothesis::score)
    }

    /// The standard deviation of the labels that is in use, in millimetres.
    pub fn noise_mm(&self) -> f32 {
        self.model.labels.noise_steps() * f32::from(Fingerprint::STEP_MM)
    }

    /// Whether the worst n-gram is farther from the map than noise explains.
    pub(super) fn has_unexplained_ngram(&self) -> bool {
        f32::from(self.worst.distance_mm) > EXPLAINED_DEVIATIONS * self.noise_mm()
    }
}

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    /// The vertex of this hypothesis where the robot is by another one: that of the newest place before at which the other one was
    /// at its vertex. [`NONE`] for a vertex that the other one visits for the first time.
    fn counterpart(&self, other: &Self, places: usize) -> u8 {
        // A place that is not on the map counts for the newest one that is.
        let Some(newest) = (0..places).rev().find(|&index| other.came_by(index) < UNSEEN) else { return NONE };
        let vertex = other.map.vertex(other.came_by(newest));
        if self.map_key == other.map_key {
            // The numbers of their ways may differ; vertices are numbered in the order of their first visit.
            return vertex;
        }
        let earlier = (0..newest).rev().find(|&index| other.map.vertex(other.came_by(index)) == vertex);
        earlier.map_or(NONE, |index| self.map.vertex(self.came_by(index)))
    }
}

/// Nats in units of 2⁻¹⁶; saturates.
fn q16(nats: f32) -> i32 {
    (nats * ONE_Q16) as i32
}
