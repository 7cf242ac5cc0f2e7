//! Reads a recording from its beginning, finished or truncated.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};
use prost::Message;

use super::{RecordingError, Topic};

/// Maximum length of a record, which bounds the memory; a longer one is damage.
const RECORD_BYTES: usize = 1 << 24;
const READ_BYTES: usize = 1 << 16;

/// A recorded frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimedFrame {
    /// Time of arrival of its last byte, in nanoseconds since 1970.
    pub time_ns: u64,
    /// The received bytes, up to and including the terminating zero.
    pub bytes: Vec<u8>,
}

/// Iterator over the frames of a recording, in order of arrival.
///
/// A truncated file yields its remaining frames and ends; [`Recording::is_cut`] is then true. Damage within the file is
/// an error, and the last item. Memory: some 100 KiB for a file of any length.
pub struct Recording<FILE> {
    file: FILE,
    reader: LinearReader,
    channel: Option<u16>,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Reading,
    Whole,
    Cut,
    Failed,
}

impl Recording<BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// If the file does not exist or cannot be read.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Ok(Self::new(BufReader::new(File::open(path)?)))
    }
}

impl<FILE: Read> Recording<FILE> {
    /// Reads an open file.
    pub fn new(file: FILE) -> Self {
        let options =
            LinearReaderOptions::default().with_validate_chunk_crcs(true).with_record_length_limit(RECORD_BYTES);
        Self { file, reader: LinearReader::new_with_options(options), channel: None, state: State::Reading }
    }

    /// Whether the file is truncated, for example because its recording was killed. Valid after the last frame.
    pub const fn is_cut(&self) -> bool {
        matches!(self.state, State::Cut)
    }

    /// The next frame, or `None` at the end of the file.
    fn advance(&mut self) -> Result<Option<TimedFrame>, RecordingError> {
        loop {
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => {
                    let count = read(&mut self.file, self.reader.insert(bytes.min(READ_BYTES)))?;
                    self.reader.notify_read(count);
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => match parse_record(opcode, data)? {
                    Record::Channel(channel) if channel.topic == Topic::Frames.name() => {
                        self.channel = Some(channel.id);
                    }
                    Record::Message { header, data } if Some(header.channel_id) == self.channel => {
                        let Ok(bytes) = Vec::<u8>::decode(&*data) else { return Err(RecordingError::NoFrames) };
                        return Ok(Some(TimedFrame { time_ns: header.log_time, bytes }));
                    }
                    _ => {}
                },
                Some(Err(error)) => return Err(error.into()),
            }
        }
    }
}

fn read(file: &mut impl Read, buffer: &mut [u8]) -> Result<usize, RecordingError> {
    loop {
        match file.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            result => return Ok(result?),
        }
    }
}

impl<FILE: Read> Iterator for Recording<FILE> {
    type Item = Result<TimedFrame, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.state != State::Reading {
            return None;
        }
        match self.advance() {
            Ok(Some(frame)) => Some(Ok(frame)),
            Ok(None) if self.channel.is_some() => {
                self.state = State::Whole;
                None
            }
            Err(RecordingError::Mcap(McapError::UnexpectedEof)) => {
                self.state = State::Cut;
                None
            }
            failed => {
                self.state = State::Failed;
                Some(Err(failed.err().unwrap_or(RecordingError::NoFrames)))
            }
        }
    }
}
