//! Why the filter chose its best map.

use serde::{Deserialize, Serialize};

use crate::filter::{Update, WeightFactors};

/// The evidence for the best map after a place. Logarithms are natural, in units of 2⁻¹⁶ nats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Evidence {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// The distance of Eq. 2 between the map and the history in millimetres, 65535 if it is infinite. The robust filter and
    /// the reference settings of the paper's filter take the half from the history to the map.
    pub consistency_mm: u16,
    /// The factors of the weight of the best hypothesis.
    pub factors: Factors,
    /// The lead of the best hypothesis over its best rival, as a difference of logarithms of weights: −15 to 15 nats.
    pub lead_q16: i32,
    /// The number of distinct hypotheses.
    pub distinct_hypotheses: u16,
}

/// The factors of a weight, one variant for each filter. Append-only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Factors {
    /// The factors of a [`RobustFilter`](crate::RobustFilter): evidence of its hypothesis and prior of its map.
    Robust {
        /// The evidence of the observed labels, with the means and variances of the vertices integrated out.
        ln_labels_q16: i32,
        /// The evidence of the moves between vertices and of the hints.
        ln_moves_q16: i32,
        /// The prior of the numbers of vertices and edges.
        ln_size_q16: i32,
    },
    /// The factors of a [`PaperFilter`](crate::PaperFilter).
    Paper {
        /// Eq. 7: how well the observation fits the label of its vertex.
        ln_label_q16: i32,
        /// Eq. 8: how consistent the map is with the history.
        ln_consistency_q16: i32,
        /// Eq. 9: the penalty for similar vertices.
        ln_size_q16: i32,
    },
    /// The factors of an [`OrderedFilter`](crate::OrderedFilter).
    Ordered {
        /// The evidence of the observed labels, with the means and variances of the vertices integrated out.
        ln_labels_q16: i32,
        /// The evidence of exits, ways, travel times and closures, and the prior of the map.
        ln_moves_q16: i32,
    },
}

impl From<WeightFactors> for Factors {
    fn from(factors: WeightFactors) -> Self {
        match factors {
            WeightFactors::Robust(factors) => Self::Robust {
                ln_labels_q16: factors.ln_labels_q16,
                ln_moves_q16: factors.ln_moves_q16,
                ln_size_q16: factors.ln_size_q16,
            },
            WeightFactors::Ordered(factors) => {
                Self::Ordered { ln_labels_q16: factors.ln_labels_q16, ln_moves_q16: factors.ln_moves_q16 }
            }
            WeightFactors::Paper(factors) => Self::Paper {
                ln_label_q16: factors.ln_label_q16,
                ln_consistency_q16: factors.ln_consistency_q16,
                ln_size_q16: factors.ln_size_q16,
            },
        }
    }
}

impl From<&Update> for Evidence {
    fn from(update: &Update) -> Self {
        Self {
            place_index: update.place_index,
            consistency_mm: update.consistency_mm,
            factors: update.factors.into(),
            lead_q16: update.lead_q16,
            distinct_hypotheses: u16::from(update.distinct),
        }
    }
}
