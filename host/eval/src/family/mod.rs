//! Families of random environments: planar graphs whose places share a few labels, with their ways in the order in which they
//! were drawn.

mod drawing;

use super::{
    environment::{Environment, Place},
    graph::Graph,
    planar::draw_planar,
    walk::{PathRng, path_rng},
};
use drawing::Drawing;
use rand::{RngExt, seq::SliceRandom};
use std::{collections::BTreeSet, fmt, ops::RangeInclusive, str::FromStr};

/// The means of two categories are at least this far apart, in millimetres.
const APART_MM: f64 = 250.0;
/// Range of the means of the categories, in millimetres.
const MEANS_MM: RangeInclusive<f64> = 400.0..=2950.0;
/// Largest number of categories whose means fit in this range.
const MAX_LABELS: usize = 11;
/// Number of category assignments tried for each graph, and number of graphs tried.
const ASSIGNMENTS: usize = 100;
const GRAPHS: usize = 1000;

/// The class of the environments of a family. In all classes, no two places have the same set of 5-grams around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Neighbours of a place may have the same category.
    General,
    /// No place has two neighbours of one category, so the next label determines the next place.
    RightResolving,
    /// As `General`, with parallel corridors, loops and dead ends, one of each at least.
    Multigraph,
}

impl Class {
    /// All classes, in the order of the documentation.
    const ALL: [Self; 3] = [Self::General, Self::RightResolving, Self::Multigraph];

    /// The name in reports and on the command line.
    fn name(self) -> &'static str {
        match self {
            Self::General => "general",
            Self::RightResolving => "right-resolving",
            Self::Multigraph => "multigraph",
        }
    }
}

/// A family of random environments. Every range is sampled uniformly for each environment.
#[derive(Clone, Debug, PartialEq)]
pub struct Family {
    /// The seed of its environments; it is independent of the seed of the paths.
    pub seed: u64,
    /// How many environments it has.
    pub count: usize,
    /// How many places an environment has.
    pub places: RangeInclusive<usize>,
    /// The mean number of neighbours of a place.
    pub degree: RangeInclusive<f64>,
    /// How many categories there are. The means of the fingerprints of one category are equal.
    pub labels: RangeInclusive<usize>,
    /// The standard deviation of the fingerprints of a place, in metres; drawn for each place.
    pub noise_m: RangeInclusive<f64>,
    /// The class of all its environments.
    pub class: Class,
}

/// Why a family cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FamilyError {
    /// There are too few or too many fields.
    Fields(usize),
    /// A field is not a number, or not a range of numbers, or out of its range.
    Field {
        /// The name of the field.
        name: &'static str,
        /// The text of the field.
        text: String,
        /// The allowed values.
        allowed: &'static str,
    },
    /// No environment of this kind was found.
    NoneFound,
}

impl fmt::Display for FamilyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fields(fields) => write!(
                f,
                "a family is SEED,COUNT,V_MIN,V_MAX,DEGREE,LABELS,NOISE[,CLASS], which is 7 or 8 fields, not {fields}"
            ),
            Self::Field { name, text, allowed } => write!(f, "{name} = {text}: must be {allowed}"),
            Self::NoneFound => {
                write!(f, "no such environment in {GRAPHS} random graphs: try more LABELS or a smaller DEGREE")
            }
        }
    }
}

impl std::error::Error for FamilyError {}

impl FromStr for Family {
    type Err = FamilyError;

    fn from_str(text: &str) -> Result<Self, FamilyError> {
        let fields: Vec<&str> = text.split(',').map(str::trim).collect();
        let (&[seed, count, least, most, degree, labels, noise], class) = fields
            .split_first_chunk::<7>()
            .filter(|(_, more)| more.len() <= 1)
            .map(|(seven, more)| (seven, more.first()))
            .ok_or(FamilyError::Fields(fields.len()))?;
        let places = number("V_MIN", least, 3..=64, "3 to 64")?..=number("V_MAX", most, 3..=64, "3 to 64")?;
        if places.is_empty() {
            return Err(FamilyError::Field { name: "V_MAX", text: most.into(), allowed: "V_MIN or more" });
        }
        Ok(Self {
            seed: number("SEED", seed, 0..=u64::MAX, "a number")?,
            count: number("COUNT", count, 1..=100_000, "1 to 100000")?,
            places,
            degree: range("DEGREE", degree, 1.0..=5.0, "a number or range A-B from 1 to 5")?,
            labels: range("LABELS", labels, 1..=MAX_LABELS, "a number or range A-B from 1 to 11")?,
            noise_m: range("NOISE", noise, 0.0..=1.0, "a number or range A-B of metres from 0 to 1")?,
            class: class.map_or(Ok(Class::General), |text| {
                let allowed = "general, right-resolving or multigraph";
                let class = Class::ALL.into_iter().find(|class| class.name() == *text);
                class.ok_or_else(|| FamilyError::Field { name: "CLASS", text: (*text).into(), allowed })
            })?,
        })
    }
}

