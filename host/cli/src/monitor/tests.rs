//! The model and the view of a simulated robot.

use std::time::{Duration, Instant};

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::ring::Echo;
use toposlam::wire::{
    Capacities, Command, Echoes, Encoder, GoalState, GoalStatus, Hello, MAX_FRAME_BYTES, Message, Outcome,
    PROTOCOL_VERSION, Refusal, Remapped, ResetCause,
};

use super::model::{Action, Model};
use super::view;
use toposlam_link::link::{Answer, LinkEvent, Task, TaskError};
use toposlam_link::listener::Listener;
use toposlam_link::topology::TopologicalMap;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

/// A monitor fed directly with messages, without a line.
struct Watch {
    model: Model,
    listener: Listener,
    encoder: Encoder,
    now: Instant,
}

impl Watch {
    fn new(line: &str) -> Self {
        let (now, listener) = (Instant::now(), Listener::new());
        let mut model = Model::new(line);
        model.apply(LinkEvent::Connected, now);
        Self { model, listener, encoder: Encoder::new(0), now }
    }

    fn receive_bytes(&mut self, bytes: &[u8]) {
        let Self { model, listener, now, .. } = self;
        listener.feed(bytes, |listener, event| model.apply(LinkEvent::received(listener, event), *now));
    }

    fn receive(&mut self, message: &Message) {
        let mut frame = [0; MAX_FRAME_BYTES];
        let bytes = self.encoder.encode(message, &mut frame).unwrap().to_vec();
        self.receive_bytes(&bytes);
    }

    /// The text on a screen of the given size.
    fn screen(&mut self, width: u16, height: u16) -> String {
        self.model.settle(self.now);
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| view::draw(frame, &self.model)).unwrap();
        terminal.backend().to_string()
    }

    fn press(&mut self, key: KeyCode) -> Option<Action> {
        self.model.press(KeyEvent::new(key, KeyModifiers::NONE))
    }

    fn type_text(&mut self, text: &str) -> Option<Action> {
        text.chars().for_each(|character| assert_eq!(self.press(KeyCode::Char(character)), None));
        self.press(KeyCode::Enter)
    }
}

/// A monitor that has received the whole stream of a robot in the office, and the robot's own map.
fn office(places: usize) -> (Watch, usize, Vec<u16>) {
    let mut watch = Watch::new("tcp:robot:7070");
    let plan = Plan::built_in("office").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    while exploration.places() < places {
        exploration.advance();
        watch.receive_bytes(&exploration.board().sent);
    }
    let map = TopologicalMap::of(exploration.robot().mapper().filter());
    let radii = map.vertices.iter().map(|vertex| vertex.radius_mm).collect();
    (watch, map.all_edges().len(), radii)
}

fn hello() -> Hello {
    let capacities =
        Capacities { vertices: 16, hypotheses: 10, history: 400, ngram_length: 5, fingerprint_step_mm: 4, sonars: 16 };
    Hello::new(3, ResetCause::Watchdog, 1, capacities)
}

#[test]
fn a_wide_screen_shows_map_location_beliefs_and_evidence() {
    let (mut watch, edges, radii) = office(40);
    let screen = watch.screen(140, 45);
    let picture = watch.listener.replica().clone();
    for radius in &radii {
        assert!(screen.matches(&radius.to_string()).count() >= 2, "{radius} mm is in the map and the table\n{screen}");
    }
    assert!(screen.contains(&format!("{} vertices, {edges} edges", radii.len())), "{screen}");
    let location = picture.location().unwrap();
    assert!(screen.contains(&format!("at vertex {} with place 39", location.vertex)), "{screen}");
    assert!(screen.contains(&format!("@{} {}", location.vertex, radii[usize::from(location.vertex)])), "{screen}");
    let belief = picture.belief().unwrap();
    let map = if belief.is_uncertain() { "uncertain" } else { "this map" };
    let rivals = format!("{map} {}‰, its rivals {}‰", belief.map_permille, 1000 - belief.map_permille);
    assert!(screen.contains(&rivals), "{screen}");
    let evidence = picture.evidence().unwrap();
    assert!(screen.contains(&format!("consistency {} mm", evidence.consistency_mm)), "{screen}");
    assert!(screen.contains(&format!("worst {} mm", picture.worst().unwrap().distance_mm)), "{screen}");
    for word in ["as the robot has it", "heading", "no faults", " 0 lost, 0 corrupt", "turns, stack", "rim at"] {
        assert!(screen.contains(word), "{word}\n{screen}");
    }
}

