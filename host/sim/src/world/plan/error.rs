//! Why a file is no floor plan.

use std::fmt;
use std::path::PathBuf;

use super::bitmap::CELLS_MAX;

/// Why a text or an image is no floor plan.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlanError {
    /// The first line of a text plan is not `cell_mm N` with N from 10 to 1000.
    Header,
    /// A character other than `#`, `.` and `S` in a text plan.
    Character {
        /// The character.
        character: char,
        /// The line, counted from 1.
        line: usize,
    },
    /// More than one `S` in a text plan.
    Start,
    /// No place that is free.
    NoFreeSpace,
    /// More cells than a plan may have.
    TooLarge {
        /// Cells in a row.
        columns: usize,
        /// Rows.
        rows: usize,
    },
    /// The file cannot be read.
    Read(String),
    /// An image without the YAML file that gives its resolution.
    NoYaml,
    /// A value that is not allowed, in a map_server YAML file.
    YamlValue {
        /// The line, counted from 1.
        line: usize,
        /// The key.
        key: &'static str,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A key that is missing in a map_server YAML file.
    YamlKey {
        /// The key.
        key: &'static str,
        /// What is allowed.
        allowed: &'static str,
    },
    /// An image that is neither PNG nor PGM, by its first bytes.
    Magic,
    /// The header of a PGM image.
    PgmHeader {
        /// What is allowed.
        allowed: &'static str,
    },
    /// An image with fewer pixels than its header says.
    Truncated {
        /// The pixels of the header.
        expected: usize,
        /// The pixels that are there.
        found: usize,
    },
    /// An image that the PNG decoder refuses.
    Png(String),
    /// An SVG file that is no XML.
    Xml(String),
    /// An element of an SVG file that is no part of a plan.
    Svg {
        /// The line, counted from 1.
        line: u32,
        /// The element.
        element: String,
        /// What is allowed.
        allowed: &'static str,
    },
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header => write!(f, "line 1: expected `cell_mm N` with N from 10 to 1000"),
            Self::Character { character, line } => {
                write!(f, "line {line}: {character:?} is none of '#' (wall), '.' (free), 'S' (start)")
            }
            Self::Start => write!(f, "more than one start cell 'S'; allowed is one at most"),
            Self::NoFreeSpace => write!(f, "nothing is free"),
            Self::TooLarge { columns, rows } => {
                write!(f, "{columns} by {rows} cells; allowed are {CELLS_MAX} cells at most")
            }
            Self::Read(error) => write!(f, "{error}"),
            Self::NoYaml => write!(f, "an image has no scale; give the map_server YAML file that names it"),
            Self::YamlValue { line, key, allowed } => write!(f, "line {line}: {key} must be {allowed}"),
            Self::YamlKey { key, allowed } => write!(f, "{key} is missing; it must be {allowed}"),
            Self::Magic => write!(f, "the image is neither PNG nor PGM (P2, P5)"),
            Self::PgmHeader { allowed } => write!(f, "PGM header: expected {allowed}"),
            Self::Truncated { expected, found } => {
                write!(f, "the image ends after {found} of {expected} pixels")
            }
            Self::Png(error) => write!(f, "PNG: {error}"),
            Self::Xml(error) => write!(f, "XML: {error}"),
            Self::Svg { line, element, allowed } => write!(f, "line {line}: <{element}>: expected {allowed}"),
        }
    }
}

impl std::error::Error for PlanError {}

/// Why a file is no floor plan, and which file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanFileError {
    /// The plan, or the image that its YAML file names.
    pub file: PathBuf,
    /// What is wrong with it.
    pub error: PlanError,
}

impl fmt::Display for PlanFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.error)
    }
}

/// The text names the error: there is no source that repeats it.
impl std::error::Error for PlanFileError {}
