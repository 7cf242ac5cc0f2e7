//! Topological SLAM that fits in a microcontroller.
//!
//! A robot with a ring of cheap sonars, without odometry or camera, drives through corridors that look alike and
//! builds the map of places and connections on its own. Data flows one way, and every stage is usable alone:
//!
//! ```text
//! ring frame ─▶ place ─▶ hypotheses ─▶ map update ─▶ wire
//! (sonar, ring) (place)  (filter)      (filter)      (wire)
//! ```
//!
//! The crate never allocates and holds no unsafe code. Capacities are const generics, big state is const-constructed
//! (so a `static` of it lies in `.bss`) and initialised in place. The same input, configuration and seed give the
//! same result, bit for bit, on every target.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod consistency;
#[cfg(feature = "defmt")]
mod defmt;
mod fault;
mod filter;
mod fingerprint;
mod history;
mod likelihood;
mod map;
#[cfg(feature = "wire")]
mod mapper;
mod ngram;
pub mod place;
pub mod reference;
pub mod ring;
pub mod sonar;
#[cfg(feature = "wire")]
pub mod wire;

pub use consistency::{Consistency, Direction, Evidence};
pub use fault::{FaultCounters, FaultKind};
pub use filter::{Config, ConfigError, PaperFilter, Particle, Prior, Update, WeightFactors};
pub use fingerprint::{Fingerprint, FingerprintError};
pub use history::History;
pub use map::{Map, VerticesFull};
#[cfg(feature = "wire")]
pub use mapper::{Mapper, MapperConfig, MapperError};
pub use ngram::{Ngram, NgramError, NgramLength, NgramTable, NgramsFull};
