//! `toposlam export`: a robot's map as GraphML, DOT, GeoJSON, JSON or SVG.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use toposlam_cli::{errln, output};
use toposlam_link::client::Client;
use toposlam_link::export;
use toposlam_link::layout::Layout;
use toposlam_link::line;
use toposlam_link::listener::{Event, Listener, Understanding};
#[cfg(feature = "recording")]
use toposlam_link::recording::{self, RecordingError};

/// Arguments of `toposlam export`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Source of the map: serial port of a robot, tcp:HOST:PORT, recording (FILE.mcap, feature `recording`), file with the bytes of a
    /// line, or - for such bytes on the standard input.
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
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Graphml,
    Dot,
    Geojson,
    Json,
    Svg,
}

fn edge_m(text: &str) -> Result<f64, String> {
    super::drive::number_in(text, 0.1..=1000.0)
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let listener = listen(&arguments.source, arguments.baud)?;
    complain(&listener);
    let map = listener.map();
    ensure!(!map.vertices.is_empty(), "{}: no map received", arguments.source.display());
    let mut layout = Layout::new();
    layout.arrange(&map);
    let here = listener.replica().location().map(|location| location.vertex);
    let text = match arguments.format {
        Format::Graphml => export::graphml(&map, &layout, here),
        Format::Dot => export::dot(&map, &layout, here),
        Format::Geojson => export::geojson(&map, &layout, here, arguments.edge_m),
        Format::Json => export::json(&map, &layout, here),
        Format::Svg => export::svg(&map, &layout, here),
    };
    match &arguments.output {
        Some(file) => output::write_file(file, text, arguments.force),
        None => Ok(output::write_bytes(text.as_bytes())?),
    }
}

/// Warns of what makes the map doubtful.
fn complain(listener: &Listener) {
    let understanding = listener.understanding();
    if !matches!(understanding, Understanding::Whole | Understanding::Unknown) {
        errln!("{understanding}");
    }
    match listener.counters().restarts {
        0 => {}
        restarts => errln!("{restarts} restarts of the robot; the map is that of the last start"),
    }
}

/// Reads the map of a source; returns the listener that holds it.
fn listen(source: &OsStr, baud: u32) -> anyhow::Result<Listener> {
    if source == "-" {
        return recorded(io::stdin().lock()).context("reading the standard input");
    }
    let path = Path::new(source);
    if path.extension().is_some_and(|extension| extension == "mcap") {
        return replayed(path).with_context(|| format!("reading {}", path.display()));
    }
    if path.is_file() {
        let file = File::open(source).with_context(|| format!("opening {}", path.display()))?;
        return recorded(file).with_context(|| format!("reading {}", path.display()));
    }
    let name = source.to_str().with_context(|| format!("{}: no such file", path.display()))?;
    let line = line::open(name, baud)?;
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
    complain_of_gaps(&listener);
    Ok(listener)
}

/// The state at the end of a recording.
#[cfg(feature = "recording")]
fn replayed(path: &Path) -> Result<Listener, RecordingError> {
    let mut listener = Listener::new();
    for bytes in recording::frames(path)? {
        listener.feed(&bytes?, |_, _| ());
    }
    complain_of_gaps(&listener);
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
