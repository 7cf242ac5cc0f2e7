//! The session with a Zenoh router.
//!
//! A put of Zenoh blocks while the router does not read, and reports no loss. So the messages wait in a queue of this program, and a
//! thread puts them.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, channel, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use zenoh::liveliness::LivelinessToken;
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::{Config, Result, Session, Wait};

use super::{Broker, BrokerEvent, Options, Outlet, QUEUE_MESSAGES, RETRY, Reports, Shared};

/// How often the thread looks whether the router is connected.
const POLL: Duration = Duration::from_millis(100);

/// A message in the queue.
enum Item {
    Put(String, Vec<u8>),
    End,
}

impl Outlet for SyncSender<Item> {
    fn queue(&self, topic: &str, payload: Vec<u8>, _: bool) -> bool {
        self.try_send(Item::Put(topic.to_owned(), payload)).is_ok()
    }

    fn end(&self) -> bool {
        self.try_send(Item::End).is_ok()
    }
}

/// Starts the thread of the session. It sends when it ends.
pub(super) fn start(
    options: Options,
    shared: Arc<Shared>,
    on_event: impl FnMut(BrokerEvent) + Send + 'static,
) -> (Box<dyn Outlet>, Receiver<()>) {
    let (outlet, items) = sync_channel(QUEUE_MESSAGES);
    let (sender, ended) = channel();
    let queue = outlet.clone();
    thread::spawn(move || {
        let mut reports = Reports::new(on_event);
        while !shared.is_ending() {
            match Connection::open(&options.broker, &shared) {
                Ok(connection) => {
                    connection.serve(&items, &queue, &shared, &mut reports);
                    break;
                }
                Err(error) => {
                    reports.disconnected(error.to_string());
                    thread::sleep(RETRY);
                }
            }
        }
        // The receiver may already be gone.
        let _ = sender.send(());
    });
    (Box::new(outlet), ended)
}

/// A session that was opened. It connects again by itself when the router restarts.
struct Connection {
    session: Session,
    /// Answers queries for the status and the map.
    _answers: [Queryable<()>; 2],
    /// Disappears with this program.
    _token: LivelinessToken,
}

impl Connection {
    fn open(broker: &Broker, shared: &Arc<Shared>) -> Result<Self> {
        let session = zenoh::open(config(broker)?).wait()?;
        let answers = [answer(&session, shared, true)?, answer(&session, shared, false)?];
        let token = session.liveliness().declare_token(shared.topics.status.clone()).wait()?;
        Ok(Self { session, _answers: answers, _token: token })
    }

    /// Puts what is queued until the publisher ends.
    fn serve(
        self,
        items: &Receiver<Item>,
        outlet: &SyncSender<Item>,
        shared: &Shared,
        reports: &mut Reports<impl FnMut(BrokerEvent)>,
    ) {
        let mut next_poll = Instant::now();
        loop {
            if Instant::now() >= next_poll {
                next_poll = Instant::now() + POLL;
                self.report(outlet, shared, reports);
            }
            match items.recv_timeout(POLL) {
                Ok(Item::Put(topic, payload)) => {
                    // Fails only when the session is closed.
                    let _ = self.session.put(topic, payload).congestion_control(CongestionControl::Block).wait();
                }
                Err(RecvTimeoutError::Timeout) if !shared.is_ending() => {}
                Ok(Item::End) | Err(_) => break,
            }
        }
        let _ = self.session.close().wait();
    }

    /// Reports a router that came or went.
    fn report(&self, outlet: &SyncSender<Item>, shared: &Shared, reports: &mut Reports<impl FnMut(BrokerEvent)>) {
        let is_connected = self.session.info().routers_zid().wait().next().is_some();
        if is_connected && !shared.is_connected() {
            shared.connected(outlet);
            reports.connected();
        } else if !is_connected {
            shared.disconnected();
            reports.disconnected("the router is gone".to_owned());
        }
    }
}

/// A client of one router, which searches for no other.
fn config(broker: &Broker) -> Result<Config> {
    let host = &broker.host;
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"client\"".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("connect/endpoints", format!("[{:?}]", format!("tcp/{host}:{}", broker.port))),
        ("connect/timeout_ms", "0".to_owned()),
    ] {
        config.insert_json5(key, &value)?;
    }
    Ok(config)
}

/// Answers queries for the newest status or map.
fn answer(session: &Session, shared: &Arc<Shared>, is_status: bool) -> Result<Queryable<()>> {
    let key = if is_status { &shared.topics.status } else { &shared.topics.map }.clone();
    let (reply_key, shared) = (key.clone(), Arc::clone(shared));
    let reply = move |query: Query| {
        let newest = {
            let retained = shared.retained();
            if is_status { Some(retained.status.to_owned()) } else { retained.map.clone() }
        };
        if let Some(newest) = newest {
            // The one who asked may be gone.
            let _ = query.reply(&reply_key, newest).wait();
        }
    };
    session.declare_queryable(key).callback(reply).wait()
}
