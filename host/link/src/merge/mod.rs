//! Merges two maps of one building: finds the part that both have, and folds it.
//!
//! Two ways, one of each map, taken for the same way determine an *alignment*: which vertices and ways of the maps are the
//! same, along all edges that both maps have. Each pair of ways gives one. An alignment is scored by the evidence for and
//! against it, as a log-likelihood ratio against two unrelated parts of the building. The best one is taken if its probability
//! is high enough, with the alignments that contradict it and with no common part as alternatives, and if it does not contradict
//! itself. Parts that the maps have in common elsewhere are aligned in the same way afterwards.
//!
//! ```
//! use toposlam_link::merge::{MergeError, merge};
//! use toposlam_link::topology::TopologicalMap;
//!
//! assert_eq!(merge(&TopologicalMap::default(), &TopologicalMap::default()), Err(MergeError::NoWays));
//! ```

mod alignment;
mod buildings;
mod evidence;
mod folding;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fmt;

use alignment::Alignment;
pub use buildings::{Building, buildings};
use evidence::Background;
pub use evidence::Evidence;

use crate::plural::count;
use crate::topology::TopologicalMap;

/// An alignment with a smaller probability is refused.
const LEAST_PROBABILITY: f64 = 0.99;
/// An alignment with less evidence, in nats, is refused.
const LEAST_NATS: f64 = 10.0;
/// An alignment is refused when one that contradicts it has a larger share of its evidence: the building repeats itself, and
/// evidence of vertices side by side is then not independent.
const RIVAL_SHARE: f64 = 0.5;
/// An alignment whose radii and travel times differ more is refused: a vertex of one map stands for two places.
const MISFIT_MAX: f64 = 0.9;
/// The most vertices of a merged map: those of the wire protocol.
const VERTICES_MAX: usize = 64;

/// A merged map, and what it was merged by.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// The map: the vertices of the first with their numbers, then those that only the second has.
    pub map: TopologicalMap,
    /// The vertices that both maps have, as numbers in the first and in the second.
    pub common: Vec<(u8, u8)>,
    /// The parts in common with their evidence, the one that was found first at the front.
    pub parts: Vec<Part>,
}

/// A part that both maps have.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its vertices, as numbers in the first map and in the second.
    pub common: Vec<(u8, u8)>,
    /// The evidence for and against it.
    pub evidence: Evidence,
    /// The evidence of the best alignment that contradicts it, in nats; `None` without any.
    pub rival_nats: Option<f64>,
    /// The probability of the alignment, 0 to 1.
    pub probability: f64,
}

/// Why two maps were not merged.
#[derive(Clone, Debug, PartialEq)]
pub enum MergeError {
    /// A map has no ways: only the maps of the ordered filter have them.
    NoWays,
    /// No vertex of one map is like one of the other.
    NothingInCommon,
    /// The best alignment is not certain enough. It is reported with its evidence and the reason.
    Uncertain(Doubt, Box<Part>),
    /// The merged map would have more vertices than a robot's map can have.
    TooManyVertices(usize),
}

impl fmt::Display for MergeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoWays => f.write_str("a map has no ways; only the maps of the ordered filter can be merged"),
            Self::NothingInCommon => f.write_str("the maps have nothing in common"),
            Self::Uncertain(doubt, part) => write!(f, "the common part is not certain: {doubt}: {part}"),
            Self::TooManyVertices(count) => {
                write!(f, "the merged map would have {count} vertices, but a map has at most {VERTICES_MAX}")
            }
        }
    }
}

impl std::error::Error for MergeError {}

/// Why a common part is not certain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// A way leads to two vertices: one of the maps is wrong.
    Contradiction,
    /// Radii and travel times differ too much: one of the maps is wrong.
    Misfit,
    /// The evidence is too small.
    LittleEvidence,
    /// An alignment that contradicts it has much of its evidence: the building repeats itself, or is symmetric.
    Repetition,
    /// The alternatives are too probable.
    Probability,
    /// The maps can be drawn in the plane, and the merged one cannot.
    Genus,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Contradiction => "the maps contradict each other, so one of them is wrong",
            Self::Misfit => "radii and travel times differ too much, so one of the maps is wrong",
            Self::LittleEvidence => "the maps have too little in common; larger maps have more",
            Self::Repetition => {
                "the building is symmetric or repeats itself, and another alignment has more than half of the evidence"
            }
            Self::Probability => "the alternatives are too probable; larger maps tell them apart",
            Self::Genus => "the merged map cannot be drawn in the plane, but both maps can",
        })
    }
}

