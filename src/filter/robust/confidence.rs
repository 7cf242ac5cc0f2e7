//! How probable it is that the best map is right.
//!
//! The scores of the hypotheses do not suffice: the model is an approximation, and the search may have missed the right map. A search
//! that has found it finds it again: folds start from the history, and each new place may lead to a better map.

use super::beam::Beam;
use crate::filter::beam::Ranked as _;

/// This share of the difference of two scores counts, because the model is an approximation.
const SCORE_SHARE: f32 = 0.5;

/// The weight of maps that no search finds, relative to that of the best one.
const UNSEEN: f32 = 0.1;

/// After this many places the odds of a map are even, if folds find it as often as they miss it and its rivals have its weight.
const EVEN_PLACES: f32 = 65.0;

/// The odds grow with this power of the places, and with this power of the ratio of the folds.
const PLACES_POWER: f32 = 0.7;
const FOLDS_POWER: f32 = 0.5;

/// The evidence for the best map since a refinement step found it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Trials {
    /// The places observed since then.
    pub(crate) places: u16,
    /// The folds since then, with the noise of the model, that led to the best map, and those that led to another map.
    pub(crate) found: u8,
    pub(crate) missed: u8,
}

impl Trials {
    /// Those of a map that was just found.
    pub(crate) const NONE: Self = Self { places: 0, found: 0, missed: 0 };

    /// Those of a map that was given.
    pub(super) const OF_KNOWN_MAP: Self = Self { places: 512, ..Self::NONE };

    /// Counts a place.
    pub(super) fn add_place(&mut self) {
        self.places = self.places.saturating_add(1);
    }

    /// Counts a fold.
    pub(super) fn add_fold(&mut self, is_found: bool) {
        if self.found.max(self.missed) == u8::MAX {
            self.found /= 2;
            self.missed /= 2;
        }
        *(if is_found { &mut self.found } else { &mut self.missed }) += 1;
    }

    /// The logarithm of the odds that the trials give.
    fn ln_odds(&self) -> f32 {
        let ln = |count: f32| libm::logf(count + 1.0);
        FOLDS_POWER * (ln(self.found.into()) - ln(self.missed.into()))
            + PLACES_POWER * (ln(self.places.into()) - libm::logf(EVEN_PLACES))
    }
}

/// The probability that the best map of a beam of `wanted` hypotheses at most is right. The odds are the product of
///
/// ```text
/// same / (rivals + beyond + UNSEEN · same)            weights e^(lead · SCORE_SHARE); beyond: the worst hypothesis of a full beam
/// √((found + 1) / (missed + 1))                       the folds since the map was found
/// ((places + 1) / EVEN_PLACES)^PLACES_POWER           the places since then
/// min(1, EXPLAINED_DEVIATIONS · s / d)                d: the distance of the worst n-gram from the map
/// ```
///
/// `excess` is the reciprocal of the last one, if it is more than 1. The constants were fitted by logistic regression, on random families
/// that are not those of the evaluation. Cost: O(N).
pub(super) fn probability<const N: usize, const V: usize, const T: usize>(
    beam: &Beam<N, V, T>,
    wanted: usize,
    trials: Trials,
    excess: f32,
) -> f32 {
    let Some(best) = beam.best() else { return 0.0 };
    let (mut same, mut rivals, mut beyond) = (0.0, 0.0, 0.0);
    for hypothesis in beam.iter() {
        let lead = (best.score() - hypothesis.score()).max(0.0);
        beyond = libm::expf(-lead * SCORE_SHARE);
        *(if hypothesis.map_alone_key() == best.map_alone_key() { &mut same } else { &mut rivals }) += beyond;
    }
    if beam.len() < wanted {
        beyond = 0.0;
    }
    let odds = same / (rivals + beyond + UNSEEN * same);
    let ln_odds = libm::logf(odds) + trials.ln_odds() - libm::logf(excess.max(1.0));
    1.0 / (1.0 + libm::expf(-ln_odds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::robust::hypothesis::Hypothesis;

    type Hypotheses = Beam<4, 4, 8>;

    /// A beam of hypotheses with these leads of the best one; each has another map.
    fn beam(leads: &[f32]) -> Hypotheses {
        let mut beam = Hypotheses::new();
        let mut hypothesis = Hypothesis::UNUSED;
        for (number, lead) in (0..).zip(leads) {
            hypothesis.map_key = number;
            hypothesis.evidence = -lead;
            if number == 0 {
                beam.start_with(&hypothesis);
            } else {
                beam.insert(&hypothesis, 4);
            }
        }
        beam
    }

    const PROVEN: Trials = Trials { places: 200, found: 40, missed: 2 };

    #[test]
    fn a_lone_survivor_is_not_certain() {
        let lone = probability(&beam(&[0.0]), 4, Trials::NONE, 1.0);
        assert!((0.3..0.9).contains(&lone), "{lone}");
    }

    #[test]
    fn what_is_outside_a_full_beam_counts_as_a_rival() {
        let rivals = beam(&[0.0, 4.0, 4.0, 4.0]);
        let [full, free] = [4, 5].map(|wanted| probability(&rivals, wanted, PROVEN, 1.0));
        assert!(full < free, "{full} {free}");
    }

    #[test]
    fn a_map_that_folds_find_again_and_that_stands_is_more_probable() {
        let rivals = beam(&[0.0, 2.0]);
        let of = |places, found, missed| probability(&rivals, 4, Trials { places, found, missed }, 1.0);
        assert!(of(50, 20, 5) > of(50, 5, 20) && of(100, 10, 10) > of(10, 10, 10));
        assert!(of(200, 40, 2) > 0.8 && of(5, 0, 40) < 0.1);
    }

    #[test]
    fn an_n_gram_far_above_the_noise_lowers_the_probability() {
        let rivals = beam(&[0.0, 6.0]);
        let of = |excess| probability(&rivals, 4, PROVEN, excess);
        assert!(of(4.0) < of(1.0) && of(0.5) == of(1.0));
    }

    #[test]
    fn many_folds_keep_their_ratio() {
        let mut trials = Trials::NONE;
        (0..2000).for_each(|number| trials.add_fold(number % 4 != 0));
        let share = f32::from(trials.found) / (f32::from(trials.found) + f32::from(trials.missed));
        assert!((0.7..0.8).contains(&share), "{trials:?}");
    }
}
