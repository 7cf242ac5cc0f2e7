//! Recordings of a robot's line as ROS 2 bags: a folder with an MCAP file and its `metadata.yaml`.
//!
//! No part of ROS is needed to write them. `docs/ros2.md` lists the topics.

mod cdr;
mod messages;

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use mcap::{WriteOptions, Writer, records::MessageHeader, write::NoSeek};
use toposlam::wire::Message;

use super::drawing::Drawing;
use super::scene::Scene;
use super::{RecordingError, Summary};
use crate::export;
use crate::listener::{Event, Listener};

/// A topic, its message type and the definition of the type.
struct Topic {
    name: &'static str,
    message: &'static str,
    definition: &'static str,
}

const SCAN: usize = 0;
const MAP: usize = 1;
const ROUTE: usize = 2;
const TOPICS: [Topic; 3] = [
    Topic {
        name: "/toposlam/scan",
        message: "sensor_msgs/msg/LaserScan",
        definition: include_str!("definitions/LaserScan.msg"),
    },
    Topic {
        name: "/toposlam/map",
        message: "visualization_msgs/msg/MarkerArray",
        definition: include_str!("definitions/MarkerArray.msg"),
    },
    Topic { name: "/toposlam/route_graph", message: "std_msgs/msg/String", definition: "string data\n" },
];

/// Writes a robot's stream to a ROS 2 bag.
pub struct Ros2Bag {
    folder: PathBuf,
    file: Writer<NoSeek<BufWriter<File>>>,
    channels: [u16; TOPICS.len()],
    counts: [u32; TOPICS.len()],
    /// Times of the first and the last message.
    span_ns: Option<(u64, u64)>,
    listener: Listener,
    drawing: Drawing,
    frame_mm: Option<f64>,
    summary: Summary,
}

impl Ros2Bag {
    /// Creates a folder with the name of the bag.
    ///
    /// `frame_mm` is how far the robot drives in a ring frame, for the costs of the route graph ([`export::geojson`]).
    ///
    /// # Errors
    /// If the folder exists or cannot be written.
    pub fn create(folder: &Path, frame_mm: Option<f64>) -> Result<Self, RecordingError> {
        fs::create_dir(folder)?;
        let output = BufWriter::new(File::create_new(folder.join(file_name(folder)))?);
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("toposlam ", env!("CARGO_PKG_VERSION")))
            .disable_seeking(true);
        let mut file = options.create(NoSeek::new(output))?;
        let mut channels = [0; TOPICS.len()];
        for (channel, topic) in channels.iter_mut().zip(&TOPICS) {
            let schema = file.add_schema(topic.message, "ros2msg", topic.definition.as_bytes())?;
            let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())]);
            *channel = file.add_channel(schema, topic.name, "cdr", &metadata)?;
        }
        Ok(Self {
            folder: folder.to_owned(),
            file,
            channels,
            counts: [0; TOPICS.len()],
            span_ns: None,
            listener: Listener::new(),
            drawing: Drawing::default(),
            frame_mm,
            summary: Summary::default(),
        })
    }

    /// Records bytes in pieces of any length. `time_ns` is their time of arrival in nanoseconds since 1970.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn record(&mut self, bytes: &[u8], time_ns: u64) -> Result<(), RecordingError> {
        let mut scans = Vec::new();
        let Self { listener, drawing, summary, .. } = self;
        listener.feed(bytes, |_, event| {
            let Event::Message(header, message) = event else { return };
            summary.frames = summary.frames.wrapping_add(1);
            drawing.layout.apply(header, message);
            match message {
                Message::Ring { echoes, .. } => scans.push(messages::scan(echoes, time_ns)),
                Message::Place { .. } => summary.places += 1,
                _ => {}
            }
        });
        self.summary.bytes += bytes.len() as u64;
        for scan in scans {
            self.write(SCAN, time_ns, &scan)?;
        }
        if self.drawing.is_due(time_ns) { self.draw(time_ns) } else { Ok(()) }
    }

    fn draw(&mut self, time_ns: u64) -> Result<(), RecordingError> {
        // A bag has no empty map.
        if self.listener.replica().vertices() == 0 {
            return Ok(());
        }
        let Some(scene) = self.drawing.scene(&self.listener, time_ns) else { return Ok(()) };
        let markers = messages::markers(&scene, time_ns);
        let Scene { map, layout, robot } = scene;
        let route = export::geojson(map, layout, robot, super::METRES_PER_EDGE, self.frame_mm);
        self.write(MAP, time_ns, &markers)?;
        self.write(ROUTE, time_ns, &messages::string(&route))
    }

    fn write(&mut self, topic: usize, time_ns: u64, data: &[u8]) -> Result<(), RecordingError> {
        let sequence = self.counts[topic];
        let header =
            MessageHeader { channel_id: self.channels[topic], sequence, log_time: time_ns, publish_time: time_ns };
        self.counts[topic] = sequence.wrapping_add(1);
        let (first_ns, last_ns) = self.span_ns.unwrap_or((time_ns, time_ns));
        self.span_ns = Some((first_ns.min(time_ns), last_ns.max(time_ns)));
        Ok(self.file.write_to_known_channel(&header, data)?)
    }

    /// The counts so far.
    pub const fn summary(&self) -> Summary {
        self.summary
    }

    /// Writes the remaining data and `metadata.yaml`.
    ///
    /// # Errors
    /// If the folder cannot be written.
    pub fn finish(mut self) -> Result<Summary, RecordingError> {
        if let Some((_, last_ns)) = self.span_ns {
            self.draw(last_ns)?;
        }
        self.file.finish()?;
        let metadata = self.metadata();
        self.file.into_inner().into_inner().flush()?;
        fs::write(self.folder.join("metadata.yaml"), metadata)?;
        Ok(self.summary)
    }

    /// `metadata.yaml` in version 5 of rosbag2, which Humble and all later distributions read.
    fn metadata(&self) -> String {
        let (first_ns, last_ns) = self.span_ns.unwrap_or((0, 0));
        let (duration_ns, count) = (last_ns - first_ns, self.counts.iter().sum::<u32>());
        let name = file_name(&self.folder);
        let topics: String = TOPICS
            .iter()
            .zip(self.counts)
            .map(|(topic, count)| {
                let Topic { name, message, .. } = topic;
                format!(
                    "    - topic_metadata:\n        name: {name}\n        type: {message}\n        \
                     serialization_format: cdr\n        offered_qos_profiles: \"\"\n      message_count: {count}\n"
                )
            })
            .collect();
        format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    \
             nanoseconds: {duration_ns}\n  starting_time:\n    nanoseconds_since_epoch: {first_ns}\n  \
             message_count: {count}\n  topics_with_message_count:\n{topics}  compression_format: \"\"\n  \
             compression_mode: \"\"\n  relative_file_paths:\n    - {name:?}\n  files:\n    - path: {name:?}\n      \
             starting_time:\n        nanoseconds_since_epoch: {first_ns}\n      duration:\n        \
             nanoseconds: {duration_ns}\n      message_count: {count}\n"
        )
    }
}

/// The name of the MCAP file in the folder of a bag.
fn file_name(folder: &Path) -> String {
    let name = folder.file_name().unwrap_or(folder.as_os_str());
    format!("{}_0.mcap", name.to_string_lossy())
}
