//! `toposlam fleet`: monitor many robots in one thread, and measure the cost.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use clap::Args;
use toposlam_cli::fleet::cost::{allow_many_connections, computing_time, most_connections, resident_bytes};
use toposlam_cli::fleet::maps::Maps;
use toposlam_cli::fleet::{End, Fleet, Robot, Totals};
use toposlam_cli::{errln, outln};

use super::interrupt::Interrupt;
use super::robots::pace;

/// Interval of the printed figures.
const REPORT: Duration = Duration::from_secs(1);
/// Interval at which the maps are merged.
const MERGE: Duration = Duration::from_secs(10);
/// Maximum wait for connections before the first report.
const CONNECTING: Duration = Duration::from_secs(5);

/// Open files that are not connections.
const OTHER_FILES: u64 = 32;

/// Arguments of `toposlam fleet`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// File with a robot in each line: tcp:HOST:PORT and optionally its name.
    #[arg(required_unless_present = "simulate", conflicts_with = "simulate")]
    lines: Option<PathBuf>,
    /// Monitor this many recorded robots, which a child process serves.
    #[arg(long, value_name = "ROBOTS", value_parser = clap::value_parser!(u32).range(1..))]
    simulate: Option<u32>,
    /// Stop after this many seconds [default: at Ctrl-C, or when no robot is connected any more].
    #[arg(long)]
    seconds: Option<u64>,
    /// Keep one merged map per building in this directory, as building-1.json and so on, in the JSON of `export`.
    #[arg(long, value_name = "DIRECTORY")]
    maps: Option<PathBuf>,
    /// Replace files of the directory.
    #[arg(long, requires = "maps")]
    force: bool,
    /// Speed of the recorded robots, 0.01 to 1000 times real time; 0 for as fast as they are read.
    #[arg(long, default_value_t = 1.0, value_parser = pace, requires = "simulate")]
    speed: f64,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    allow_many_connections().context("opening many connections")?;
    if let Some(robots) = arguments.simulate {
        check_connections(robots)?;
    }
    let (lines, _robots) = match (&arguments.lines, arguments.simulate) {
        (None, Some(count)) => {
            let (robots, address) = Robots::start(count, arguments.speed)?;
            ((0..count).map(|number| (format!("robot {number}"), address.clone())).collect(), Some(robots))
        }
        (file, _) => {
            let file = file.as_deref().context("neither a file of lines nor --simulate was given")?;
            let text = std::fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))?;
            (lines_of(&text)?, None)
        }
    };
    let names = || lines.iter().map(|(name, _)| name.clone()).collect();
    let maps = arguments.maps.as_deref().map(|directory| Maps::start(directory, names(), arguments.force));
    let mut maps = maps.transpose()?;
    let interrupt = Interrupt::watch()?;
    let mut fleet = Fleet::new()?;
    let resident_before = resident_bytes();
    for (name, address) in &lines {
        fleet.connect(name, address);
    }
    let began = Instant::now();
    while fleet.totals().connecting > 0 && began.elapsed() < CONNECTING && !interrupt.is_told() {
        fleet.listen(REPORT / 100, |_, _, _| ())?;
    }
    let end = arguments.seconds.map(Duration::from_secs);
    let start = Sample::take(Instant::now(), &fleet);
    let (mut last, mut merged_at) = (start, Instant::now());
    loop {
        let report_at = last.at + REPORT;
        while let Some(left) = report_at.checked_duration_since(Instant::now())
            && !left.is_zero()
            && !interrupt.is_told()
        {
            fleet.listen(left, |_, _, _| ())?;
        }
        let sample = Sample::take(Instant::now(), &fleet);
        outln!("{}", sample.since(&last))?;
        last = sample;
        if let Some(maps) = &mut maps
            && merged_at.elapsed() >= MERGE
        {
            maps.update(&fleet);
            merged_at = Instant::now();
        }
        let is_over = end.is_some_and(|end| last.at - start.at >= end);
        if is_over || interrupt.is_told() || last.totals.connected + last.totals.connecting == 0 {
            break;
        }
    }
    for robot in fleet.robots() {
        match robot.end() {
            Some(End::Closed) => errln!("{} closed its line", robot.name()),
            Some(End::Failed(reason)) => errln!("{} failed: {reason}", robot.name()),
            None => {}
        }
    }
    for building in maps.map(|maps| maps.finish(&fleet)).transpose()?.into_iter().flatten() {
        outln!("{building}")?;
    }
    outln!("in all: {}", last.since(&start))?;
    let totals = fleet.totals();
    let robots = fleet.robots().len().max(1) as u64;
    outln!("{} bytes of state per robot", size_of::<Robot>())?;
    if let (Some(before), Some(after)) = (resident_before, resident_bytes()) {
        outln!("{} bytes of resident memory per robot, {after} in all", after.saturating_sub(before) / robots)?;
    }
    ensure!(
        totals.messages > 0,
        "no robot has sent a message: {} connecting, {} closed, {} failed",
        totals.connecting,
        totals.closed,
        totals.failed
    );
    Ok(())
}

