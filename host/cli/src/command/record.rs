//! `toposlam record`: record the line of a robot in an MCAP file, or in a ROS 2 bag.

use std::fs::File;
use std::io::{BufWriter, ErrorKind};
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use clap::Args;
use toposlam_cli::outln;
use toposlam_link::line::{Line, open};
use toposlam_link::plural::count;
use toposlam_link::recording::{Recorder, RecordingError, Ros2Bag, Summary};

use super::export::frame_mm;
use super::interrupt::Interrupt;

const BUFFER_BYTES: usize = 4096;

/// Arguments of `toposlam record`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Serial port of the robot, or tcp:HOST:PORT.
    line: String,
    /// MCAP file to create; with --ros2, the folder of the bag. An existing one is an error.
    file: PathBuf,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
    /// Stop after this many seconds [default: at Ctrl-C, or at the end of the line].
    #[arg(long)]
    seconds: Option<u64>,
    /// Stop after this many places.
    #[arg(long)]
    places: Option<u32>,
    /// Write a ROS 2 bag: ring, map and route graph in messages of ROS 2, without the bytes of the line.
    #[arg(long)]
    ros2: bool,
    /// How far the robot drives in a ring frame, in millimetres, 0.1 to 1000: edges with a travel time get their length as their cost
    /// in the route graph of a ROS 2 bag.
    #[arg(long, value_name = "MM", value_parser = frame_mm, requires = "ros2")]
    frame_mm: Option<f64>,
}

/// What is written.
enum Output {
    Mcap(Box<Recorder<BufWriter<File>>>),
    Ros2(Box<Ros2Bag>),
}

impl Output {
    fn create(arguments: &Arguments) -> Result<Self, RecordingError> {
        Ok(if arguments.ros2 {
            Self::Ros2(Box::new(Ros2Bag::create(&arguments.file, arguments.frame_mm)?))
        } else {
            Self::Mcap(Box::new(Recorder::create(&arguments.file)?))
        })
    }

    fn record(&mut self, bytes: &[u8], time_ns: u64) -> Result<(), RecordingError> {
        match self {
            Self::Mcap(recorder) => recorder.record(bytes, time_ns),
            Self::Ros2(bag) => bag.record(bytes, time_ns),
        }
    }

    fn summary(&self) -> Summary {
        match self {
            Self::Mcap(recorder) => recorder.summary(),
            Self::Ros2(bag) => bag.summary(),
        }
    }

    fn finish(self) -> Result<Summary, RecordingError> {
        match self {
            Self::Mcap(recorder) => recorder.finish(),
            Self::Ros2(bag) => bag.finish(),
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut line = open(&arguments.line, arguments.baud)?;
    let file = &arguments.file;
    let mut recorder = Output::create(arguments).with_context(|| format!("creating {}", file.display()))?;
    let interrupt = Interrupt::watch()?;
    // A monotonic clock: the system clock may be adjusted during the recording.
    let start = Instant::now();
    let start_time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let end = arguments.seconds.map(Duration::from_secs);
    let is_over = |places: u32| {
        interrupt.is_told()
            || end.is_some_and(|end| start.elapsed() >= end)
            || arguments.places.is_some_and(|wanted| places >= wanted)
    };
    let mut lost = None;
    while lost.is_none() && !is_over(recorder.summary().places) {
        let mut buffer = [0; BUFFER_BYTES];
        match read(&mut line, &mut buffer) {
            Ok(bytes) => recorder.record(bytes, (start_time + start.elapsed()).as_nanos() as u64)?,
            Err(error) => lost = Some(error),
        }
    }
    let summary = recorder.finish()?;
    outln!(
        "{}: {} frames of {} bytes in {:.1} s, {}",
        file.display(),
        summary.frames,
        summary.bytes,
        start.elapsed().as_secs_f64(),
        count(summary.places, "place", "places")
    )?;
    match lost {
        Some(error) if error.kind() != ErrorKind::UnexpectedEof => Err(error).context("the line to the robot failed"),
        _ => Ok(()),
    }
}

/// The received bytes, if any; the end of the line is an error.
fn read<'buffer>(line: &mut Box<dyn Line>, buffer: &'buffer mut [u8]) -> std::io::Result<&'buffer [u8]> {
    match line.read(buffer) {
        Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
        Ok(count) => Ok(&buffer[..count]),
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {
            Ok(&[])
        }
        Err(error) => Err(error),
    }
}
