//! Model of the monitor: processes events of the link and keys, and returns actions.
//!
//! Independent of terminal and line; the caller supplies the time.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use toposlam::FaultKind;
use toposlam::wire::{Arrival, Command, Header, Info, Message, Outcome};

use super::prompt::{Prompt, Question};
use toposlam_link::event_text;
use toposlam_link::link::{Answer, LinkEvent, TASKS, Task, TaskError};
use toposlam_link::watch::Watch;

const LOG_LINES: usize = 200;

/// The state of the monitor.
#[derive(Clone, Debug)]
pub struct Model {
    watch: Watch,
    received_at: Option<Instant>,
    silence: Option<Duration>,
    reported: Reported,
    waiting: VecDeque<String>,
    log: VecDeque<Entry>,
    prompt: Option<Prompt>,
    helps: bool,
    pane: Pane,
    /// First visible vertex of the table.
    scroll: usize,
}

/// The action of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Start a task on the link.
    Start(Task),
    /// End the monitor.
    Quit,
}

/// The selected pane, on a screen without room for all panes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pane {
    Map,
    Vertices,
    Ring,
    Robot,
}

impl Pane {
    pub(super) const ALL: [Self; 4] = [Self::Map, Self::Vertices, Self::Ring, Self::Robot];

    const fn next(self, steps: usize) -> Self {
        Self::ALL[(self as usize + steps) % Self::ALL.len()]
    }
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) is_bad: bool,
    pub(super) text: String,
}

/// The robot's mode, as far as its replies confirm it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reported {
    pub(super) paused: Option<bool>,
    pub(super) localise_only: Option<bool>,
    pub(super) info: Option<Info>,
}

impl Model {
    /// A monitor of the named line that has received nothing; `-` is the standard input, which is read-only.
    pub fn new(line: &str) -> Self {
        Self {
            watch: Watch::new(line),
            received_at: None,
            silence: None,
            reported: Reported::default(),
            waiting: VecDeque::new(),
            log: VecDeque::new(),
            prompt: None,
            helps: false,
            pane: Pane::Map,
            scroll: 0,
        }
    }

    /// Processes an event of the link.
    pub fn apply(&mut self, event: LinkEvent, now: Instant) {
        match &event {
            LinkEvent::Connected => {
                self.received_at = Some(now);
                self.note("connected");
            }
            LinkEvent::Disconnected(reason) => self.show_problem(format!("no line: {reason}; trying again")),
            LinkEvent::Ended => self.note("the input has ended"),
            LinkEvent::Received(event, _) => {
                self.received_at = Some(now);
                if let Ok((header, message)) = event {
                    self.update(*header, message);
                }
            }
            LinkEvent::TaskDone(task, answer) => {
                self.waiting.pop_front();
                self.task_done(task, answer);
            }
        }
        self.watch.apply(event);
    }

    fn update(&mut self, header: Header, message: &Message) {
        match header.arrival {
            Arrival::Late => return,
            Arrival::Restart => {
                self.reported = Reported::default();
                self.show_problem("the robot has restarted".to_owned());
            }
            Arrival::First | Arrival::InOrder | Arrival::AfterGap { .. } => {}
        }
        match message {
            Message::Remapped(_) | Message::GoalStatus(_) => self.note(event_text::message(message)),
            Message::Fault { kind, count } if self.is_new_fault(*kind, *count) => {
                self.show_problem(event_text::message(message))
            }
            _ => {}
        }
    }

    fn is_new_fault(&self, kind: u8, count: u32) -> bool {
        FaultKind::ALL.get(usize::from(kind)).is_none_or(|&kind| self.watch.listener().replica().fault(kind) != count)
    }

    fn task_done(&mut self, task: &Task, answer: &Result<Answer, TaskError>) {
        match answer {
            Ok(Answer::Outcome(Outcome::Refused(refusal))) => {
                let why = match task {
                    Task::Command(command) => event_text::refusal(command, *refusal),
                    _ => refusal.to_string(),
                };
                self.show_problem(format!("{task}: refused: {why}"));
            }
            Ok(Answer::Outcome(outcome)) => {
                self.note(format!("{task}: {}", event_text::outcome(outcome)));
                match (task, outcome) {
                    (_, Outcome::Info(info)) => {
                        let (paused, localise_only) = (Some(info.paused), Some(info.localise_only));
                        self.reported = Reported { paused, localise_only, info: Some(*info) };
                    }
                    (Task::Command(Command::Pause { on }), _) => self.reported.paused = Some(*on),
                    (Task::Command(Command::LocaliseOnly { on }), _) => self.reported.localise_only = Some(*on),
                    _ => {}
                }
            }
            Ok(Answer::Written(bytes)) => self.note(format!("{task}: {bytes} bytes written")),
            Ok(Answer::Restored { bytes, changes }) => {
                self.note(format!("{task}: {bytes} bytes restored"));
                for change in changes.iter().flatten() {
                    self.note(format!("the snapshot has changed: {change}"));
                }
                self.reported = Reported::default();
            }
            Err(error) => self.show_problem(format!("{task}: {error}")),
        }
    }

