//! The newest state, shared between the publisher and the waiting browsers.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::state::State;

/// The numbers of both parts that a browser received last; 0 means none.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    map: u64,
    live: u64,
}

/// The result of waiting for a new state.
pub(super) enum Change {
    /// The parts that the browser has not received yet.
    Parts { map: Option<Arc<str>>, live: Option<Arc<str>> },
    /// Timeout without a new state.
    Nothing,
    /// The server is shutting down.
    Closed,
}

pub(super) struct Newest {
    inner: Mutex<Inner>,
    changed: Condvar,
}

struct Inner {
    map: Part,
    live: Part,
    closed: bool,
}

struct Part {
    number: u64,
    text: Arc<str>,
}

impl Part {
    fn first(text: String) -> Self {
        Self { number: 1, text: text.into() }
    }

    fn replace(&mut self, text: String) -> bool {
        let differs = *self.text != *text;
        if differs {
            *self = Self { number: self.number + 1, text: text.into() };
        }
        differs
    }

    fn unless_seen(&self, seen: &mut u64) -> Option<Arc<str>> {
        let is_new = *seen != self.number;
        *seen = self.number;
        is_new.then(|| Arc::clone(&self.text))
    }
}

impl Newest {
    pub(super) fn new(state: &State) -> Self {
        let inner =
            Inner { map: Part::first(state.map.to_string()), live: Part::first(state.live.to_string()), closed: false };
        Self { inner: Mutex::new(inner), changed: Condvar::new() }
    }

    pub(super) fn publish(&self, state: &State) {
        let (map, live) = (state.map.to_string(), state.live.to_string());
        let mut inner = self.lock();
        let (map_differs, live_differs) = (inner.map.replace(map), inner.live.replace(live));
        if map_differs || live_differs {
            self.changed.notify_all();
        }
    }

    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    pub(super) fn is_closed(&self) -> bool {
        self.lock().closed
    }

    /// Both parts as one JSON object.
    pub(super) fn json(&self) -> String {
        let inner = self.lock();
        format!("{{\"map\":{},\"live\":{}}}", inner.map.text, inner.live.text)
    }

    /// Waits for a part that the browser has not received yet.
    pub(super) fn wait(&self, seen: &mut Seen, patience: Duration) -> Change {
        let is_old =
            |inner: &mut Inner| !inner.closed && inner.map.number == seen.map && inner.live.number == seen.live;
        let waited = self.changed.wait_timeout_while(self.lock(), patience, is_old);
        let (inner, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
        if inner.closed {
            return Change::Closed;
        }
        if timeout.timed_out() {
            return Change::Nothing;
        }
        Change::Parts { map: inner.map.unless_seen(&mut seen.map), live: inner.live.unless_seen(&mut seen.live) }
    }

    /// Ignores poisoning: no change can panic halfway, so the state is always consistent.
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
