//! What an evaluation prints: the JSON object and the table.

use serde::Serialize;
use std::{collections::BTreeMap, fmt};

/// The results for all environments of one run; serialises to the JSON object of `toposlam evaluate`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// One entry for each environment, in the order asked for.
    pub environments: Vec<EnvironmentReport>,
}

/// The results for one environment. Shares lie between 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnvironmentReport {
    /// The name of the environment.
    pub name: String,
    /// The filter: `paper`.
    pub filter: String,
    /// Where the n-grams of the environment came from: `path`, `exploration` or `none`.
    pub prior: String,
    /// How many paths were drawn.
    pub paths: usize,
    /// How many places each path visits.
    pub length: usize,
    /// How many particles the filter draws.
    pub particles: u8,
    /// The seed of all paths.
    pub seed: u64,
    /// The share of final maps that are exactly right.
    pub exact: f64,
    /// The share of final maps that are right but for their labels.
    pub isomorphic: f64,
    /// How many of the final maps have this many vertices.
    pub vertices: BTreeMap<usize, usize>,
    /// The mean over paths of [`MapScore::edge_f1`](super::score::MapScore::edge_f1) of the final map.
    pub edge_f1: f64,
    /// The share of steps at which the best hypothesis of that moment knew where the robot was.
    pub location_online: f64,
    /// The share of steps at which the path of the final map is right.
    pub location_smoothed: f64,
    /// The two-sided distance (Eq. 2) of the final map from the n-grams of the environment.
    pub consistency_mm: Distribution,
    /// Wall-clock time of one filter update, in seconds, on one thread. The only entry that differs from run to run.
    pub seconds_per_place: f64,
}

/// Two points of a distribution over paths, each a value that occurred (nearest rank).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Distribution {
    /// Half of the values are not larger.
    pub median: u16,
    /// Nine tenths of the values are not larger.
    pub p90: u16,
}

impl Distribution {
    /// The distribution of some values; all zero without values.
    pub fn of(mut values: Vec<u16>) -> Self {
        values.sort_unstable();
        let rank = |percent: usize| (values.len() * percent).div_ceil(100).saturating_sub(1);
        let at = |percent| values.get(rank(percent)).copied().unwrap_or(0);
        Self { median: at(50), p90: at(90) }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let header = ["exact", "isomorphic", "edge F1", "online", "smoothed", "median mm", "p90 mm", "ms/place"];
        write!(f, "{:<24}{:<13}", "environment", "prior")?;
        header.iter().try_for_each(|title| write!(f, "{title:>11}"))?;
        writeln!(f, "  vertices: maps")?;
        for row in &self.environments {
            write!(f, "{:<24}{:<13}", row.name, row.prior)?;
            for share in [row.exact, row.isomorphic, row.edge_f1, row.location_online, row.location_smoothed] {
                write!(f, "{share:>11.3}")?;
            }
            write!(f, "{:>11}{:>11}", row.consistency_mm.median, row.consistency_mm.p90)?;
            write!(f, "{:>11.3} ", row.seconds_per_place * 1e3)?;
            row.vertices.iter().try_for_each(|(vertices, maps)| write!(f, " {vertices}:{maps}"))?;
            writeln!(f)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_points_of_a_distribution_are_nearest_ranks() {
        assert_eq!(Distribution::of((1..=10).rev().collect()), Distribution { median: 5, p90: 9 });
        assert_eq!(Distribution::of(vec![7]), Distribution { median: 7, p90: 7 });
        assert_eq!(Distribution::of(vec![]), Distribution::default());
    }
}
