//! `toposlam command`: send a command to a robot over its line.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Subcommand, ValueEnum};
use toposlam::wire::{Command, MapReplica};
use toposlam_link::client::Client;
use toposlam_link::line::{Line, open};
use toposlam_link::listener::{Event, Listener};
use toposlam_link::topology::TopologicalMap;
use toposlam_link::{event_text, setting};

/// Arguments of `toposlam command`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Serial port of the robot, or tcp:HOST:PORT.
    line: String,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
    /// Timeout of a reply, in milliseconds; then the request is repeated.
    #[arg(long, default_value_t = 1000)]
    timeout_ms: u64,
    /// Number of times that a request is sent before the command fails.
    #[arg(long, default_value_t = 5)]
    attempts: u32,
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Print version, settings and state of the robot.
    Info,
    /// Print the map.
    Map,
    /// Fetch a snapshot of the map and write it to a file.
    Snapshot {
        /// File to write.
        file: PathBuf,
    },
    /// Replace the map by that of a snapshot.
    Restore {
        /// File written by `snapshot`.
        file: PathBuf,
    },
    /// Delete the map and restart mapping.
    Reset,
    /// Change a setting.
    Set {
        /// Name of the setting.
        #[arg(value_parser = setting::NAMES)]
        name: String,
        /// New value; docs/wire.md lists units and ranges.
        value: u16,
    },
    /// Keep the map unchanged and only localise, or map again.
    LocaliseOnly {
        /// on: localise only; off: map.
        state: Switch,
    },
    /// Drive to a vertex of the map.
    GoTo {
        /// Number of the vertex.
        vertex: u8,
    },
    /// Explore the building.
    Explore,
    /// Pause the robot and the mapping, or continue.
    Pause {
        /// on: pause; off: continue.
        state: Switch,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Switch {
    On,
    Off,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let line = open(&arguments.line, arguments.baud)?;
    let mut client = Client::new(line, rand::random(), |_: &Listener, _: Event<'_>| {});
    client.timeout = std::time::Duration::from_millis(arguments.timeout_ms);
    client.attempts = arguments.attempts;
    match &arguments.action {
        Action::Info => println!("{}", event_text::info(&client.info()?).join("\n")),
        Action::Map => print_map(client.map()?),
        Action::Snapshot { file } => {
            let snapshot = client.snapshot()?;
            std::fs::write(file, &snapshot).with_context(|| format!("writing {}", file.display()))?;
            println!("{} bytes", snapshot.len());
        }
        Action::Restore { file } => {
            let snapshot = std::fs::read(file).with_context(|| format!("reading {}", file.display()))?;
            client.restore(&snapshot)?;
            println!("{} bytes restored", snapshot.len());
        }
        Action::Reset => order(&mut client, Command::Reset)?,
        Action::Set { name, value } => {
            let setting = setting::named(name, *value).context("unknown setting")?;
            order(&mut client, Command::SetConfig(setting))?;
        }
        Action::LocaliseOnly { state } => {
            order(&mut client, Command::LocaliseOnly { on: *state == Switch::On })?;
        }
        Action::GoTo { vertex } => order(&mut client, Command::GoTo { vertex: *vertex })?,
        Action::Explore => order(&mut client, Command::Explore)?,
        Action::Pause { state } => order(&mut client, Command::Pause { on: *state == Switch::On })?,
    }
    Ok(())
}

fn order(client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>, command: Command) -> anyhow::Result<()> {
    client.order(command)?;
    println!("done");
    Ok(())
}

pub(super) fn print_map(replica: &MapReplica<64>) {
    let map = TopologicalMap::from(replica);
    let all_edges = map.all_edges();
    println!("map: {} vertices, {} edges", replica.vertices(), all_edges.len());
    for row in (0..replica.vertices()).filter_map(|vertex| replica.row(vertex)) {
        println!("  vertex {:2}: radius {:4} mm, {} visits", row.vertex, row.radius_mm, row.visits);
    }
    let edges = all_edges.iter().map(|([a, b], _)| format!("{}-{}", a.min(b), a.max(b)));
    println!("  edges: {}", edges.collect::<Vec<_>>().join(" "));
    if !map.ways.is_empty() {
        let frontiers: Vec<String> = map.frontiers().map(|end| format!("{}.{}", end.vertex, end.way)).collect();
        println!("  frontiers: {}", frontiers.join(" "));
    }
    if let Some(location) = replica.location() {
        println!("  at vertex {}", location.vertex);
    }
}