    /// Processes a key; returns its action, if any.
    pub fn press(&mut self, key: KeyEvent) -> Option<Action> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return (key.code == KeyCode::Char('c')).then_some(Action::Quit);
        }
        if self.prompt.is_some() {
            return self.type_into_prompt(key.code);
        }
        if self.helps {
            self.helps = false;
            return (key.code == KeyCode::Char('q')).then_some(Action::Quit);
        }
        match key.code {
            KeyCode::Char('q') => Some(Action::Quit),
            KeyCode::Char('?') => {
                self.helps = true;
                None
            }
            KeyCode::Tab => {
                self.pane = self.pane.next(1);
                None
            }
            KeyCode::BackTab => {
                self.pane = self.pane.next(Pane::ALL.len() - 1);
                None
            }
            KeyCode::Up => {
                self.scroll = self.scroll.saturating_sub(1);
                None
            }
            KeyCode::Down => {
                self.scroll = (self.scroll + 1).min(self.watch.map().vertices.len().saturating_sub(1));
                None
            }
            KeyCode::Char(character) => self.begin(character),
            _ => None,
        }
    }

    /// The keys that send commands.
    fn begin(&mut self, key: char) -> Option<Action> {
        let wanted = match key {
            'i' => Ok(Command::Info),
            'u' => Ok(Command::GetMap),
            'e' => Ok(Command::Explore),
            'p' => Ok(Command::Pause { on: true }),
            'c' => Ok(Command::Pause { on: false }),
            'l' => Ok(Command::LocaliseOnly { on: true }),
            'm' => Ok(Command::LocaliseOnly { on: false }),
            'g' => Err(Question::GoTo),
            'n' => Err(Question::Name),
            's' => Err(Question::Snapshot),
            'r' => Err(Question::Restore),
            't' => Err(Question::Setting),
            'x' => Err(Question::Reset),
            _ => return None,
        };
        if self.is_read_only() {
            self.show_problem("the standard input takes no commands".to_owned());
            return None;
        }
        match wanted {
            Ok(command) => self.start(Task::Command(command)),
            Err(question) => {
                self.prompt = Some(Prompt::new(question));
                None
            }
        }
    }

    fn type_into_prompt(&mut self, key: KeyCode) -> Option<Action> {
        match key {
            KeyCode::Char(character) => self.prompt.as_mut()?.push(character),
            KeyCode::Backspace => self.prompt.as_mut()?.pop(),
            KeyCode::Esc => self.prompt = None,
            KeyCode::Enter => match self.prompt.take()?.answer(self.watch.map()) {
                Ok(task) => return self.start(task),
                Err(why) => self.show_problem(why),
            },
            _ => {}
        }
        None
    }

    /// Refuses a task when the link has no room for it.
    fn start(&mut self, task: Task) -> Option<Action> {
        if self.waiting.len() >= TASKS {
            self.show_problem(format!("{task}: {TASKS} requests are waiting already"));
            return None;
        }
        self.waiting.push_back(task.to_string());
        Some(Action::Start(task))
    }

    /// Arranges the map if it has changed, and updates the time of silence. Call it before drawing.
    pub fn settle(&mut self, now: Instant) {
        self.watch.arrange();
        self.silence = self.received_at.map(|received_at| now.saturating_duration_since(received_at));
    }

    /// The state of the robot.
    pub const fn watch(&self) -> &Watch {
        &self.watch
    }

    /// Whether commands cannot be sent.
    pub fn is_read_only(&self) -> bool {
        self.watch.line() == "-"
    }

    pub(super) const fn silence(&self) -> Option<Duration> {
        self.silence
    }

    pub(super) const fn reported(&self) -> Reported {
        self.reported
    }

    pub(super) fn waiting(&self) -> Option<&str> {
        self.waiting.front().map(String::as_str)
    }

    pub(super) const fn log(&self) -> &VecDeque<Entry> {
        &self.log
    }

    pub(super) const fn prompt(&self) -> Option<&Prompt> {
        self.prompt.as_ref()
    }

    pub(super) const fn helps(&self) -> bool {
        self.helps
    }

    pub(super) const fn scroll(&self) -> usize {
        self.scroll
    }

    pub(super) const fn pane(&self) -> Pane {
        self.pane
    }

    fn note(&mut self, text: impl Into<String>) {
        self.push(Entry { is_bad: false, text: text.into() });
    }

    fn show_problem(&mut self, text: String) {
        self.push(Entry { is_bad: true, text });
    }

    fn push(&mut self, entry: Entry) {
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(entry);
    }
}
