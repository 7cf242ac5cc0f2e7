//! Which n-grams distinguish places with equal labels, on random graphs without noise: the study of Werner, Maire and Sitte that the
//! paper cites as \[8\].
//!
//! A place is *aliased* when another place has its label. For each environment the study finds the smallest n for which the
//! smallest map with the n-grams of the environment is unique and has exactly its walks. `docs/aliasing.md` describes it.

pub mod figure;
mod search;

use super::{
    environment::{Environment, Place},
    equivalence::SmallestEquivalent,
    graph::Graph,
    parallel,
    planar::draw_planar,
    walk::{PathRng, path_rng},
};
use rand::{RngExt, seq::SliceRandom};
use search::{Found, LabelledGraph, smallest_maps};
use serde::Serialize;
use std::{
    collections::{BTreeSet, VecDeque},
    fmt,
};

/// The lengths of the n-grams that are tried.
pub const LENGTHS: std::ops::RangeInclusive<usize> = 2..=7;
/// The upper ends of the bins of the share of aliased places.
const BINS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

/// How the graphs are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GraphKind {
    /// Planar graphs of random points, with this mean number of neighbours of a place.
    Planar(f64),
    /// Rectangular grids.
    Grid,
}

impl fmt::Display for GraphKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Planar(degree) => write!(f, "planar, degree {degree}"),
            Self::Grid => f.write_str("grid"),
        }
    }
}

/// The environments of the study, and the limit of the search.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// The kinds of graphs.
    pub kinds: Vec<GraphKind>,
    /// The numbers of places, 64 at most.
    pub places: Vec<usize>,
    /// How many environments there are of each kind and size.
    pub environments: usize,
    /// The seed of the environments.
    pub seed: u64,
    /// How many nodes the search for the smallest maps expands for each n, at most.
    pub most_nodes: u64,
    /// Threads; 0 for one per processor.
    pub threads: usize,
}

/// One environment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// The share of places whose label another place has.
    pub aliased: f64,
    /// The mean number of neighbours of a place.
    pub degree: f64,
    /// How many places walks distinguish: the vertices of the right map.
    pub distinguishable: usize,
    /// The smallest n for which the smallest map is unique and has exactly the walks of the environment; `None` if there is none up to 7
    /// that the search finds.
    pub length: Option<usize>,
    /// Whether this map has a vertex for each place that walks distinguish. Otherwise it is smaller: no n-gram shows a place whose
    /// neighbours are among those of another place with its label.
    pub right: bool,
    /// Whether no n suffices and the search reached its limit for one of them.
    pub ended: bool,
    /// The nodes that the search expanded for the last n.
    pub nodes: u64,
}

/// All environments of a kind and a size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The kind of the graphs.
    pub kind: String,
    /// The number of places.
    pub places: usize,
    /// The environments.
    pub results: Vec<Outcome>,
}

/// What the study found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// One row for each kind and size.
    pub rows: Vec<Row>,
}

impl Study {
    /// Runs the study. The result depends on its fields alone, not on the number of threads.
    ///
    /// # Errors
    /// When a thread does not start.
    ///
    /// # Panics
    /// When a graph has fewer than two places.
    pub fn run(&self) -> std::io::Result<Report> {
        let mut rows = Vec::new();
        for &kind in &self.kinds {
            for &places in &self.places {
                let results = parallel::map(self.environments, self.threads, |number| {
                    // Kinds and sizes have streams of their own.
                    let stream = (number * 64 + places) as u64;
                    self.outcome(&draw(kind, places, &mut path_rng(self.seed, stream)))
                })?;
                rows.push(Row { kind: kind.to_string(), places, results });
            }
        }
        Ok(Report { rows })
    }

    fn outcome(&self, environment: &LabelledGraph) -> Outcome {
        let places = environment.labels.len();
        let right = environment.smallest_equivalent();
        let walk: Vec<u8> =
            covering_walk(&environment.graph).into_iter().map(|place| environment.labels[place]).collect();
        let is_aliased = |&label: &u8| environment.labels.iter().filter(|&&other| other == label).count() > 1;
        let mut result = Outcome {
            aliased: environment.labels.iter().filter(|label| is_aliased(label)).count() as f64 / places as f64,
            degree: 2.0 * environment.graph.edges().len() as f64 / places as f64,
            distinguishable: right.labels.len(),
            length: None,
            right: false,
            ended: false,
            nodes: 0,
        };
        for length in LENGTHS {
            let (found, nodes) =
                smallest_maps(&walk, &environment.ngrams(length), length, right.labels.len(), self.most_nodes);
            result.nodes = nodes;
            match found {
                // With longer n-grams this map stays the only smallest one.
                Found::One(map) if map.has_same_walks(environment) => {
                    result.length = Some(length);
                    result.right = map.is_isomorphic_to(&right);
                    result.ended = false;
                    break;
                }
                Found::Ended => result.ended = true,
                Found::One(_) | Found::Several => {}
            }
        }
        result
    }
}

