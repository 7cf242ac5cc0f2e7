//! `toposlam export`: a robot's map as GraphML, DOT, GeoJSON, JSON, SVG, or a snapshot to localise on.

use std::ffi::{OsStr, OsString};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use toposlam_cli::{errln, output};
use toposlam_link::client::Client;
use toposlam_link::event_text;
use toposlam_link::export;
use toposlam_link::import;
use toposlam_link::layout::Layout;
use toposlam_link::line::{self, Line};
use toposlam_link::listener::{Event, Listener, Understanding};
#[cfg(feature = "recording")]
use toposlam_link::recording::{self, RecordingError};
use toposlam_link::topology::TopologicalMap;

/// Arguments of `toposlam export`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Source of the map: serial port of a robot, tcp:HOST:PORT, recording (FILE.mcap, feature `recording`), JSON, GeoJSON or GraphML of
    /// this command, a snapshot, file with the bytes of a line, or - for such bytes on the standard input.
    source: OsString,
    /// Output format.
    #[arg(long)]
    format: Format,
    /// File to write [default: the standard output].
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
    /// Approximate length of an edge in GeoJSON, in metres, 0.1 to 1000.
    #[arg(long, value_name = "METRES", default_value_t = 5.0, value_parser = edge_m)]
    edge_m: f64,
    /// How far the robot drives in a ring frame, in millimetres, 0.1 to 1000: edges with a travel time get their length as their cost
    /// in GeoJSON.
    #[arg(long, value_name = "MM", value_parser = frame_mm)]
    frame_mm: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Graphml,
    Dot,
    Geojson,
    Json,
    Svg,
    /// A snapshot with which a robot localises on the map (`toposlam command LINE restore`).
    Snapshot,
}

fn edge_m(text: &str) -> Result<f64, String> {
    super::drive::number_in(text, 0.1..=1000.0)
}

pub(super) fn frame_mm(text: &str) -> Result<f64, String> {
    super::drive::number_in(text, 0.1..=1000.0)
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    check_output(arguments.output.as_deref(), arguments.force)?;
    let (map, here) = read(&arguments.source, arguments.baud)?;
    let mut layout = Layout::new();
    layout.arrange(&map);
    let bytes = match arguments.format {
        Format::Graphml => export::graphml(&map, &layout, here).into_bytes(),
        Format::Dot => export::dot(&map, &layout, here).into_bytes(),
        Format::Geojson => export::geojson(&map, &layout, here, arguments.edge_m, arguments.frame_mm).into_bytes(),
        Format::Json => export::json(&map, &layout, here).into_bytes(),
        Format::Svg => export::svg(&map, &layout, here).into_bytes(),
        Format::Snapshot => import::known_map(&map)?,
    };
    output::write(arguments.output.as_deref(), &bytes, arguments.force)
}

/// Fails if the output exists already, before the source is read.
pub(super) fn check_output(file: Option<&Path>, force: bool) -> anyhow::Result<()> {
    file.map_or(Ok(()), |file| output::check(file, force))
}

/// Warns of what makes the map doubtful.
fn complain(listener: &Listener) {
    let understanding = listener.understanding();
    if !matches!(understanding, Understanding::Whole | Understanding::Unknown) {
        errln!("{understanding}");
    }
    if let Some(restarts) = event_text::restarts(listener.counters().restarts) {
        errln!("{restarts}");
    }
}

/// The map of a source, and the vertex of the robot if it is known.
pub(crate) fn read(source: &OsStr, baud: u32) -> anyhow::Result<(TopologicalMap, Option<u8>)> {
    let path = Path::new(source);
    let listener = if source == "-" {
        recorded(io::stdin().lock()).context("reading the standard input")?
    } else if path.extension().is_some_and(|extension| extension == "mcap") {
        replayed(path).with_context(|| format!("reading {}", path.display()))?
    } else if path.is_file() {
        let reading = || format!("reading {}", path.display());
        let bytes = std::fs::read(path).with_context(reading)?;
        if let Some(map) = imported(&bytes).with_context(reading)? {
            return Ok((map, None));
        }
        recorded(&bytes[..]).with_context(reading)?
    } else {
        let name = source.to_str().with_context(|| format!("{}: no such file", path.display()))?;
        requested(line::open(name, baud)?)?
    };
    let counters = listener.counters();
    ensure!(
        counters.messages + counters.unknown() > 0,
        "{}: no message of a robot, and no map in JSON, GeoJSON, GraphML or a snapshot",
        source.display()
    );
    complain(&listener);
    let map = listener.map();
    ensure!(!map.vertices.is_empty(), "{}: no map received", source.display());
    complain_of_gaps(&listener);
    Ok((map, listener.replica().location().map(|location| location.vertex)))
}

/// The map of a file in JSON, GeoJSON or GraphML, or of a snapshot; `None` for other bytes.
fn imported(bytes: &[u8]) -> anyhow::Result<Option<TopologicalMap>> {
    match bytes.trim_ascii_start().first() {
        Some(b'{') => Ok(Some(import::json(std::str::from_utf8(bytes)?)?)),
        Some(b'<') => Ok(Some(import::graphml(std::str::from_utf8(bytes)?)?)),
        // The bytes of a line do not begin as a snapshot does.
        _ if bytes.starts_with(b"TSLM") => Ok(Some(import::snapshot(bytes)?)),
        _ => Ok(None),
    }
}

/// The state of a robot with its whole map.
fn requested(line: Box<dyn Line>) -> anyhow::Result<Listener> {
    let mut client = Client::new(line, rand::random(), |_: &Listener, _: Event<'_>| {});
    client.map()?;
    Ok(client.listener().clone())
}

/// The state at the end of a robot's byte stream.
fn recorded(mut bytes: impl Read) -> io::Result<Listener> {
    let mut listener = Listener::new();
    let mut buffer = [0; 1 << 16];
    loop {
        match bytes.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => listener.feed(&buffer[..count], |_, _| ()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(listener)
}

/// The state at the end of a recording.
#[cfg(feature = "recording")]
fn replayed(path: &Path) -> Result<Listener, RecordingError> {
    let mut listener = Listener::new();
    for bytes in recording::frames(path)? {
        listener.feed(&bytes?, |_, _| ());
    }
    Ok(listener)
}

#[cfg(not(feature = "recording"))]
fn replayed(_: &Path) -> anyhow::Result<Listener> {
    Err(super::missing::no_recordings())
}

fn complain_of_gaps(listener: &Listener) {
    if !listener.replica().is_complete() || !listener.replica().is_converged() {
        errln!("the map is incomplete: vertices or edges may be missing");
    }
}
