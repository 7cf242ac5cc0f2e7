//! The results of an evaluation, in the form of the JSON object of `toposlam evaluate`.

mod table;

use super::{
    case::Case,
    judge::{Judgement, PathResult},
    reliability::Reliability,
    settings::{Filter, Settings},
    walk::EXHAUSTIVE_FROM_LENGTH,
};
use serde::Serialize;
use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};
use toposlam::{Direction, OrderedConfig, PaperConfig, RobustConfig};

/// The width of a bin of [`Row::consistency_bins`], in millimetres.
pub const BIN_MM: u16 = 20;

/// The results of one run; serialises to the JSON object of `toposlam evaluate`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What holds for all rows.
    pub settings: SettingsReport,
    /// One row for each case, filter and check point, in the requested order.
    pub rows: Vec<Row>,
}

/// The settings of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SettingsReport {
    /// The seed of all paths.
    pub seed: u64,
    /// How the paths were drawn: `uniform`, `forward` or `explore`.
    pub walk: &'static str,
    /// Where the n-grams of the environment came from: `path`, `exploration` or `none`.
    pub prior: String,
    /// The hints besides fingerprints, as on the command line.
    pub hints: String,
    /// How the bearings of ways were drawn: `spread` or `right-angles`.
    pub bearings: &'static str,
    /// Refinement steps of the filter after each place.
    pub refinement_steps: u32,
    /// Refinement steps of the filter after each place of the prior.
    pub prior_refinement_steps: u32,
    /// Refinement steps of a search from the true path; 0 without one.
    pub search_from_truth: u32,
    /// How many bits a fingerprint has.
    pub fingerprint_bits: u32,
    /// The length `n` of an n-gram.
    pub ngram_length: u8,
    /// The parameters of the filters that ran, by their names.
    pub filters: BTreeMap<&'static str, FilterReport>,
}

/// The parameters of one filter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum FilterReport {
    /// Those of the paper's filter.
    Paper {
        /// N.
        hypotheses: u8,
        /// phi of Eq. 9.
        penalty: f64,
        /// sigma_l of Eq. 7 and 9, in millimetres.
        sigma_label_mm: u16,
        /// sigma_c of Eq. 8, in millimetres.
        sigma_consistency_mm: u16,
        /// The direction of Eq. 2, as on the command line.
        consistency: &'static str,
    },
    /// Those of the robust filter.
    Robust {
        /// Number of hypotheses.
        hypotheses: u8,
        /// Initial estimate of the standard deviation of a fingerprint, in millimetres.
        noise_mm: u16,
        /// Number of repair moves tried at each place.
        moves: u8,
        /// Probability of a wrong turn in the filter's model, 0 to 1.
        wrong_turn: f64,
        /// Probability of a wrong degree in the filter's model, 0 to 1.
        wrong_degree: f64,
    },
    /// Those of the ordered filter. The probabilities and the noise are those of the filter's model.
    Ordered {
        /// Initial estimate of the standard deviation of a fingerprint, in millimetres.
        noise_mm: u16,
        /// Probability of a wrong exit, 0 to 1.
        wrong_exit: f64,
        /// Probability that a way is not seen, 0 to 1.
        missed_way: f64,
        /// Probability that something is seen that is no way, 0 to 1.
        false_way: f64,
        /// Standard deviation of a bearing, in milliradians.
        bearing_noise_mrad: u16,
        /// Standard deviation of a travel time, as a share of it.
        travel_noise: f64,
    },
}

impl SettingsReport {
    /// The settings of one or more evaluations that differ only in their filter.
    pub fn of(settings: &Settings, filters: &[Filter]) -> Self {
        Self {
            seed: settings.seed,
            walk: settings.walk.name(),
            prior: settings.prior.name().into(),
            hints: settings.hints.to_string(),
            bearings: settings.bearings.name(),
            refinement_steps: settings.refinement_steps,
            prior_refinement_steps: settings.prior_refinement_steps,
            search_from_truth: settings.search_from_truth,
            fingerprint_bits: settings.fingerprint_bits,
            ngram_length: settings.ngram_length.get(),
            filters: filters.iter().map(|&filter| (filter.name(), filter.into())).collect(),
        }
    }
}

