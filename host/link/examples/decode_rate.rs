//! Measures how fast a listener decodes one hour of a simulated robot's stream, on one core.
//!
//! `cargo run --release -p toposlam-link --example decode_rate`; with a FILE after `--` it also writes the stream
//! there, so that `python/examples/decode_rate.py` can measure the same in Python.

use std::time::Instant;

use anyhow::Context;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_link::listener::Listener;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

/// One hour at ten ring frames per second.
const RING_FRAMES: u32 = 36_000;
const RUNS: usize = 21;
/// Largest piece that a line delivers.
const PIECE_BYTES: usize = 4096;

fn main() -> anyhow::Result<()> {
    let stream = an_hour()?;
    if let Some(file) = std::env::args_os().nth(1) {
        std::fs::write(&file, &stream).with_context(|| format!("writing {}", file.display()))?;
    }
    let mut seconds: Vec<f64> = Vec::with_capacity(RUNS);
    let mut listener = Listener::new();
    for _ in 0..RUNS {
        listener = Listener::new();
        let begun = Instant::now();
        for piece in stream.chunks(PIECE_BYTES) {
            listener.feed(piece, |_, _| ());
        }
        seconds.push(begun.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    let median = seconds[RUNS / 2];
    let (bytes, frames) = (stream.len(), listener.counters().messages);
    let vertices = listener.replica().vertices();
    println!("{bytes} bytes, {frames} frames, {vertices} vertices, median of {RUNS} runs on one core");
    println!("{:.1} MB/s, {:.0} frames/s", bytes as f64 / median / 1e6, f64::from(frames) / median);
    Ok(())
}

/// The stream of a robot in the office plan over one hour.
fn an_hour() -> anyhow::Result<Vec<u8>> {
    let plan = Plan::built_in("office").context("the office is built in")?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer)?;
    let mut stream = vec![0];
    for _ in 0..RING_FRAMES {
        exploration.advance();
        stream.extend_from_slice(&exploration.board().sent);
    }
    Ok(stream)
}
