//! Writing a recording while the line is listened to.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use foxglove::messages::{Log, log::Level};
use toposlam::FaultKind;
use toposlam::wire::{Arrival, Message};

use super::RecordingError;
use super::scene::{Scene, scan, timestamp};
use super::topics::{Topic, Topics};
use crate::json;
use crate::layout::Layout;
use crate::listener::{Event, Listener};
use crate::topology::TopologicalMap;

/// What has no end after this many bytes is no frame; it is written in pieces.
const PIECE_BYTES: usize = 256;
/// The map is drawn so often at most.
const DRAWING_PERIOD_NS: u64 = 100_000_000;

const FAULT_KINDS: usize = FaultKind::ALL.len();

/// Writes what a robot says into an MCAP file.
///
/// The file is kept in chunks of up to 256 KiB or five seconds, and each goes to the file as soon as it is whole: what was
/// recorded before is readable whatever happens. Memory: a chunk, and some hundred bytes for each chunk that was
/// written, for the index at the end of the file.
pub struct Recorder<FILE: Write> {
    notes: Notes<FILE>,
    listener: Listener,
    /// The frame that is not complete yet.
    piece: Vec<u8>,
    newest_ns: u64,
    summary: Summary,
}

/// What a recording holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Frames, damaged ones included.
    pub frames: u32,
    /// Bytes of these frames.
    pub bytes: u64,
    /// Places that the robot found meanwhile.
    pub places: u32,
}

impl Recorder<BufWriter<File>> {
    /// Makes a file that does not exist yet.
    ///
    /// # Errors
    /// When the file exists or cannot be written.
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        Self::new(BufWriter::new(File::create_new(path)?))
    }
}

impl<FILE: Write> Recorder<FILE> {
    /// Writes to a file that is open.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn new(file: FILE) -> Result<Self, RecordingError> {
        Ok(Self {
            notes: Notes {
                topics: Topics::create(file)?,
                layout: Layout::new(),
                drawn: None,
                faults: [0; FAULT_KINDS],
            },
            listener: Listener::new(),
            piece: Vec::with_capacity(PIECE_BYTES),
            newest_ns: 0,
            summary: Summary::default(),
        })
    }

    /// Takes bytes as the line delivers them, in pieces of any length. `time_ns` is when they came, in nanoseconds since
    /// 1970, and should not run backwards. A frame is written when its last byte has come, with the time of that.
    ///
    /// # Errors
    /// When the file cannot be written. It then ends with the last chunk that was whole.
    pub fn hear(&mut self, bytes: &[u8], time_ns: u64) -> Result<(), RecordingError> {
        self.newest_ns = time_ns;
        for &byte in bytes {
            self.piece.push(byte);
            if byte == 0 || self.piece.len() == PIECE_BYTES {
                self.take_in(time_ns)?;
            }
        }
        self.notes.draw(&self.listener, time_ns)
    }

    fn take_in(&mut self, time_ns: u64) -> Result<(), RecordingError> {
        let Self { notes, listener, piece, summary, newest_ns: _ } = self;
        notes.topics.frame(time_ns, summary.frames, piece)?;
        summary.frames = summary.frames.wrapping_add(1);
        summary.bytes += piece.len() as u64;
        let mut written = Ok(());
        listener.feed(piece, |_, event| {
            summary.places += u32::from(matches!(event, Event::Message(_, Message::Place { .. })));
            if written.is_ok() {
                written = notes.note(event, time_ns);
            }
        });
        piece.clear();
        written
    }

    /// What was heard so far.
    pub const fn listener(&self) -> &Listener {
        &self.listener
    }

    /// What was recorded so far.
    pub const fn summary(&self) -> Summary {
        self.summary
    }

    /// Writes what is left and the index, which makes the file quick to open.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn finish(mut self) -> Result<Summary, RecordingError> {
        let time_ns = self.newest_ns;
        if !self.piece.is_empty() {
            self.take_in(time_ns)?;
        }
        self.notes.redraw(&self.listener, time_ns)?;
        self.notes.topics.finish()?;
        Ok(self.summary)
    }
}

/// What is written beside the frames.
struct Notes<FILE: Write> {
    topics: Topics<FILE>,
    layout: Layout,
    drawn: Option<Drawn>,
    /// The newest count of each kind of fault.
    faults: [u32; FAULT_KINDS],
}

/// The map as it was drawn last.
struct Drawn {
    map: TopologicalMap,
    robot: Option<u8>,
    time_ns: u64,
}

impl<FILE: Write> Notes<FILE> {
    fn note(&mut self, event: Event<'_>, time_ns: u64) -> Result<(), RecordingError> {
        let Event::Message(header, message) = event else {
            return self.topics.event(time_ns, 0, &json::event(event));
        };
        if let Message::Ring { frame_index, echoes } = message {
            return self.topics.message(Topic::Ring, time_ns, *frame_index, &scan(echoes, time_ns));
        }
        self.topics.event(time_ns, header.sequence.into(), &json::event(event))?;
        if header.arrival == Arrival::Late {
            return Ok(());
        }
        if header.arrival == Arrival::Restart {
            self.faults = [0; FAULT_KINDS];
        }
        self.layout.hear(header, message);
        if let Message::Fault { kind, count } = message { self.fault(*kind, *count, time_ns) } else { Ok(()) }
    }

    /// The robot repeats its counts; only one that has grown is told.
    fn fault(&mut self, kind: u8, count: u32, time_ns: u64) -> Result<(), RecordingError> {
        let known = self.faults.get_mut(usize::from(kind));
        if known.as_deref() == Some(&count) {
            return Ok(());
        }
        if let Some(known) = known {
            *known = count;
        }
        let name = FaultKind::ALL.get(usize::from(kind)).map_or(format!("fault {kind}"), |kind| format!("{kind:?}"));
        let log = Log {
            timestamp: Some(timestamp(time_ns)),
            level: Level::Warning.into(),
            message: format!("{name}: {count} so far"),
            name: "robot".to_owned(),
            ..Default::default()
        };
        self.topics.message(Topic::Log, time_ns, kind.into(), &log)
    }

    fn draw(&mut self, listener: &Listener, time_ns: u64) -> Result<(), RecordingError> {
        let is_soon = |drawn: &Drawn| time_ns.saturating_sub(drawn.time_ns) < DRAWING_PERIOD_NS;
        if self.drawn.as_ref().is_some_and(is_soon) { Ok(()) } else { self.redraw(listener, time_ns) }
    }

    fn redraw(&mut self, listener: &Listener, time_ns: u64) -> Result<(), RecordingError> {
        let map = listener.map();
        let robot = listener.replica().location().map(|location| location.vertex);
        if self.drawn.as_ref().is_some_and(|drawn| drawn.map == map && drawn.robot == robot) {
            return Ok(());
        }
        self.layout.arrange(&map);
        let scene = Scene { map: &map, points: self.layout.points(), robot };
        self.topics.message(Topic::Map, time_ns, 0, &scene.update(time_ns))?;
        self.topics.message(Topic::Vertices, time_ns, 0, &scene.vertices(time_ns))?;
        self.topics.message(Topic::Transform, time_ns, 0, &scene.transform(time_ns))?;
        self.drawn = Some(Drawn { map, robot, time_ns });
        Ok(())
    }
}
