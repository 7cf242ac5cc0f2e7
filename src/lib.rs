//! Topological SLAM that fits in a microcontroller.
//!
//! A robot with a ring of range sensors, without odometry or camera, explores corridors that look alike and builds a graph of
//! places. Data flows one way, and each stage is a module that can be used alone:
//!
//! ```text
//! ring frame ─▶ place ─▶ hypotheses ─▶ map update ─▶ messages
//! (ring)        (place)  (filter)      (map)         (wire)
//!              └────────── Mapper ──────────┘
//! └───────────────────────── Robot ────────────────────────┘
//! ```
//!
//! The crate never allocates and has no unsafe code. Capacities are const generics. Large state is const-constructed, so that
//! a `static` of it is in `.bss`, and initialised in place.
//!
//! # From ring frames to a map
//!
//! ```
//! use toposlam::ring::{Echo, RingFrame, RingGeometry};
//! use toposlam::{Mapper, MapperConfig, Passage, RobustFilter};
//!
//! /// The frame of a ring of 16 sensors in a corridor that ends ahead.
//! fn frame(half_width_mm: u16, ahead_mm: u16) -> RingFrame<16> {
//!     let mut echoes = [Echo::Silence; 16];
//!     for (sensor, range_mm) in [(0, ahead_mm), (4, half_width_mm), (12, half_width_mm)] {
//!         echoes[sensor] = Echo::Range { range_mm };
//!     }
//!     RingFrame { echoes }
//! }
//!
//! let mut mapper = Mapper::<16, 16, RobustFilter<10, 16, 400>>::new();
//! mapper.start(&MapperConfig::for_ring(RingGeometry::even()))?;
//!
//! // To and fro between the ends of a corridor that is 1.6 m wide at one end and 2.4 m at the other.
//! for half_width_mm in [800, 1200, 800, 1200, 800] {
//!     for step in -50_i16..=50 {
//!         let ahead_mm = half_width_mm + 30 * step.unsigned_abs();
//!         if let Some((place, update)) = mapper.observe(&frame(half_width_mm, ahead_mm), Passage::UNKNOWN) {
//!             println!("{} mm: vertex {}", place.fingerprint.radius_mm(), update.vertex);
//!         }
//!     }
//! }
//! assert_eq!(mapper.filter().observed(), 5);
//! let [a, b] = mapper.map().vertices().collect::<Vec<_>>()[..] else { panic!("two vertices") };
//! assert!(mapper.map().edges().eq([(a, b)]));
//! # Ok::<(), toposlam::ConfigError>(())
//! ```
//!
//! [`Mapper`] is a place detector and a filter, with the refinement of the map between two places. It takes either filter, or
//! another [`Filter`]. The feature `wire` adds the `Reporter`, which sends the results of the mapper, and the whole `Robot`.
//! The examples of the crate show a filter alone, a ring of one's own, recorded ring frames, and a whole robot.
//!
//! # Consistency of a map
//!
//! [`Consistency`] computes the measure of Eq. 2 for any [`Map`] and any [`History`] or [`NgramTable`]:
//!
//! ```
//! use toposlam::{Consistency, Direction, Fingerprint, History, Map, NgramLength};
//!
//! let [wide, narrow] = [1200, 800].map(|radius_mm| Fingerprint::from_radius_mm(radius_mm).unwrap());
//! let mut map = Map::<2>::new();
//! let (a, b) = (map.add_vertex(wide)?, map.add_vertex(narrow)?);
//! map.add_edge(a, b);
//! let mut history = History::<1>::new();
//! history.push(wide);
//! history.push(narrow);
//! let length = NgramLength::new(5)?;
//! let mut consistency = Consistency::<2, 1, 1>::new();
//! assert_eq!(consistency.distance_steps(&map, &history, length, Direction::TwoSided), Some(0));
//! // The robot visits a place that the map does not have, 100 mm wider than the widest one of the map.
//! history.push(Fingerprint::from_radius_mm(1300)?);
//! let distance = consistency.distance_steps(&map, &history, length, Direction::TwoSided);
//! assert_eq!(distance.map(|steps| steps * length.label_step_mm()), Some(100));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! | Feature | Adds |
//! |---|---|
//! | none | detector, filters, [`Mapper`], drive, drivers of the sonars |
//! | `snapshot` | snapshots of the stages as byte strings (module `persist::snapshot`) |
//! | `store` | snapshots in flash, wear-levelled (module `persist::store`); implies `snapshot` |
//! | `wire` | the serial protocol (module `wire`) and the whole robot (module `robot`); implies `snapshot` |
//! | `defmt` | `defmt::Format` for the types that a firmware logs |
//! | `firmware`, `pll` | the images in `src/bin`; only for the target of the reference board |
//!
//! # Capacities and memory
//!
//! | Parameter | Meaning | Range | Reference robot |
//! |---|---|---|---|
//! | `SONARS` | sensors of the ring | 3 to 128 | 16 |
//! | `N` | hypotheses, or particles | 1 to 255 | 10 |
//! | `HISTORY` of a [`RobustFilter`] | places that repair moves can reassign | 8 to 16384 | 400 |
//! | `V` | vertices of a map | 1 to 64; 2 to 32 for the robust filter | 16 |
//! | `WORDS` of a [`History`] | 32 places each, for the paper's filter | powers of two | none |
//! | `WORDS` of an [`NgramTable`] or [`Prior`] | 16 n-grams each | even numbers up to 1024 | none |
//!
//! Each type documents its size as a function of these. [`mod@reference`] has the capacities of the reference robot. A full
//! table is counted as a [`FaultKind`], and the map stays. A full history drops its oldest places.
//!
//! # Determinism
//!
//! The same input, configuration and seed give the same result, bit for bit, on every target. The weights of the paper's filter
//! are sums of integer logarithms. The evidence of the robust filter is computed in single precision with the operations of
//! IEEE 754 in a fixed order. Random draws are a function of the seed and the number of the place. `libm` computes exponentials
//! and logarithms in software. `toposlam emulate` compares the firmware with a host: the location at every place, and the
//! whole map at the end.
//!
//! # The paper
//!
//! [`PaperFilter`] is the filter of the paper. [`OrderedFilter`], the robot's default, also uses ways, exits and travel times;
//! [`RobustFilter`] is the choice for radii alone. `docs/inference.md` describes both.
//!
//! F. Werner, F. Maire, J. Sitte, H. Choset, S. Tully, G. Kantor: *Topological SLAM using Neighbourhood Information of
//! Places*. All numbers of equations, definitions and sections refer to it.
//!
//! | Paper | File |
//! |---|---|
//! | Eq. 1, labels | `place/fingerprint.rs`, as running means `map/` |
//! | Definitions 3 to 5, n-grams | `filter/paper/ngram/` |
//! | Definition 6, Eq. 2 and 3, consistency | `filter/paper/consistency/` |
//! | Eq. 4 and 5, the filter's step | `filter/paper/selection.rs`, `filter/paper/resample.rs` |
//! | Eq. 6, the weight | `filter/paper/particle.rs` |
//! | Eq. 7 to 9, its factors | `filter/paper/likelihood.rs` |
//! | Section III.B, localisation | `filter/mod.rs` ([`Update::vertex`]) |
//! | Eq. 2, the half from history to map, with its n-gram | `filter/worst_ngram.rs` |
//! | Section IV.A, meet points | `place/` |
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod bearing;
#[cfg(feature = "snapshot")]
mod checksum;
mod config_error;
#[cfg(feature = "defmt")]
mod defmt;
pub mod drive;
mod fault;
mod filter;
mod map;
mod mapper;
#[cfg(feature = "snapshot")]
pub mod persist;
pub mod place;
pub mod reference;
pub mod ring;
#[cfg(feature = "wire")]
pub mod robot;
mod setters;
mod top_k;
#[cfg(feature = "wire")]
pub mod wire;

pub use config_error::ConfigError;
pub use fault::{FaultCounters, FaultKind};
pub use filter::{
    CERTAIN_Q16, Consistency, Direction, Evidence, Exit, Filter, FilterCapacities, History, Ngram, NgramError,
    NgramLength, NgramTable, NgramsFull, Observation, OrderedConfig, OrderedFactors, OrderedFilter, PaperConfig,
    PaperFactors, PaperFilter, Particle, Passage, Prior, RobustConfig, RobustFactors, RobustFilter, Update, Ways,
    WaysError, WeightFactors, WorstNgram,
};
pub use map::{Bearing, DartId, DartMap, Darts, Map, PerVertex, VertexId, VertexSet, VerticesFull, WAYS_MAX};
pub use mapper::{Mapper, MapperConfig};
pub use place::{Fingerprint, FingerprintError};

/// The code in the README is compiled as a test.
#[cfg(all(doctest, feature = "wire"))]
#[doc = include_str!("../README.md")]
struct Readme;

/// So is the code in the guide to wiring.
#[cfg(doctest)]
#[doc = include_str!("../docs/wiring.md")]
struct Wiring;
