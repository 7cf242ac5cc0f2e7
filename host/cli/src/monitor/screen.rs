//! The monitor in the terminal of this program.

use std::io::{self, IsTerminal, Stdout, stdout};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::event::{self, Event, KeyEvent};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode};

use super::model::{Action, Model};
use super::view;
use toposlam_link::link::{Link, LinkEvent, Options, Source};

/// Maximum number of queued events; then the link waits.
const QUEUE: usize = 1024;
/// Delay before drawing: the messages of a place arrive in a burst, and a frame should show all of them.
const BURST_TIME: Duration = Duration::from_millis(2);
/// Minimum interval between frames; more are not visible, and a slow connection would fall behind.
const LEAST_FRAME_TIME: Duration = Duration::from_millis(16);
/// Interval of redrawing without an event, for values that depend on the time.
const IDLE_FRAME_TIME: Duration = Duration::from_millis(250);
/// Polling interval at which the keyboard thread checks whether it should end.
const KEY_PATIENCE: Duration = Duration::from_millis(100);

enum Input {
    Link(LinkEvent),
    Key(KeyEvent),
    Resized,
    Failed(io::Error),
}

/// Shows a robot until a key, a signal or `drawn` ends it. Calls `drawn` after each frame with the model.
///
/// `name` is the name of the line, `-` for the standard input; keys are always read from the terminal.
///
/// # Errors
/// If the standard output is not a terminal, or the terminal fails.
pub fn run(
    name: &str,
    baud: u32,
    options: Options,
    mut drawn: impl FnMut(&Model) -> ControlFlow<()>,
) -> anyhow::Result<()> {
    ensure!(stdout().is_terminal(), "the standard output is no terminal; --headless needs none");
    let ended = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGHUP, signal_hook::consts::SIGINT] {
        signal_hook::flag::register(signal, Arc::clone(&ended)).context("installing the signal handlers")?;
    }
    let mut screen = Screen::enter().context("taking over the terminal")?;
    let (sender, inputs) = sync_channel(QUEUE);
    let keys = sender.clone();
    let no_more_keys = Arc::clone(&ended);
    thread::spawn(move || send_keys(&keys, &no_more_keys));
    let link = Link::start(Source::named(name, baud), options, move |event| sender.send(Input::Link(event)).is_ok());
    let outcome = show(&mut screen, &mut Model::new(name), &link, &inputs, &ended, &mut drawn);
    ended.store(true, Ordering::Relaxed);
    outcome
}

fn show(
    screen: &mut Screen,
    model: &mut Model,
    link: &Link,
    inputs: &Receiver<Input>,
    ended: &AtomicBool,
    drawn: &mut impl FnMut(&Model) -> ControlFlow<()>,
) -> anyhow::Result<()> {
    let mut last_frame: Option<Instant> = None;
    let mut changed = true;
    while !ended.load(Ordering::Relaxed) {
        let frame_time = if changed { LEAST_FRAME_TIME } else { IDLE_FRAME_TIME };
        let due = last_frame.map_or(Duration::ZERO, |last| frame_time.saturating_sub(last.elapsed()));
        let mut input = match inputs.recv_timeout(due) {
            Ok(input) => Some(input),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => bail!("the link and the keys are gone"),
        };
        let burst_ends = Instant::now() + BURST_TIME;
        for _ in 0..QUEUE {
            let Some(something) = input else { break };
            changed = true;
            match something {
                Input::Link(event) => model.apply(event, Instant::now()),
                Input::Key(key) => match model.press(key) {
                    Some(Action::Quit) => return Ok(()),
                    Some(Action::Start(task)) => link.start_task(task),
                    None => {}
                },
                Input::Resized => {}
                Input::Failed(error) => return Err(error).context("reading the keys"),
            }
            input = inputs.recv_timeout(burst_ends.saturating_duration_since(Instant::now())).ok();
        }
        let frame_time = if changed { LEAST_FRAME_TIME } else { IDLE_FRAME_TIME };
        if last_frame.is_none_or(|last| last.elapsed() >= frame_time) {
            model.settle(Instant::now());
            screen.terminal.draw(|frame| view::draw(frame, model)).context("drawing")?;
            if drawn(model).is_break() {
                return Ok(());
            }
            last_frame = Some(Instant::now());
            changed = false;
        }
    }
    Ok(())
}

fn send_keys(inputs: &SyncSender<Input>, ended: &AtomicBool) {
    while !ended.load(Ordering::Relaxed) {
        let input = match event::poll(KEY_PATIENCE).and_then(|is_there| is_there.then(event::read).transpose()) {
            Ok(Some(Event::Key(key))) => Input::Key(key),
            Ok(Some(Event::Resize(..))) => Input::Resized,
            Ok(_) => continue,
            Err(error) => {
                // The receiver is gone.
                let _ = inputs.send(Input::Failed(error));
                return;
            }
        };
        if inputs.send(input).is_err() {
            return;
        }
    }
}

/// The terminal in use by the monitor; its previous state is restored on every exit path.
struct Screen {
    terminal: Terminal<CrosstermBackend<Stdout>>,
}

impl Screen {
    fn enter() -> io::Result<Self> {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            give_back();
            before(panic);
        }));
        enable_raw_mode()?;
        IS_TAKEN.store(true, Ordering::Relaxed);
        let entered = execute!(stdout(), EnterAlternateScreen);
        match entered.and_then(|()| Terminal::new(CrosstermBackend::new(stdout()))) {
            Ok(terminal) => Ok(Self { terminal }),
            Err(error) => {
                give_back();
                Err(error)
            }
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        give_back();
    }
}

/// Whether the terminal must be restored.
static IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// Runs once: leaving the alternate screen again would reset the cursor, and a panic message would be overwritten.
fn give_back() {
    if IS_TAKEN.swap(false, Ordering::Relaxed) {
        // There is no recovery if the terminal fails here.
        let _ = disable_raw_mode();
        let _ = execute!(stdout(), LeaveAlternateScreen, Show);
    }
}
