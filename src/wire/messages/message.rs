//! The messages of the robot. Append-only within a frame version (`docs/wire.md`, Stability).

use core::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use super::code::codes;
use super::{
    Belief, Echoes, Evidence, Exploration, GoalStatus, Name, Remapped, Reply, Start, Velocity, VertexWays, Worst,
};
use crate::filter::{Filter, FilterCapacities, Update};
use crate::mapper::MapperConfig;
use crate::place::Fingerprint;

/// The version of the messages and requests.
pub const PROTOCOL_VERSION: u16 = 7;

/// The 64-bit FNV-1a hash of the schema in `docs/wire.md`; a test computes it from the types.
pub const SCHEMA_HASH: u64 = 0xFF77_031D_62C1_94A5;

/// A message from the robot. Every message but [`Message::Remapped`] gives absolute values, not increments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Message {
    /// The robot introduces itself: first after the start, then periodically.
    Hello(Hello),
    /// The detector confirmed a visit to a place: the measurement, before any inference.
    Place {
        /// The number of the place since the start, from 0.
        place_index: u32,
        /// The ring frame in which the place was confirmed, from 0.
        frame_index: u32,
        /// The radius of the largest free disc around the place, in millimetres.
        radius_mm: u16,
        /// The number of ways that lead away from the place; `None` if the detector could not count them.
        degree: Option<u8>,
    },
    /// The size of the map and its digest.
    Map {
        /// The number of vertices. Vertices with this id or a higher one do not exist.
        vertices: u8,
        /// The number of edges, self-loops included.
        edges: u16,
        /// The CRC-32 of the map's canonical bytes, see [`map_digest`](crate::wire::map_digest).
        digest: u32,
    },
    /// The label of a vertex.
    Vertex {
        /// The vertex.
        vertex: u8,
        /// The mean of the radii observed there, in millimetres.
        radius_mm: u16,
        /// The number of observations in the mean.
        visits: u32,
    },
    /// An edge was added or removed. An edge can be removed when another hypothesis becomes the best one.
    Edge {
        /// The vertex with the smaller id.
        a: u8,
        /// The vertex with the larger id; equal to `a` for a self-loop.
        b: u8,
        /// Whether the edge exists.
        present: bool,
    },
    /// The vertex that the robot is at.
    Location(Location),
    /// Why the filter chose its best map.
    Evidence(Evidence),
    /// One vertex with its edges, from the repeated map.
    Row(Row),
    /// The count of one kind of fault since the start.
    Fault {
        /// The number of the [`FaultKind`](crate::FaultKind).
        kind: u8,
        /// The count since the start; it saturates.
        count: u32,
    },
    /// The state of the firmware.
    Health(Health),
    /// One frame of the sonar ring, for viewers.
    Ring {
        /// The number of the ring frame since the start, from 0; it wraps.
        frame_index: u32,
        /// The echo of each sensor, in the order of the ring's geometry.
        echoes: Echoes,
    },
    /// Where the robot may be, and how probable the map is.
    Belief(Belief),
    /// The vertex ids changed: vertices were merged, split, removed or reordered.
    Remapped(Remapped),
    /// The n-gram of the history that the map explains worst.
    Worst(Worst),
    /// The answer to a request.
    Reply(Reply),
    /// The velocity command of one ring frame.
    Velocity(Velocity),
    /// The status of the goal, whenever it changes.
    GoalStatus(GoalStatus),
    /// The ways of a vertex, from a filter that knows them.
    Ways(VertexWays),
    /// How far the map is explored, from a filter that knows the ways.
    Exploration(Exploration),
    /// The name of a vertex.
    Name {
        /// The vertex.
        vertex: u8,
        /// Its name.
        name: Name,
    },
    /// The vertices with a name; the others have none.
    Named {
        /// The vertices as a set of bits.
        vertices: u64,
    },
}

/// The introduction of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// The [`PROTOCOL_VERSION`] of the robot.
    pub protocol_version: u16,
    /// The [`SCHEMA_HASH`] of the robot.
    pub schema_hash: u64,
    /// The number of the start; 0 if the robot does not count them.
    pub boot: u32,
    /// Why the robot started.
    pub reset_cause: ResetCause,
    /// The seed of the random draws. A host can repeat the run with it.
    pub seed: u64,
    /// The capacities of the robot.
    pub capacities: Capacities,
    /// The session id: a number that differs from one start to the next, and from robot to robot. 0 if there is none, as in
    /// protocol version 5.
    #[serde(deserialize_with = "or_zero")]
    pub session: u32,
}

/// A number that older senders leave out.
fn or_zero<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    Ok(u32::deserialize(deserializer).unwrap_or(0))
}

impl Hello {
    /// The introduction of a robot that runs this version of the library, without a session id.
    pub const fn new(boot: u32, reset_cause: ResetCause, seed: u64, capacities: Capacities) -> Self {
        let (protocol_version, schema_hash) = (PROTOCOL_VERSION, SCHEMA_HASH);
        Self { protocol_version, schema_hash, boot, reset_cause, seed, capacities, session: 0 }
    }