fn number<T: FromStr + PartialOrd>(
    name: &'static str,
    text: &str,
    allowed: RangeInclusive<T>,
    allowed_words: &'static str,
) -> Result<T, FamilyError> {
    let number = text.parse().ok().filter(|number| allowed.contains(number));
    number.ok_or_else(|| FamilyError::Field { name, text: text.into(), allowed: allowed_words })
}

/// A range `A-B`, or a single number.
fn range<T: FromStr + PartialOrd + Copy>(
    name: &'static str,
    text: &str,
    allowed: RangeInclusive<T>,
    allowed_words: &'static str,
) -> Result<RangeInclusive<T>, FamilyError> {
    let (least, most) = text.split_once('-').unwrap_or((text, text));
    let end = |end: &str| end.parse().ok().filter(|number| allowed.contains(number));
    match (end(least), end(most)) {
        (Some(least), Some(most)) if least <= most => Ok(least..=most),
        _ => Err(FamilyError::Field { name, text: text.into(), allowed: allowed_words }),
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seed, count, places, .. } = self;
        write!(f, "{seed},{count},{},{},", places.start(), places.end())?;
        write!(f, "{},{},{},", Span(&self.degree), Span(&self.labels), Span(&self.noise_m))?;
        f.write_str(self.class.name())
    }
}

struct Span<'a, T>(&'a RangeInclusive<T>);

impl<T: fmt::Display + PartialEq> fmt::Display for Span<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.start() == self.0.end() {
            write!(f, "{}", self.0.start())
        } else {
            write!(f, "{}-{}", self.0.start(), self.0.end())
        }
    }
}

impl Family {
    /// Environment number `index` of the family. It depends only on the family and the index.
    ///
    /// Graph and categories are redrawn until the class holds, so environments for which it rarely holds are rare.
    ///
    /// # Errors
    /// [`FamilyError::NoneFound`] when none of 1000 graphs had a valid assignment of categories.
    pub fn environment(&self, index: usize) -> Result<Environment, FamilyError> {
        let mut rng = path_rng(self.seed, index as u64);
        for _ in 0..GRAPHS {
            let places = rng.random_range(self.places.clone());
            let edges = (rng.random_range(self.degree.clone()) * places as f64 / 2.0).round();
            let labels = rng.random_range(self.labels.clone()).min(places);
            let (graph, points) = draw_planar(places, edges as usize, &mut rng);
            let Some(categories) = self.draw_categories(&graph, labels, &mut rng) else { continue };
            let means_mm = draw_means_mm(labels, &mut rng);
            let place = |(id, &category): (u32, &usize)| {
                let sd_mm = 1000.0 * rng.random_range(self.noise_m.clone());
                Place { id, mean_mm: means_mm[category], sd_mm }
            };
            let places = (0..).zip(&categories).map(place).collect();
            let mut drawing = Drawing::of_points(&graph, &points);
            if self.class == Class::Multigraph && !drawing.extend(&mut rng) {
                continue;
            }
            let environment = Environment::new(format!("{self} number {index}"), places, &drawing.edges);
            return environment.and_then(|it| it.with_ways(&drawing.ways)).map_err(|_| FamilyError::NoneFound);
        }
        Err(FamilyError::NoneFound)
    }

    /// The category of every place; all categories occur.
    fn draw_categories(&self, graph: &Graph, labels: usize, rng: &mut PathRng) -> Option<Vec<usize>> {
        let neighbours = graph.neighbours();
        (0..ASSIGNMENTS).find_map(|_| {
            let categories = match self.class {
                Class::General | Class::Multigraph => {
                    (0..neighbours.len()).map(|_| rng.random_range(0..labels)).collect()
                }
                Class::RightResolving => draw_right_resolving(&neighbours, labels, rng)?,
            };
            let all_occur = categories.iter().collect::<BTreeSet<_>>().len() == labels;
            (all_occur && are_distinguishable(&neighbours, &categories)).then_some(categories)
        })
    }
}

