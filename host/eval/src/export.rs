//! Writes paths to files, so that other programs can map the same paths: a table of the filter's input, and the ground
//! truth.

use super::{
    case::Case,
    corridors::Corridors,
    environment::Place,
    rotation::RotationSystem,
    run::Course,
    settings::{EvaluationError, Settings},
    trial::{Trial, Truth},
};
use serde::Serialize;
use std::{collections::BTreeMap, f64::consts::TAU, fmt, fs, io, path::Path};
use toposlam::{Exit, Observation, Ways};

/// Why paths were not written.
#[derive(Debug)]
#[non_exhaustive]
pub enum ExportError {
    /// There is no path to write.
    Evaluation(EvaluationError),
    /// A file or directory was not written.
    Write {
        /// The file or directory.
        file: String,
        /// The error.
        error: io::Error,
    },
}

impl fmt::Display for ExportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Evaluation(error) => error.fmt(f),
            Self::Write { file, error } => write!(f, "cannot write {file}: {error}"),
        }
    }
}

impl std::error::Error for ExportError {}

/// One case in `manifest.json`.
#[derive(Serialize)]
struct Entry<'a> {
    /// Where its files are, relative to the manifest.
    directory: String,
    name: &'a str,
    paths: usize,
    lengths: &'a [usize],
    seed: u64,
}

/// Ground truth of one path: `<path>.truth.json`. Places are numbered by their index.
#[derive(Serialize)]
struct TruthFile<'a> {
    /// The place of every step.
    places: Vec<usize>,
    /// The vertex of the smallest equivalent at every step, at the last check point.
    classes: Vec<usize>,
    /// Mean and standard deviation of every place of the environment, in millimetres.
    labels: Vec<[f64; 2]>,
    /// All pairs of connected places of the environment.
    edges: Vec<[usize; 2]>,
    /// All corridors of the environment, if the hints are ways.
    #[serde(skip_serializing_if = "Option::is_none")]
    corridors: Option<Vec<[usize; 2]>>,
    /// The positions in `corridors` of the ways of every place, counter-clockwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    ways: Option<Vec<Vec<usize>>>,
    /// The check points.
    lengths: &'a [usize],
    /// The true map at each check point.
    truth: BTreeMap<usize, TruthGraph>,
}

#[derive(Serialize)]
struct TruthGraph {
    classes: Vec<usize>,
    vertices: usize,
    edges: Vec<[usize; 2]>,
}

/// Writes every path of every case: `manifest.json`, and in a directory for each case `<path>.csv` and
/// `<path>.truth.json`.
///
/// # Errors
/// [`ExportError`] when there is no path, or a file cannot be written.
pub fn export(directory: &Path, cases: &[Case], settings: &Settings) -> Result<(), ExportError> {
    let mut manifest: Vec<Entry> = Vec::new();
    for case in cases {
        let mut name = slug(&case.name);
        while manifest.iter().any(|entry| entry.directory == name) {
            name.push_str("-again");
        }
        let folder = directory.join(&name);
        fs::create_dir_all(&folder).map_err(|error| write_error(&folder, error))?;
        let course = Course::new(case, settings).map_err(ExportError::Evaluation)?;
        for path in 0..settings.paths as u64 {
            let trial = course.trial(path).map_err(ExportError::Evaluation)?;
            write(&folder.join(format!("{path}.csv")), table(&trial))?;
            write(&folder.join(format!("{path}.truth.json")), json(&truth_file(&trial, settings)))?;
        }
        let Settings { paths, lengths, seed, .. } = settings;
        manifest.push(Entry { directory: name, name: &case.name, paths: *paths, lengths, seed: *seed });
    }
    write(&directory.join("manifest.json"), json(&manifest))
}

/// A name of letters, digits, dots and hyphens.
fn slug(name: &str) -> String {
    let mut slug = String::new();
    for character in name.to_lowercase().chars() {
        if character.is_ascii_alphanumeric() || character == '.' {
            slug.push(character);
        } else if !slug.ends_with('-') {
            slug.push('-');
        }
    }
    let slug = slug.trim_matches(['-', '.']);
    if slug.is_empty() { "unnamed".to_owned() } else { slug.to_owned() }
}

