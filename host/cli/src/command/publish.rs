//! `toposlam publish`: publish a robot's messages to an MQTT broker or through a Zenoh router.

use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use toposlam_cli::publish::{Broker, BrokerEvent, Options, Publisher};
use toposlam_cli::{errln, outln};
use toposlam_link::link::{Link, LinkEvent, Options as LinkOptions, Source};

use super::interrupt::Interrupt;

/// Polling interval of the end conditions.
const TURN: Duration = Duration::from_millis(50);

/// Arguments of `toposlam publish`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Serial port of the robot, tcp:HOST:PORT, or - for the bytes of its line on the standard input.
    line: String,
    /// Broker: mqtt://HOST:PORT, mqtt://USER:PASSWORD@HOST:PORT, or zenoh://HOST:PORT for a Zenoh router.
    #[arg(long)]
    broker: Broker,
    /// Name of the robot in the topics toposlam/NAME/events, map and status.
    #[arg(long, value_name = "NAME")]
    robot: String,
    /// Also publish the frames of the line as toposlam/NAME/frames.
    #[arg(long)]
    frames: bool,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = 115_200)]
    baud: u32,
    /// Stop after this many seconds [default: at Ctrl-C, or at the end of the standard input].
    #[arg(long)]
    seconds: Option<u64>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut options = Options::new(arguments.broker.clone(), &arguments.robot)?;
    options.frames = arguments.frames;
    let publisher = Publisher::start(options, |event| match event {
        BrokerEvent::Connected => errln!("the broker is connected"),
        BrokerEvent::Disconnected(reason) => errln!("the broker is away: {reason}"),
    });
    let publisher = Arc::new(Mutex::new(Some(publisher)));
    let interrupt = Interrupt::watch()?;
    let (sender, ended) = channel();
    let teller = Arc::clone(&publisher);
    let source = Source::named(&arguments.line, arguments.baud);
    let link = Link::start(source, LinkOptions::default(), move |event| {
        match &event {
            LinkEvent::Connected => errln!("the robot is connected"),
            LinkEvent::Disconnected(reason) => errln!("the robot is away: {reason}"),
            _ => {}
        }
        let mut publisher = teller.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(publisher) = publisher.as_mut() else { return false };
        publisher.apply(&event);
        // The result matters only while the main thread waits.
        !matches!(event, LinkEvent::Ended) || sender.send(()).is_ok()
    });
    let end = arguments.seconds.map(|seconds| Instant::now() + Duration::from_secs(seconds));
    let is_over = || interrupt.is_told() || end.is_some_and(|end| Instant::now() >= end);
    while !is_over() && ended.recv_timeout(TURN).is_err() {}
    drop(link);
    // Dropped here and not in the link's thread, so that its last messages are sent.
    let Some(publisher) = publisher.lock().unwrap_or_else(PoisonError::into_inner).take() else { return Ok(()) };
    let counters = publisher.counters();
    drop(publisher);
    outln!("{} published, {} dropped", counters.published, counters.dropped)?;
    Ok(())
}