/// Gives every place, in random order, a random category that no other neighbour of its neighbours has. `None` when a
/// place has more neighbours than there are categories; an empty assignment when the search reaches a dead end.
fn draw_right_resolving(neighbours: &[Vec<usize>], labels: usize, rng: &mut PathRng) -> Option<Vec<usize>> {
    if neighbours.iter().any(|around| around.len() > labels) {
        return None;
    }
    let mut order: Vec<usize> = (0..neighbours.len()).collect();
    order.shuffle(rng);
    let mut categories = vec![None; neighbours.len()];
    for place in order {
        let taken: BTreeSet<usize> = neighbours[place]
            .iter()
            .flat_map(|&next| &neighbours[next])
            .filter_map(|&other| categories[other])
            .collect();
        let free: Vec<usize> = (0..labels).filter(|category| !taken.contains(category)).collect();
        if free.is_empty() {
            return Some(Vec::new());
        }
        categories[place] = Some(free[rng.random_range(0..free.len())]);
    }
    Some(categories.into_iter().flatten().collect())
}

/// Whether no two places have the same set of 5-grams centred on them, which is the same set of label strings of the
/// two-step walks from them.
fn are_distinguishable(neighbours: &[Vec<usize>], categories: &[usize]) -> bool {
    let around = |place: usize| -> BTreeSet<[usize; 3]> {
        let walks = neighbours[place].iter().flat_map(|&next| neighbours[next].iter().map(move |&last| (next, last)));
        walks.map(|(next, last)| [categories[place], categories[next], categories[last]]).collect()
    };
    (0..categories.len()).map(around).collect::<BTreeSet<_>>().len() == categories.len()
}