impl LabelledGraph {
    /// The map in which places that no walk distinguishes are one vertex.
    fn smallest_equivalent(&self) -> Self {
        let place = |(id, &label): (u32, &u8)| Place { id, mean_mm: 100.0 * f64::from(label), sd_mm: 1.0 };
        let places: Vec<Place> = (0..).zip(&self.labels).map(place).collect();
        let edges: Vec<[u32; 2]> = self.graph.edges().iter().map(|&(a, b)| [a as u32, b as u32]).collect();
        let environment = Environment::new("aliasing".into(), places, &edges);
        let environment = environment.expect("a connected graph with labels in range is an environment");
        let smallest = SmallestEquivalent::of_environment(&environment);
        let mut labels = vec![0; smallest.graph.vertex_count()];
        for (class, &label) in smallest.class_of_place.iter().zip(&self.labels) {
            if let Some(class) = *class {
                labels[class] = label;
            }
        }
        Self { labels, graph: smallest.graph }
    }
}

/// A random graph with random labels. The number of aliased places is uniform, and so is the number of labels that they share.
fn draw(kind: GraphKind, places: usize, rng: &mut PathRng) -> LabelledGraph {
    let graph = match kind {
        GraphKind::Planar(degree) => draw_planar(places, (degree * places as f64 / 2.0).round() as usize, rng).0,
        GraphKind::Grid => grid(places),
    };
    let aliased = match rng.random_range(0..places) {
        0 => 0,
        more => more + 1,
    };
    let shared = if aliased == 0 { 0 } else { rng.random_range(1..=aliased / 2) };
    let mut order: Vec<usize> = (0..places).collect();
    order.shuffle(rng);
    let mut labels = vec![0; places];
    for (rank, &place) in order.iter().enumerate() {
        // Each shared label has two places at least.
        labels[place] = match rank {
            pair if pair < 2 * shared => pair / 2,
            other if other < aliased => rng.random_range(0..shared),
            single => shared + single - aliased,
        } as u8;
    }
    LabelledGraph { labels, graph }
}

/// The grid of this many places that is nearest to a square.
fn grid(places: usize) -> Graph {
    let columns = (1..=places).filter(|columns| places.is_multiple_of(*columns) && columns * columns >= places).min();
    let columns = columns.unwrap_or(places);
    let right = (0..places).filter(|place| place % columns + 1 < columns).map(|place| (place, place + 1));
    let down = (0..places.saturating_sub(columns)).map(|place| (place, place + columns));
    Graph::from_edges(places, right.chain(down))
}

/// A walk along all edges, each time to the nearest edge that was not driven.
fn covering_walk(graph: &Graph) -> Vec<usize> {
    let neighbours = graph.neighbours();
    let mut left: BTreeSet<(usize, usize)> = graph.edges().clone();
    let mut walk = vec![0];
    while !left.is_empty() {
        let at = *walk.last().unwrap_or(&0);
        let is_left = |a: usize, b: usize| left.contains(&(a.min(b), a.max(b)));
        // Breadth first over the known edges, to the first place with an edge that is left.
        let mut from = vec![None; graph.vertex_count()];
        let mut queue = VecDeque::from([at]);
        let mut end = None;
        while let Some(place) = queue.pop_front() {
            if let Some(&next) = neighbours[place].iter().find(|&&next| is_left(place, next)) {
                end = Some((place, next));
                break;
            }
            for &next in &neighbours[place] {
                if from[next].is_none() && next != at {
                    from[next] = Some(place);
                    queue.push_back(next);
                }
            }
        }
        let Some((mut place, next)) = end else { break };
        left.remove(&(place.min(next), place.max(next)));
        let mut way = vec![next];
        while place != at {
            way.push(place);
            place = from[place].unwrap_or(at);
        }
        walk.extend(way.into_iter().rev());
    }
    walk
}

impl Row {
    /// The environments in each bin of the share of aliased places, with the upper end of the bin.
    fn bins(&self) -> impl Iterator<Item = (f64, Vec<&Outcome>)> {
        BINS.into_iter().enumerate().map(|(number, end)| {
            let start = number.checked_sub(1).map_or(-1.0, |before| BINS[before]);
            (end, self.results.iter().filter(|result| result.aliased > start && result.aliased <= end).collect())
        })
    }
}

