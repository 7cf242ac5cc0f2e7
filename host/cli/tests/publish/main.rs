//! `publish`: what a subscriber receives, and the behaviour when robot or broker is gone.
#![cfg(any(feature = "mqtt", feature = "zenoh"))]

#[cfg(feature = "mqtt")]
mod mqtt;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::net::TcpListener;
use std::process::Child;
use std::thread;
use std::time::Duration;

use serde_json::Value;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_link::broadcast::Broadcast;
use toposlam_link::listener::Listener;
use toposlam_link::topology::TopologicalMap;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

/// Timeout of every wait in these tests.
const DEADLINE: Duration = Duration::from_secs(60);
const SHORT: Duration = Duration::from_millis(2);
const PLACES: usize = 12;

/// A process that is killed at the end of the test.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Whether a payload contains exactly this map.
fn is_map(payload: &[u8], map: &TopologicalMap) -> bool {
    let json: Value = serde_json::from_slice(payload).unwrap();
    let number = |value: &Value| value.as_u64().unwrap();
    let labels = json["vertices"].as_array().unwrap().iter().enumerate().map(|(index, vertex)| {
        assert_eq!(number(&vertex["vertex"]), index as u64);
        (number(&vertex["radius_mm"]), number(&vertex["visits"]))
    });
    let edges = json["edges"].as_array().unwrap().iter().map(|edge| (number(&edge[0]), number(&edge[1])));
    labels.eq(map.vertices.iter().map(|vertex| (vertex.radius_mm.into(), vertex.visits.into())))
        && edges.eq(map.edges.iter().map(|&(a, b)| (a.into(), b.into())))
        && number(&json["digest"]) == u64::from(map.digest())
}

/// A robot that explores once a client is connected, and then only repeats its state.
fn robot() -> String {
    let mut broadcast = Broadcast::bind("127.0.0.1:0").unwrap();
    let line = format!("tcp:{}", broadcast.address().unwrap());
    thread::spawn(move || {
        let mut say = |said: &[u8]| {
            broadcast.exchange(said);
            thread::sleep(SHORT);
            broadcast.listeners()
        };
        while say(&[]) == 0 {}
        let mut buffer = [0; SNAPSHOT_BYTES];
        let mut exploration = explored(&mut buffer, |said| {
            say(said);
        });
        exploration.command(toposlam::wire::Command::Pause { on: true });
        loop {
            exploration.advance();
            say(&exploration.board().sent);
        }
    });
    line
}

/// Runs a deterministic exploration until the robot has sent its whole map.
fn explored(buffer: &mut [u8], mut say: impl FnMut(&[u8])) -> Exploration<'_> {
    let plan = Plan::built_in("flat").unwrap();
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, buffer).unwrap();
    let mut listener = Listener::new();
    while exploration.places() < PLACES || !listener.replica().is_converged() || listener.map() != map(&exploration) {
        exploration.advance();
        let said = &exploration.board().sent;
        listener.feed(said, |_, _| ());
        say(said);
    }
    exploration
}

fn map(exploration: &Exploration<'_>) -> TopologicalMap {
    TopologicalMap::of(exploration.robot().mapper().filter())
}