fn table(trial: &Trial) -> io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let with_ways = trial.corridors.is_some();
    let columns = ["place", "radius_mm", "turn", "degree", "ways_mrad", "exit_mrad", "travel_frames"];
    writer.write_record(&columns[..if with_ways { 7 } else { 4 }])?;
    for (step, visit) in trial.visits.iter().enumerate() {
        let Observation { fingerprint, ways, exit, travel_frames, .. } = visit.observation;
        let turn = exit.map_or("", |exit| if exit.is_back() { "back" } else { "on" });
        let degree = ways.map_or(String::new(), |ways| ways.count().to_string());
        let mut record = vec![step.to_string(), fingerprint.radius_mm().to_string(), turn.into(), degree];
        if with_ways {
            let others = ways.as_ref().and_then(Ways::others).unwrap_or(&[]);
            record.push(others.iter().map(|&bearing| mrad(bearing)).collect::<Vec<_>>().join(" "));
            record.push(match exit {
                None | Some(Exit::On) => String::new(),
                Some(Exit::Back) => mrad(0),
                Some(Exit::Bearing(bearing)) => mrad(bearing),
            });
            record.push(travel_frames.map_or(String::new(), |frames| frames.to_string()));
        }
        writer.write_record(&record)?;
    }
    writer.into_inner().map_err(|error| error.into_error())
}

/// A bearing in 1/256 of a turn, in milliradians.
fn mrad(bearing: u8) -> String {
    (f64::from(bearing) * 1000.0 * TAU / 256.0).round().to_string()
}

fn truth_file<'a>(trial: &Trial, settings: &'a Settings) -> TruthFile<'a> {
    let pairs = |edges: &mut dyn Iterator<Item = &(usize, usize)>| edges.map(|&(a, b)| [a, b]).collect();
    let truth_after = |length: usize| {
        let Truth { graph, classes, .. } = trial.truth(length);
        let classes = classes[trial.places_before()..].to_vec();
        TruthGraph { classes, vertices: graph.vertex_count(), edges: pairs(&mut graph.edges().iter()) }
    };
    let label = |place: &Place| [place.mean_mm, place.sd_mm];
    let rotation = trial.corridors.as_ref().map(Corridors::rotation);
    let ways = |rotation: &RotationSystem| {
        let positions = |place| rotation.ways(place).iter().map(|dart| dart / 2).collect();
        (0..rotation.vertex_count()).map(positions).collect()
    };
    TruthFile {
        places: trial.visits.iter().map(|visit| visit.place).collect(),
        classes: truth_after(settings.longest()).classes,
        labels: trial.environment.places().iter().map(label).collect(),
        edges: pairs(&mut trial.environment.graph().edges().iter()),
        corridors: rotation.map(|_| pairs(&mut trial.environment.corridors().iter())),
        ways: rotation.map(ways),
        lengths: &settings.lengths,
        truth: settings.lengths.iter().map(|&length| (length, truth_after(length))).collect(),
    }
}

fn json(value: &impl Serialize) -> io::Result<Vec<u8>> {
    Ok(serde_json::to_vec(value)?)
}

fn write(file: &Path, content: io::Result<Vec<u8>>) -> Result<(), ExportError> {
    content.and_then(|content| fs::write(file, content)).map_err(|error| write_error(file, error))
}

fn write_error(file: &Path, error: io::Error) -> ExportError {
    ExportError::Write { file: file.display().to_string(), error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slugs_hold_letters_digits_dots_and_hyphens() {
        assert_eq!(slug("wean-surrogate-sd, 20 placements"), "wean-surrogate-sd-20-placements");
        assert_eq!(slug("family 1,20,8,14,2-3,3,0.03,general"), "family-1-20-8-14-2-3-3-0.03-general");
        assert_eq!(slug("Größe/../x"), "gr-e-..-x");
        assert_eq!(slug(".."), "unnamed");
    }
}
