//! `publish` with a real router: a session of Zenoh in the mode of a router.

use std::net::TcpListener;
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Instant;

use serde_json::Value;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_cli::publish::{BrokerEvent, Options, Publisher};
use toposlam_link::link::LinkEvent;
use toposlam_link::listener::Listener;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Config, Session, Wait};

use super::{DEADLINE, Process, SHORT, explored, free_port, is_map, map, robot};

fn session(mode: &str, endpoints: &str, port: u16) -> Session {
    let mut config = Config::default();
    config.insert_json5("mode", &format!("{mode:?}")).unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    config.insert_json5(endpoints, &format!("[\"tcp/127.0.0.1:{port}\"]")).unwrap();
    zenoh::open(config).wait().unwrap()
}

fn router(port: u16) -> Session {
    session("router", "listen/endpoints", port)
}

fn subscriber(port: u16) -> Session {
    session("client", "connect/endpoints", port)
}

/// Asks until an answer is the awaited one.
fn ask_until(session: &Session, key: &str, is_it: impl Fn(&[u8]) -> bool) {
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < DEADLINE, "no such answer for {key}");
        let replies = session.get(key).wait().unwrap();
        while let Ok(reply) = replies.recv() {
            if reply.result().is_ok_and(|sample| is_it(&sample.payload().to_bytes())) {
                return;
            }
        }
        thread::sleep(SHORT);
    }
}

#[test]
fn a_late_subscriber_asks_for_the_map_and_sees_that_the_publisher_died() {
    let port = free_port();
    let _router = router(port);
    let early = subscriber(port);
    let (sender, samples) = channel::<Sample>();
    let all = early.declare_subscriber("toposlam/kitchen/**");
    let _all = all.callback(move |sample| sender.send(sample).unwrap_or_default()).wait().unwrap();

    let map = map(&explored(&mut [0; SNAPSHOT_BYTES], |_| ()));
    let publisher = Command::new(env!("CARGO_BIN_EXE_toposlam"))
        .args(["publish", &robot(), "--robot", "kitchen", "--frames", "--broker", &format!("zenoh://127.0.0.1:{port}")])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut publisher = Process(publisher);
    let (mut listener, mut places, mut has_map) = (Listener::new(), 0, false);
    while !(has_map && places > 0 && listener.replica().is_converged() && listener.map() == map) {
        let sample = samples.recv_timeout(DEADLINE).unwrap();
        let payload = sample.payload().to_bytes();
        match sample.key_expr().as_str() {
            "toposlam/kitchen/frames" => listener.feed(&payload, |_, _| ()),
            "toposlam/kitchen/events" => {
                let event: Value = serde_json::from_slice(&payload).unwrap();
                places += usize::from(event["event"] == "Place");
            }
            "toposlam/kitchen/map" => has_map |= is_map(&payload, &map),
            _ => {}
        }
    }
    assert_eq!((listener.counters().corrupt, listener.counters().unknown_message), (0, 0));

    let late = subscriber(port);
    let (sender, tokens) = channel();
    let alive = late.liveliness().declare_subscriber("toposlam/*/status").history(true);
    let _alive = alive.callback(move |sample| sender.send(sample.kind()).unwrap_or_default()).wait().unwrap();
    ask_until(&late, "toposlam/*/map", |payload| is_map(payload, &map));
    ask_until(&late, "toposlam/*/status", |payload| payload == b"online");
    assert_eq!(tokens.recv_timeout(DEADLINE).unwrap(), SampleKind::Put);
    publisher.0.kill().unwrap();
    assert_eq!(tokens.recv_timeout(DEADLINE).unwrap(), SampleKind::Delete);
}

#[test]
fn a_restarted_router_gets_the_newest_map_and_drops_are_counted() {
    let port = free_port();
    let options = Options::new(format!("zenoh://127.0.0.1:{port}").parse().unwrap(), "kitchen").unwrap();
    let (sender, news) = channel();
    let mut publisher = Publisher::start(options, move |news| sender.send(news).unwrap_or_default());
    publisher.apply(&LinkEvent::Connected);
    let (mut listener, mut events) = (Listener::new(), 0);
    let mut buffer = [0; SNAPSHOT_BYTES];
    let exploration = explored(&mut buffer, |said| {
        listener.feed(said, |listener, event| {
            publisher.apply(&LinkEvent::received(listener, event));
            events += 1;
        });
    });
    assert_eq!(publisher.counters().dropped, events);
    assert!(matches!(news.recv_timeout(DEADLINE).unwrap(), BrokerEvent::Disconnected(_)));

    for _ in 0..2 {
        let router = router(port);
        assert_eq!(news.recv_timeout(DEADLINE).unwrap(), BrokerEvent::Connected);
        ask_until(&subscriber(port), "toposlam/kitchen/map", |payload| is_map(payload, &map(&exploration)));
        router.close().wait().unwrap();
        assert!(matches!(news.recv_timeout(DEADLINE).unwrap(), BrokerEvent::Disconnected(_)));
    }
    let _router = router(port);
    assert_eq!(news.recv_timeout(DEADLINE).unwrap(), BrokerEvent::Connected);
    let subscriber = subscriber(port);
    let status = subscriber.declare_subscriber("toposlam/kitchen/status").wait().unwrap();
    ask_until(&subscriber, "toposlam/kitchen/status", |payload| payload == b"online");
    drop(publisher);
    while &*status.recv_timeout(DEADLINE).unwrap().unwrap().payload().to_bytes() != b"offline" {}
}

#[test]
fn a_router_that_does_not_answer_blocks_nobody() {
    const SOME: u64 = 1000;
    let router = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("zenoh://{}", router.local_addr().unwrap());
    let mut publisher = Publisher::start(Options::new(address.parse().unwrap(), "kitchen").unwrap(), |_| ());
    let (_connection, _) = router.accept().unwrap();
    let (mut listener, start) = (Listener::new(), Instant::now());
    while publisher.counters().dropped < SOME {
        listener.feed(&[7, 0], |listener, event| publisher.apply(&LinkEvent::received(listener, event)));
    }
    assert_eq!(publisher.counters().published, 0);
    drop(publisher);
    assert!(start.elapsed() < DEADLINE);
}
