//! The monitor without a screen: writes a line of text for each event, for scripts and logs.

use std::io::{self, Write};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use serde_json::{Value, json};

use toposlam_link::link::{Link, LinkEvent, Options, Source};
use toposlam_link::listener::Understanding;
use toposlam_link::{event_text, json};

/// Maximum number of queued events; then the link waits.
const QUEUE: usize = 1024;

/// Output format of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As text.
    Words,
    /// As one JSON object per line.
    Json,
}

/// Limits of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Number of messages and decoding errors.
    pub events: Option<u64>,
    /// Duration.
    pub time: Option<Duration>,
}

/// Writes events until a limit is reached, the standard input ends, or the reader of the output closes it.
///
/// `name` is the name of the line, `-` for the standard input. A failed line is reopened.
///
/// # Errors
/// If the time is over before the requested number of events, or before any event, and if the output cannot be written.
pub fn run(
    name: &str,
    baud: u32,
    options: Options,
    form: Form,
    limits: Limits,
    mut out: impl Write,
) -> anyhow::Result<()> {
    let (sender, inbox) = sync_channel(QUEUE);
    let _link = Link::start(Source::named(name, baud), options, move |event| sender.send(event).is_ok());
    let deadline = limits.time.and_then(|time| Instant::now().checked_add(time));
    let (mut events, mut knows_several) = (0, false);
    while limits.events.is_none_or(|most| events < most) {
        let patience = deadline.map_or(Duration::MAX, |deadline| deadline.saturating_duration_since(Instant::now()));
        let event = match inbox.recv_timeout(patience) {
            Ok(event) => event,
            Err(RecvTimeoutError::Timeout) => break,
            Err(RecvTimeoutError::Disconnected) => break,
        };
        events += u64::from(matches!(event, LinkEvent::Received(..)));
        let is_several = several(&event);
        let is_over = matches!(event, LinkEvent::Ended);
        let mut written = write_line(&event, name, form, &mut out);
        if is_several && !knows_several {
            written = written.and_then(|()| warn_of_several(name, form, &mut out));
        }
        knows_several = is_several;
        if let Err(error) = written {
            // The reader has closed the output.
            return if error.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(error).context("writing") };
        }
        if is_over {
            return Ok(());
        }
    }
    let wanted = limits.events.unwrap_or(1);
    ensure!(events >= wanted, "{events} of {wanted} events came in time");
    Ok(())
}

/// Whether the frames of several robots alternate on the line.
fn several(event: &LinkEvent) -> bool {
    matches!(event, LinkEvent::Received(_, listener) if listener.understanding() == Understanding::Several)
}

fn warn_of_several(name: &str, form: Form, out: &mut impl Write) -> io::Result<()> {
    let text = Understanding::Several;
    match form {
        Form::Words => writeln!(out, "warning: {text}")?,
        Form::Json => writeln!(out, "{}", json!({"event": "Several", "line": name, "text": text.to_string()}))?,
    }
    out.flush()
}

fn write_line(event: &LinkEvent, name: &str, form: Form, out: &mut impl Write) -> io::Result<()> {
    match form {
        Form::Words => writeln!(out, "{}", in_words(event, name))?,
        Form::Json => writeln!(out, "{}", as_json(event, name))?,
    }
    out.flush()
}

fn in_words(event: &LinkEvent, name: &str) -> String {
    match event {
        LinkEvent::Connected => format!("connected to {name}"),
        LinkEvent::Disconnected(reason) => format!("no line to {name}: {reason}; trying again"),
        LinkEvent::Ended => "the input has ended".to_owned(),
        LinkEvent::Received(event, _) => event_text::event(event.into()),
        LinkEvent::TaskDone(task, answer) => format!("{task}: {answer:?}"),
    }
}

fn as_json(event: &LinkEvent, name: &str) -> Value {
    match event {
        LinkEvent::Connected => json!({"event": "Connected", "line": name}),
        LinkEvent::Disconnected(reason) => json!({"event": "Disconnected", "line": name, "reason": reason}),
        LinkEvent::Ended => json!({"event": "Ended", "line": name}),
        LinkEvent::Received(event, _) => json::event(event.into()),
        LinkEvent::TaskDone(task, answer) => {
            json!({"event": "Answered", "task": task.to_string(), "answer": format!("{answer:?}")})
        }
    }
}
