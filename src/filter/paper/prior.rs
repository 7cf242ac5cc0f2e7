//! The n-grams of an earlier exploration: Γ_env of the paper.

use crate::filter::{Consistency, Ngram, NgramLength, NgramTable, NgramsFull};

/// At most `16 · WORDS` n-grams of an earlier exploration, with the memory to compare them with maps of `V` vertices.
///
/// Memory: about `92 · V · (WORDS + 1) + 184 · WORDS` bytes.
#[derive(Clone, Debug)]
pub struct Prior<const V: usize, const WORDS: usize> {
    ngrams: NgramTable<WORDS>,
    consistency: Consistency<V, WORDS, 7>,
}

impl<const V: usize, const WORDS: usize> Prior<V, WORDS> {
    /// A prior without n-grams.
    pub const fn new(length: NgramLength) -> Self {
        Self { ngrams: NgramTable::new(length), consistency: Consistency::new() }
    }

    /// The n-grams of the prior.
    pub const fn ngrams(&self) -> &NgramTable<WORDS> {
        &self.ngrams
    }

    /// Adds one n-gram; returns whether it is new.
    ///
    /// # Errors
    /// [`NgramsFull`] if there is no room for it; the prior does not change then.
    pub fn insert(&mut self, ngram: Ngram) -> Result<bool, NgramsFull> {
        self.consistency.forget();
        self.ngrams.insert(ngram)
    }

    /// Adds the n-grams that end at the newest observation of an exploration; see [`NgramTable::extend`].
    ///
    /// # Errors
    /// [`NgramsFull`] if some n-grams did not fit; the others were added.
    pub fn extend<const POSITIONS: usize>(
        &mut self,
        exploration: &crate::filter::History<POSITIONS>,
    ) -> Result<(), NgramsFull> {
        self.consistency.forget();
        self.ngrams.extend(exploration)
    }

    /// The n-grams and the memory to compare them with maps.
    pub(super) fn split(&mut self) -> (&NgramTable<WORDS>, &mut Consistency<V, WORDS, 7>) {
        (&self.ngrams, &mut self.consistency)
    }
}
