//! The environment graph: places with the statistics of their fingerprints, and the corridors between them.

use super::graph::{Graph, first_unreached};
use serde::Deserialize;
use std::{collections::HashMap, fmt, fs, io, path::Path, str::FromStr};
use toposlam::Fingerprint;

/// A place as an environment file describes it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// The number of the place in the file; edges refer to it.
    pub id: u32,
    /// The mean of its fingerprints in millimetres, 0 to 8188.
    pub mean_mm: f64,
    /// The standard deviation of its fingerprints in millimetres, 0 or more.
    pub sd_mm: f64,
}

/// A connected graph of places and corridors, with the fingerprint statistics of each place.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    name: String,
    places: Vec<Place>,
    graph: Graph,
    neighbours: Vec<Vec<usize>>,
}

/// Why an environment cannot be used.
#[derive(Debug)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// The file cannot be read.
    Read(io::Error),
    /// The file is not TOML of the expected form.
    Parse(toml::de::Error),
    /// There is no edge, so no robot can drive.
    NoEdges,
    /// Two places have the same id.
    DuplicatePlace {
        /// The id that is used twice.
        id: u32,
    },
    /// A mean is outside the range of a fingerprint.
    MeanOutOfRange {
        /// The place in question.
        id: u32,
        /// Its mean in millimetres.
        mean_mm: f64,
    },
    /// A standard deviation is negative or not a number.
    DeviationOutOfRange {
        /// The place in question.
        id: u32,
        /// Its standard deviation in millimetres.
        sd_mm: f64,
    },
    /// An edge ends at a place that is not listed.
    UnknownPlace {
        /// The edge as written.
        edge: [u32; 2],
        /// The end that is not listed.
        id: u32,
    },
    /// An edge is listed twice, in the same or in the opposite direction.
    DuplicateEdge {
        /// The second occurrence.
        edge: [u32; 2],
    },
    /// No walk leads from one place to another.
    Disconnected {
        /// Where the walk starts.
        from: u32,
        /// The place it never reaches.
        to: u32,
    },
}

impl fmt::Display for EnvironmentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read(error) => write!(f, "cannot read the environment: {error}"),
            Self::Parse(error) => write!(f, "cannot parse the environment: {error}"),
            Self::NoEdges => write!(f, "the environment has no edges"),
            Self::DuplicatePlace { id } => write!(f, "place {id} is listed twice"),
            Self::MeanOutOfRange { id, mean_mm } => {
                write!(f, "place {id}: mean_mm = {mean_mm} is not within 0 to {}", Fingerprint::MAX.radius_mm())
            }
            Self::DeviationOutOfRange { id, sd_mm } => write!(f, "place {id}: sd_mm = {sd_mm} is not 0 or more"),
            Self::UnknownPlace { edge: [a, b], id } => write!(f, "edge [{a}, {b}]: there is no place {id}"),
            Self::DuplicateEdge { edge: [a, b] } => write!(f, "edge [{a}, {b}] is listed twice"),
            Self::Disconnected { from, to } => write!(f, "no walk leads from place {from} to place {to}"),
        }
    }
}

impl std::error::Error for EnvironmentError {}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    edges: Vec<[u32; 2]>,
    place: Vec<Place>,
}

impl FromStr for Environment {
    type Err = EnvironmentError;

    fn from_str(text: &str) -> Result<Self, EnvironmentError> {
        let File { name, edges, place } = toml::from_str(text).map_err(EnvironmentError::Parse)?;
        Self::new(name, place, &edges)
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

    /// An environment from its places and the pairs of ids that are connected. An edge may connect a place to itself.
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
        let mut graph = Graph::new(places.len());
        for &edge in edges {
            let end = |id| index_of.get(&id).copied().ok_or(EnvironmentError::UnknownPlace { edge, id });
            if !graph.add_edge(end(edge[0])?, end(edge[1])?) {
                return Err(EnvironmentError::DuplicateEdge { edge });
            }
        }
        if edges.is_empty() {
            return Err(EnvironmentError::NoEdges);
        }
        let neighbours = graph.neighbours();
        if let Some(unreached) = first_unreached(&neighbours) {
            return Err(EnvironmentError::Disconnected { from: places[0].id, to: places[unreached].id });
        }
        Ok(Self { name, places, graph, neighbours })
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

    /// The environment graph.
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
        assert_eq!(refusal("[[1, 2], [2, 3], [2, 1]]", &THREE), "edge [2, 1] is listed twice");
        assert_eq!(refusal("[]", &THREE), "the environment has no edges");
        assert_eq!(refusal("[[1, 1]]", &[THREE[0], THREE[0]]), "place 1 is listed twice");
        assert_eq!(refusal("[[1, 1]]", &[(1, 8200.0, 1.0)]), "place 1: mean_mm = 8200 is not within 0 to 8188");
        assert_eq!(refusal("[[1, 1]]", &[(1, 800.0, -1.0)]), "place 1: sd_mm = -1 is not 0 or more");
        assert!(refusal("[[1]]", &THREE).starts_with("cannot parse the environment: TOML parse error"));
    }
}
