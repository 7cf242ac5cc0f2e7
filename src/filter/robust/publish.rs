//! What the filter publishes after a place: the best map with its vertex ids, the belief, and the probability of the map.

use super::{RobustFilter, confidence};
use crate::filter::beam::Ranked as _;
use crate::filter::worst_ngram::worst_ngram;
use crate::filter::{RobustFactors, Update, WeightFactors, WorstNgram};
use crate::map::VertexId;
use crate::place::Fingerprint;

/// 1 in the unit of probabilities.
const ONE_Q16: f32 = 65536.0;

/// The largest lead that is published, in nats.
const LEAD_MAX: f32 = 15.0;

/// An n-gram that is farther from the map than this many standard deviations of a label is not explained by noise: of several
/// hundred labels the worst is about three and a half off, and the noise is an estimate.
const EXPLAINED_DEVIATIONS: f32 = 5.0;

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// Publishes the best map.
    pub(super) fn publish(&mut self) -> Update {
        let Some(best) = self.beam.best() else { return Update::NONE };
        if self.localise_only {
            self.vertex_ids.keep(best.vertices.into());
        } else {
            // The newest observation is not published yet.
            let published = self.history.len().saturating_sub(1);
            let observations = self.published_path.iter().copied().zip(best.path).take(published);
            let label = |vertex| Some(&best.statistics[vertex]).filter(|held| held.visits >= 2).map(|held| held.mean);
            self.vertex_ids.update::<HISTORY>(&self.map, best.vertices.into(), 0, observations, label);
        }
        let ids = &self.vertex_ids.ids;
        for (published, &vertex) in self.published_path.iter_mut().zip(&best.path).take(self.history.len()) {
            *published = ids[vertex];
        }
        self.map.clear();
        for id in best.vertices() {
            let vertex = best.vertices().find(|&vertex| ids[vertex] == id).unwrap_or(VertexId::FIRST);
            let statistics = &best.statistics[vertex];
            // A map of the same capacity has room for every vertex.
            let _ = self.map.add_known_vertex(statistics.mean_label(), statistics.visits.into());
        }
        self.belief_q16.fill(0);
        for vertex in best.vertices() {
            for neighbour in best.neighbours[vertex].iter() {
                self.map.add_edge(ids[vertex], ids[neighbour]);
            }
            self.belief_q16[ids[vertex]] = (self.forward.belief[vertex] * ONE_Q16) as u32;
        }
        self.worst = self.find_worst_ngram();
        let score = best.score();
        let rivals = self.beam.iter().filter(|held| held.map_alone_key() != best.map_alone_key());
        let rival = rivals.map(|rival| rival.score() - score).fold(f32::NEG_INFINITY, f32::max);
        // While the filter only localises, the map is known.
        let probability = if self.localise_only {
            1.0
        } else {
            let excess = f32::from(self.worst.distance_mm) / (EXPLAINED_DEVIATIONS * self.noise_mm());
            confidence::probability(&self.beam, self.config.hypotheses.into(), self.trials, excess)
        };
        self.map_probability_q16 = ((probability * ONE_Q16) as u32).max(1);
        let [labels, transitions, size] = best.factors(&self.model);
        Update {
            place_index: self.observed.wrapping_sub(1),
            vertex: best.at.map_or(VertexId::FIRST, |at| ids[at]),
            is_new: best.at.is_some_and(|at| best.statistics[at].visits == 1),
            consistency_mm: self.worst.distance_mm,
            factors: WeightFactors::Robust(RobustFactors {
                ln_labels_q16: q16(labels),
                ln_moves_q16: q16(transitions),
                ln_size_q16: q16(size),
            }),
            lead_q16: q16((-rival).clamp(-LEAD_MAX, LEAD_MAX)),
            distinct: self.beam.len() as u8,
        }
    }

    /// The n-gram that the published map explains worst.
    pub(crate) fn find_worst_ngram(&self) -> WorstNgram {
        let place = |index| {
            let observation = self.history.get(index)?;
            Some((observation.steps, observation.starts_sequence(), self.published_path.get(index).copied()))
        };
        worst_ngram::<V, HISTORY>(self.history.len(), &self.map, place)
    }

    /// The vertex of each of the newest `HISTORY` places on the best path of the last update, the oldest first.
    pub fn path(&self) -> impl Iterator<Item = VertexId> + '_ {
        self.published_path.iter().copied().take(self.history.len())
    }

    /// The log evidence of the best hypothesis, and the bound of its map's other paths, in nats.
    pub fn evidence(&self) -> (f32, f32) {
        self.beam.best().map_or((0.0, 0.0), |best| (best.evidence, best.other_paths))
    }

    /// The standard deviation of the labels that is in use, in millimetres.
    pub fn noise_mm(&self) -> f32 {
        self.model.noise_steps() * f32::from(Fingerprint::STEP_MM)
    }

    /// Whether the worst n-gram is farther from the map than noise explains.
    pub(super) fn has_unexplained_ngram(&self) -> bool {
        f32::from(self.worst.distance_mm) > EXPLAINED_DEVIATIONS * self.noise_mm()
    }
}

/// Nats in units of 2⁻¹⁶; saturates.
fn q16(nats: f32) -> i32 {
    (nats * ONE_Q16) as i32
}