impl From<Filter> for FilterReport {
    fn from(filter: Filter) -> Self {
        match filter {
            Filter::Paper(PaperConfig {
                particles,
                penalty_permille,
                sigma_label_mm,
                sigma_consistency_mm,
                direction,
                ..
            }) => Self::Paper {
                hypotheses: particles,
                penalty: f64::from(penalty_permille) / 1000.0,
                sigma_label_mm,
                sigma_consistency_mm,
                consistency: match direction {
                    Direction::TwoSided => "two-sided",
                    Direction::MapToHistory => "map-to-history",
                    Direction::HistoryToMap => "history-to-map",
                },
            },
            Filter::Robust(RobustConfig {
                hypotheses,
                noise_mm,
                moves,
                wrong_turn_permille,
                wrong_degree_permille,
                ..
            }) => Self::Robust {
                hypotheses,
                noise_mm,
                moves,
                wrong_turn: f64::from(wrong_turn_permille) / 1000.0,
                wrong_degree: f64::from(wrong_degree_permille) / 1000.0,
            },
            Filter::Ordered(OrderedConfig {
                noise_mm,
                wrong_exit_permille,
                missed_way_permille,
                false_way_permille,
                bearing_noise_mrad,
                travel_noise_permille,
                ..
            }) => Self::Ordered {
                noise_mm,
                wrong_exit: f64::from(wrong_exit_permille) / 1000.0,
                missed_way: f64::from(missed_way_permille) / 1000.0,
                false_way: f64::from(false_way_permille) / 1000.0,
                bearing_noise_mrad,
                travel_noise: f64::from(travel_noise_permille) / 1000.0,
            },
        }
    }
}

/// The results of one filter in one case, judged at one check point. Shares lie between 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The name of the case: an environment, placements or a family.
    pub name: String,
    /// Number of its environments.
    pub environments: usize,
    /// The seed they were drawn with; `null` for an environment from a file.
    pub environment_seed: Option<u64>,
    /// The filter: `ordered`, `robust` or `paper`.
    pub filter: &'static str,
    /// Number of paths.
    pub paths: usize,
    /// Number of places after which the map was judged.
    pub length: usize,
    /// The share of maps that are exactly right.
    pub exact: f64,
    /// The 95 % confidence interval of [`Row::exact`] (Wilson), for independent paths. Where several paths share a
    /// random environment, it is too narrow for the class of environments.
    pub exact_interval: [f64; 2],
    /// The share of maps that have the right vertices and edges, whatever the order of the ways; absent for maps that are not
    /// judged by their ways.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact_edges: Option<f64>,
    /// The share of maps that are isomorphic to the truth, regardless of labels.
    pub isomorphic: f64,
    /// How many maps are exact, by the probability that the filter states.
    pub reliability: Reliability,
    /// Number of maps for each number of vertices (the paper's Fig. 5).
    pub vertices: BTreeMap<usize, usize>,
    /// The mean over paths of [`MapScore::edge_f1`](super::score::MapScore::edge_f1).
    pub edge_f1: f64,
    /// The share of places at which the best hypothesis of that moment was localised.
    pub location_online: f64,
    /// The share of places that are right on the path of the map at the check point.
    pub location_smoothed: f64,
    /// The two-sided distance (Eq. 2) of the map from the n-grams of the environment.
    pub consistency_mm: Distribution<u16>,
    /// Number of maps for each range of distances, 20 mm wide and named by its lower bound in millimetres (the paper's
    /// Fig. 4); an infinite distance is in bin 65520.
    pub consistency_bins: BTreeMap<u16, usize>,
    /// The place from which on the map was exact, up to the check point, tested after every tenth place. Over all
    /// paths: `null` where the map of that path is not exact.
    pub places_until_exact: Distribution<Option<usize>>,
    /// Number of paths that do not traverse every edge although their whole length requires it.
    pub paths_not_exhaustive: usize,
    /// Number of times, up to the end of the paths, that a filter needed a new vertex and its map was full.
    pub vertices_full: u64,
    /// The share of paths for which a long search from the true path ends in another map, so that no better search for
    /// the same score finds the truth; absent without such a search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// Processor time to map the n-grams of the prior, in seconds a path; differs from run to run.
    pub prior_seconds: f64,
    /// Processor time of one filter update and the refinement before it, in seconds; differs from run to run.
    pub seconds_per_place: f64,
}

/// Median and 90th percentile over paths, each a value that occurred (nearest rank).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Distribution<T> {
    /// Half of the values are not larger.
    pub median: T,
    /// Nine tenths of the values are not larger.
    pub p90: T,
}

impl<T: Ord + Copy + Default> Distribution<T> {
    /// The distribution of some values; the default without values.
    pub fn of(mut values: Vec<T>) -> Self {
        values.sort_unstable();
        let rank = |percent: usize| (values.len() * percent).div_ceil(100).saturating_sub(1);
        let at = |percent| values.get(rank(percent)).copied().unwrap_or_default();
        Self { median: at(50), p90: at(90) }
    }
}

impl Distribution<Option<usize>> {
    /// As [`Distribution::of`], with `None` for a value beyond every number.
    fn of_reached(values: impl Iterator<Item = Option<usize>>) -> Self {
        let Distribution { median, p90 } = Distribution::of(values.map(|value| value.unwrap_or(usize::MAX)).collect());
        let reached = |value| Some(value).filter(|&value| value != usize::MAX);
        Self { median: reached(median), p90: reached(p90) }
    }
}

