//! The environment graph: places with the statistics of their fingerprints, the corridors between them, and optionally the
//! order of the ways at each place and the lengths of the corridors.

mod error;

pub use error::EnvironmentError;

use super::{
    graph::{Graph, first_unreached},
    rotation::{RotationSystem, partner},
};
use serde::Deserialize;
use std::{collections::HashMap, fs, ops::RangeInclusive, path::Path, str::FromStr};
use toposlam::{Fingerprint, WAYS_MAX};

/// The length of a corridor in metres.
const LENGTHS_M: RangeInclusive<f64> = 0.1..=1000.0;

/// A place and its fingerprints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The number of the place in the file; edges refer to it.
    pub id: u32,
    /// The mean of its fingerprints in millimetres, 0 to 8188.
    pub mean_mm: f64,
    /// The standard deviation of its fingerprints in millimetres, 0 or more.
    pub sd_mm: f64,
}

/// A connected graph of places and corridors, with the fingerprint statistics of each place. Loops and parallel corridors are
/// possible.
///
/// One end of a corridor is a *dart*: corridor `e` has the dart `2 e` at its first place and `2 e + 1` at its second.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    name: String,
    places: Vec<Place>,
    corridors: Vec<(usize, usize)>,
    graph: Graph,
    neighbours: Vec<Vec<usize>>,
    exits: Vec<Vec<usize>>,
    rotation: Option<RotationSystem>,
    lengths_m: Option<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    edges: Vec<[u32; 2]>,
    lengths_m: Option<Vec<f64>>,
    place: Vec<PlaceEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceEntry {
    id: u32,
    mean_mm: f64,
    sd_mm: f64,
    ways: Option<Vec<usize>>,
}

impl FromStr for Environment {
    type Err = EnvironmentError;

    fn from_str(text: &str) -> Result<Self, EnvironmentError> {
        let File { name, edges, lengths_m, place: entries } = toml::from_str(text).map_err(EnvironmentError::Parse)?;
        let place = |&PlaceEntry { id, mean_mm, sd_mm, .. }: &PlaceEntry| Place { id, mean_mm, sd_mm };
        let mut environment = Self::new(name, entries.iter().map(place).collect(), &edges)?;
        if entries.iter().any(|entry| entry.ways.is_some()) {
            let ways = |entry: &PlaceEntry| entry.ways.clone().ok_or(EnvironmentError::NoWays { id: entry.id });
            environment = environment.with_ways(&entries.iter().map(ways).collect::<Result<Vec<_>, _>>()?)?;
        }
        match lengths_m {
            Some(lengths_m) => environment.with_lengths_m(lengths_m),
            None => Ok(environment),
        }
    }
}

impl Environment {
    /// Reads an environment file.
    ///
    /// # Errors
    /// [`EnvironmentError`] when the file cannot be read, is malformed, or describes no connected environment.
    pub fn load(path: &Path) -> Result<Self, EnvironmentError> {
        fs::read_to_string(path).map_err(EnvironmentError::Read)?.parse()
    }

    /// An environment from its places and the pairs of ids that are connected. A pair may occur several times, and connect a
    /// place to itself.
    ///
    /// # Errors
    /// [`EnvironmentError`] when a place or an edge is out of range, listed twice, unknown, or cannot be reached.
    pub fn new(name: String, places: Vec<Place>, edges: &[[u32; 2]]) -> Result<Self, EnvironmentError> {
        let mut index_of = HashMap::new();
        for (index, &Place { id, mean_mm, sd_mm }) in places.iter().enumerate() {
            if index_of.insert(id, index).is_some() {
                return Err(EnvironmentError::DuplicatePlace { id });
            }
            if !(0.0..=f64::from(Fingerprint::MAX.radius_mm())).contains(&mean_mm) {
                return Err(EnvironmentError::MeanOutOfRange { id, mean_mm });
            }
            if !(0.0..f64::INFINITY).contains(&sd_mm) {
                return Err(EnvironmentError::DeviationOutOfRange { id, sd_mm });
            }
        }
        let mut corridors = Vec::new();
        for &edge in edges {
            let end = |id| index_of.get(&id).copied().ok_or(EnvironmentError::UnknownPlace { edge, id });
            corridors.push((end(edge[0])?, end(edge[1])?));
        }
        if edges.is_empty() {
            return Err(EnvironmentError::NoEdges);
        }
        let graph = Graph::from_edges(places.len(), corridors.iter().copied());
        let neighbours = graph.neighbours();
        if let Some(unreached) = first_unreached(&neighbours) {
            return Err(EnvironmentError::Disconnected { from: places[0].id, to: places[unreached].id });
        }
        let end = |dart: usize| if dart.is_multiple_of(2) { corridors[dart / 2].0 } else { corridors[dart / 2].1 };
        let mut exits = vec![Vec::new(); places.len()];
        (0..2 * corridors.len()).for_each(|dart| exits[end(dart)].push(dart));
        exits.iter_mut().for_each(|exits| exits.sort_by_key(|&dart| (end(partner(dart)), dart)));
        Ok(Self { name, places, corridors, graph, neighbours, exits, rotation: None, lengths_m: None })
    }

