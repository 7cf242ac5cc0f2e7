//! The server as seen by a browser, with a simulated robot on the line.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::ring::Echo;
use toposlam::wire::{
    Capacities, Command, Echoes, Encoder, Hello, List, MAX_FRAME_BYTES, Message, PROTOCOL_VERSION, Remapped, ResetCause,
};

use super::server::{Options, Server};
use super::state::State;
use toposlam_link::broadcast::Broadcast;
use toposlam_link::link::{self, LinkEvent};
use toposlam_link::listener::Listener;
use toposlam_link::topology::TopologicalMap;
use toposlam_link::watch::Watch;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

/// Timeout of every wait in these tests.
const FOREVER: Duration = Duration::from_secs(60);

fn server(options: Options) -> Server {
    Server::bind("127.0.0.1:0", options, &numbered(0)).unwrap()
}

fn numbered(number: u32) -> State {
    State { map: Value::Null, live: number.into() }
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(FOREVER)).unwrap();
    stream
}

/// The head and the body of the response to the given bytes.
fn answer(server: &Server, request: &str) -> (String, String) {
    let mut stream = connect(server.address());
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    (head.to_owned(), body.to_owned())
}

fn get(server: &Server, path: &str) -> (String, String) {
    answer(server, &format!("GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", server.address()))
}

/// Client of the event stream: the name, data and length in bytes of each event.
struct Events(BufReader<TcpStream>);

impl Events {
    fn of(address: SocketAddr) -> Self {
        Self::on(connect(address), address)
    }

    fn on(mut stream: TcpStream, address: SocketAddr) -> Self {
        write!(stream, "GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
        Self(BufReader::new(stream))
    }

    fn live_numbers(self) -> impl Iterator<Item = u64> {
        self.filter_map(|(name, data, _)| if name == "live" { data.as_u64() } else { None })
    }
}

impl Iterator for Events {
    type Item = (String, Value, usize);