/// The 95 % confidence interval of a share after Wilson.
fn wilson(share: f64, count: usize) -> [f64; 2] {
    const Z: f64 = 1.959_964;
    let count = count as f64;
    let middle = share + Z * Z / (2.0 * count);
    let half = Z * (share * (1.0 - share) / count + Z * Z / (4.0 * count * count)).sqrt();
    let scale = 1.0 + Z * Z / count;
    [((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0)]
}

/// Summarises the paths of a case, one row for each check point.
pub(super) fn rows(case: &Case, settings: &Settings, results: &[PathResult]) -> Vec<Row> {
    (0..settings.lengths.len()).map(|check_point| row(case, settings, results, check_point)).collect()
}

fn row(case: &Case, settings: &Settings, results: &[PathResult], check_point: usize) -> Row {
    let judged = || results.iter().map(|result| &result.judgements[check_point]);
    let mean = |value: fn(&Judgement) -> f64| judged().map(value).sum::<f64>() / results.len() as f64;
    let mut vertices = BTreeMap::new();
    let mut consistency_bins = BTreeMap::new();
    for judgement in judged() {
        *vertices.entry(judgement.vertices).or_insert(0) += 1;
        *consistency_bins.entry(judgement.consistency_mm / BIN_MM * BIN_MM).or_insert(0) += 1;
    }
    let exact = mean(|judgement| f64::from(u8::from(judgement.score.exact)));
    let length = settings.lengths[check_point];
    let filter_time: Duration = judged().map(|judgement| judgement.filter_time).sum();
    let prior_time: Duration = results.iter().map(|result| result.prior_time).sum();
    let share = |value: fn(&Judgement) -> Option<bool>| {
        let values: Vec<bool> = judged().filter_map(value).collect();
        let hits = values.iter().filter(|&&value| value).count();
        (!values.is_empty()).then(|| hits as f64 / values.len() as f64)
    };
    let missed = results.iter().filter(|result| !result.exhaustive).count();
    Row {
        name: case.name.clone(),
        environments: case.environments.len(),
        environment_seed: case.environment_seed,
        filter: settings.filter.name(),
        paths: settings.paths,
        length,
        exact,
        exact_interval: wilson(exact, results.len()),
        exact_edges: share(|judgement| judgement.exact_edges),
        isomorphic: mean(|judgement| f64::from(u8::from(judgement.score.isomorphic))),
        reliability: Reliability::of(judged().map(|judgement| (judgement.map_probability, judgement.score.exact))),
        vertices,
        edge_f1: mean(|judgement| judgement.score.edge_f1),
        location_online: mean(|judgement| judgement.localised_share),
        location_smoothed: mean(|judgement| judgement.score.location),
        consistency_mm: Distribution::of(judged().map(|judgement| judgement.consistency_mm).collect()),
        consistency_bins,
        places_until_exact: Distribution::of_reached(judged().map(|judgement| judgement.exact_from)),
        paths_not_exhaustive: if settings.longest() >= EXHAUSTIVE_FROM_LENGTH { missed } else { 0 },
        vertices_full: results.iter().map(|result| u64::from(result.vertices_full)).sum(),
        limit: share(|judgement| judgement.leaves_truth),
        prior_seconds: prior_time.as_secs_f64() / results.len() as f64,
        seconds_per_place: filter_time.as_secs_f64() / (results.len() * length) as f64,
    }
}

impl Report {
    /// The reliability of each filter over all rows.
    pub fn reliability(&self) -> impl Iterator<Item = (&'static str, Reliability)> {
        let names: BTreeSet<&'static str> = self.rows.iter().map(|row| row.filter).collect();
        names.into_iter().map(|name| {
            let rows = self.rows.iter().filter(|row| row.filter == name);
            (name, Reliability::sum(rows.map(|row| &row.reliability)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_of_a_distribution_are_nearest_ranks() {
        assert_eq!(Distribution::of((1_u16..=10).rev().collect()), Distribution { median: 5, p90: 9 });
        assert_eq!(Distribution::of(vec![7_u16]), Distribution { median: 7, p90: 7 });
        assert_eq!(Distribution::of(Vec::<u16>::new()), Distribution::default());
    }

    #[test]
    fn maps_that_are_never_exact_come_last() {
        let values = [None, Some(30), Some(10), Some(20)];
        assert_eq!(Distribution::of_reached(values.into_iter()), Distribution { median: Some(20), p90: None });
    }

    #[test]
    fn the_interval_of_a_share_is_the_wilson_interval() {
        // Published values for 0 of 10, 8 of 10 and 10 of 10.
        for (hits, low, high) in [(0.0, 0.0, 0.2775), (8.0, 0.4902, 0.9433), (10.0, 0.7225, 1.0)] {
            let [least, most] = wilson(hits / 10.0, 10);
            assert!((least - low).abs() < 1e-4 && (most - high).abs() < 1e-4, "{least} {most}");
        }
    }
}