#[test]
fn a_small_screen_cycles_through_the_panes_and_any_size_works() {
    let (mut watch, _, radii) = office(40);
    let screen = watch.screen(80, 24);
    for word in ["map:", "its rivals", "at vertex", "no faults", "heading"] {
        assert!(screen.contains(word), "{word}\n{screen}");
    }
    let seen = radii.iter().filter(|radius| screen.contains(&radius.to_string())).count();
    assert!(2 * seen > radii.len(), "radii are printed where there is room\n{screen}");
    for title in ["edges to", "rim at", "what it does", "map:"] {
        assert_eq!(watch.press(KeyCode::Tab), None);
        assert!(watch.screen(40, 10).contains(title), "{title}");
    }
    for (width, height) in [(1, 1), (3, 2), (20, 5), (59, 60), (200, 3), (110, 34), (109, 34), (400, 200)] {
        watch.screen(width, height);
    }
}

#[test]
fn the_vertex_table_scrolls() {
    let (mut watch, _, radii) = office(40);
    watch.press(KeyCode::Tab);
    let last = radii.last().unwrap().to_string();
    assert!(!watch.screen(50, 10).contains(&last));
    radii.iter().for_each(|_| drop(watch.press(KeyCode::Down)));
    assert!(watch.screen(50, 10).contains(&last));
    radii.iter().for_each(|_| drop(watch.press(KeyCode::Up)));
    assert!(watch.screen(50, 10).contains(&radii[0].to_string()));
}

#[test]
fn another_version_shows_a_banner_and_another_schema_an_alarm() {
    let mut watch = Watch::new("tcp:robot:7070");
    watch.receive(&Message::Hello(hello()));
    let screen = watch.screen(100, 30);
    assert!(!screen.contains("version") && screen.contains("start 3 (the watchdog was not fed in time)"), "{screen}");
    let theirs = PROTOCOL_VERSION + 1;
    watch.receive(&Message::Hello(Hello { protocol_version: theirs, ..hello() }));
    let screen = watch.screen(100, 30);
    assert!(screen.contains(&format!("protocol version {theirs}, this program {PROTOCOL_VERSION}")), "{screen}");
    watch.receive(&Message::Hello(Hello { schema_hash: 7, ..hello() }));
    let screen = watch.screen(100, 30);
    assert!(screen.contains("DO NOT TRUST") && screen.contains("0x0000000000000007"), "{screen}");
}

#[test]
fn faults_are_named_and_counted_and_logged_once() {
    let mut watch = Watch::new("tcp:robot:7070");
    for count in [2, 2, 3] {
        watch.receive(&Message::Fault { kind: 14, count });
    }
    let screen = watch.screen(120, 40);
    assert!(screen.contains("DriveLost 3"), "{screen}");
    assert_eq!(screen.matches("fault DriveLost: 2 times").count(), 1, "{screen}");
}

#[test]
fn lost_and_damaged_frames_are_counted_on_the_screen() {
    let mut watch = Watch::new("tcp:robot:7070");
    watch.receive(&Message::Edge { a: 0, b: 1, present: true });
    let mut frame = [0; MAX_FRAME_BYTES];
    let mut damaged = watch.encoder.encode(&Message::Edge { a: 1, b: 2, present: true }, &mut frame).unwrap().to_vec();
    damaged[2] ^= 1;
    watch.receive_bytes(&damaged);
    watch.receive(&Message::Edge { a: 2, b: 3, present: true });
    let screen = watch.screen(140, 40);
    assert!(screen.contains("2 frames, 1 lost, 1 corrupt"), "{screen}");
    assert!(screen.contains("may lack something"), "{screen}");
}