/// Fails if this process may not open a connection for each robot. The same limit holds for the process of the robots.
fn check_connections(robots: u32) -> anyhow::Result<()> {
    let Some(most) = most_connections() else { return Ok(()) };
    let most = most.saturating_sub(OTHER_FILES);
    ensure!(
        u64::from(robots) <= most,
        "--simulate {robots}: the operating system allows {most} connections per process (open files of `ulimit -Hn`, and local ports)"
    );
    Ok(())
}

/// Totals and computing time at a moment.
#[derive(Clone, Copy)]
struct Sample {
    at: Instant,
    computing: Option<Duration>,
    totals: Totals,
}

impl Sample {
    fn take(at: Instant, fleet: &Fleet) -> Self {
        Self { at, computing: computing_time(), totals: fleet.totals() }
    }

    /// Formats the state, and the rates since an earlier sample.
    fn since(&self, earlier: &Self) -> String {
        let (now, then) = (&self.totals, &earlier.totals);
        let seconds = (self.at - earlier.at).as_secs_f64();
        let counts = [now.messages - then.messages, now.bytes - then.bytes, now.places - then.places];
        let rates = |seconds: f64| {
            let [messages, bytes, places] = counts.map(|count| count as f64 / seconds);
            format!("{messages:.0} messages, {bytes:.0} bytes, {places:.1} updates")
        };
        let mut text = format!(
            "{} connecting, {} connected, {} closed, {} failed, {} maps whole; {} a second",
            now.connecting,
            now.connected,
            now.closed,
            now.failed,
            now.converged,
            rates(seconds)
        );
        if let (Some(now), Some(then)) = (self.computing, earlier.computing) {
            let computing = (now - then).as_secs_f64();
            text += &format!("; {:.1} % of a core, on a whole core {}", computing / seconds * 100.0, rates(computing));
        }
        text += &format!("; {} frames lost, {} damaged", now.lost - then.lost, now.damaged - then.damaged);
        if now.unknown > then.unknown {
            text += &format!(", {} unknown", now.unknown - then.unknown);
        }
        text
    }
}

/// The child process that serves recorded robots; it ends with this one.
struct Robots(Child);

impl Robots {
    /// Starts the process, and returns the address of its robots.
    fn start(count: u32, speed: f64) -> anyhow::Result<(Self, String)> {
        let mut robots = Command::new(std::env::current_exe()?)
            .args(["robots", "--listen", "127.0.0.1:0"])
            .args(["--count", &count.to_string(), "--speed", &speed.to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .context("starting the robots")?;
        let output = robots.stdout.take();
        let robots = Self(robots);
        let mut line = String::new();
        BufReader::new(output.context("the robots have no output")?).read_line(&mut line)?;
        let (_, address) = line.trim_end().split_once("tcp:").context("the robots print no address")?;
        Ok((robots, address.to_owned()))
    }
}

impl Drop for Robots {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Parses the name and the address of each robot.
fn lines_of(text: &str) -> anyhow::Result<Vec<(String, String)>> {
    let mut lines = Vec::new();
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (line, name) = line.split_once(char::is_whitespace).unwrap_or((line, line));
        let address = line.strip_prefix("tcp:").with_context(|| format!("{line}: not tcp:HOST:PORT"))?;
        lines.push((name.trim().to_owned(), address.to_owned()));
    }
    ensure!(!lines.is_empty(), "there is no robot to listen to");
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_lists_names_and_addresses() {
        let lines = lines_of("# hall\ntcp:10.0.0.1:7070 first robot\n\n  tcp:localhost:7071\n").unwrap();
        let expected = [("first robot", "10.0.0.1:7070"), ("tcp:localhost:7071", "localhost:7071")];
        assert_eq!(lines, expected.map(|(name, address)| (name.to_owned(), address.to_owned())));
        assert!(lines_of("# nobody\n").is_err());
        assert!(lines_of("/dev/ttyUSB0\n").unwrap_err().to_string().contains("tcp:HOST:PORT"));
    }
}
