//! `toposlam play`: play a recording back, or serve it as a robot.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::Args;
use toposlam_link::broadcast::Broadcast;
use toposlam_link::listener::Listener;
use toposlam_link::recording::Recording;

use super::console::print_map;
use super::interrupt::Interrupt;
use super::robot::speed;

/// Interval of the accept and send loop.
const TURN: Duration = Duration::from_millis(10);
/// Timeout for sending the last bytes to clients.
const FAREWELL: Duration = Duration::from_secs(5);

/// Arguments of `toposlam play`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// MCAP file written by `record`.
    file: PathBuf,
    /// Serve the recorded line at this address in real time, from the first connection.
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "output")]
    listen: Option<String>,
    /// Write the bytes of the line to a file in real time; - for the standard output.
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Speed, 0.01 to 1000 times real time.
    #[arg(long, default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Write without pauses.
    #[arg(long, conflicts_with_all = ["speed", "listen"])]
    fast: bool,
}

/// Destination of the recorded bytes.
enum Output {
    Nowhere,
    Bytes(Box<dyn Write>),
    Listeners(Broadcast),
}

impl Output {
    fn open(arguments: &Arguments) -> anyhow::Result<Self> {
        if let Some(address) = &arguments.listen {
            let broadcast = Broadcast::bind(address).with_context(|| format!("listening at {address}"))?;
            eprintln!("the recording listens at tcp:{}", broadcast.address()?);
            return Ok(Self::Listeners(broadcast));
        }
        Ok(match &arguments.output {
            None => Self::Nowhere,
            Some(path) if path.as_os_str() == "-" => Self::Bytes(Box::new(std::io::stdout())),
            Some(path) => {
                Self::Bytes(Box::new(File::create(path).with_context(|| format!("writing {}", path.display()))?))
            }
        })
    }

    fn write(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        match self {
            Self::Nowhere => Ok(()),
            Self::Bytes(output) => output.write_all(bytes),
            Self::Listeners(broadcast) => {
                broadcast.exchange(bytes);
                Ok(())
            }
        }
    }

    /// Waits until the last bytes are sent.
    fn finish(&mut self) -> std::io::Result<()> {
        match self {
            Self::Nowhere => Ok(()),
            Self::Bytes(output) => output.flush(),
            Self::Listeners(broadcast) => {
                let deadline = Instant::now() + FAREWELL;
                while broadcast.unsent_bytes() > 0 && Instant::now() < deadline {
                    broadcast.exchange(&[]);
                    std::thread::sleep(TURN);
                }
                Ok(())
            }
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let file = &arguments.file;
    let mut recording = Recording::open(file).with_context(|| format!("reading {}", file.display()))?;
    let mut output = Output::open(arguments)?;
    let interrupt = Interrupt::watch()?;
    if let Output::Listeners(broadcast) = &mut output {
        while broadcast.listeners() == 0 && !interrupt.is_told() {
            broadcast.exchange(&[]);
            std::thread::sleep(TURN);
        }
    }
    let is_paced = !matches!(output, Output::Nowhere) && !arguments.fast;
    let start = Instant::now();
    let mut listener = Listener::new();
    let (mut frames, mut bytes, mut first_ns, mut last_ns) = (0_u64, 0, None, 0);
    for frame in &mut recording {
        let frame = frame?;
        last_ns = frame.time_ns;
        let since_ns = frame.time_ns.saturating_sub(*first_ns.get_or_insert(frame.time_ns));
        if is_paced {
            let due = start + Duration::from_nanos(since_ns).div_f64(arguments.speed);
            while Instant::now() < due && !interrupt.is_told() {
                output.write(&[])?;
                std::thread::sleep(TURN.min(due.saturating_duration_since(Instant::now())));
            }
        }
        if interrupt.is_told() {
            break;
        }
        output.write(&frame.bytes)?;
        frames += 1;
        bytes += frame.bytes.len();
        listener.feed(&frame.bytes, |_, _| ());
    }
    output.finish()?;
    if matches!(output, Output::Bytes(_)) {
        return Ok(());
    }
    let seconds = last_ns.saturating_sub(first_ns.unwrap_or(last_ns)) as f64 / 1e9;
    println!("{frames} frames of {bytes} bytes in {seconds:.1} s");
    if recording.is_cut() {
        println!("the file was cut: the end of the recording is missing");
    }
    let counters = listener.counters();
    let damaged = counters.corrupt + counters.cut + counters.too_long;
    let unknown = counters.unknown_version + counters.unknown_message;
    println!("{} messages, {} frames lost, {damaged} damaged, {unknown} unknown", counters.messages, counters.lost);
    println!("{}", listener.understanding());
    print_map(listener.replica());
    Ok(())
}