/// The share of environments for which an n suffices, by kind, size and share of aliased places.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<18} {:>6} {:>8} {:>5}", "graphs", "places", "aliased", "count")?;
        for length in LENGTHS {
            write!(f, " {:>6}", format!("n = {length}"))?;
        }
        writeln!(f, " {:>6} {:>6} {:>12}", "right", "ended", "median nodes")?;
        for row in &self.rows {
            for (end, results) in row.bins().filter(|(_, results)| !results.is_empty()) {
                let count = results.len();
                write!(f, "{:<18} {:>6} {:>8} {count:>5}", row.kind, row.places, format!("to {end:.1}"))?;
                for length in LENGTHS {
                    let enough =
                        results.iter().filter(|result| result.length.is_some_and(|needed| needed <= length)).count();
                    write!(f, " {:>6.2}", enough as f64 / count as f64)?;
                }
                let right = results.iter().filter(|result| result.right).count() as f64 / count as f64;
                let ended = results.iter().filter(|result| result.ended).count();
                let mut nodes: Vec<u64> = results.iter().map(|result| result.nodes).collect();
                nodes.sort_unstable();
                writeln!(f, " {right:>6.2} {ended:>6} {:>12}", nodes[count / 2])?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study() -> Study {
        Study {
            kinds: vec![GraphKind::Planar(2.5), GraphKind::Grid],
            places: vec![4, 6],
            environments: 12,
            seed: 3,
            most_nodes: 5_000,
            threads: 2,
        }
    }

    fn result(labels: &[u8], graph: Graph) -> Outcome {
        study().outcome(&LabelledGraph { labels: labels.to_vec(), graph })
    }

    #[test]
    fn two_labels_suffice_when_no_place_is_aliased() {
        let found = result(&[0, 1, 2, 3, 4, 5], grid(6));
        assert_eq!((found.aliased, found.length, found.ended), (0.0, Some(2), false));
    }

    #[test]
    fn places_with_equal_labels_need_longer_n_grams() {
        // 0-1-2-1-3: the 2-grams are also those of a star around one place 1.
        let path = Graph::from_edges(5, [(0, 1), (1, 2), (2, 3), (3, 4)]);
        let found = result(&[0, 1, 2, 1, 3], path.clone());
        assert_eq!((found.aliased, found.length), (0.4, Some(3)));
        // 0-1-1-1-2: the middle place differs from its neighbours only by what is two places away.
        let found = result(&[0, 1, 1, 1, 2], path);
        assert!(found.length > Some(3), "{found:?}");
    }

    #[test]
    fn places_that_no_walk_distinguishes_are_one_vertex_of_the_right_map() {
        // A ring of two labels is a corridor of two places.
        let ring = Graph::from_edges(6, (0..6).map(|place| (place, (place + 1) % 6)));
        let found = result(&[0, 1, 0, 1, 0, 1], ring);
        assert_eq!((found.aliased, found.distinguishable, found.length), (1.0, 2, Some(2)));
    }

    #[test]
    fn a_place_whose_neighbours_another_place_of_its_label_has_too_is_never_distinguished() {
        // A grid of two rows. Place 0 has two of the three neighbours of place 4.
        let found = result(&[0, 1, 2, 3, 0, 4], grid(6));
        assert_eq!((found.distinguishable, found.right), (6, false));
        assert!(found.length.is_some());
    }

    #[test]
    fn all_shares_of_aliased_places_occur() {
        let aliased = |seed| study().outcome(&draw(GraphKind::Grid, 6, &mut path_rng(seed, 0))).aliased;
        let shares: BTreeSet<u64> = (0..60).map(|seed| (6.0 * aliased(seed)).round() as u64).collect();
        assert_eq!(shares, BTreeSet::from([0, 2, 3, 4, 5, 6]));
    }

    #[test]
    fn a_covering_walk_follows_every_edge() {
        for seed in 0..20 {
            let graph = draw_planar(12, 18, &mut path_rng(seed, 1)).0;
            let walk = covering_walk(&graph);
            let driven: BTreeSet<_> =
                walk.windows(2).map(|step| (step[0].min(step[1]), step[0].max(step[1]))).collect();
            assert_eq!(&driven, graph.edges());
        }
    }

    #[test]
    fn the_report_does_not_depend_on_threads_and_longer_n_grams_suffice_more_often() {
        let report = study().run().unwrap();
        assert_eq!(report, Study { threads: 1, ..study() }.run().unwrap());
        assert_eq!(report.rows.len(), 4);
        let text = report.to_string();
        assert!(text.contains("grid") && text.contains("n = 7"), "{text}");
    }
}
