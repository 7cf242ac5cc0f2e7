//! `publish` with a real broker, mosquitto.

use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Instant;

use rumqttc::{Client, Connection, Event, MqttOptions, Packet, Publish, QoS};
use serde_json::Value;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_cli::publish::{BrokerEvent, Options, Publisher};
use toposlam_link::link::LinkEvent;
use toposlam_link::listener::Listener;
use toposlam_link::topology::TopologicalMap;

use super::{DEADLINE, Process, SHORT, explored, free_port, is_map, map, robot};

/// The path of the broker on Debian, which is not in every user's `PATH`.
fn mosquitto() -> Option<&'static str> {
    let found = ["mosquitto", "/usr/sbin/mosquitto"]
        .into_iter()
        .find(|name| Command::new(name).arg("-h").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok());
    if found.is_none() {
        assert!(std::env::var("CI").is_err(), "mosquitto is missing: apt-get install mosquitto");
        eprintln!("SKIPPED: mosquitto is missing: apt-get install mosquitto");
    }
    found
}

fn start_broker(program: &str, directory: &Path, port: u16) -> Process {
    let settings = directory.join("mosquitto.conf");
    std::fs::write(&settings, format!("listener {port} 127.0.0.1\nallow_anonymous true\npersistence false\n")).unwrap();
    let mut command = Command::new(program);
    let broker = command.arg("-c").arg(&settings).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let broker = Process(broker.unwrap());
    let start = Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(start.elapsed() < DEADLINE, "the broker does not answer");
        thread::sleep(SHORT);
    }
    broker
}

struct Subscriber {
    connection: Connection,
    _client: Client,
}

impl Subscriber {
    /// Subscribes to all topics of a robot.
    fn connect(port: u16, name: &str) -> Self {
        let mut options = MqttOptions::new(name, "127.0.0.1", port);
        options.set_max_packet_size(1 << 17, 1 << 17);
        let (client, mut connection) = Client::new(options, 10);
        client.subscribe("toposlam/kitchen/#", QoS::AtLeastOnce).unwrap();
        while !matches!(connection.recv_timeout(DEADLINE).unwrap().unwrap(), Event::Incoming(Packet::SubAck(_))) {}
        Self { connection, _client: client }
    }

    /// Waits for a message.
    fn wait_for(&mut self, mut is_it: impl FnMut(&Publish) -> bool) -> Publish {
        let start = Instant::now();
        loop {
            assert!(start.elapsed() < DEADLINE, "no such message arrived");
            if let Event::Incoming(Packet::Publish(message)) = self.connection.recv_timeout(DEADLINE).unwrap().unwrap()
                && is_it(&message)
            {
                return message;
            }
        }
    }

    fn wait_for_map(&mut self, map: &TopologicalMap) -> Publish {
        self.wait_for(|message| message.topic == "toposlam/kitchen/map" && is_map(&message.payload, map))
    }

    fn wait_for_status(&mut self, status: &str) -> Publish {
        self.wait_for(|message| message.topic == "toposlam/kitchen/status" && message.payload == status.as_bytes())
    }
}

#[test]
fn a_late_subscriber_gets_the_map_and_the_last_will() {
    let Some(program) = mosquitto() else { return };
    let directory = tempfile::tempdir().unwrap();
    let port = free_port();
    let _broker = start_broker(program, directory.path(), port);
    let mut early = Subscriber::connect(port, "early");

    let map = map(&explored(&mut [0; SNAPSHOT_BYTES], |_| ()));
    let line = robot();
    let publisher = Command::new(env!("CARGO_BIN_EXE_toposlam"))
        .args(["publish", &line, "--robot", "kitchen", "--frames", "--broker", &format!("mqtt://127.0.0.1:{port}")])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut publisher = Process(publisher);
    let (mut listener, mut places, mut has_map) = (Listener::new(), 0, false);
    early.wait_for(|message| {
        match message.topic.as_str() {
            "toposlam/kitchen/frames" => listener.feed(&message.payload, |_, _| ()),
            "toposlam/kitchen/events" => {
                let event: Value = serde_json::from_slice(&message.payload).unwrap();
                places += usize::from(event["event"] == "Place");
            }
            _ => {}
        }
        has_map |= message.topic == "toposlam/kitchen/map" && is_map(&message.payload, &map);
        has_map && places > 0 && listener.replica().is_converged() && listener.map() == map
    });
    assert!(map.vertices.len() > 2 && !map.edges.is_empty());
    assert_eq!((listener.counters().corrupt, listener.counters().unknown_message), (0, 0));

    let mut late = Subscriber::connect(port, "late");
    assert!(late.wait_for_map(&map).retain);
    let mut later = Subscriber::connect(port, "later");
    assert!(later.wait_for_status("online").retain);
    publisher.0.kill().unwrap();
    late.wait_for_status("offline");
}

#[test]
fn a_reconnected_broker_gets_the_newest_map_and_drops_are_counted() {
    let Some(program) = mosquitto() else { return };
    let directory = tempfile::tempdir().unwrap();
    let port = free_port();
    let options = Options::new(format!("mqtt://127.0.0.1:{port}").parse().unwrap(), "kitchen").unwrap();
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
        let broker = start_broker(program, directory.path(), port);
        assert_eq!(news.recv_timeout(DEADLINE).unwrap(), BrokerEvent::Connected);
        let mut subscriber = Subscriber::connect(port, "subscriber");
        subscriber.wait_for_map(&map(&exploration));
        drop(broker);
        assert!(matches!(news.recv_timeout(DEADLINE).unwrap(), BrokerEvent::Disconnected(_)));
    }
    let _broker = start_broker(program, directory.path(), port);
    let mut subscriber = Subscriber::connect(port, "subscriber");
    subscriber.wait_for_status("online");
    drop(publisher);
    subscriber.wait_for_status("offline");
}

#[test]
fn a_broker_that_does_not_read_blocks_nobody() {
    const SOME: u64 = 1000;
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("mqtt://{}", broker.local_addr().unwrap());
    let (sender, news) = channel();
    let mut publisher = Publisher::start(Options::new(address.parse().unwrap(), "kitchen").unwrap(), move |news| {
        sender.send(news).unwrap_or_default();
    });
    let (mut connection, _) = broker.accept().unwrap();
    // The connection is accepted, but never read.
    connection.write_all(&[0x20, 2, 0, 0]).unwrap();
    assert_eq!(news.recv_timeout(DEADLINE).unwrap(), BrokerEvent::Connected);
    let (mut listener, mut events) = (Listener::new(), 0);
    while publisher.counters().dropped < SOME {
        listener.feed(&[7, 0], |listener, event| publisher.apply(&LinkEvent::received(listener, event)));
        events += 1;
    }
    // The status is published as well.
    let counters = publisher.counters();
    assert!((events..=events + 1).contains(&(counters.published + counters.dropped)), "{events} {counters:?}");
}