    fn next(&mut self) -> Option<Self::Item> {
        let (mut name, mut line, mut bytes) = (String::new(), String::new(), 0);
        loop {
            line.clear();
            let count = self.0.read_line(&mut line).unwrap();
            bytes += count;
            if count == 0 {
                return None;
            }
            if let Some(event) = line.strip_prefix("event: ") {
                event.trim().clone_into(&mut name);
            } else if let Some(data) = line.strip_prefix("data: ") {
                return Some((name, serde_json::from_str(data).unwrap(), bytes));
            }
        }
    }
}

#[test]
fn the_page_is_self_contained_and_loads_no_other_resource() {
    let server = server(Options::default());
    let (head, page) = get(&server, "/");
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n") && head.contains("text/html; charset=utf-8"), "{head}");
    let policy = head.lines().find_map(|line| line.strip_prefix("Content-Security-Policy: ")).unwrap();
    assert!(policy.starts_with("default-src 'none'; ") && policy.contains("frame-ancestors 'none'"), "{policy}");
    assert!(!policy.contains("unsafe") && !policy.contains('*'), "{policy}");
    let nonce = policy.split("script-src 'nonce-").nth(1).unwrap().split('\'').next().unwrap();
    assert_eq!((nonce.len(), page.matches(&format!("nonce=\"{nonce}\"")).count()), (32, 2));
    assert!(!page.contains("{{") && page.trim_end().ends_with("</html>"));
    for elsewhere in ["src=", "@import", "url(", "https:", "//cdn"] {
        assert!(!page.contains(elsewhere), "{elsewhere}");
    }
    assert_ne!(get(&server, "/").1, page, "each response has a new nonce");
}

#[test]
fn unknown_paths_methods_and_hosts_are_refused() {
    let quick = Options { patience: Duration::from_millis(100), names: vec!["robot.lan".into()], ..Options::default() };
    let server = server(quick);
    let head = |request: &str| answer(&server, request).0;
    let is = |head: String, status: &str| assert!(head.starts_with(&format!("HTTP/1.1 {status} ")), "{status}: {head}");
    for path in ["/", "/map.json", "/events"] {
        is(head(&format!("GET {path} HTTP/1.1\r\nHost: evil.example\r\n\r\n")), "403");
    }
    is(head("GET / HTTP/1.1\r\nHost: robot.lan:8080\r\n\r\n"), "200");
    is(head("GET / HTTP/1.1\r\n\r\n"), "400");
    is(head("GET /elsewhere HTTP/1.1\r\nHost: localhost\r\n\r\n"), "404");
    let posted = head("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    assert!(posted.contains("Allow: GET, HEAD"), "{posted}");
    is(posted, "405");
    is(head("GET / HTTP/1.1\r\nHost: loc"), "408");
    is(head(&format!("GET / HTTP/1.1\r\nHost: localhost\r\n{}\r\n", "A: b\r\n".repeat(101))), "431");
    let (head, body) = answer(&server, "HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    assert!(head.contains("Content-Security-Policy") && body.is_empty(), "{head}");
}

#[test]
fn two_browsers_and_map_json_show_the_same_map() {
    let mut robot = Broadcast::bind("127.0.0.1:0").unwrap();
    let line = format!("tcp:{}", robot.address().unwrap());
    let server = Arc::new(Server::bind("127.0.0.1:0", Options::default(), &State::of(&mut Watch::new(&line))).unwrap());
    thread::spawn({
        let server = Arc::clone(&server);
        move || super::follow(&line, 0, link::Options::default(), &server)
    });
    let maps: Vec<Receiver<Value>> = (0..2).map(|_| maps_of(server.address())).collect();
    while robot.listeners() == 0 {
        robot.exchange(&[]);
    }

    let plan = Plan::built_in("ring").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    while exploration.places() < 12 {
        exploration.advance();
        robot.exchange(&exploration.board().sent);
    }
    // From here on the robot stands still and keeps sending its map.
    exploration.command(Command::Pause { on: true });
    let deadline = Instant::now() + FOREVER;
    let mut seen = vec![Value::Null; maps.len()];
    let is_robots = |map: &Value, robots: &TopologicalMap| {
        map["converged"] == true
            && map["edges"] == json!(robots.edges)
            && map["vertices"].as_array().is_some_and(|vertices| {
                vertices.len() == robots.vertices.len()
                    && vertices.iter().zip(&robots.vertices).all(|(shown, vertex)| {
                        shown["radius_mm"] == vertex.radius_mm
                            && shown["visits"] == vertex.visits
                            && shown["x"].is_f64()
                    })
            })
    };
    loop {
        exploration.advance();
        robot.exchange(&exploration.board().sent);
        thread::sleep(Duration::from_millis(1));
        for (seen, maps) in seen.iter_mut().zip(&maps) {
            *seen = maps.try_iter().last().unwrap_or(seen.take());
        }
        let robots = TopologicalMap::of(exploration.robot().mapper().filter());
        if seen.iter().all(|map| is_robots(map, &robots)) {
            assert!(robots.vertices.len() >= 2 && !robots.edges.is_empty());
            break;
        }
        assert!(Instant::now() < deadline, "{robots:?}, received: {seen:?}");
    }
    let newest: Value = serde_json::from_str(&get(&server, "/map.json").1).unwrap();
    assert_eq!(newest["map"]["edges"], seen[0]["edges"]);
    assert_eq!(newest["map"]["connection"], json!({"state": "open"}));
    assert!(newest["live"]["drive"]["doing"].is_string());
    assert_eq!(newest["live"]["line"]["damaged"], 0);

    drop(robot);
    for maps in &maps {
        let cut = maps.iter().find(|map| map["connection"]["state"] == "cut").unwrap();
        assert!(cut["connection"]["reason"].is_string() && cut["edges"] == seen[0]["edges"], "the map is kept");
    }
}

/// The maps that a browser receives.
fn maps_of(address: SocketAddr) -> Receiver<Value> {
    let (sender, maps) = channel();
    thread::spawn(move || {
        for (_, map, _) in Events::of(address).filter(|(name, ..)| name == "map") {
            if sender.send(map).is_err() {
                return;
            }
        }
    });
    maps
}

#[test]
fn late_and_slow_browsers_get_the_newest_state() {
    let server = server(Options { pace: Duration::ZERO, patience: FOREVER, ..Options::default() });
    server.publish(&numbered(1));
    let (early, address) = (with_little_room(server.address()), server.address());
    let mut early = Events::on(early, address).live_numbers();
    assert_eq!(early.next(), Some(1));
    let states = 100_000;
    (2..=states).for_each(|number| server.publish(&numbered(number)));
    assert_eq!(Events::of(address).live_numbers().next(), Some(states.into()), "the newest state comes first");
    let lagged: Vec<u64> = early.take_while(|&number| number < u64::from(states)).collect();
    assert!(lagged.len() < 50_000, "{} states were queued for it", lagged.len());
    assert!(lagged.is_sorted());
}

#[test]
fn a_browser_that_does_not_read_is_dropped_and_blocks_nobody() {
    let server = server(Options { pace: Duration::ZERO, patience: Duration::from_millis(200), ..Options::default() });
    let mut stuck = with_little_room(server.address());
    write!(stuck, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let (sender, numbers) = channel();
    let address = server.address();
    thread::spawn(move || Events::of(address).live_numbers().try_for_each(|number| sender.send(number)));
    numbers.recv_timeout(FOREVER).unwrap();
    let deadline = Instant::now() + FOREVER;
    let mut published = 0_u32;
    while server.connections() != 1 {
        published += 1;
        let state = State { map: format!("{published}{}", "x".repeat(50_000)).into(), live: published.into() };
        server.publish(&state);
        thread::sleep(Duration::from_millis(1));
        assert!(Instant::now() < deadline, "{} connections after {published} states", server.connections());
    }
    assert!(numbers.iter().any(|number| number == u64::from(published)), "the other browser receives the newest state");
}

/// A connection with a small receive buffer.
fn with_little_room(address: SocketAddr) -> TcpStream {
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::STREAM, None).unwrap();
    socket.set_recv_buffer_size(8192).unwrap();
    socket.connect(&address.into()).unwrap();
    socket.set_read_timeout(Some(FOREVER)).unwrap();
    socket.into()
}

#[test]
fn excess_browsers_are_refused_and_dropping_the_server_ends_all_streams() {
    let server = server(Options { connections: 1, ..Options::default() });
    let mut only = Events::of(server.address());
    assert_eq!(only.by_ref().take(2).filter(|(name, ..)| name == "live").count(), 1);
    let (head, _) = answer(&server, "");
    assert!(head.starts_with("HTTP/1.1 503 "), "{head}");
    let address = server.address();
    drop(server);
    assert_eq!(only.next(), None);
    assert!(TcpStream::connect(address).is_err(), "the server no longer accepts connections");
}

fn receive(watch: &mut Watch, messages: &[Message]) {
    let (mut listener, mut encoder) = (Listener::new(), Encoder::new(0));
    for message in messages {
        let mut frame = [0; MAX_FRAME_BYTES];
        listener.feed(encoder.encode(message, &mut frame).unwrap(), |listener, event| {
            watch.apply(LinkEvent::received(listener, event));
        });
        watch.arrange();
    }
}

#[test]
fn another_version_is_distinguished_from_another_schema() {
    let capacities =
        Capacities { vertices: 16, hypotheses: 10, history: 400, ngram_length: 5, fingerprint_step_mm: 2, sonars: 16 };
    let hello = Hello::new(1, ResetCause::PowerOn, 1, capacities);
    let understanding = |hello| {
        let mut watch = Watch::new("line");
        receive(&mut watch, &[Message::Hello(hello)]);
        State::of(&mut watch).map["understanding"].take()
    };
    assert_eq!(State::of(&mut Watch::new("line")).map["understanding"]["level"], "unknown");
    assert_eq!(understanding(hello)["level"], "whole");
    assert_eq!(understanding(Hello { schema_hash: 1, ..hello })["level"], "not");
    let newer = understanding(Hello { protocol_version: PROTOCOL_VERSION + 1, ..hello });
    assert_eq!(newer["level"], "partly");
    assert!(newer["text"].as_str().unwrap().contains(&format!("version {}", PROTOCOL_VERSION + 1)), "{newer}");
}

#[test]
fn a_ring_frame_changes_the_live_part_only() {
    let mut watch = Watch::new("line");
    let before = State::of(&mut watch);
    let echoes = Echoes::new(&[Echo::Range { range_mm: 1482 }, Echo::Silence, Echo::Dead]);
    receive(&mut watch, &[Message::Ring { frame_index: 7, echoes }]);
    let State { map, live } = State::of(&mut watch);
    assert_eq!(live["ring"], json!({"frame_index": 7, "ranges_mm": [1482, "silence", "dead"]}));
    assert_eq!((before.live["ring"].is_null(), map), (true, before.map));
}

#[test]
fn a_renumbered_vertex_keeps_its_position() {
    let edge = |a, b| Message::Edge { a, b, present: true };
    let positions = |watch: &mut Watch| -> Vec<(f64, f64)> {
        let map = State::of(watch).map;
        let vertices = map["vertices"].as_array().unwrap().iter();
        vertices.map(|vertex| (vertex["x"].as_f64().unwrap(), vertex["y"].as_f64().unwrap())).collect()
    };
    let path = [edge(0, 1), edge(1, 2), edge(2, 3)];
    let mut before = Watch::new("line");
    receive(&mut before, &path);
    let mut after = Watch::new("line");
    let reversed = Message::Remapped(Remapped { place_index: 4, vertices: List::new([3, 2, 1, 0]) });
    receive(&mut after, &[path.as_slice(), &[reversed]].concat());
    let mut expected = positions(&mut before);
    expected.reverse();
    assert_eq!(positions(&mut after), expected);
}

/// Measures the latency and the size of a ring frame from the robot's line to a browser:
/// `cargo test -p toposlam-cli --lib serve::tests::measure -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement of a minute"]
fn measure_the_latency_from_the_robot_to_a_browser() {
    const FRAMES: u32 = 600;
    let mut robot = Broadcast::bind("127.0.0.1:0").unwrap();
    let line = format!("tcp:{}", robot.address().unwrap());
    let server = Arc::new(Server::bind("127.0.0.1:0", Options::default(), &State::of(&mut Watch::new(&line))).unwrap());
    let events = Events::of(server.address());
    thread::spawn({
        let server = Arc::clone(&server);
        move || super::follow(&line, 0, link::Options::default(), &server)
    });
    let (sender, arrivals) = channel();
    thread::spawn(move || {
        events.into_iter().try_for_each(|(name, data, bytes)| {
            let frame = data["drive"]["frame_index"].as_u64();
            sender.send((name, frame, bytes, Instant::now()))
        })
    });
    while robot.listeners() == 0 {
        robot.exchange(&[]);
    }
    let plan = Plan::built_in("office").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    let mut said_at = Vec::new();
    let start = Instant::now();
    for frame in 1..=FRAMES {
        exploration.advance();
        said_at.push(Instant::now());
        robot.exchange(&exploration.board().sent);
        thread::sleep((start + frame * Duration::from_millis(100)).saturating_duration_since(Instant::now()));
    }
    let seconds = start.elapsed().as_secs_f64();
    let arrivals: Vec<_> = arrivals.try_iter().collect();
    let total =
        |part: &str| arrivals.iter().filter(|(name, ..)| name == part).map(|(_, _, bytes, _)| bytes).sum::<usize>();
    let mut latencies: Vec<Duration> = Vec::new();
    let mut next = 0;
    for (_, frame, _, at) in &arrivals {
        if let Some(frame) = frame.filter(|&frame| frame >= next) {
            next = frame + 1;
            latencies.push(at.saturating_duration_since(said_at[frame as usize]));
        }
    }
    latencies.sort_unstable();
    assert!(latencies.len() > FRAMES as usize / 2, "{} frames of {FRAMES} arrived", latencies.len());
    println!(
        "{} of {FRAMES} frames arrived, after {:?} (median), {:?} (95 %), {:?} (worst)",
        latencies.len(),
        latencies[latencies.len() / 2],
        latencies[latencies.len() * 95 / 100],
        latencies[latencies.len() - 1]
    );
    println!(
        "{:.0} bytes/s of maps, {:.0} bytes/s of frames",
        total("map") as f64 / seconds,
        total("live") as f64 / seconds
    );
}
