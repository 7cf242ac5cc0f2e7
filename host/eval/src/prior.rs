//! The prior n-grams of the environment (Γ_env of the paper).

use toposlam::{Fingerprint, History, Ngram, NgramLength, NgramsFull, Prior};

/// Source of the prior n-grams of the environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PriorSource {
    /// All n-grams of the path that is mapped, derived before it starts: Section IV of the paper. The robust filter
    /// gets every `n` successive places of the path.
    Path,
    /// One n-gram for every walk of `n` places of the whole environment, with new readings: an earlier exploration that
    /// traversed every intersection from every direction.
    Exploration,
    /// No prior: the n-grams grow with the path, as on a robot in an unknown building.
    None,
}

impl PriorSource {
    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Exploration => "exploration",
            Self::None => "none",
        }
    }
}

/// Largest number of n-grams of a path of `places` places, with turns back at any place.
pub fn path_ngrams(length: NgramLength, places: usize) -> usize {
    let steps = u32::from(length.get()) - 1;
    // 2^steps ways to turn from each place; a way and its reversal are one n-gram, and some ways are their own reversal.
    let own_reversals = if steps % 2 == 0 { 1 << (steps / 2) } else { 0 };
    places.saturating_mul(((1 << steps) + own_reversals) / 2)
}

/// The n-grams of a whole path.
///
/// # Errors
/// [`NgramsFull`] when there are more different n-grams than the prior holds.
pub fn path_prior<const V: usize, const WORDS: usize>(
    observations: &[Fingerprint],
    length: NgramLength,
) -> Result<Box<Prior<V, WORDS>>, NgramsFull> {
    let mut prior = Box::new(Prior::new(length));
    // New n-grams reach back by at most the longest length, so the shortest ring is enough.
    let mut history = History::<1>::new();
    for &observation in observations {
        history.push(observation);
        prior.extend(&history)?;
    }
    Ok(prior)
}

/// A table of given n-grams. Sequences whose length is not `n` have no n-gram and are skipped.
///
/// # Errors
/// [`NgramsFull`] when there are more different n-grams than the prior holds.
pub fn table_prior<const V: usize, const WORDS: usize>(
    sequences: impl IntoIterator<Item = impl AsRef<[Fingerprint]>>,
    length: NgramLength,
) -> Result<Box<Prior<V, WORDS>>, NgramsFull> {
    let mut prior = Box::new(Prior::new(length));
    for sequence in sequences {
        if let Ok(ngram) = Ngram::new(length, sequence.as_ref()) {
            prior.insert(ngram)?;
        }
    }
    Ok(prior)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        environment::{Environment, Place},
        walk::{PathRng, all_walks, observe, path_rng},
    };
    use std::path::Path;

    #[test]
    fn the_path_of_table_i_has_the_24_published_3_grams() {
        let history = [0, 1, 2, 0, 4, 3, 0, 1, 4, 0, 2, 1, 4, 3, 0, 1, 2].map(|letter| 400 + 300 * letter);
        let observations = history.map(|radius_mm| Fingerprint::from_radius_mm(radius_mm).unwrap());
        let prior = path_prior::<8, 8>(&observations, NgramLength::new(3).unwrap()).unwrap();
        assert_eq!(prior.ngrams().len(), 24);
    }

    #[test]
    fn path_ngrams_is_a_tight_upper_bound() {
        let mut rng = path_rng(1, 0);
        let place = shipped("wean-surrogate-variance").places()[0];
        let observations: Vec<_> = (0..60).map(|_| observe(&place, &mut rng)).collect();
        for labels in 2..=7 {
            let length = NgramLength::new(labels).unwrap();
            let held = path_prior::<8, 256>(&observations, length).unwrap().ngrams().len();
            let most = path_ngrams(length, observations.len());
            assert!(held <= most && held * 10 >= most * 8, "{labels}: {held} of {most}");
        }
    }

    fn readings(environment: &Environment, walks: &[Vec<usize>], rng: &mut PathRng) -> Vec<Vec<Fingerprint>> {
        let mut read = |walk: &Vec<usize>| walk.iter().map(|&at| observe(&environment.places()[at], rng)).collect();
        walks.iter().map(&mut read).collect()
    }

    fn shipped(name: &str) -> Environment {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("environments/{name}.toml"));
        Environment::load(&path).unwrap()
    }

    #[test]
    fn an_exploration_of_table_i_without_noise_has_the_24_published_3_grams() {
        let published = shipped("table-i");
        let edges = published.graph().edges().iter();
        let edges: Vec<_> = edges.map(|&(a, b)| [published.places()[a].id, published.places()[b].id]).collect();
        let places = published.places().iter().map(|&place| Place { sd_mm: 0.0, ..place });
        let environment = Environment::new("table-i".into(), places.collect(), &edges).unwrap();
        let walks = all_walks(&environment, 3, usize::MAX).unwrap();
        let length = NgramLength::new(3).unwrap();
        let prior = table_prior::<8, 8>(readings(&environment, &walks, &mut path_rng(1, 0)), length).unwrap();
        assert_eq!(prior.ngrams().len(), 24);
    }

    #[test]
    fn an_exploration_of_the_surrogate_has_287_noisy_5_grams() {
        let environment = shipped("wean-surrogate-variance");
        let walks = all_walks(&environment, 5, usize::MAX).unwrap();
        assert_eq!(walks.len(), 287);
        let length = NgramLength::new(5).unwrap();
        let read = readings(&environment, &walks, &mut path_rng(1, 0));
        let prior = table_prior::<8, 32>(&read, length).unwrap();
        assert_eq!(prior.ngrams().len(), 287);
        assert!(table_prior::<8, 8>(&read, length).is_err());
    }
}
