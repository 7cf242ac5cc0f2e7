//! Runs the monitor with a simulated robot: measures the latency from a place to the screen, or prints the screen as
//! text.
//!
//! ```sh
//! cargo run --release --package toposlam-cli --example monitor -- latency 200 1     # places, speed
//! cargo run --release --package toposlam-cli --example monitor -- screenshot 80 24 40    # columns, rows, places
//! ```
//!
//! `latency` uses the terminal. The time of a place starts when the robot's bytes are written to the socket, and ends
//! when the frame that shows the robot at that place, or at a later one, is written to the terminal.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use ratatui::{Terminal, backend::TestBackend};
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_cli::monitor::{model::Model, screen, view};
use toposlam_link::broadcast::Broadcast;
use toposlam_link::link::{LinkEvent, Options};
use toposlam_link::listener::Listener;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

/// Ring frames per second of robot time.
const FRAMES_PER_SECOND: f64 = 10.0;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["latency", places, speed] => latency(places.parse()?, speed.parse()?),
        ["screenshot", columns, rows, places] => screenshot(columns.parse()?, rows.parse()?, places.parse()?),
        _ => bail!("say latency PLACES SPEED, or screenshot COLUMNS ROWS PLACES"),
    }
}

/// Time at which the bytes of each place were written, for places not yet drawn.
type Written = Arc<Mutex<BTreeMap<u32, Instant>>>;

fn latency(places: usize, speed: f64) -> anyhow::Result<()> {
    let broadcast = Broadcast::bind("127.0.0.1:0")?;
    let line = format!("tcp:{}", broadcast.address()?);
    let written = Written::default();
    let robots = Arc::clone(&written);
    thread::spawn(move || be_a_robot(broadcast, speed, &robots));
    let mut times_ms = Vec::new();
    screen::run(&line, 0, Options::default(), |model| {
        if let (Some(location), Ok(mut written)) = (model.watch().listener().replica().location(), written.lock()) {
            let later = written.split_off(&location.place_index.saturating_add(1));
            let drawn = std::mem::replace(&mut *written, later);
            times_ms.extend(drawn.into_values().map(|written_at| written_at.elapsed().as_secs_f64() * 1000.0));
        }
        if times_ms.len() < places { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    })?;
    times_ms.sort_by(f64::total_cmp);
    let at = |share: f64| times_ms.get((share * (times_ms.len() - 1) as f64).round() as usize).copied();
    let (median, most_of, worst) = (at(0.5), at(0.95), at(1.0));
    let (Some(median), Some(most_of), Some(worst)) = (median, most_of, worst) else { bail!("no place was drawn") };
    println!(
        "{} places at speed {speed}: median {median:.1} ms, 95 % {most_of:.1} ms, max {worst:.1} ms",
        times_ms.len()
    );
    Ok(())
}

fn be_a_robot(mut broadcast: Broadcast, speed: f64, written: &Written) -> anyhow::Result<()> {
    let plan = Plan::built_in("office").context("it is built in")?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer)?;
    while broadcast.listeners() == 0 {
        broadcast.exchange(&[]);
        thread::sleep(Duration::from_millis(1));
    }
    let frame_time = Duration::from_secs_f64(1.0 / (FRAMES_PER_SECOND * speed));
    let mut next_frame = Instant::now();
    loop {
        if let Some((_, update)) = exploration.advance()
            && let Ok(mut written) = written.lock()
        {
            written.insert(update.place_index, Instant::now());
        }
        broadcast.exchange(&exploration.board().sent);
        next_frame += frame_time;
        thread::sleep(next_frame.saturating_duration_since(Instant::now()));
    }
}

fn screenshot(columns: u16, rows: u16, places: usize) -> anyhow::Result<()> {
    let plan = Plan::built_in("office").context("it is built in")?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer)?;
    let (mut model, mut listener, now) = (Model::new("tcp:127.0.0.1:7070"), Listener::new(), Instant::now());
    model.apply(LinkEvent::Connected, now);
    while exploration.places() < places {
        exploration.advance();
        listener
            .feed(&exploration.board().sent, |listener, event| model.apply(LinkEvent::received(listener, event), now));
        model.settle(now);
    }
    let mut terminal = Terminal::new(TestBackend::new(columns, rows))?;
    terminal.draw(|frame| view::draw(frame, &model))?;
    for line in terminal.backend().to_string().lines() {
        println!("{}", line.trim_matches('"').trim_end());
    }
    Ok(())
}
