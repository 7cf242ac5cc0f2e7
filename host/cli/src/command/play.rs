//! `toposlam play`: play a recording back, or serve it as a robot.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use clap::Args;
use toposlam_cli::{errln, outln, output};
use toposlam_link::broadcast::Broadcast;
use toposlam_link::event_text;
use toposlam_link::listener::Listener;
use toposlam_link::playback::Playback;
use toposlam_link::recording::Recording;

use super::console::print_map;
use super::interrupt::Interrupt;
use super::robot::speed;

/// Interval of the accept and send loop.
const TURN: Duration = Duration::from_millis(10);
/// Timeout for sending the last bytes to clients.
const FAREWELL: Duration = Duration::from_secs(5);
/// Interval at which the map is repeated after the end, so that clients do not take the line for dead.
const REPEAT: Duration = Duration::from_secs(2);

/// Arguments of `toposlam play`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// MCAP file written by `record`.
    file: PathBuf,
    /// Serve the recorded line at this address in real time, from the first connection. Clients may request the map.
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "output")]
    listen: Option<String>,
    /// Write the bytes of the line to a file in real time; - for the standard output.
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
    /// Speed, 0.01 to 1000 times real time.
    #[arg(long, default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Write without pauses.
    #[arg(long, conflicts_with_all = ["speed", "listen"])]
    fast: bool,
    /// At the end, start again; clients notice a restart of the robot.
    #[arg(long = "loop", requires = "listen")]
    repeats: bool,
    /// At the end, keep the last map at the address until Ctrl-C.
    #[arg(long, requires = "listen", conflicts_with = "repeats")]
    wait: bool,
}

/// Destination of the recorded bytes.
enum Output {
    Nowhere,
    Standard,
    File(File),
    Clients(Box<Clients>),
}

/// The clients of a played recording.
struct Clients {
    broadcast: Broadcast,
    playback: Playback,
    /// Answers to be sent.
    answers: Vec<u8>,
}

impl Output {
    fn open(arguments: &Arguments) -> anyhow::Result<Self> {
        if let Some(address) = &arguments.listen {
            let broadcast = Broadcast::bind(address).with_context(|| format!("listening at {address}"))?;
            errln!("the recording listens at tcp:{}", broadcast.address()?);
            return Ok(Self::Clients(Box::new(Clients { broadcast, playback: Playback::new(), answers: Vec::new() })));
        }
        Ok(match &arguments.output {
            None => Self::Nowhere,
            Some(path) if path.as_os_str() == "-" => Self::Standard,
            Some(path) => Self::File(output::create(path, arguments.force)?),
        })
    }

    /// Writes recorded bytes. Clients get the answers to their requests, too.
    fn write(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        match self {
            Self::Nowhere => {}
            Self::Standard => output::write_bytes(bytes)?,
            Self::File(file) => file.write_all(bytes).context("writing the output")?,
            Self::Clients(clients) => {
                let Clients { broadcast, playback, answers } = &mut **clients;
                let mut sent = std::mem::take(answers);
                sent.extend(playback.play(bytes));
                let received = broadcast.exchange(&sent);
                *answers = playback.answer(&received);
            }
        }
        Ok(())
    }

    fn is_paused(&self) -> bool {
        matches!(self, Self::Clients(clients) if clients.playback.is_paused())
    }

    /// Repeats the last map until the interrupt.
    fn keep(&mut self, interrupt: &Interrupt) -> anyhow::Result<()> {
        let mut repeated = Instant::now();
        while !interrupt.is_told() {
            if let Self::Clients(clients) = self
                && repeated.elapsed() >= REPEAT
            {
                repeated = Instant::now();
                clients.answers.extend(clients.playback.whole_map());
            }
            self.write(&[])?;
            std::thread::sleep(TURN);
        }
        Ok(())
    }

    /// Waits until the last bytes are sent.
    fn finish(&mut self) -> anyhow::Result<()> {
        let deadline = Instant::now() + FAREWELL;
        self.write(&[])?;
        while let Self::Clients(clients) = self
            && clients.broadcast.unsent_bytes() > 0
            && Instant::now() < deadline
        {
            clients.broadcast.exchange(&[]);
            std::thread::sleep(TURN);
        }
        Ok(())
    }
}

/// Counts of a round of the recording.
#[derive(Default)]
struct Played {
    frames: u64,
    bytes: usize,
    time: Duration,
    is_cut: bool,
    listener: Listener,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let file = &arguments.file;
    // An invalid file is reported before anything is written.
    let mut recording = Recording::open(file).with_context(|| format!("reading {}", file.display()))?;
    ensure!(recording.next().is_some(), "{}: the recording is empty", file.display());
    let mut output = Output::open(arguments)?;
    let interrupt = Interrupt::watch()?;
    while let Output::Clients(clients) = &output
        && clients.broadcast.listeners() == 0
        && !interrupt.is_told()
    {
        output.write(&[])?;
        std::thread::sleep(TURN);
    }
    let mut played = play(arguments, &mut output, &interrupt)?;
    while arguments.repeats && !interrupt.is_told() {
        if let Output::Clients(clients) = &mut output {
            clients.playback.rewind();
        }
        played = play(arguments, &mut output, &interrupt)?;
    }
    if arguments.wait {
        output.keep(&interrupt)?;
    }
    output.finish()?;
    if matches!(output, Output::Standard | Output::File(_)) {
        return Ok(());
    }
    summarise(&played)
}

/// Plays the recording once.
fn play(arguments: &Arguments, output: &mut Output, interrupt: &Interrupt) -> anyhow::Result<Played> {
    let mut recording =
        Recording::open(&arguments.file).with_context(|| format!("reading {}", arguments.file.display()))?;
    let is_paced = !matches!(output, Output::Nowhere) && !arguments.fast;
    let mut start = Instant::now();
    let mut first_ns = None;
    let mut played = Played::default();
    for frame in &mut recording {
        let frame = frame?;
        played.time = Duration::from_nanos(frame.time_ns.saturating_sub(*first_ns.get_or_insert(frame.time_ns)));
        let since_start = played.time.div_f64(arguments.speed);
        while is_paced && (output.is_paused() || Instant::now() < start + since_start) && !interrupt.is_told() {
            let turn =
                if output.is_paused() { TURN } else { (start + since_start).saturating_duration_since(Instant::now()) };
            output.write(&[])?;
            std::thread::sleep(TURN.min(turn));
            if output.is_paused() {
                start += TURN;
            }
        }
        if interrupt.is_told() {
            break;
        }
        output.write(&frame.bytes)?;
        played.frames += 1;
        played.bytes += frame.bytes.len();
        played.listener.feed(&frame.bytes, |_, _| ());
    }
    played.is_cut = recording.is_cut();
    Ok(played)
}

fn summarise(played: &Played) -> anyhow::Result<()> {
    let Played { frames, bytes, time, is_cut, listener } = played;
    outln!("{frames} frames of {bytes} bytes in {:.1} s", time.as_secs_f64())?;
    if *is_cut {
        outln!("the file was cut: the end of the recording is missing")?;
    }
    let counters = listener.counters();
    let damaged = counters.damaged();
    let unknown = counters.unknown();
    outln!("{} messages, {} frames lost, {damaged} damaged, {unknown} unknown", counters.messages, counters.lost)?;
    if let Some(restarts) = event_text::restarts(counters.restarts) {
        outln!("{restarts}")?;
    }
    outln!("{}", listener.understanding())?;
    print_map(listener.replica())
}
