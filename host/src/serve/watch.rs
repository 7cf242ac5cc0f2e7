//! The newest state of a robot on a link.

use serde_json::{Value, json};
use toposlam::wire::{Arrival, Message};

use super::state::{self, State};
use crate::layout::Layout;
use crate::listener::Listener;
use crate::monitor::link::News;
use crate::monitor::model::Connection;

/// Takes in the news of a link, and keeps the picture of the map.
#[derive(Clone, Debug)]
pub struct Watch {
    line: String,
    connection: Connection,
    listener: Listener,
    layout: Layout,
}

impl Watch {
    /// A watch of a line of that name that has heard nothing.
    pub fn new(line: &str) -> Self {
        Self {
            line: line.to_owned(),
            connection: Connection::Opening,
            listener: Listener::new(),
            layout: Layout::new(),
        }
    }

    /// Takes in what happened on the link.
    pub fn hear(&mut self, news: News) {
        match news {
            News::Connected => self.connection = Connection::Open,
            News::Disconnected(reason) => self.connection = Connection::Cut(reason),
            News::Ended => self.connection = Connection::Ended,
            News::Heard(Ok((header, message)), listener) => {
                if header.arrival == Arrival::Restart {
                    self.layout = Layout::new();
                }
                if let Message::Renamed(renamed) = &message
                    && header.arrival != Arrival::Late
                {
                    self.layout.rename(renamed);
                }
                self.listener = *listener;
            }
            News::Heard(Err(_), listener) => self.listener = *listener,
            News::Answered(..) => {}
        }
    }

    /// All that is known: that of [`state`], and in its map `line`, the line's name, and `connection`. Arranges the map.
    pub fn state(&mut self) -> State {
        self.layout.arrange(&self.listener.map());
        let mut map = state::map(&self.listener, &self.layout);
        map["line"] = self.line.as_str().into();
        map["connection"] = self.connection();
        State { map, live: state::live(&self.listener) }
    }

    fn connection(&self) -> Value {
        match &self.connection {
            Connection::Opening => json!({"state": "opening"}),
            Connection::Open => json!({"state": "open"}),
            Connection::Cut(reason) => json!({"state": "cut", "reason": reason}),
            Connection::Ended => json!({"state": "ended"}),
        }
    }
}
