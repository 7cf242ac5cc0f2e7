//! n-consistency: how far apart two sets of n-grams are (Definition 6, Eq. 2 and 3).

use crate::ngram::{Ngram, NgramSet};

/// The two directed halves of Eq. 2, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hausdorff {
    /// The largest distance from an n-gram of the map to its closest one of the history.
    pub map_to_history: f64,
    /// The largest distance from an n-gram of the history to its closest one of the map.
    pub history_to_map: f64,
    /// How many times two n-grams were compared (Eq. 3). Because an n-gram equals its reversal, each pair is compared
    /// twice, so this is twice the product of the two numbers of distinct n-grams: the least a plain enumeration does.
    pub comparisons: u64,
}

impl Hausdorff {
    /// The larger of the two halves: Eq. 2 as printed.
    pub fn two_sided(&self) -> f64 {
        self.map_to_history.max(self.history_to_map)
    }
}

/// **Eq. 2**: the Hausdorff distance between the n-grams of a map and those of a history, by comparing all of them.
///
/// The paper does not say what an empty set gives. Here the maximum over no n-gram is 0 and the minimum over none is
/// infinite: two empty sets agree, an empty and a non-empty one are infinitely far apart in one direction.
pub fn hausdorff(map: &NgramSet, history: &NgramSet) -> Hausdorff {
    let mut closest_of_history = vec![f64::INFINITY; history.len()];
    let mut result = Hausdorff { map_to_history: 0.0, history_to_map: 0.0, comparisons: 0 };
    for alpha in map {
        let mut closest = f64::INFINITY;
        for (beta, closest_to_beta) in history.iter().zip(&mut closest_of_history) {
            let apart = distance_either_way(alpha, beta);
            result.comparisons += 2;
            closest = closest.min(apart);
            *closest_to_beta = closest_to_beta.min(apart);
        }
        result.map_to_history = result.map_to_history.max(closest);
    }
    result.history_to_map = closest_of_history.into_iter().fold(0.0, f64::max);
    result
}

/// An n-gram equals its reversal, so two of them are as far apart as in the better of the two orientations.
fn distance_either_way(alpha: &Ngram, beta: &Ngram) -> f64 {
    let forward = distance(alpha.labels().iter(), beta.labels().iter());
    let backward = distance(alpha.labels().iter(), beta.labels().iter().rev());
    forward.min(backward)
}

/// **Eq. 3**: the distance between two n-grams, the largest difference of two labels at the same position.
pub fn distance<'a>(alpha: impl Iterator<Item = &'a f64>, beta: impl Iterator<Item = &'a f64>) -> f64 {
    alpha.zip(beta).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// **Definition 6**: two sets of n-grams are n-consistent when they are equal.
pub fn is_consistent(a: &NgramSet, b: &NgramSet) -> bool {
    a == b
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(ngrams: &[&[f64]]) -> NgramSet {
        ngrams.iter().map(|labels| Ngram::new(labels)).collect()
    }

    #[test]
    fn each_half_is_the_worst_of_the_closest() {
        let map = set(&[&[1.0, 2.0], &[10.0, 20.0]]);
        let history = set(&[&[2.0, 2.0], &[19.0, 13.0], &[50.0, 50.0]]);
        // (10, 20) and the reversal of (19, 13) are 3 apart; (50, 50) is 40 from (10, 20).
        let expected = Hausdorff { map_to_history: 3.0, history_to_map: 40.0, comparisons: 12 };
        assert_eq!(hausdorff(&map, &history), expected);
        assert_eq!(expected.two_sided(), 40.0);
    }

    #[test]
    fn empty_sets_agree_and_are_infinitely_far_from_others() {
        let some = set(&[&[1.0, 2.0]]);
        assert_eq!(hausdorff(&set(&[]), &set(&[])).two_sided(), 0.0);
        assert_eq!(hausdorff(&some, &set(&[])).map_to_history, f64::INFINITY);
        assert_eq!(hausdorff(&some, &set(&[])).history_to_map, 0.0);
        assert_eq!(hausdorff(&set(&[]), &some).history_to_map, f64::INFINITY);
    }
}
