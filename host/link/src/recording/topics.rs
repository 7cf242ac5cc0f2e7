//! The topics of a recording: their names, their schemas, and the output file.

use std::{collections::BTreeMap, io::Write};

use foxglove::messages::{FrameTransform, LaserScan, Log, PosesInFrame, SceneUpdate};
use foxglove::{Encode, Schema};
use mcap::{WriteOptions, Writer, records::MessageHeader, write::NoSeek};
use prost::Message;
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, field_descriptor_proto,
};
use serde_json::Value;

use super::RecordingError;

/// Maximum duration of a chunk: a killed recording loses no more than this.
const CHUNK_NS: u64 = 5_000_000_000;
/// Maximum size of a chunk, which is buffered in memory until it is complete.
const CHUNK_BYTES: u64 = 1 << 18;

/// A topic of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// Frames as received.
    Frames,
    /// Ranges of the sonar ring.
    Ring,
    /// The map as a scene.
    Map,
    /// Positions of the map's vertices.
    Vertices,
    /// The robot's position in the map.
    Transform,
    /// All messages except ring frames.
    Events,
    /// Faults.
    Log,
}

impl Topic {
    /// All topics.
    pub const ALL: [Self; 7] =
        [Self::Frames, Self::Ring, Self::Map, Self::Vertices, Self::Transform, Self::Events, Self::Log];

    /// The name of the topic in the file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frames => "/toposlam/frames",
            Self::Ring => "/toposlam/ring",
            Self::Map => "/toposlam/map",
            Self::Vertices => "/toposlam/vertices",
            Self::Transform => "/toposlam/transform",
            Self::Events => "/toposlam/events",
            Self::Log => "/toposlam/log",
        }
    }

    fn schema(self) -> Option<Schema> {
        match self {
            Self::Frames => Some(Schema::new("toposlam.Frame", "protobuf", frame_descriptor())),
            Self::Ring => LaserScan::get_schema(),
            Self::Map => SceneUpdate::get_schema(),
            Self::Vertices => PosesInFrame::get_schema(),
            Self::Transform => FrameTransform::get_schema(),
            Self::Events => {
                Some(Schema::new("toposlam.Event", "jsonschema", include_bytes!("event.schema.json").as_slice()))
            }
            Self::Log => Log::get_schema(),
        }
    }

    const fn message_encoding(self) -> &'static str {
        if matches!(self, Self::Events) { "json" } else { "protobuf" }
    }
}

/// `message Frame { bytes data = 1; }`, the message that `prost` derives for a `Vec<u8>`.
fn frame_descriptor() -> Vec<u8> {
    let data = FieldDescriptorProto {
        name: Some("data".to_owned()),
        number: Some(1),
        label: Some(field_descriptor_proto::Label::Optional.into()),
        r#type: Some(field_descriptor_proto::Type::Bytes.into()),
        ..Default::default()
    };
    let frame = DescriptorProto { name: Some("Frame".to_owned()), field: vec![data], ..Default::default() };
    let file = FileDescriptorProto {
        name: Some("toposlam/Frame.proto".to_owned()),
        package: Some("toposlam".to_owned()),
        message_type: vec![frame],
        syntax: Some("proto3".to_owned()),
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// The file, with a channel for each topic.
pub(super) struct Topics<FILE: Write> {
    file: Writer<NoSeek<FILE>>,
    channels: [u16; Topic::ALL.len()],
    chunk_began_ns: Option<u64>,
}

impl<FILE: Write> Topics<FILE> {
    pub(super) fn create(file: FILE) -> Result<Self, RecordingError> {
        // Without seeking, a complete chunk is written at once.
        let options = WriteOptions::new()
            .library(concat!("toposlam ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true);
        let mut file = options.create(NoSeek::new(file))?;
        let mut channels = [0; Topic::ALL.len()];
        for topic in Topic::ALL {
            let schema = match topic.schema() {
                Some(Schema { name, encoding, data }) => file.add_schema(&name, &encoding, &data)?,
                None => 0,
            };
            channels[topic as usize] =
                file.add_channel(schema, topic.name(), topic.message_encoding(), &BTreeMap::new())?;
        }
        Ok(Self { file, channels, chunk_began_ns: None })
    }

    pub(super) fn frame(&mut self, time_ns: u64, sequence: u32, bytes: &Vec<u8>) -> Result<(), RecordingError> {
        self.write(Topic::Frames, time_ns, sequence, &bytes.encode_to_vec())
    }

    pub(super) fn event(&mut self, time_ns: u64, sequence: u32, event: &Value) -> Result<(), RecordingError> {
        self.write(Topic::Events, time_ns, sequence, event.to_string().as_bytes())
    }

    pub(super) fn message(
        &mut self,
        topic: Topic,
        time_ns: u64,
        sequence: u32,
        message: &impl Message,
    ) -> Result<(), RecordingError> {
        self.write(topic, time_ns, sequence, &message.encode_to_vec())
    }

    fn write(&mut self, topic: Topic, time_ns: u64, sequence: u32, data: &[u8]) -> Result<(), RecordingError> {
        let began_ns = *self.chunk_began_ns.get_or_insert(time_ns);
        if time_ns.saturating_sub(began_ns) >= CHUNK_NS {
            self.file.flush()?;
            self.chunk_began_ns = Some(time_ns);
        }
        let header = MessageHeader {
            channel_id: self.channels[topic as usize],
            sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        Ok(self.file.write_to_known_channel(&header, data)?)
    }

    pub(super) fn finish(mut self) -> Result<(), RecordingError> {
        self.file.finish()?;
        Ok(self.file.into_inner().into_inner().flush()?)
    }
}
