//! The subject of one row of a report: an environment, or several that are averaged over.

use super::{
    environment::{Environment, EnvironmentError},
    family::{Family, FamilyError},
    walk::path_rng,
};
use rand::seq::SliceRandom;
use std::{fmt, path::PathBuf, str::FromStr};

/// One environment, or several of a kind. Path `p` goes through environment `p` modulo their number.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The name in reports.
    pub name: String,
    /// The environments, one or more.
    pub environments: Vec<Environment>,
    /// The seed they were drawn with; `None` when they were given.
    pub environment_seed: Option<u64>,
}

impl From<Environment> for Case {
    fn from(environment: Environment) -> Self {
        Self { name: environment.name().into(), environments: vec![environment], environment_seed: None }
    }
}

/// One environment with several random assignments of its labels to its places. Mean and standard deviation move
/// together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Placements {
    /// The seed of the placements; it is independent of the seed of the paths.
    pub seed: u64,
    /// How many placements there are, 1 or more.
    pub count: usize,
    /// The file of the environment.
    pub file: PathBuf,
}

/// A text does not describe placements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlacementsError;

impl fmt::Display for PlacementsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "placements are SEED,COUNT,FILE.toml, with two numbers, COUNT at least 1")
    }
}

impl std::error::Error for PlacementsError {}

impl FromStr for Placements {
    type Err = PlacementsError;

    fn from_str(text: &str) -> Result<Self, PlacementsError> {
        let mut fields = text.splitn(3, ',');
        let (seed, count, file) = (fields.next(), fields.next(), fields.next());
        let seed = seed.and_then(|seed| seed.parse().ok()).ok_or(PlacementsError)?;
        let count = count.and_then(|count| count.parse().ok()).filter(|&count| count >= 1).ok_or(PlacementsError)?;
        let file = file.filter(|file| !file.is_empty()).ok_or(PlacementsError)?;
        Ok(Self { seed, count, file: file.into() })
    }
}

impl Placements {
    /// Reads the environment and assigns its labels at random, once for each placement.
    ///
    /// # Errors
    /// [`EnvironmentError`] when the file is not a valid environment.
    pub fn load(&self) -> Result<Case, EnvironmentError> {
        Ok(Case::of_placements(&Environment::load(&self.file)?, self.seed, self.count))
    }
}

impl Case {
    /// An environment with `count` random placements of its labels.
    pub fn of_placements(environment: &Environment, seed: u64, count: usize) -> Self {
        let placement = |index: usize| {
            let mut labels: Vec<usize> = (0..environment.places().len()).collect();
            labels.shuffle(&mut path_rng(seed, index as u64));
            environment.with_labels_of(&labels)
        };
        Self {
            name: format!("{}, {count} placements", environment.name()),
            environments: (0..count).map(placement).collect(),
            environment_seed: Some(seed),
        }
    }

    /// All environments of a family.
    ///
    /// # Errors
    /// [`FamilyError::NoneFound`] when one of them cannot be drawn.
    pub fn of_family(family: &Family) -> Result<Self, FamilyError> {
        let environments = (0..family.count).map(|index| family.environment(index)).collect::<Result<_, _>>()?;
        Ok(Self { name: format!("family {family}"), environments, environment_seed: Some(family.seed) })
    }

    /// The environment of a path.
    ///
    /// # Panics
    /// When the case has no environment.
    pub fn environment(&self, path: u64) -> &Environment {
        &self.environments[path as usize % self.environments.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{collections::BTreeSet, path::Path};

    #[test]
    fn placements_permute_the_labels_on_the_same_graph() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("environments/wean-surrogate-sd.toml");
        let placements: Placements = format!("4,20,{}", path.display()).parse().unwrap();
        let case = placements.load().unwrap();
        assert_eq!(case.name, "wean-surrogate-sd, 20 placements");
        let original = Environment::load(&path).unwrap();
        let labels = |environment: &Environment| -> Vec<(u64, u64)> {
            let label = environment.places().iter().map(|place| (place.mean_mm.to_bits(), place.sd_mm.to_bits()));
            label.collect()
        };
        let sorted = |environment: &Environment| labels(environment).into_iter().collect::<BTreeSet<_>>();
        let mut orders = BTreeSet::from([labels(&original)]);
        for environment in &case.environments {
            assert_eq!(environment.graph(), original.graph());
            assert_eq!(sorted(environment), sorted(&original));
            assert!(orders.insert(labels(environment)), "all placements differ");
        }
        assert_eq!(case.environment(25), &case.environments[5]);
    }

    #[test]
    fn malformed_placements_are_rejected() {
        for text in ["", "1", "1,2", "1,2,", "1,0,a.toml", "x,2,a.toml"] {
            assert_eq!(text.parse::<Placements>(), Err(PlacementsError), "{text}");
        }
    }
}
