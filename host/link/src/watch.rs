//! State of the robot on a link and a layout of its map: the model of every live view.
//!
//! ```
//! use toposlam::wire::{Encoder, MAX_FRAME_BYTES, Message};
//! use toposlam_link::{link::LinkEvent, listener::Listener, watch::Watch};
//!
//! let mut watch = Watch::new("tcp:robot:7070");
//! let (mut listener, mut frame) = (Listener::new(), [0; MAX_FRAME_BYTES]);
//! let edge = Message::Edge { a: 0, b: 1, present: true };
//! listener.feed(Encoder::new(0).encode(&edge, &mut frame)?, |listener, event| watch.apply(LinkEvent::received(listener, event)));
//! watch.arrange();
//! assert_eq!((watch.map().edges.as_slice(), watch.points().len()), ([(0, 1)].as_slice(), 2));
//! # Ok::<(), toposlam::wire::EncodeError>(())
//! ```

use crate::layout::{Layout, Point};
use crate::link::LinkEvent;
use crate::listener::Listener;
use crate::topology::TopologicalMap;

/// State of the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Connection {
    /// Opening for the first time.
    Opening,
    /// Open.
    Open,
    /// Closed for this reason; the link retries.
    Lost(String),
    /// The standard input has ended.
    Ended,
}

/// Processes the events of a link, and keeps the layout of the map.
#[derive(Clone, Debug)]
pub struct Watch {
    line: String,
    connection: Connection,
    listener: Listener,
    map: TopologicalMap,
    layout: Layout,
}

impl Watch {
    /// A watch of the named line that has received nothing.
    pub fn new(line: &str) -> Self {
        Self {
            line: line.to_owned(),
            connection: Connection::Opening,
            listener: Listener::new(),
            map: TopologicalMap::default(),
            layout: Layout::new(),
        }
    }

    /// Processes one event of the link.
    pub fn apply(&mut self, event: LinkEvent) {
        match event {
            LinkEvent::Connected => self.connection = Connection::Open,
            LinkEvent::Disconnected(reason) => self.connection = Connection::Lost(reason),
            LinkEvent::Ended => self.connection = Connection::Ended,
            LinkEvent::Received(event, listener) => {
                if let Ok((header, message)) = &event {
                    self.layout.apply(*header, message);
                }
                self.listener = *listener;
            }
            LinkEvent::TaskDone(..) => {}
        }
    }

    /// Updates the map and gives each vertex a position. Call it before drawing.
    pub fn arrange(&mut self) {
        self.map = self.listener.map();
        self.layout.arrange(&self.map);
    }

    /// Name of the line; `-` is the standard input.
    pub fn line(&self) -> &str {
        &self.line
    }

    /// State of the line.
    pub const fn connection(&self) -> &Connection {
        &self.connection
    }

    /// State of the robot.
    pub const fn listener(&self) -> &Listener {
        &self.listener
    }

    /// The map as of the last arrangement.
    pub const fn map(&self) -> &TopologicalMap {
        &self.map
    }

    /// The drawing of the map as of the last arrangement.
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The position of every vertex of the map.
    pub fn points(&self) -> &[Point] {
        self.layout.points()
    }
}