    /// The same environment with the ways of each place in counter-clockwise order, as positions in the edges; a loop is there
    /// twice.
    ///
    /// # Errors
    /// [`EnvironmentError`] when a way is wrong, missing or doubled, or when the ways do not lie in the plane.
    pub fn with_ways(self, positions: &[Vec<usize>]) -> Result<Self, EnvironmentError> {
        let mut ways = Vec::new();
        for (place, positions) in positions.iter().enumerate() {
            let id = self.places[place].id;
            let mut left = self.exits[place].clone();
            let mut darts = Vec::new();
            for &position in positions {
                let ends = self.corridors.get(position).map(|&(a, b)| [a, b]);
                if !ends.is_some_and(|ends| ends.contains(&place)) {
                    return Err(EnvironmentError::NotAWay { id, position });
                }
                let first = left.iter().position(|&dart| dart / 2 == position);
                darts.push(left.remove(first.ok_or(EnvironmentError::DoubledWay { id, position })?));
            }
            if let Some(dart) = left.first() {
                return Err(EnvironmentError::MissingWay { id, position: dart / 2 });
            }
            if darts.len() > WAYS_MAX {
                return Err(EnvironmentError::TooManyWays { id, ways: darts.len() });
            }
            ways.push(darts);
        }
        let rotation = RotationSystem::new(ways);
        match rotation.genus() {
            0 => Ok(Self { rotation: Some(rotation), ..self }),
            genus => Err(EnvironmentError::NotPlanar { genus }),
        }
    }

    /// The same environment with the length of each corridor in metres, in the order of the edges.
    ///
    /// # Errors
    /// [`EnvironmentError`] when there is not one length within 0.1 to 1000 m for each edge.
    pub fn with_lengths_m(self, lengths_m: Vec<f64>) -> Result<Self, EnvironmentError> {
        let (lengths, edges) = (lengths_m.len(), self.corridors.len());
        if lengths != edges {
            return Err(EnvironmentError::LengthCount { lengths, edges });
        }
        match lengths_m.iter().position(|length_m| !LENGTHS_M.contains(length_m)) {
            Some(position) => Err(EnvironmentError::LengthOutOfRange { position, length_m: lengths_m[position] }),
            None => Ok(Self { lengths_m: Some(lengths_m), ..self }),
        }
    }

    /// The same graph with other labels: place `i` takes the mean and the standard deviation of place `labels[i]`.
    ///
    /// # Panics
    /// When `labels` does not hold one place for each place.
    pub fn with_labels_of(&self, labels: &[usize]) -> Self {
        let relabelled = |(place, &from): (&Place, &usize)| Place { id: place.id, ..self.places[from] };
        let places: Vec<Place> = self.places.iter().zip(labels).map(relabelled).collect();
        assert_eq!(places.len(), self.places.len(), "every place has a label");
        Self { places, ..self.clone() }
    }

    /// The name in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The places in the order of the file. All other functions refer to a place by its index here.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The two places of each corridor, in the order of the edges of the file.
    pub fn corridors(&self) -> &[(usize, usize)] {
        &self.corridors
    }

    /// The place of a dart.
    ///
    /// # Panics
    /// When there is no such dart.
    pub fn place_of(&self, dart: usize) -> usize {
        let (first, second) = self.corridors[dart / 2];
        if dart.is_multiple_of(2) { first } else { second }
    }

    /// The darts of every place, in ascending order of the places they lead to; a loop has two darts.
    pub fn exits(&self) -> &[Vec<usize>] {
        &self.exits
    }

    /// The order of the ways, if it is given.
    pub fn rotation(&self) -> Option<&RotationSystem> {
        self.rotation.as_ref()
    }

    /// The length of each corridor in metres, if it is given.
    pub fn lengths_m(&self) -> Option<&[f64]> {
        self.lengths_m.as_deref()
    }

    /// The environment as a graph without parallel edges.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// The neighbours of every place, in ascending order.
    pub fn neighbours(&self) -> &[Vec<usize>] {
        &self.neighbours
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(edges: &str, places: &[(u32, f64, f64)]) -> String {
        let mut text = format!("name = \"test\"\nedges = {edges}\n");
        for (id, mean_mm, sd_mm) in places {
            text += &format!("[[place]]\nid = {id}\nmean_mm = {mean_mm:?}\nsd_mm = {sd_mm:?}\n");
        }
        text.parse::<Environment>().unwrap_err().to_string()
    }

    const THREE: [(u32, f64, f64); 3] = [(1, 800.0, 10.0), (2, 900.5, 0.8), (3, 1000.0, 0.0)];

    #[test]
    fn the_shipped_environments_load_and_have_their_published_sizes() {
        for (file, places, edges) in
            [("wean-surrogate-sd", 11, 13), ("wean-surrogate-variance", 11, 13), ("table-i", 6, 7)]
        {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("environments/{file}.toml"));
            let environment = Environment::load(&path).unwrap();
            assert_eq!(environment.name(), file);
            assert_eq!((environment.places().len(), environment.graph().edges().len()), (places, edges));
        }
    }

