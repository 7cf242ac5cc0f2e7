//! Publishes a robot's messages to an MQTT broker (feature `mqtt`) or through a Zenoh router (feature `zenoh`). Subscribers cannot send
//! commands.
//!
//! | Topic | Holds | Retained | QoS |
//! |---|---|---|---|
//! | `toposlam/NAME/status` | `online` or `offline`: whether the robot is connected; the last will is `offline` | yes | 1 |
//! | `toposlam/NAME/map` | the whole map as [`map_json`], after each change, once its digest matches the robot's | yes | 1 |
//! | `toposlam/NAME/events` | each message and decoding error as [`json::event`] | no | 0 |
//! | `toposlam/NAME/frames` | each message as the frame it came in, if [`Options::frames`] is set | no | 0 |
//!
//! Zenoh has no retained messages and no last will. There the publisher answers queries for status and map, and holds a liveliness token
//! with the key of the status.
//!
//! The broker never delays the robot's line: messages that exceed a bounded queue, or arrive while the broker is
//! disconnected, are dropped and counted. Status and map are published again after a reconnection.
//!
//! ```
//! use toposlam_cli::publish::{Broker, Options, Publisher};
//!
//! let broker: Broker = "mqtt://127.0.0.1:1".parse()?;
//! if let Ok(options) = Options::new(broker, "kitchen") {
//!     // No broker listens there; the publisher keeps trying.
//!     let publisher = Publisher::start(options, |_| ());
//!     assert_eq!(publisher.counters().published, 0);
//! }
//! assert!("http://127.0.0.1".parse::<Broker>().is_err());
//! # Ok::<(), toposlam_cli::publish::OptionError>(())
//! ```

mod broker;
#[cfg(feature = "mqtt")]
mod mqtt;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::{Value, json};
use toposlam::wire::{Encoder, MAX_FRAME_BYTES, Message};

pub use broker::{Broker, OptionError, Options, Protocol};

use toposlam_link::json;
use toposlam_link::link::LinkEvent;
use toposlam_link::listener::{Event, Listener};

/// Maximum number of queued messages.
const QUEUE_MESSAGES: usize = 256;
/// Delay before the next attempt to connect.
const RETRY: Duration = Duration::from_millis(500);
/// Timeout of the disconnection.
const FAREWELL: Duration = Duration::from_secs(1);

/// An event of the connection to the broker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BrokerEvent {
    /// The broker has accepted the connection.
    Connected,
    /// The connection failed. The publisher retries; a repeated failure for the same reason is not reported.
    Disconnected(String),
}

/// Counts of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Messages handed to the connection, maps and statuses included.
    pub published: u64,
    /// Events and frames that were dropped because the broker was disconnected or too slow.
    pub dropped: u64,
}

/// Publishes a robot's messages to a broker. Dropping it sets the robot's status to `offline`.
pub struct Publisher {
    outlet: Box<dyn Outlet>,
    shared: Arc<Shared>,
    frames: bool,
    ended: Receiver<()>,
}

/// The bounded queue of a connection to a broker. Both methods return at once, `false` if the queue is full.
trait Outlet: Send {
    /// Queues a message. A retained one is delivered to later subscribers, too.
    fn queue(&self, topic: &str, payload: Vec<u8>, is_retained: bool) -> bool;
    /// Ends the connection after the queued messages.
    fn end(&self) -> bool;
}

/// State shared by the publisher and the broker's thread.
struct Shared {
    topics: Topics,
    /// Locked while its content is queued, so that the newest is queued last.
    retained: Mutex<Retained>,
    is_connected: AtomicBool,
    is_ending: AtomicBool,
    published: AtomicU64,
    dropped: AtomicU64,
}

struct Topics {
    status: String,
    map: String,
    events: String,
    frames: String,
}

/// Retained messages, and whether they must be published.
struct Retained {
    status: &'static str,
    status_due: bool,
    map: Option<String>,
    map_due: bool,
}