    /// What distinguishes this start of the robot.
    pub const fn start(&self) -> Start {
        Start { session: self.session, boot: self.boot, reset_cause: self.reset_cause, seed: self.seed }
    }

    /// Checks that this version of the library understands the robot.
    ///
    /// Within a frame version messages are only appended. So of a robot with another protocol version, the messages that
    /// both sides know are understood.
    ///
    /// # Errors
    /// [`HelloError::SchemaDiffers`] if the protocol versions are equal and the schemas are not.
    pub const fn check(&self) -> Result<(), HelloError> {
        if self.protocol_version == PROTOCOL_VERSION && self.schema_hash != SCHEMA_HASH {
            return Err(HelloError::SchemaDiffers { ours: SCHEMA_HASH, theirs: self.schema_hash });
        }
        Ok(())
    }
}

codes! {
    /// Why a robot started.
    ResetCause {
        /// The cause is unknown.
        Unknown => "the cause is unknown",
        /// The power was switched on.
        PowerOn = 1 => "the power was switched on",
        /// The supply voltage fell too low.
        BrownOut = 2 => "the supply voltage fell too low",
        /// The reset pin was pulled.
        ResetPin = 3 => "the reset pin was pulled",
        /// The watchdog was not fed in time.
        Watchdog = 4 => "the watchdog was not fed in time",
        /// The program requested a reset.
        Software = 5 => "the program requested a reset",
        /// The chip entered a low-power mode that the firmware forbids.
        LowPower = 6 => "the chip entered a forbidden low-power mode",
    }
}

/// The capacities of a robot, and the unit of its labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Capacities {
    /// The most vertices of a map, 1 to 64.
    pub vertices: u8,
    /// The number of hypotheses, or of particles.
    pub hypotheses: u16,
    /// The most observations in the history.
    pub history: u16,
    /// The length n of the n-grams.
    pub ngram_length: u8,
    /// The resolution of the labels in millimetres.
    pub fingerprint_step_mm: u8,
    /// The number of sonars in the ring.
    pub sonars: u8,
}

impl Capacities {
    /// The capacities of a robot with maps of this many vertices.
    pub const fn new(vertices: u8, filter: FilterCapacities, sonars: u8) -> Self {
        let FilterCapacities { hypotheses, history, ngram_length } = filter;
        let fingerprint_step_mm = Fingerprint::STEP_MM as u8;
        Self { vertices, hypotheses, history, ngram_length, fingerprint_step_mm, sonars }
    }

    /// The capacities of a [`Mapper`](crate::Mapper) with these settings.
    pub fn of_mapper<const SONARS: usize, const V: usize, F: Filter<V>>(
        config: &MapperConfig<SONARS, F::Config>,
    ) -> Self {
        Self::new(V as u8, F::capacities(&config.filter), SONARS as u8)
    }
}

/// Where the robot is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Location {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// The vertex that the place belongs to.
    pub vertex: u8,
}

impl Location {
    /// The same location under the new vertex ids; `None` if the vertex was removed.
    pub(in crate::wire) fn remapped(self, remapped: &Remapped) -> Option<Self> {
        Some(Self { vertex: remapped.now(self.vertex)?, ..self })
    }
}

impl From<&Update> for Location {
    fn from(update: &Update) -> Self {
        Self { place_index: update.place_index, vertex: update.vertex.into() }
    }
}

/// One vertex of the map: its label and its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// The vertex.
    pub vertex: u8,
    /// The mean of the radii observed there, in millimetres.
    pub radius_mm: u16,
    /// The number of observations in the mean.
    pub visits: u32,
    /// The neighbours as a set of bits: bit `w` is set if an edge joins this vertex and vertex `w`.
    pub neighbours: u64,
}

/// The bit of a vertex in a row, 0 from vertex 64 on, so that `bit(v).wrapping_sub(1)` has every bit below `v`.
pub(in crate::wire) fn bit(vertex: u8) -> u64 {
    1u64.checked_shl(u32::from(vertex)).unwrap_or(0)
}

/// The state of the firmware. A value that the firmware does not measure is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health {
    /// Time since the start in milliseconds; it wraps.
    pub uptime_ms: u32,
    /// The number of turns of the main loop; it wraps.
    pub loop_count: u32,
    /// The largest stack use since the start, in bytes.
    pub stack_high_water_bytes: u32,
    /// The longest time that one turn of the main loop took, in microseconds.
    pub worst_turn_us: u32,
}

/// Why a robot is not understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HelloError {
    /// Both sides have the same protocol version and different schemas.
    SchemaDiffers {
        /// The schema hash of this library.
        ours: u64,
        /// The schema hash of the robot.
        theirs: u64,
    },
}

impl fmt::Display for HelloError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SchemaDiffers { ours, theirs } => {
                write!(f, "the schema hash of the robot is {theirs:#018x}, that of this listener {ours:#018x}")
            }
        }
    }
}

impl core::error::Error for HelloError {}
