//! Topological SLAM from a sequence of places: the interface of a filter, the robust filter, and the paper's filter.

pub(crate) mod beam;
mod interface;
mod observation;
pub(crate) mod ordered;
mod paper;
pub(crate) mod robust;
mod vertex_ids;
mod ways;
pub(crate) mod worst_ngram;

pub use interface::{CERTAIN_Q16, Filter, FilterCapacities};
pub use observation::{Observation, Passage};
pub use ordered::{OrderedConfig, OrderedFilter};
pub use paper::{
    Consistency, Direction, Evidence, History, Ngram, NgramError, NgramLength, NgramTable, NgramsFull, PaperConfig,
    PaperFilter, Particle, Prior,
};
pub use robust::{RobustConfig, RobustFilter};
pub use ways::{Exit, Ways, WaysError};

use crate::map::VertexId;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// The random draws of one step of work: a function of the seed and the number of the step alone, so that a restored filter
/// continues with the same draws.
pub(crate) fn draws(seed: u64, number: u64) -> Xoshiro128PlusPlus {
    Xoshiro128PlusPlus::seed_from_u64(seed.wrapping_add(number.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
}

/// A number between 0 and 1, without either, from 24 random bits.
pub(crate) fn uniform(bits: u32) -> f32 {
    ((bits >> 8) as f32 + 0.5) / (1 << 24) as f32
}

/// The best hypothesis after an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Update {
    /// How many places were observed before this one.
    pub place_index: u32,
    /// The vertex of the robot (Section III.B).
    pub vertex: VertexId,
    /// Whether the vertex was added by this observation.
    pub is_new: bool,
    /// The distance of Eq. 2, or of the half of it that is configured, in millimetres; `u16::MAX` when it is infinite.
    pub consistency_mm: u16,
    /// The factors of the weight.
    pub factors: WeightFactors,
    /// By how much the weight leads that of every other prediction, at least, as a logarithm in units of 2⁻¹⁶ nats:
    /// predictions that were never proposed count with a bound on their weight. Negative when a heavier one was not
    /// drawn; 15 nats or more are reported as 15.
    pub lead_q16: i32,
    /// How many different particles survived.
    pub distinct: u8,
}

impl Update {
    /// The update of a filter that was not started.
    pub(crate) const NONE: Self = Self {
        place_index: 0,
        vertex: VertexId::FIRST,
        is_new: false,
        consistency_mm: 0,
        factors: WeightFactors::Robust(RobustFactors::ONE),
        lead_q16: 0,
        distinct: 0,
    };
}

/// The factors of the weight of a hypothesis, one variant for each filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeightFactors {
    /// Of a [`RobustFilter`].
    Robust(RobustFactors),
    /// Of a [`PaperFilter`].
    Paper(PaperFactors),
    /// Of an [`OrderedFilter`].
    Ordered(OrderedFactors),
}

impl WeightFactors {
    /// The logarithm of the weight, the sum of those of its factors, in units of 2⁻¹⁶ nats; saturates.
    #[must_use]
    pub const fn ln_weight_q16(&self) -> i32 {
        let (ln_size, ln_label, ln_rest) = match self {
            Self::Robust(factors) => (factors.ln_size_q16, factors.ln_labels_q16, factors.ln_moves_q16),
            Self::Paper(factors) => (factors.ln_size_q16, factors.ln_label_q16, factors.ln_consistency_q16),
            Self::Ordered(factors) => (0, factors.ln_labels_q16, factors.ln_moves_q16),
        };
        ln_size.saturating_add(ln_label).saturating_add(ln_rest)
    }
}

/// The factors of the weight of a hypothesis of the robust filter, as natural logarithms in units of 2⁻¹⁶ nats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobustFactors {
    /// The evidence of the observed labels, with the means and variances of the vertices integrated out.
    pub ln_labels_q16: i32,
    /// The evidence of the moves between vertices and of the hints.
    pub ln_moves_q16: i32,
    /// The prior of the numbers of vertices and edges.
    pub ln_size_q16: i32,
}

impl RobustFactors {
    /// No evidence.
    pub(crate) const ONE: Self = Self { ln_labels_q16: 0, ln_moves_q16: 0, ln_size_q16: 0 };
}

/// The factors of the weight of a hypothesis of the ordered filter, as natural logarithms in units of 2⁻¹⁶ nats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderedFactors {
    /// The evidence of the observed labels, with the means and variances of the vertices integrated out.
    pub ln_labels_q16: i32,
    /// The evidence of exits, ways, travel times and closures, and the prior of the map.
    pub ln_moves_q16: i32,
}

/// The factors of the weight of a particle of the paper's filter (Eq. 6), as natural logarithms in units of 2⁻¹⁶ nats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaperFactors {
    /// Eq. 7: how well the observation fits the label that its vertex had before.
    pub ln_label_q16: i32,
    /// Eq. 8: how consistent the map is with the history.
    pub ln_consistency_q16: i32,
    /// Eq. 9: the penalty for similar vertices.
    pub ln_size_q16: i32,
}

impl PaperFactors {
    pub(crate) const ONE: Self = Self { ln_label_q16: 0, ln_consistency_q16: 0, ln_size_q16: 0 };

    /// The logarithm of the weight (Eq. 6) in units of 2⁻¹⁶ nats; saturates.
    #[must_use]
    pub const fn ln_weight_q16(&self) -> i32 {
        WeightFactors::Paper(*self).ln_weight_q16()
    }
}

/// The n-gram of the history that is farthest from every walk of the best map, and the walk that comes nearest to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorstNgram {
    /// How far, in millimetres: the half of Eq. 2 that asks whether the map explains what was observed; `u16::MAX` when
    /// it is infinite.
    pub distance_mm: u16,
    /// How many labels the n-gram has; 0 when only the distance is known.
    pub length: u8,
    /// How many places ago the newest of its labels was observed; 0 for the newest place.
    pub newest_age: u16,
    /// The vertices of the nearest walk, the oldest first, `length` of them.
    pub vertices: [VertexId; 7],
}

impl WorstNgram {
    /// No n-gram.
    pub const NONE: Self = Self { distance_mm: 0, length: 0, newest_age: 0, vertices: [VertexId::FIRST; 7] };

    /// The vertices of the nearest walk, the oldest first.
    pub fn walk(&self) -> &[VertexId] {
        self.vertices.get(..usize::from(self.length)).unwrap_or(&self.vertices)
    }
}
