//! For tests alone: the random draws are given.

use super::{PaperFilter, Prior};
use crate::filter::Update;
use crate::place::Fingerprint;

impl<const N: usize, const V: usize, const WORDS: usize> PaperFilter<N, V, WORDS> {
    /// As [`Filter::observe`](crate::Filter::observe), with the random draws given: for each particle in turn, one that proposes
    /// a prediction and one that accepts or rejects it, until one is accepted. After 128 proposals, one draw for each particle
    /// that is still missing.
    #[doc(hidden)]
    pub fn observe_with_draws(&mut self, fingerprint: Fingerprint, random: impl FnMut() -> u32) -> Update {
        self.step(fingerprint, random)
    }

    /// As [`PaperFilter::observe_with_prior`], with the random draws given as in [`PaperFilter::observe_with_draws`].
    #[doc(hidden)]
    pub fn observe_with_prior_and_draws<const PRIOR_WORDS: usize>(
        &mut self,
        fingerprint: Fingerprint,
        prior: &mut Prior<V, PRIOR_WORDS>,
        random: impl FnMut() -> u32,
    ) -> Update {
        self.step_with_prior(fingerprint, prior, random)
    }
}
