//! `toposlam merge`: one map of the maps of two robots or two runs in one building.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;
use toposlam_cli::{errln, output};
use toposlam_link::export;
use toposlam_link::layout::Layout;
use toposlam_link::merge::merge;

use super::export::{check_output, read};

/// Arguments of `toposlam merge`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Source of the first map, as of `export`: line of a robot, recording, JSON of `export`, snapshot. Its vertices keep their numbers.
    first: OsString,
    /// Source of the second map.
    second: OsString,
    /// File for the merged map in the JSON of `export` [default: the standard output].
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    check_output(arguments.output.as_deref(), arguments.force)?;
    let (first, here) = read(&arguments.first, arguments.baud)?;
    let (second, _) = read(&arguments.second, arguments.baud)?;
    let merged = merge(&first, &second)?;
    for part in &merged.parts {
        errln!("common part: {part}");
    }
    let pairs: Vec<String> = merged.common.iter().map(|(a, b)| format!("{a}={b}")).collect();
    errln!("common vertices, first = second: {}", pairs.join(" "));
    for name in second.names.values().filter(|name| !merged.map.names.values().any(|known| known == *name)) {
        errln!("the name `{name}` of the second map is dropped: its vertex has another name in the first");
    }
    let sizes = [&first, &second, &merged.map].map(|map| map.vertices.len());
    errln!("vertices: {} and {}, merged {}", sizes[0], sizes[1], sizes[2]);
    let mut layout = Layout::new();
    layout.arrange(&merged.map);
    let text = export::json(&merged.map, &layout, here);
    output::write(arguments.output.as_deref(), text.as_bytes(), arguments.force)
}
