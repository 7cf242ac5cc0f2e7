//! `toposlam command`: tell a robot on a serial line what to do.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Subcommand, ValueEnum};
use toposlam::wire::{Command, MapReplica};
use toposlam_link::client::Client;
use toposlam_link::line::{Line, open};
use toposlam_link::listener::{Event, Listener};
use toposlam_link::{setting, wording};

/// Arguments of `toposlam command`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The robot's line: a serial port, or tcp:HOST:PORT.
    line: String,
    /// The speed of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
    /// Repeat a request after this many milliseconds without a reply.
    #[arg(long, default_value_t = 1000)]
    timeout_ms: u64,
    /// Send a request this often before giving up.
    #[arg(long, default_value_t = 5)]
    attempts: u32,
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Say which robot this is and what it does.
    Info,
    /// Print the map.
    Map,
    /// Take a snapshot and write it to a file.
    Snapshot {
        /// The file.
        file: PathBuf,
    },
    /// Go on with the map of a snapshot.
    Restore {
        /// A file that `snapshot` wrote.
        file: PathBuf,
    },
    /// Forget the map and start anew.
    Reset,
    /// Change a setting.
    Set {
        /// Which one.
        #[arg(value_parser = setting::NAMES)]
        name: String,
        /// Its value.
        value: u16,
    },
    /// Keep the map as it is and only tell where the robot is, or go on mapping.
    LocaliseOnly {
        /// Whether the map is kept.
        state: Switch,
    },
    /// Drive to a vertex of the map.
    GoTo {
        /// The number of the vertex.
        vertex: u8,
    },
    /// Go on exploring.
    Explore,
    /// Stand still, or go on.
    Pause {
        /// Whether to stand still.
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
        Action::Info => println!("{}", wording::info(&client.info()?).join("\n")),
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
            let setting = setting::named(name, *value).context("there is no such setting")?;
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
    println!("map: {} vertices, {} edges", replica.vertices(), replica.edges().count());
    for row in (0..replica.vertices()).filter_map(|vertex| replica.row(vertex)) {
        println!("  vertex {:2}: radius {:4} mm, {} visits", row.vertex, row.radius_mm, row.visits);
    }
    let edges: Vec<String> = replica.edges().map(|(a, b)| format!("{a}-{b}")).collect();
    println!("  edges: {}", edges.join(" "));
    if let Some(location) = replica.location() {
        println!("  at vertex {}", location.vertex);
    }
}
