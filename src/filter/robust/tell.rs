//! What the filter tells of its best map: graph and numbers, where the robot may be, how far the map is to be trusted.

use super::{RobustFilter, worst};
use crate::filter::{RobustFactors, Update, WeightFactors, WorstNgram};
use crate::map::bits;
use crate::{Fingerprint, Map, VertexId};

/// One in the unit of probabilities.
const ONE_Q16: f32 = 65536.0;

/// The largest lead that is told, in nats.
const LEAD_MAX: f32 = 15.0;

/// The worst label of several hundred is some three and a half standard deviations off; the noise is an estimate as well.
const EXPLAINED_DEVIATIONS: f32 = 5.0;

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// Tells the best map under the numbers that its vertices are known by.
    pub(super) fn publish(&mut self) -> Update {
        let Some(best) = self.beam.get(0) else { return Update::NONE };
        if self.localise_only {
            self.names.hold(&self.record, best);
        } else {
            self.names.follow(&self.record, &self.map, best);
        }
        self.map.clear();
        for name in 0..best.vertices {
            let vertex = (0..best.vertices).find(|&vertex| self.names.name(vertex) == name).unwrap_or(0);
            let tally = best.tally(vertex);
            // A map of the same capacity has room for every vertex.
            let _ = self.map.add_known_vertex(tally.mean_label(), tally.visits.into());
        }
        self.belief_q16 = [0; V];
        for vertex in 0..best.vertices {
            let name = self.names.name(vertex);
            for neighbour in bits(best.row(vertex).into()) {
                if let (Some(a), Some(b)) = (VertexId::new(name), VertexId::new(self.names.name(neighbour))) {
                    self.map.add_edge(a, b);
                }
            }
            let probability = self.forward.belief.get(usize::from(vertex)).copied().unwrap_or(0.0);
            if let Some(belief) = self.belief_q16.get_mut(usize::from(name)) {
                *belief = (probability * ONE_Q16) as u32;
            }
        }
        self.worst = worst::worst_ngram(&self.record, &self.map, self.names.path());
        let (mut same, mut all) = (0.0, 0.0);
        let mut rival = f32::NEG_INFINITY;
        for hypothesis in self.beam.iter() {
            let behind = hypothesis.score() - best.score();
            let weight = libm::expf(behind.min(0.0));
            all += weight;
            if hypothesis.map_alone_key() == best.map_alone_key() {
                same += weight;
            } else {
                rival = rival.max(behind);
            }
        }
        self.map_probability_q16 = (same / all * ONE_Q16) as u32;
        let factors = best.factors(&self.prices);
        Update {
            place_index: self.observed.wrapping_sub(1),
            vertex: VertexId::new(self.names.name(best.place)).unwrap_or(VertexId::FIRST),
            is_new: best.tally(best.place).visits == 1,
            consistency_mm: self.worst.distance_mm,
            factors: WeightFactors::Robust(RobustFactors {
                ln_labels_q16: q16(factors[0]),
                ln_moves_q16: q16(factors[1]),
                ln_size_q16: q16(factors[2]),
            }),
            lead_q16: q16((-rival).clamp(-LEAD_MAX, LEAD_MAX)),
            distinct: self.beam.len() as u8,
        }
    }

    /// The best map. Its vertices keep their numbers from update to update as far as it goes; see
    /// [`RobustFilter::renamed`].
    pub fn map(&self) -> &Map<V> {
        &self.map
    }

    /// The vertex that each of the newest `HISTORY` places was taken for, the oldest first, as the best hypothesis saw the
    /// past at the last update.
    pub fn path(&self) -> impl Iterator<Item = VertexId> + '_ {
        self.names.path().iter().filter_map(|&vertex| VertexId::new(vertex)).take(self.record.len())
    }

    /// The vertex of a place on that path, so many places ago, 0 for the newest.
    pub fn recent(&self, ago: usize) -> Option<VertexId> {
        let index = self.record.len().checked_sub(ago)?.checked_sub(1)?;
        VertexId::new(*self.names.path().get(index)?)
    }

    /// The probability that the robot is at a vertex of the best map, given that map, in units of 2⁻¹⁶.
    pub fn place_probability_q16(&self, vertex: VertexId) -> u32 {
        self.belief_q16.get(vertex.index()).copied().unwrap_or(0)
    }

    /// The probability that the best map is right, were one of the hypotheses right, in units of 2⁻¹⁶.
    pub fn map_probability_q16(&self) -> u32 {
        self.map_probability_q16
    }

    /// For each vertex before the last update its number now; `None` when it is gone. A vertex that was merged into
    /// another has the number of the other.
    pub fn renamed(&self, before: VertexId) -> Option<VertexId> {
        self.names.renamed(before)
    }

    /// The n-gram of the history that is farthest from every walk of the best map.
    pub fn worst(&self) -> WorstNgram {
        self.worst
    }

    /// Whether some n-gram of the history is farther from every walk of the best map than noise makes it.
    pub fn is_in_doubt(&self) -> bool {
        f32::from(self.worst.distance_mm) > EXPLAINED_DEVIATIONS * self.noise_mm()
    }

    /// The logarithm of the evidence of the best hypothesis, and what its map gains from other paths, in nats.
    pub fn evidence(&self) -> (f32, f32) {
        self.beam.get(0).map_or((0.0, 0.0), |best| (best.evidence, best.surplus))
    }

    /// The standard deviation of a fingerprint that the filter works with now, in millimetres.
    pub fn noise_mm(&self) -> f32 {
        self.prices.noise_steps() * f32::from(Fingerprint::STEP_MM)
    }
}

/// Nats in units of 2⁻¹⁶; saturates.
fn q16(nats: f32) -> i32 {
    (nats * ONE_Q16) as i32
}