impl Part {
    /// Why the part is not certain; `None` if it is.
    fn doubt(&self) -> Option<Doubt> {
        let nats = self.evidence.total();
        let repeats = self.rival_nats.is_some_and(|rival_nats| rival_nats > RIVAL_SHARE * nats);
        let doubts = [
            (self.evidence.contradictions > 0, Doubt::Contradiction),
            (self.evidence.misfit() > MISFIT_MAX, Doubt::Misfit),
            (nats < LEAST_NATS, Doubt::LittleEvidence),
            (repeats, Doubt::Repetition),
            (self.probability < LEAST_PROBABILITY, Doubt::Probability),
        ];
        doubts.into_iter().find(|(holds, _)| *holds).map(|(_, doubt)| doubt)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = 100.0 * self.probability;
        write!(f, "{}, probability {percent:.1} %, {}", count(self.common.len(), "vertex", "vertices"), self.evidence)?;
        match self.rival_nats {
            Some(nats) => write!(f, "; the best alternative has {nats:.1} nats"),
            None => f.write_str("; no alternative"),
        }
    }
}

/// Merges two maps of one building.
///
/// Cost: O(D² · V) for maps of V vertices and D ways, but most alignments end after a few vertices.
///
/// # Errors
/// [`MergeError`] when the maps cannot be merged, or have no common part that is certain.
pub fn merge(first: &TopologicalMap, second: &TopologicalMap) -> Result<Merged, MergeError> {
    if first.ways.is_empty() || second.ways.is_empty() {
        return Err(MergeError::NoWays);
    }
    let background = Background::of(first, second);
    let alignments = alignments(first, second, &background);
    let genus_max = folding::genus(first).max(folding::genus(second));
    let mut whole = Alignment::default();
    let mut merged = None;
    let mut parts = Vec::new();
    while let Some((alignment, part)) = best(&alignments, &whole) {
        let joined = whole.with(alignment);
        let folded = folding::fold(first, second, &joined);
        let doubt = part.doubt().or_else(|| (folding::genus(&folded) > genus_max).then_some(Doubt::Genus));
        match doubt {
            None => {
                whole = joined;
                merged = Some(folded);
                parts.push(part);
            }
            Some(doubt) if parts.is_empty() => return Err(MergeError::Uncertain(doubt, Box::new(part))),
            Some(_) => break,
        }
    }
    let map = merged.ok_or(MergeError::NothingInCommon)?;
    if map.vertices.len() > VERTICES_MAX {
        return Err(MergeError::TooManyVertices(map.vertices.len()));
    }
    Ok(Merged { map, common: whole.vertex_pairs(), parts })
}

/// All different alignments with a positive score.
fn alignments(first: &TopologicalMap, second: &TopologicalMap, background: &Background) -> Vec<Alignment> {
    let mut different: BTreeMap<Vec<(u8, u8)>, Alignment> = BTreeMap::new();
    for (way, _) in first.all_ways() {
        for (other, _) in second.all_ways() {
            let alignment = Alignment::from_pair(first, second, background, way, other);
            if alignment.evidence.total() > 0.0 {
                let known = different.entry(alignment.vertex_pairs()).or_insert_with(|| alignment.clone());
                if known.evidence.total() < alignment.evidence.total() {
                    *known = alignment;
                }
            }
        }
    }
    different.into_values().collect()
}

/// The best alignment of the vertices that are not merged yet, with its probability.
fn best<'a>(alignments: &'a [Alignment], whole: &Alignment) -> Option<(&'a Alignment, Part)> {
    let open: Vec<&Alignment> = alignments.iter().filter(|alignment| alignment.is_disjoint_from(whole)).collect();
    let score = |alignment: &Alignment| alignment.evidence.total();
    let best = *open.iter().max_by(|a, b| score(a).total_cmp(&score(b)))?;
    let rivals = || open.iter().filter(|rival| best.contradicts(rival));
    let rival_nats = rivals().map(|rival| score(rival)).max_by(f64::total_cmp);
    // Beforehand all alignments are equally probable, and no common part is as probable as all of them together.
    let against: f64 = rivals().map(|rival| (score(rival) - score(best)).exp()).sum();
    let unrelated = open.len() as f64 * (-score(best)).exp();
    let probability = 1.0 / (1.0 + against + unrelated);
    Some((best, Part { common: best.vertex_pairs(), evidence: best.evidence, rival_nats, probability }))
}