const ONLINE: &str = "online";
const OFFLINE: &str = "offline";

impl Publisher {
    /// Starts a thread that connects to the broker and reports through `on_event`.
    pub fn start(options: Options, on_event: impl FnMut(BrokerEvent) + Send + 'static) -> Self {
        let topic = |what| format!("toposlam/{}/{what}", options.robot);
        let topics =
            Topics { status: topic("status"), map: topic("map"), events: topic("events"), frames: topic("frames") };
        let shared = Arc::new(Shared {
            topics,
            retained: Mutex::new(Retained { status: OFFLINE, status_due: true, map: None, map_due: false }),
            is_connected: AtomicBool::new(false),
            is_ending: AtomicBool::new(false),
            published: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
        });
        let frames = options.frames;
        let (outlet, ended): (Box<dyn Outlet>, _) = match options.broker.protocol {
            #[cfg(feature = "mqtt")]
            Protocol::Mqtt => mqtt::start(options, Arc::clone(&shared), on_event),
            #[cfg(feature = "zenoh")]
            Protocol::Zenoh => zenoh::start(options, Arc::clone(&shared), on_event),
            #[allow(unreachable_patterns)]
            _ => unreachable!("options are refused if their protocol is not built"),
        };
        Self { outlet, shared, frames, ended }
    }

    /// Processes an event of the robot's link. Never blocks.
    pub fn apply(&mut self, event: &LinkEvent) {
        let mut retained = self.shared.retained();
        match event {
            LinkEvent::Connected => retained.set_status(ONLINE),
            LinkEvent::Disconnected(_) | LinkEvent::Ended => retained.set_status(OFFLINE),
            LinkEvent::Received(event, listener) => {
                let event = Event::from(event);
                if changes_map(event) && listener.replica().is_converged() {
                    retained.set_map(map_json(listener).to_string());
                }
                self.shared.offer(&*self.outlet, &self.shared.topics.events, json::event(event).to_string());
                if let (true, Event::Message(header, message)) = (self.frames, event) {
                    let mut buffer = [0; MAX_FRAME_BYTES];
                    // A buffer of this size is always sufficient.
                    let frame = Encoder::new(header.sequence).encode(message, &mut buffer).unwrap_or(&[]);
                    self.shared.offer(&*self.outlet, &self.shared.topics.frames, frame);
                }
            }
            LinkEvent::TaskDone(..) => {}
        }
        self.shared.settle(&*self.outlet, &mut retained);
    }

    /// The counts so far.
    pub fn counters(&self) -> Counters {
        Counters {
            published: self.shared.published.load(Ordering::Relaxed),
            dropped: self.shared.dropped.load(Ordering::Relaxed),
        }
    }
}

impl Drop for Publisher {
    fn drop(&mut self) {
        let mut retained = self.shared.retained();
        retained.set_status(OFFLINE);
        self.shared.settle(&*self.outlet, &mut retained);
        drop(retained);
        self.shared.is_ending.store(true, Ordering::Relaxed);
        // If the queue is full, the broker publishes the last will instead.
        if self.outlet.end() && self.shared.is_connected() {
            let _ = self.ended.recv_timeout(FAREWELL);
        }
    }
}

impl Retained {
    fn set_status(&mut self, status: &'static str) {
        self.status_due |= self.status != status;
        self.status = status;
    }

    fn set_map(&mut self, map: String) {
        if self.map.as_ref() != Some(&map) {
            self.map = Some(map);
            self.map_due = true;
        }
    }
}

impl Shared {
    fn retained(&self) -> std::sync::MutexGuard<'_, Retained> {
        // Ignores poisoning: the content is always consistent.
        self.retained.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The broker accepted the connection. A new or restarted broker has no retained messages.
    fn connected(&self, outlet: &dyn Outlet) {
        let mut retained = self.retained();
        (retained.status_due, retained.map_due) = (true, true);
        self.is_connected.store(true, Ordering::Relaxed);
        self.settle(outlet, &mut retained);
    }