#[test]
fn a_ring_frame_is_drawn_with_its_silent_and_dead_sonars() {
    let mut watch = Watch::new("tcp:robot:7070");
    let count = |screen: &str, mark: char| screen.matches(mark).count();
    let mut echoes = [Echo::Range { range_mm: 900 }; 16];
    watch.receive(&Message::Ring { frame_index: 11, echoes: Echoes::new(&echoes) });
    let before = watch.screen(140, 45);
    echoes[3] = Echo::Dead;
    echoes[5] = Echo::Silence;
    watch.receive(&Message::Ring { frame_index: 12, echoes: Echoes::new(&echoes) });
    let screen = watch.screen(140, 45);
    assert!(screen.contains("ring 12, rim at 900 mm"), "{screen}");
    assert_eq!(count(&screen, 'x'), count(&before, 'x') + 1, "{screen}");
    assert_eq!(count(&screen, '-'), count(&before, '-') + 1, "{screen}");
}

#[test]
fn a_cut_line_and_a_silent_robot_are_reported_at_the_top() {
    let mut watch = Watch::new("tcp:robot:7070");
    assert!(!watch.screen(80, 24).contains("no data for"));
    watch.now += Duration::from_secs(7);
    assert!(watch.screen(80, 24).contains("no data for 7 s"));
    watch.model.apply(LinkEvent::Disconnected("the cable is out".to_owned()), watch.now);
    let screen = watch.screen(80, 24);
    assert!(screen.contains("no line: the cable is out; trying again"), "{screen}");
    assert!(!screen.contains("no data for"), "{screen}");
}

#[test]
fn every_command_of_the_wire_has_a_key() {
    let mut watch = Watch::new("tcp:robot:7070");
    for (key, command) in [
        ('i', Command::Info),
        ('u', Command::GetMap),
        ('e', Command::Explore),
        ('p', Command::Pause { on: true }),
        ('c', Command::Pause { on: false }),
        ('l', Command::LocaliseOnly { on: true }),
        ('m', Command::LocaliseOnly { on: false }),
    ] {
        assert_eq!(watch.press(KeyCode::Char(key)), Some(Action::Start(Task::Command(command))));
    }
    for (key, text, task) in [
        ('g', "3", Task::Command(Command::GoTo { vertex: 3 })),
        ('s', "a.snapshot", Task::Snapshot { file: "a.snapshot".into(), force: false }),
        ('r', "a.snapshot", Task::Restore("a.snapshot".into())),
        ('t', "noise-mm 40", Task::Command(Command::SetConfig(toposlam::wire::Setting::NoiseMm(40)))),
        ('x', "yes", Task::Command(Command::Reset)),
    ] {
        assert_eq!(watch.press(KeyCode::Char(key)), None);
        assert_eq!(watch.type_text(text), Some(Action::Start(task)));
    }
    assert_eq!(watch.press(KeyCode::Char('q')), Some(Action::Quit));
    let control_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    assert_eq!(watch.model.press(control_c), Some(Action::Quit));
}

#[test]
fn a_prompt_is_shown_and_can_be_cancelled_or_answered_wrongly() {
    let mut watch = Watch::new("tcp:robot:7070");
    watch.press(KeyCode::Char('x'));
    assert!(watch.screen(80, 24).contains("forget the whole map?"));
    assert_eq!(watch.type_text("y"), None);
    assert!(watch.screen(80, 24).contains("not reset"));
    watch.press(KeyCode::Char('g'));
    assert_eq!(watch.press(KeyCode::Char('7')), None);
    watch.press(KeyCode::Backspace);
    watch.press(KeyCode::Char('q'));
    assert!(watch.screen(80, 24).contains("which vertex? q"), "letters go to the prompt");
    watch.press(KeyCode::Esc);
    assert!(!watch.screen(80, 24).contains("which vertex?"));
}

