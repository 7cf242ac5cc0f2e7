//! The messages. Append-only: a variant is never changed, moved or removed once released (`docs/wire.md`, Stability).

use core::fmt;

use serde::{Deserialize, Serialize};

use super::code::codes;
use super::{Belief, Drive, Echoes, Journey, Renamed, Reply, Worst};
use crate::{Filter, FilterCapacities, Fingerprint, MapperConfig, Update};

/// The version of the messages and requests; it grows by one whenever some are appended.
pub const PROTOCOL_VERSION: u16 = 3;

/// FNV-1a (64 bit) of the description of all messages and requests that `docs/wire.md` prints; a test recomputes it from the types.
pub const SCHEMA_HASH: u64 = 0x06A5_446B_0B1D_C83D;

/// One message from the robot. All of them but [`Message::Renamed`] state facts in absolute terms and are no increment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Message {
    /// Who is speaking: sent first after the start and again every so many ticks.
    Hello(Hello),
    /// The detector confirmed a place (what it saw, before any inference).
    Place {
        /// The number of the place since the start, from 0.
        place_index: u32,
        /// The ring frame in which the place was confirmed, from 0.
        frame_index: u32,
        /// The radius of the largest free disc around the place, in millimetres.
        radius_mm: u16,
        /// How many ways lead away from the place, when the detector could count them.
        degree: Option<u8>,
    },
    /// How large the map now is, and a digest of it.
    Map {
        /// The number of vertices; vertices from this number on do not exist (any more).
        vertices: u8,
        /// The number of edges, self-loops included.
        edges: u16,
        /// CRC-32 of the map's canonical bytes, see [`map_digest`](crate::wire::map_digest).
        digest: u32,
    },
    /// The label of a vertex is now this.
    Vertex {
        /// The number of the vertex.
        vertex: u8,
        /// The mean radius observed there, in millimetres.
        radius_mm: u16,
        /// How many observations the mean is made of.
        visits: u32,
    },
    /// An edge now exists, or does no longer: another hypothesis may have become the best one.
    Edge {
        /// The vertex with the smaller number.
        a: u8,
        /// The vertex with the larger number; equal to `a` for a self-loop.
        b: u8,
        /// Whether the edge exists.
        present: bool,
    },
    /// The robot is at this vertex.
    Location(Location),
    /// Why the inference believes so.
    Evidence(Evidence),
    /// One vertex of the rolling full picture.
    Row(Row),
    /// How often a kind of fault was seen since the start.
    Fault {
        /// The number of the [`FaultKind`](crate::FaultKind).
        kind: u8,
        /// The count since the start; it saturates.
        count: u32,
    },
    /// How the firmware is doing.
    Health(Health),
    /// One reading of the sonar ring, for viewers.
    Ring {
        /// The number of the ring frame since the start, from 0; it wraps.
        frame_index: u32,
        /// What each sonar said, in the order of the ring's geometry.
        echoes: Echoes,
    },
    /// Where the robot may be, and how far the map is to be trusted.
    Belief(Belief),
    /// The vertices have new numbers from here on: some were merged, split off, left out or put in another order.
    Renamed(Renamed),
    /// What the map explains worst.
    Worst(Worst),
    /// The answer to a request.
    Reply(Reply),
    /// Where the drive steers, once for each ring frame.
    Drive(Drive),
    /// How the way to a vertex goes that the robot was told to go to.
    Journey(Journey),
}

/// Who is speaking.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// The speaker's [`PROTOCOL_VERSION`].
    pub protocol_version: u16,
    /// The speaker's [`SCHEMA_HASH`].
    pub schema_hash: u64,
    /// A number that differs from one start of the robot to the next (a counter in flash, or noise); 0 when it has none.
    pub boot: u32,
    /// Why the robot started.
    pub reset_cause: ResetCause,
    /// The seed of the random draws, with which a host can repeat the run.
    pub seed: u64,
    /// What the robot has room for.
    pub capacities: Capacities,
}

impl Hello {
    /// The introduction of a robot that runs this version of the library.
    pub const fn new(boot: u32, reset_cause: ResetCause, seed: u64, capacities: Capacities) -> Self {
        Self { protocol_version: PROTOCOL_VERSION, schema_hash: SCHEMA_HASH, boot, reset_cause, seed, capacities }
    }