    fn disconnected(&self) {
        self.is_connected.store(false, Ordering::Relaxed);
    }

    fn is_ending(&self) -> bool {
        self.is_ending.load(Ordering::Relaxed)
    }

    fn is_connected(&self) -> bool {
        self.is_connected.load(Ordering::Relaxed)
    }

    /// Queues a message that may be dropped.
    fn offer(&self, outlet: &dyn Outlet, topic: &str, payload: impl Into<Vec<u8>>) {
        let is_queued = self.is_connected() && outlet.queue(topic, payload.into(), false);
        let count = if is_queued { &self.published } else { &self.dropped };
        count.fetch_add(1, Ordering::Relaxed);
    }

    /// Queues retained messages that the broker does not have yet. If the queue is full, the next event retries.
    fn settle(&self, outlet: &dyn Outlet, retained: &mut Retained) {
        if !self.is_connected() {
            return;
        }
        let queue = |topic: &str, payload: &str| {
            let is_queued = outlet.queue(topic, payload.into(), true);
            self.published.fetch_add(u64::from(is_queued), Ordering::Relaxed);
            !is_queued
        };
        retained.status_due = retained.status_due && queue(&self.topics.status, retained.status);
        if let (true, Some(map)) = (retained.map_due, &retained.map) {
            retained.map_due = queue(&self.topics.map, map);
        }
    }
}

/// Reports the state of a connection, a repeated failure for the same reason once.
struct Reports<F> {
    on_event: F,
    last_reason: String,
}

impl<F: FnMut(BrokerEvent)> Reports<F> {
    fn new(on_event: F) -> Self {
        Self { on_event, last_reason: String::new() }
    }

    fn connected(&mut self) {
        self.last_reason.clear();
        (self.on_event)(BrokerEvent::Connected);
    }

    fn disconnected(&mut self, reason: String) {
        if reason != self.last_reason {
            (self.on_event)(BrokerEvent::Disconnected(reason.clone()));
            self.last_reason = reason;
        }
    }
}

fn changes_map(event: Event<'_>) -> bool {
    matches!(
        event,
        Event::Message(
            _,
            Message::Map { .. }
                | Message::Vertex { .. }
                | Message::Edge { .. }
                | Message::Row(_)
                | Message::Ways(_)
                | Message::Exploration(_)
                | Message::Location(_)
                | Message::Remapped(_)
                | Message::Name { .. }
                | Message::Named { .. }
        )
    )
}

/// A map as JSON: `vertices`, each with `vertex`, `radius_mm`, `visits` and, if it has one, its `name`; `edges`, each a pair of vertices;
/// `location`, `null` or the robot's `vertex` and the `place_index` of its last place; `digest`, the robot's digest of the map;
/// and if the robot knows ways `ways`, those of each vertex with the fields of `docs/wire.md`, and `exploration`, its `frontiers`
/// and whether it is `complete`.
pub fn map_json(listener: &Listener) -> Value {
    let map = listener.map();
    let vertices: Vec<Value> = (0_u8..)
        .zip(&map.vertices)
        .map(|(vertex, label)| {
            let mut object = json!({"vertex": vertex, "radius_mm": label.radius_mm, "visits": label.visits});
            if let Some(name) = map.names.get(&vertex) {
                object["name"] = json!(name);
            }
            object
        })
        .collect();
    let location = listener
        .replica()
        .location()
        .map(|location| json!({"vertex": location.vertex, "place_index": location.place_index}));
    let mut object = json!({"vertices": vertices, "edges": map.edges, "location": location, "digest": map.digest()});
    if !map.ways.is_empty() {
        object["ways"] = json!(map.ways);
        object["exploration"] = json!(listener.replica().exploration());
    }
    object
}
