//! `toposlam export`: a robot's map as GraphML, DOT, GeoJSON, JSON or SVG.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
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
    source: String,
    /// Output format.
    #[arg(long)]
    format: Format,
    /// File to write [default: the standard output].
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
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
    if let understanding @ (Understanding::Not(_) | Understanding::Partly { .. }) = listener.understanding() {
        eprintln!("{understanding}");
    }
    let map = listener.map();
    ensure!(!map.vertices.is_empty(), "{}: no map received", arguments.source);
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
        Some(file) => std::fs::write(file, text).with_context(|| format!("writing {}", file.display())),
        None => Ok(io::stdout().write_all(text.as_bytes())?),
    }
}

/// Reads the map of a source; returns the listener that holds it.
fn listen(source: &str, baud: u32) -> anyhow::Result<Listener> {
    if source == "-" {
        return recorded(io::stdin().lock()).context("reading the standard input");
    }
    let path = Path::new(source);
    if path.extension().is_some_and(|extension| extension == "mcap") {
        return replayed(path).with_context(|| format!("reading {source}"));
    }
    if path.is_file() {
        let file = File::open(source).with_context(|| format!("opening {source}"))?;
        return recorded(file).with_context(|| format!("reading {source}"));
    }
    let line = line::open(source, baud)?;
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
        eprintln!("the map is incomplete: vertices or edges may be missing");
    }
}