#[test]
fn the_help_lists_the_keys() {
    let mut watch = Watch::new("tcp:robot:7070");
    watch.press(KeyCode::Char('?'));
    let screen = watch.screen(80, 24);
    assert!(screen.contains("reset: forget the map") && screen.contains("quit"), "{screen}");
    assert_eq!(watch.press(KeyCode::Char('x')), None);
    assert!(!watch.screen(80, 24).contains("forget the"), "the key only closed the help");
}

#[test]
fn replies_and_refusals_are_shown() {
    let mut watch = Watch::new("tcp:robot:7070");
    let go = Task::Command(Command::GoTo { vertex: 99 });
    watch.press(KeyCode::Char('g'));
    assert_eq!(watch.type_text("99"), Some(Action::Start(go.clone())));
    assert!(watch.screen(80, 24).contains("waiting for the robot: go to 99"));
    let refused = Answer::Outcome(Outcome::Refused(Refusal::UnknownVertex));
    watch.model.apply(LinkEvent::TaskDone(go.clone(), Ok(refused)), watch.now);
    let screen = watch.screen(80, 24);
    assert!(screen.contains("go to 99: refused: the map has no such vertex"), "{screen}");
    assert!(!screen.contains("waiting"), "{screen}");
    watch.model.apply(LinkEvent::TaskDone(go, Err(TaskError::NotConnected)), watch.now);
    assert!(watch.screen(80, 24).contains("go to 99: the robot is not connected"));
    let pause = Task::Command(Command::Pause { on: true });
    watch.model.apply(LinkEvent::TaskDone(pause, Ok(Answer::Outcome(Outcome::Done))), watch.now);
    let screen = watch.screen(80, 24);
    assert!(screen.contains("pause: done") && screen.contains("paused"), "{screen}");
}

#[test]
fn the_standard_input_is_read_only() {
    let mut watch = Watch::new("-");
    for key in "iuepclmgsrtx".chars() {
        assert_eq!(watch.press(KeyCode::Char(key)), None);
        assert!(watch.screen(80, 24).contains("the standard input takes no commands"), "{key}");
    }
    watch.model.apply(LinkEvent::Ended, watch.now);
    assert!(watch.screen(80, 24).contains("ended"));
    assert_eq!(watch.press(KeyCode::Char('q')), Some(Action::Quit));
}

#[test]
fn goals_and_remapped_vertices_are_shown() {
    let mut watch = Watch::new("tcp:robot:7070");
    watch.receive(&Message::Vertex { vertex: 0, radius_mm: 700, visits: 1 });
    watch.receive(&Message::Vertex { vertex: 1, radius_mm: 900, visits: 1 });
    watch.receive(&Message::GoalStatus(GoalStatus { vertex: 1, state: GoalState::Active }));
    assert!(watch.screen(120, 40).contains("goal vertex 1: active"));
    watch.receive(&Message::Remapped(Remapped { place_index: 2, vertices: toposlam::wire::List::new([1, 0]) }));
    let screen = watch.screen(120, 40);
    assert!(screen.contains("0 is 1, 1 is 0") && screen.contains("goal vertex 0: active"), "{screen}");
}

#[test]
fn a_restart_of_the_robot_is_reported_and_clears_the_map() {
    let mut watch = Watch::new("tcp:robot:7070");
    watch.receive(&Message::Hello(hello()));
    watch.receive(&Message::Edge { a: 0, b: 1, present: true });
    watch.encoder = Encoder::new(0);
    watch.receive(&Message::Hello(Hello { boot: 4, ..hello() }));
    let screen = watch.screen(120, 40);
    assert!(screen.contains("the robot has restarted") && screen.contains("no map yet"), "{screen}");
}