/// Draws the means of the categories in millimetres, ascending and far enough apart, to 0.1 mm.
fn draw_means_mm(labels: usize, rng: &mut PathRng) -> Vec<f64> {
    let slack_mm = MEANS_MM.end() - MEANS_MM.start() - APART_MM * (labels as f64 - 1.0);
    let mut offsets: Vec<f64> = (0..labels).map(|_| rng.random_range(0.0..=slack_mm)).collect();
    offsets.sort_by(f64::total_cmp);
    let mean_mm = |(category, offset): (usize, f64)| MEANS_MM.start() + APART_MM * category as f64 + offset;
    offsets.into_iter().enumerate().map(|labelled| (10.0 * mean_mm(labelled)).round() / 10.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equivalence::SmallestEquivalent;
    use toposlam::WAYS_MAX;

    fn family(text: &str) -> Family {
        text.parse().unwrap()
    }

    fn refusal(text: &str) -> String {
        text.parse::<Family>().unwrap_err().to_string()
    }

    #[test]
    fn environments_have_the_sizes_labels_and_noise_of_their_family() {
        let family = family("1,30,8,14,2-3,3-6,0.03-0.06");
        for index in 0..family.count {
            let environment = family.environment(index).unwrap();
            let count = environment.places().len();
            assert!((8..=14).contains(&count));
            let degree = 2.0 * environment.graph().edges().len() as f64 / count as f64;
            assert!((2.0 - 1.0 / 8.0..=3.0 + 1.0 / 8.0).contains(&degree), "{degree}");
            let means: BTreeSet<u64> = environment.places().iter().map(|place| place.mean_mm.to_bits()).collect();
            assert!((3..=6).contains(&means.len()));
            let mut means: Vec<f64> = means.into_iter().map(f64::from_bits).collect();
            means.sort_by(f64::total_cmp);
            assert!(means.iter().all(|mean_mm| MEANS_MM.contains(mean_mm)));
            assert!(means.windows(2).all(|pair| pair[1] - pair[0] >= APART_MM - 0.11), "{means:?}");
            assert!(environment.places().iter().all(|place| (30.0..=60.0).contains(&place.sd_mm)));
            assert_eq!(SmallestEquivalent::of_environment(&environment).graph.vertex_count(), count);
        }
    }

    /// The neighbours of each place, and the category of each place.
    fn look(environment: &Environment) -> (&[Vec<usize>], Vec<usize>) {
        let mean = |place: &Place| place.mean_mm.to_bits() as usize;
        (environment.neighbours(), environment.places().iter().map(mean).collect())
    }

    fn is_right_resolving(environment: &Environment) -> bool {
        let (neighbours, categories) = look(environment);
        neighbours
            .iter()
            .all(|around| around.iter().map(|&next| categories[next]).collect::<BTreeSet<_>>().len() == around.len())
    }

    #[test]
    fn the_next_label_determines_the_next_place_only_in_a_right_resolving_family() {
        for class in ["right-resolving", "general"] {
            let family = family(&format!("3,20,14,24,2-3,3-6,0.03,{class}"));
            let environments = (0..20).map(|index| family.environment(index).unwrap()).collect::<Vec<_>>();
            let resolving = environments.iter().filter(|environment| is_right_resolving(environment)).count();
            assert_eq!(resolving, if class == "general" { 0 } else { 20 }, "{class}");
            for environment in &environments {
                let (neighbours, categories) = look(environment);
                assert!(are_distinguishable(neighbours, &categories));
            }
        }
    }

    #[test]
    fn a_multigraph_has_loops_parallel_corridors_and_dead_ends_in_the_plane() {
        let family = family("1,20,8,24,2-3,3-6,0.03-0.12,multigraph");
        for index in 0..family.count {
            let environment = family.environment(index).unwrap();
            let corridors = environment.corridors();
            assert!(corridors.iter().any(|(a, b)| a == b), "a loop");
            let proper = corridors.iter().filter(|(a, b)| a != b).count();
            let pairs = environment.graph().edges().iter().filter(|(a, b)| a != b).count();
            assert!(proper > pairs, "a parallel corridor");
            assert!(environment.exits().iter().any(|exits| exits.len() == 1), "a dead end");
            assert!(environment.exits().iter().all(|exits| exits.len() <= WAYS_MAX));
            assert_eq!(environment.rotation().unwrap().genus(), 0);
        }
    }

    #[test]
    fn an_environment_depends_only_on_family_and_index() {
        let family_1 = family("1,2,8,14,2.5,4,0.05");
        assert_eq!(family_1.environment(1), family_1.environment(1));
        assert_ne!(family_1.environment(1), family_1.environment(0));
        assert_ne!(family_1.environment(1), family("2,2,8,14,2.5,4,0.05").environment(1));
    }

    #[test]
    fn places_with_the_same_5_grams_are_not_distinguishable() {
        let ring = |places: usize| -> Vec<Vec<usize>> {
            (0..places).map(|place| vec![(place + 1) % places, (place + places - 1) % places]).collect()
        };
        assert!(!are_distinguishable(&ring(4), &[0, 0, 0, 0]));
        assert!(!are_distinguishable(&ring(3), &[0, 1, 1]));
        assert!(are_distinguishable(&ring(3), &[0, 1, 2]));
    }

    #[test]
    fn families_round_trip_through_text_and_invalid_fields_are_named() {
        for text in [
            "1,20,8,14,2-3,3-6,0.03-0.06,right-resolving",
            "7,1,11,11,2.5,4,0.05,general",
            "1,2,40,60,2,3,0,multigraph",
        ] {
            assert_eq!(family(text).to_string(), text);
        }
        assert!(refusal("1,2,3").starts_with("a family is SEED,COUNT,"));
        assert_eq!(refusal("x,20,8,14,2,3,0.03"), "SEED = x: must be a number");
        assert_eq!(refusal("1,0,8,14,2,3,0.03"), "COUNT = 0: must be 1 to 100000");
        assert_eq!(refusal("1,20,2,14,2,3,0.03"), "V_MIN = 2: must be 3 to 64");
        assert_eq!(refusal("1,20,8,7,2,3,0.03"), "V_MAX = 7: must be V_MIN or more");
        assert_eq!(refusal("1,20,8,9,3-2,3,0.03"), "DEGREE = 3-2: must be a number or range A-B from 1 to 5");
        assert_eq!(refusal("1,20,8,9,2,12,0.03"), "LABELS = 12: must be a number or range A-B from 1 to 11");
        assert_eq!(refusal("1,20,8,9,2,3,3-6"), "NOISE = 3-6: must be a number or range A-B of metres from 0 to 1");
        assert_eq!(refusal("1,20,8,9,2,3,0.03,odd"), "CLASS = odd: must be general, right-resolving or multigraph");
        let crowded = family("1,1,3,3,2,1,0.03").environment(0);
        assert_eq!(crowded, Err(FamilyError::NoneFound));
    }
}
