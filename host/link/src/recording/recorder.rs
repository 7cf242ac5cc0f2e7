//! Writes a recording while the line is received.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use foxglove::messages::{Log, log::Level};
use toposlam::FaultKind;
use toposlam::wire::{Arrival, Message};

use super::RecordingError;
use super::drawing::Drawing;
use super::scene::{scan, timestamp};
use super::topics::{Topic, Topics};
use crate::json;
use crate::listener::{Event, Listener};

/// Maximum length of a frame; a longer run without a terminator is written in pieces.
const PIECE_BYTES: usize = 256;

const FAULT_KINDS: usize = FaultKind::ALL.len();

/// Writes a robot's stream to an MCAP file.
///
/// The file consists of chunks of up to 256 KiB or five seconds. Each complete chunk is written at once, so all earlier
/// data stay readable after a crash. Memory: one chunk, and some hundred bytes per written chunk for the index at the
/// end of the file.
pub struct Recorder<FILE: Write> {
    notes: Notes<FILE>,
    listener: Listener,
    /// The incomplete frame.
    piece: Vec<u8>,
    newest_ns: u64,
    summary: Summary,
}

/// Counts of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Number of frames, damaged ones included.
    pub frames: u32,
    /// Number of bytes of these frames.
    pub bytes: u64,
    /// Number of places that the robot detected during the recording.
    pub places: u32,
}

impl Recorder<BufWriter<File>> {
    /// Creates a new file.
    ///
    /// # Errors
    /// If the file exists or cannot be written.
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        Self::new(BufWriter::new(File::create_new(path)?))
    }
}

impl<FILE: Write> Recorder<FILE> {
    /// Writes to an open file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn new(file: FILE) -> Result<Self, RecordingError> {
        Ok(Self {
            notes: Notes { topics: Topics::create(file)?, drawing: Drawing::default(), faults: [0; FAULT_KINDS] },
            listener: Listener::new(),
            piece: Vec::with_capacity(PIECE_BYTES),
            newest_ns: 0,
            summary: Summary::default(),
        })
    }

    /// Records bytes in pieces of any length. `time_ns` is their time of arrival in nanoseconds since 1970 and should
    /// not decrease. A frame is written when its last byte arrives, with the time of that byte.
    ///
    /// # Errors
    /// If the file cannot be written. It then ends with the last complete chunk.
    pub fn record(&mut self, bytes: &[u8], time_ns: u64) -> Result<(), RecordingError> {
        self.newest_ns = time_ns;
        for &byte in bytes {
            self.piece.push(byte);
            if byte == 0 || self.piece.len() == PIECE_BYTES {
                self.take_in(time_ns)?;
            }
        }
        if self.notes.drawing.is_due(time_ns) { self.notes.draw(&self.listener, time_ns) } else { Ok(()) }
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

    /// The state of the robot so far.
    pub const fn listener(&self) -> &Listener {
        &self.listener
    }

    /// The counts so far.
    pub const fn summary(&self) -> Summary {
        self.summary
    }

    /// Writes the remaining data and the index, which lets viewers open the file quickly.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> Result<Summary, RecordingError> {
        let time_ns = self.newest_ns;
        if !self.piece.is_empty() {
            self.take_in(time_ns)?;
        }
        self.notes.draw(&self.listener, time_ns)?;
        self.notes.topics.finish()?;
        Ok(self.summary)
    }
}

/// State of the topics beside the frames.
struct Notes<FILE: Write> {
    topics: Topics<FILE>,
    drawing: Drawing,
    /// The newest count of each kind of fault.
    faults: [u32; FAULT_KINDS],
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
        self.drawing.layout.apply(header, message);
        if let Message::Fault { kind, count } = message { self.fault(*kind, *count, time_ns) } else { Ok(()) }
    }

    /// The robot repeats its counts; only an increase is logged.
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
        let Some(scene) = self.drawing.scene(listener, time_ns) else { return Ok(()) };
        self.topics.message(Topic::Map, time_ns, 0, &scene.update(time_ns))?;
        self.topics.message(Topic::Vertices, time_ns, 0, &scene.vertices(time_ns))?;
        self.topics.message(Topic::Transform, time_ns, 0, &scene.transform(time_ns))
    }
}