    /// Whether this version of the library understands the speaker.
    ///
    /// A speaker with another protocol version is understood as far as the messages known to both go, because messages
    /// are only ever appended.
    ///
    /// # Errors
    /// [`HelloError::SchemaDiffers`] when the speaker claims the same protocol version with other messages.
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
        /// Nobody can tell.
        Unknown => "for an unknown reason",
        /// The power was switched on.
        PowerOn = 1 => "the power was switched on",
        /// The supply voltage fell too low.
        BrownOut = 2 => "the supply voltage fell too low",
        /// The reset pin was pulled.
        ResetPin = 3 => "the reset pin was pulled",
        /// The watchdog was not fed in time.
        Watchdog = 4 => "the watchdog was not fed",
        /// The program asked for it.
        Software = 5 => "the program restarted itself",
        /// The chip was to sleep in a way that it may not.
        LowPower = 6 => "the chip went to sleep wrongly",
    }
}

/// What the robot has room for, and the units it counts in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Capacities {
    /// The most vertices a map can have, 1 to 64.
    pub vertices: u8,
    /// The number of hypotheses (particles).
    pub hypotheses: u16,
    /// The most observations the history holds.
    pub history: u16,
    /// The length n of the n-grams.
    pub ngram_length: u8,
    /// The width of one fingerprint step, in millimetres.
    pub fingerprint_step_mm: u8,
    /// The number of sonars in the ring.
    pub sonars: u8,
}

impl Capacities {
    /// What a robot has room for whose maps have so many vertices.
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
    /// The vertex that the place was taken for.
    pub vertex: u8,
}

impl Location {
    /// The same place under new numbers; `None` when its vertex is gone.
    pub(in crate::wire) fn renamed(self, renamed: &Renamed) -> Option<Self> {
        Some(Self { vertex: renamed.now(self.vertex)?, ..self })
    }
}

impl From<&Update> for Location {
    fn from(update: &Update) -> Self {
        Self { place_index: update.place_index, vertex: update.vertex.into() }
    }
}

/// Why the inference believes in its map. Logarithms are natural and in units of 2⁻¹⁶ nats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Evidence {
    /// The number of the place since the start, from 0.
    pub place_index: u32,
    /// The distance of Eq. 2, or of the half of it that is configured, in millimetres; 65535 when it is infinite.
    pub consistency_mm: u16,
    /// The logarithm of the winner's Eq. 7: how well the observation fits the label its vertex had before.
    pub ln_label_q16: i32,
    /// The logarithm of the winner's Eq. 8: how consistent the map is with the evidence.
    pub ln_consistency_q16: i32,
    /// The logarithm of the winner's Eq. 9: what the size of the map costs.
    pub ln_size_q16: i32,
    /// By how much the logarithm of the winner's weight leads that of the runner-up; 15 nats or more are reported as 15.
    pub lead_q16: i32,
    /// How many different hypotheses survived.
    pub distinct_hypotheses: u16,
}

impl From<&Update> for Evidence {
    fn from(update: &Update) -> Self {
        Self {
            place_index: update.place_index,
            consistency_mm: update.consistency_mm,
            ln_label_q16: update.factors.ln_label_q16,
            ln_consistency_q16: update.factors.ln_consistency_q16,
            ln_size_q16: update.factors.ln_size_q16,
            lead_q16: update.lead_q16,
            distinct_hypotheses: u16::from(update.distinct),
        }
    }
}

/// All that the map says about one vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// The number of the vertex.
    pub vertex: u8,
    /// The mean radius observed there, in millimetres.
    pub radius_mm: u16,
    /// How many observations the mean is made of.
    pub visits: u32,
    /// The neighbours as a bit row: bit `w` says that an edge joins this vertex and vertex `w`.
    pub neighbours: u64,
}

/// How the firmware is doing; a value that the firmware does not measure is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health {
    /// Time since the start in milliseconds; it wraps.
    pub uptime_ms: u32,
    /// How often the main loop went round; it wraps.
    pub loop_count: u32,
    /// The most stack that was ever in use, in bytes.
    pub stack_high_water_bytes: u32,
    /// The longest time that one place took, in microseconds.
    pub worst_update_us: u32,
}

/// Why a speaker is not understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HelloError {
    /// Both sides have the same protocol version, yet their messages differ.
    SchemaDiffers {
        /// The schema hash of this library.
        ours: u64,
        /// The schema hash of the speaker.
        theirs: u64,
    },
}

impl fmt::Display for HelloError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SchemaDiffers { ours, theirs } => {
                write!(f, "the speaker's messages have schema hash {theirs:#018x}, this listener knows {ours:#018x}")
            }
        }
    }
}

impl core::error::Error for HelloError {}
