//! Why an environment is refused.

use super::LENGTHS_M;
use std::{fmt, io};
use toposlam::{Fingerprint, WAYS_MAX};

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
    /// A place has no `ways`, but others have.
    NoWays {
        /// The place in question.
        id: u32,
    },
    /// A number in `ways` is not the position of an edge of the place.
    NotAWay {
        /// The place in question.
        id: u32,
        /// The number.
        position: usize,
    },
    /// An edge is in `ways` too often: once for an end at the place.
    DoubledWay {
        /// The place in question.
        id: u32,
        /// The position of the edge in `edges`.
        position: usize,
    },
    /// An edge of the place is missing in `ways`; a loop is there twice.
    MissingWay {
        /// The place in question.
        id: u32,
        /// The position of the edge in `edges`.
        position: usize,
    },
    /// A place has more than 7 ways.
    TooManyWays {
        /// The place in question.
        id: u32,
        /// How many it has.
        ways: usize,
    },
    /// The ways in this order do not lie in the plane.
    NotPlanar {
        /// The genus of the surface on which they lie.
        genus: usize,
    },
    /// The number of lengths is not that of edges.
    LengthCount {
        /// The number of lengths.
        lengths: usize,
        /// The number of edges.
        edges: usize,
    },
    /// A length is out of its range.
    LengthOutOfRange {
        /// The position in `edges`.
        position: usize,
        /// The length in metres.
        length_m: f64,
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
            Self::NoWays { id } => write!(f, "place {id} has no ways, but other places have"),
            Self::NotAWay { id, position } => {
                write!(f, "place {id}: {position} in ways is not the position of an edge of the place, from 0")
            }
            Self::DoubledWay { id, position } => write!(f, "place {id}: edge number {position} is in ways too often"),
            Self::MissingWay { id, position } => {
                write!(f, "place {id}: edge number {position} is missing in ways; a loop is there twice")
            }
            Self::TooManyWays { id, ways } => {
                write!(f, "place {id} has {ways} ways, but at most {WAYS_MAX} are possible")
            }
            Self::NotPlanar { genus } => write!(f, "the ways do not lie in the plane: their genus is {genus}"),
            Self::LengthCount { lengths, edges } => write!(f, "there are {lengths} lengths_m for {edges} edges"),
            Self::LengthOutOfRange { position, length_m } => {
                let (least, most) = (LENGTHS_M.start(), LENGTHS_M.end());
                write!(f, "edge number {position}: a length of {length_m} m is not within {least} to {most}")
            }
            Self::Disconnected { from, to } => write!(f, "no walk leads from place {from} to place {to}"),
        }
    }
}

impl std::error::Error for EnvironmentError {}
