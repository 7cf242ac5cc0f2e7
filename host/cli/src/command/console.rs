//! `toposlam command`: send a command to a robot over its line.

use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use clap::{Args, Subcommand, ValueEnum};
use toposlam::wire::{Command, GoalState, GoalStatus, MapReplica, Message, Name, NameError};
use toposlam_cli::output::ExitError;
use toposlam_cli::{errln, outln, output};
use toposlam_link::client::{Client, ClientError};
use toposlam_link::line::{Line, open};
use toposlam_link::listener::{Event, Listener};
use toposlam_link::plural::count;
use toposlam_link::topology::TopologicalMap;
use toposlam_link::{event_text, setting};

/// Exit statuses of `go-to --wait`.
const GAVE_UP: u8 = 3;
const TIMED_OUT: u8 = 4;
/// Interval at which the state of the robot is requested while it drives.
const ASK: Duration = Duration::from_secs(10);

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
    /// Print version, mode, settings and state of the robot.
    Info,
    /// Print the map.
    Map,
    /// Fetch a snapshot of the map and write it to a file.
    Snapshot {
        /// File to write.
        file: PathBuf,
        /// Replace an existing file.
        #[arg(long)]
        force: bool,
    },
    /// Replace the map, the settings of the filter and localise-only by those of a snapshot, and print what has changed.
    Restore {
        /// File written by `snapshot`.
        file: PathBuf,
        /// Keep the settings and localise-only of the robot.
        #[arg(long)]
        keep_settings: bool,
    },
    /// Delete the map and restart mapping.
    Reset,
    /// Print the settings, or one of them.
    Get {
        /// Name of the setting [default: all].
        #[arg(value_parser = setting::NAMES)]
        name: Option<String>,
    },
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
        /// Number or name of the vertex.
        vertex: String,
        /// Wait for the arrival. Exit status: 0 at the vertex, 3 if the robot gives up, 4 after --wait-s.
        #[arg(long)]
        wait: bool,
        /// Longest wait, in seconds.
        #[arg(long, value_name = "SECONDS", default_value_t = 600.0, requires = "wait", value_parser = seconds)]
        wait_s: f64,
    },
    /// Name a vertex, clear its name, or list all names.
    Name {
        /// Number or name of the vertex [default: list all names].
        vertex: Option<String>,
        /// The name: at most 16 bytes of UTF-8, not a number, and not the name of another vertex.
        #[arg(requires = "vertex", value_parser = name)]
        name: Option<Name>,
        /// Clear the name.
        #[arg(long, requires = "vertex", conflicts_with = "name")]
        clear: bool,
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
    if let Action::GoTo { vertex, wait: true, wait_s } = &arguments.action {
        return go_to(line, arguments, vertex, *wait_s);
    }
    let mut client = client(line, arguments, |_: &Listener, _: Event<'_>| {});
    match &arguments.action {
        Action::Info => {
            outln!("{}", event_text::info(&client.info()?).join("\n"))?;
            match client.settings() {
                Ok(settings) => outln!("{}", event_text::settings_text(&settings).join("\n"))?,
                Err(error @ ClientError::Line(_)) => return Err(error.into()),
                Err(error) => errln!("the settings: {error}"),
            }
        }
        Action::Map => print_map(client.map()?)?,
        Action::Snapshot { file, force } => {
            output::check(file, *force)?;
            let snapshot = client.snapshot()?;
            output::write_file(file, &snapshot, *force)?;
            outln!("{} bytes", snapshot.len())?;
        }
        Action::Restore { file, keep_settings } => {
            let snapshot = std::fs::read(file).with_context(|| format!("reading {}", file.display()))?;
            restore(&mut client, &snapshot, *keep_settings)?;
        }
        Action::Get { name } => {
            let settings = client.settings()?;
            let known = settings.iter().filter_map(|&setting| setting::parts(setting));
            let chosen: Vec<_> = known.filter(|(known, _)| name.as_deref().is_none_or(|name| name == *known)).collect();
            ensure!(!chosen.is_empty(), "the robot has no such setting");
            for (name, value) in chosen {
                outln!("{name} {value}")?;
            }
        }
        Action::Reset => order(&mut client, Command::Reset)?,
        Action::Set { name, value } => {
            let setting = setting::named(name, *value).context("unknown setting")?;
            order(&mut client, Command::SetConfig(setting))?;
        }
        Action::LocaliseOnly { state } => {
            order(&mut client, Command::LocaliseOnly { on: *state == Switch::On })?;
        }
        Action::GoTo { vertex, .. } => {
            send_to(&mut client, vertex)?;
            warn_if_paused(&mut client)?;
        }
        Action::Name { vertex: None, .. } => print_names(client.map()?)?,
        Action::Name { vertex: Some(vertex), name, clear } => rename(&mut client, vertex, *name, *clear)?,
        Action::Explore => order(&mut client, Command::Explore)?,
        Action::Pause { state } => order(&mut client, Command::Pause { on: *state == Switch::On })?,
    }
    Ok(())
}

fn client<F: FnMut(&Listener, Event<'_>)>(
    line: Box<dyn Line>,
    arguments: &Arguments,
    on_event: F,
) -> Client<Box<dyn Line>, F> {
    let mut client = Client::new(line, rand::random(), on_event);
    client.timeout = Duration::from_millis(arguments.timeout_ms);
    client.attempts = arguments.attempts;
    client
}

/// Restores a snapshot and prints what it has changed beside the map.
fn restore(
    client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>,
    snapshot: &[u8],
    keep_settings: bool,
) -> anyhow::Result<()> {
    let changes = match client.modes() {
        Ok(before) => client.restore_and_compare(snapshot, &before, keep_settings)?,
        Err(error @ ClientError::Line(_)) => return Err(error.into()),
        Err(error) => {
            ensure!(!keep_settings, "--keep-settings needs the settings: {error}");
            client.restore(snapshot)?;
            errln!("the robot does not report its settings, which the snapshot may have changed");
            Vec::new()
        }
    };
    outln!("{} bytes restored", snapshot.len())?;
    for change in changes {
        outln!("{}: {change}", if keep_settings { "kept, the snapshot has" } else { "changed" })?;
    }
    Ok(())
}

fn order(client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>, command: Command) -> anyhow::Result<()> {
    match client.order(command) {
        Err(ClientError::Refused(refusal)) => bail!("the robot refused: {}", event_text::refusal(&command, refusal)),
        done => done?,
    }
    outln!("{}", confirmed(client.listener(), command))?;
    Ok(())
}

/// What a robot does that has accepted a command.
fn confirmed(listener: &Listener, command: Command) -> String {
    let text = |vertex| listener.map().vertex_text(vertex);
    match command {
        Command::Reset => "the map is deleted, and the robot maps again".to_owned(),
        Command::SetConfig(setting) => format!("{} is set", setting::text(setting)),
        Command::LocaliseOnly { on: true } => "the robot keeps the map and localises".to_owned(),
        Command::LocaliseOnly { on: false } => "the robot maps".to_owned(),
        Command::GoTo { vertex } => format!("the robot is on its way to vertex {}", text(vertex)),
        Command::Explore => "the robot explores".to_owned(),
        Command::Pause { on: true } => "the robot is paused".to_owned(),
        Command::Pause { on: false } => "the robot continues".to_owned(),
        Command::Name { vertex, name } if name.is_none() => format!("vertex {vertex} has no name"),
        Command::Name { vertex, name } => format!("vertex {vertex} is named {name}"),
        _ => "done".to_owned(),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    super::drive::number_in(text, 0.0..=1e6)
}

fn name(text: &str) -> Result<Name, NameError> {
    Name::new(text)
}

/// The vertex with a number or a name. The map is requested for a name only.
fn vertex_of(client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>, text: &str) -> anyhow::Result<u8> {
    if let Ok(vertex) = text.parse() {
        return Ok(vertex);
    }
    let named = client.map()?.names().find(text);
    named.with_context(|| format!("no vertex has the name `{text}`; `name` lists the names"))
}

/// Sends the robot to a vertex by its number or name, and returns its number.
fn send_to(client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>, text: &str) -> anyhow::Result<u8> {
    loop {
        let vertex = vertex_of(client, text)?;
        order(client, Command::GoTo { vertex })?;
        // The vertices may have been renumbered since the map was requested.
        let moved = client.listener().replica().names().find(text).is_some_and(|now| now != vertex);
        if !moved {
            return Ok(vertex);
        }
    }
}

/// Whether the robot is paused; then it drives nowhere.
fn warn_if_paused(client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>) -> anyhow::Result<bool> {
    let is_paused = match client.info() {
        Ok(info) => info.paused,
        Err(error @ ClientError::Line(_)) => return Err(error.into()),
        // The command was accepted all the same.
        Err(_) => false,
    };
    if is_paused {
        errln!("the robot is paused, and drives after `pause off`");
    }
    Ok(is_paused)
}

/// Names a vertex, or clears its name.
fn rename(
    client: &mut Client<Box<dyn Line>, impl FnMut(&Listener, Event<'_>)>,
    vertex: &str,
    name: Option<Name>,
    clear: bool,
) -> anyhow::Result<()> {
    ensure!(clear || name.is_some(), "the name is missing; --clear clears the name of a vertex");
    let vertex = vertex_of(client, vertex)?;
    order(client, Command::Name { vertex, name: name.unwrap_or(Name::NONE) })
}

fn print_names(replica: &MapReplica<64>) -> anyhow::Result<()> {
    for (vertex, name) in replica.names().iter() {
        outln!("{vertex} {name}")?;
    }
    if replica.names().vertices() == 0 {
        errln!("no vertex has a name");
    }
    Ok(())
}

/// Sends the robot to a vertex and waits until it is there.
fn go_to(line: Box<dyn Line>, arguments: &Arguments, text: &str, wait_s: f64) -> anyhow::Result<()> {
    // A status that was sent before the reply is that of the previous goal.
    let (goal, is_sent) = (RefCell::new(None::<GoalStatus>), Cell::new(false));
    // A final state ends the wait; the status of the next goal follows it.
    let is_open = || goal.borrow().is_none_or(|goal| goal.state == GoalState::Active);
    let on_event = |_: &Listener, event: Event<'_>| match event {
        Event::Message(_, Message::Reply(_)) if !is_sent.replace(true) => *goal.borrow_mut() = None,
        Event::Message(_, Message::GoalStatus(status)) if is_open() => *goal.borrow_mut() = Some(*status),
        _ => {}
    };
    let mut client = client(line, arguments, on_event);
    let deadline = Instant::now() + Duration::from_secs_f64(wait_s);
    let vertex = send_to(&mut client, text)?;
    let mut is_paused = warn_if_paused(&mut client)?;
    let mut asked = Instant::now();
    loop {
        let state = goal.borrow().map(|status| status.state);
        match state {
            Some(GoalState::Reached) => return arrived(client.listener(), vertex),
            Some(GoalState::Active) | None => {}
            Some(state) => return Err(ExitError::new(GAVE_UP, format!("vertex {vertex}: {state}")).into()),
        }
        if Instant::now() >= deadline {
            let state = if is_paused { "is paused" } else { "is still on its way" };
            let text = format!("the robot is not at vertex {vertex} after {wait_s} s, and {state}");
            return Err(ExitError::new(TIMED_OUT, text).into());
        }
        // The status is sent once, and may be lost on the line.
        if asked.elapsed() >= ASK {
            asked = Instant::now();
            let info = client.info()?;
            is_paused = info.paused;
            let is_over = info.goal.is_none() && goal.borrow().is_none();
            if is_over && client.listener().replica().location().is_some_and(|location| location.vertex == vertex) {
                return arrived(client.listener(), vertex);
            }
            if is_over {
                return Err(ExitError::new(GAVE_UP, format!("the robot no longer drives to vertex {vertex}")).into());
            }
        }
        client.listen()?;
    }
}

fn arrived(listener: &Listener, vertex: u8) -> anyhow::Result<()> {
    Ok(outln!("at vertex {}", listener.map().vertex_text(vertex))?)
}

pub(super) fn print_map(replica: &MapReplica<64>) -> anyhow::Result<()> {
    let map = TopologicalMap::from(replica);
    let all_edges = map.all_edges();
    outln!("map: {}, {}", count(replica.vertices(), "vertex", "vertices"), count(all_edges.len(), "edge", "edges"))?;
    for row in (0..replica.vertices()).filter_map(|vertex| replica.row(vertex)) {
        let name = map.names.get(&row.vertex).map_or_else(String::new, |name| format!(", {name}"));
        outln!(
            "  vertex {:2}: radius {:4} mm, {}{name}",
            row.vertex,
            row.radius_mm,
            count(row.visits, "visit", "visits")
        )?;
    }
    let edges = all_edges.iter().map(|([a, b], _)| format!("{}-{}", a.min(b), a.max(b)));
    outln!("  edges: {}", edges.collect::<Vec<_>>().join(" "))?;
    if !map.ways.is_empty() {
        let frontiers: Vec<String> = map.frontiers().map(|end| format!("{}.{}", end.vertex, end.way)).collect();
        outln!("  frontiers: {}", frontiers.join(" "))?;
    }
    if let Some(location) = replica.location() {
        outln!("  at vertex {}", map.vertex_text(location.vertex))?;
    }
    Ok(())
}
