//! What the filter knows of the environment before it starts (Γ_env of the paper).

use super::{
    environment::Environment,
    walk::{PathRng, observe},
};
use toposlam::{Fingerprint, History, Ngram, NgramLength, NgramTable, NgramsFull};

/// Where the n-grams of the environment come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prior {
    /// All n-grams of the very path that is mapped, derived before it starts: Section IV of the paper.
    Path,
    /// One n-gram for every walk of `n` places of the whole environment, every reading drawn afresh: an earlier
    /// exploration that traversed every intersection from every direction.
    Exploration,
    /// Nothing: the n-grams grow with the path, as on a robot in an unknown building.
    None,
}

impl Prior {
    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Exploration => "exploration",
            Self::None => "none",
        }
    }
}

/// The history of a whole path; the oldest observations are missing when it is longer than `32 · WORDS`.
pub fn path_prior<const WORDS: usize>(observations: &[Fingerprint]) -> History<WORDS> {
    let mut history = History::new();
    for &observation in observations {
        history.push(observation);
    }
    history
}

/// One n-gram for each walk, with a fresh reading at every place of every walk. Walks are given by the index of their
/// places.
///
/// # Errors
/// [`NgramsFull`] when there are more different n-grams than the table holds.
pub fn exploration_prior<const WORDS: usize>(
    environment: &Environment,
    walks: &[Vec<usize>],
    length: NgramLength,
    rng: &mut PathRng,
) -> Result<NgramTable<WORDS>, NgramsFull> {
    let mut table = NgramTable::new(length);
    for walk in walks {
        let labels: Vec<_> = walk.iter().map(|&place| observe(&environment.places()[place], rng)).collect();
        // A walk of another length than `n` has no n-gram.
        if let Ok(ngram) = Ngram::new(length, &labels) {
            table.insert(ngram)?;
        }
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::walk::{all_walks, path_rng};
    use std::path::Path;

    fn shipped(name: &str) -> Environment {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("environments/{name}.toml"));
        Environment::load(&path).unwrap()
    }

    #[test]
    fn an_exploration_of_table_i_without_noise_has_the_24_published_3_grams() {
        let published = shipped("table-i");
        let edges = published.graph().edges().iter();
        let edges: Vec<_> = edges.map(|&(a, b)| [published.places()[a].id, published.places()[b].id]).collect();
        let places = published.places().iter().map(|&place| super::super::environment::Place { sd_mm: 0.0, ..place });
        let environment = Environment::new("table-i".into(), places.collect(), &edges).unwrap();
        let walks = all_walks(&environment, 3, usize::MAX).unwrap();
        let length = NgramLength::new(3).unwrap();
        let table = exploration_prior::<8>(&environment, &walks, length, &mut path_rng(1, 0)).unwrap();
        assert_eq!(table.len(), 24);
    }

    #[test]
    fn an_exploration_of_the_surrogate_has_287_noisy_5_grams() {
        let environment = shipped("wean-surrogate-variance");
        let walks = all_walks(&environment, 5, usize::MAX).unwrap();
        assert_eq!(walks.len(), 287);
        let length = NgramLength::new(5).unwrap();
        let table = exploration_prior::<32>(&environment, &walks, length, &mut path_rng(1, 0)).unwrap();
        assert_eq!(table.len(), 287);
        assert!(exploration_prior::<8>(&environment, &walks, length, &mut path_rng(1, 0)).is_err());
    }
}