    #[test]
    fn an_invalid_file_is_rejected_with_the_reason() {
        assert_eq!(refusal("[[1, 2], [2, 4]]", &THREE), "edge [2, 4]: there is no place 4");
        assert_eq!(refusal("[[1, 2]]", &THREE), "no walk leads from place 1 to place 3");
        assert_eq!(refusal("[]", &THREE), "the environment has no edges");
        assert_eq!(refusal("[[1, 1]]", &[THREE[0], THREE[0]]), "place 1 is listed twice");
        assert_eq!(refusal("[[1, 1]]", &[(1, 8200.0, 1.0)]), "place 1: mean_mm = 8200 is not within 0 to 8188");
        assert_eq!(refusal("[[1, 1]]", &[(1, 800.0, -1.0)]), "place 1: sd_mm = -1 is not 0 or more");
        assert!(refusal("[[1]]", &THREE).starts_with("cannot parse the environment: TOML parse error"));
    }

    const CROSSROADS: &str = "name = \"test\"\nedges = [[1, 2], [2, 1], [2, 2], [2, 3]]\n";

    fn with_ways(head: &str, ways: [&str; 3]) -> Result<Environment, EnvironmentError> {
        let place = |(id, ways): (usize, &str)| format!("[[place]]\nid = {id}\nmean_mm = 900\nsd_mm = 9\n{ways}\n");
        format!("{CROSSROADS}{head}{}", (1..).zip(ways).map(place).collect::<String>()).parse()
    }

    #[test]
    fn a_file_has_parallel_edges_loops_ways_and_lengths() {
        let ways = ["ways = [1, 0]", "ways = [2, 2, 0, 1, 3]", "ways = [3]"];
        let environment = with_ways("lengths_m = [4, 5.5, 12, 0.8]\n", ways).unwrap();
        assert_eq!(environment.corridors(), [(0, 1), (1, 0), (1, 1), (1, 2)]);
        assert_eq!(environment.graph().edges().len(), 3);
        assert_eq!(environment.exits()[1], [1, 2, 4, 5, 6]);
        assert_eq!(environment.rotation().unwrap().ways(1), [4, 5, 1, 2, 6]);
        assert_eq!(environment.lengths_m(), Some(&[4.0, 5.5, 12.0, 0.8][..]));
        let without = with_ways("", [""; 3]).unwrap();
        assert_eq!((without.rotation(), without.lengths_m()), (None, None));
    }

    #[test]
    fn invalid_ways_and_lengths_are_rejected_with_the_reason() {
        let ways = ["ways = [1, 0]", "ways = [2, 2, 0, 1, 3]", "ways = [3]"];
        let refusal = |place: usize, wrong: &'static str| {
            let mut ways = ways;
            ways[place] = wrong;
            with_ways("", ways).unwrap_err().to_string()
        };
        assert_eq!(refusal(2, ""), "place 3 has no ways, but other places have");
        let no_way = "place 3: 0 in ways is not the position of an edge of the place, from 0";
        assert_eq!(refusal(2, "ways = [0]"), no_way);
        assert_eq!(refusal(2, "ways = [9]"), no_way.replace("3: 0", "3: 9"));
        assert_eq!(refusal(2, "ways = [3, 3]"), "place 3: edge number 3 is in ways too often");
        assert_eq!(
            refusal(1, "ways = [2, 0, 1, 3]"),
            "place 2: edge number 2 is missing in ways; a loop is there twice"
        );
        assert_eq!(refusal(0, "ways = []"), "place 1: edge number 0 is missing in ways; a loop is there twice");
        assert_eq!(refusal(1, "ways = [2, 0, 2, 3, 1]"), "the ways do not lie in the plane: their genus is 1");
        assert!(refusal(1, "ways = [-1]").starts_with("cannot parse the environment: TOML parse error"));
        let lengths = |lengths: &str| with_ways(&format!("lengths_m = {lengths}\n"), ways).unwrap_err().to_string();
        assert_eq!(lengths("[1, 2, 3]"), "there are 3 lengths_m for 4 edges");
        assert_eq!(lengths("[1, 2, 0, 1]"), "edge number 2: a length of 0 m is not within 0.1 to 1000");
        assert_eq!(lengths("[1, 2, nan, 1]"), "edge number 2: a length of NaN m is not within 0.1 to 1000");
        let edges = "[[1, 2], [1, 2], [1, 2], [1, 2], [1, 1], [1, 1]]";
        let places = "[[place]]\nid = 1\nmean_mm = 9\nsd_mm = 1\nways = [0, 1, 2, 3, 4, 4, 5, 5]\n\
                      [[place]]\nid = 2\nmean_mm = 9\nsd_mm = 1\nways = [3, 2, 1, 0]\n";
        let error = format!("name = \"test\"\nedges = {edges}\n{places}").parse::<Environment>().unwrap_err();
        assert_eq!(error.to_string(), "place 1 has 8 ways, but at most 7 are possible");
    }
}
