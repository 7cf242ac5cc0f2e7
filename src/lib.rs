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
//! (so a `static` of it lies in `.bss`) and initialised in place.
//!
//! # From ring frames to a map
//!
//! ```
//! use toposlam::place::{PlaceConfig, PlaceDetector};
//! use toposlam::ring::{Echo, RingFrame, RingGeometry};
//! use toposlam::{Observation, RobustConfig, RobustFilter};
//!
//! /// What a ring of 16 sonars hears in a corridor that ends ahead.
//! fn frame(half_width_mm: u16, ahead_mm: u16) -> RingFrame<16> {
//!     let mut echoes = [Echo::Silence; 16];
//!     for (sensor, range_mm) in [(0, ahead_mm), (4, half_width_mm), (12, half_width_mm)] {
//!         echoes[sensor] = Echo::Range { range_mm };
//!     }
//!     RingFrame { echoes }
//! }
//!
//! let mut detector = PlaceDetector::<16>::new();
//! detector.start(PlaceConfig::DEFAULT, RingGeometry::even())?;
//! let mut filter = RobustFilter::<10, 16, 400>::new();
//! filter.start(RobustConfig::DEFAULT, 1)?;
//!
//! // To and fro between the ends of a corridor that is 1.6 m wide at one end and 2.4 m at the other.
//! for half_width_mm in [800, 1200, 800, 1200, 800] {
//!     for step in -50_i16..=50 {
//!         let ahead_mm = half_width_mm + 30 * step.unsigned_abs();
//!         if let Some(place) = detector.observe(&frame(half_width_mm, ahead_mm)) {
//!             let degree = place.degree;
//!             let update = filter.observe(Observation { degree, ..Observation::new(place.fingerprint) });
//!             println!("{} mm: vertex {}", place.fingerprint.radius_mm(), update.vertex);
//!         }
//!     }
//! }
//! assert_eq!(filter.observed(), 5);
//! let [a, b] = filter.map().vertices().collect::<Vec<_>>()[..] else { panic!("two vertices") };
//! assert!(filter.map().edges().eq([(a, b)]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Mapper`] is these stages in one piece, with the refinement of the map between two places. It takes either filter, or
//! another one that is a [`Filter`]. The feature `wire` adds the `Reporter`, which sends what the mapper found, and the whole
//! `Robot`.
//!
//! # How well a map fits
//!
//! [`Consistency`] is the measure of Eq. 2 on its own, for any [`Map`] and any [`History`] or [`NgramTable`]:
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
//! // The robot finds a place that the map does not have, 100 mm wider than the one it has.
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
//! | `snapshot` | snapshots of the map and the filter as byte strings (module `snapshot`) |
//! | `store` | snapshots in flash, wear-levelled (module `store`) |
//! | `wire` | the serial protocol (module `wire`) and the whole robot (module `robot`); implies `snapshot` |
//! | `defmt` | `defmt::Format` for what a firmware logs |
//! | `firmware`, `pll` | the images in `src/bin`; only for the reference board's target |
//!
//! # Capacities and memory
//!
//! | Parameter | Means | Range | Reference robot |
//! |---|---|---|---|
//! | `SONARS` | sensors of the ring | 3 to 128 | 16 |
//! | `N` | hypotheses, or particles | 1 to 255 | 10 |
//! | `HISTORY` of a [`RobustFilter`] | places that moves can still explain in another way | 8 to 16384 | 400 |
//! | `V` | vertices of a map | 1 to 64; 2 to 32 for the robust filter | 16 |
//! | `WORDS` of a [`History`] | 32 places each, for the paper's filter | powers of two | none |
//! | `WORDS` of an [`NgramTable`] or [`Prior`] | 16 n-grams each | even numbers up to 1024 | none: it maps on line |
//!
//! Each type states its size as a function of these. [`mod@reference`] has the capacities of the reference robot. What does
//! not fit is counted as a [`FaultKind`], and the map so far stays; the oldest places of a full history make room.
//!
//! # Determinism
//!
//! The same input, configuration and seed give the same result, bit for bit, on every target: the paper's weights are sums of
//! integer logarithms, the robust filter's evidence is computed in single precision with the operations of IEEE 754 in a fixed
//! order, the random draws of a place are a function of the seed and the number of the place, and where an exponential
//! or a logarithm is needed, `libm` computes it in software. `toposlam emulate` holds the firmware to a host:
//! the location at every place, and the whole map at the end.
//!
//! # Where the paper is
//!
//! [`RobustFilter`], the default, goes beyond the paper; `docs/inference.md` describes it. [`PaperFilter`] is the paper's. Both are a
//! [`Filter`].
//!
//! F. Werner, F. Maire, J. Sitte, H. Choset, S. Tully, G. Kantor: *Topological SLAM using Neighbourhood Information of
//! Places*. All numbers of equations, definitions and sections are its own.
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
//! | Eq. 2, the half from history to map, with its n-gram | `filter/robust/worst.rs` |
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
#[cfg(feature = "wire")]
pub mod wire;

pub use config_error::ConfigError;
pub use fault::{FaultCounters, FaultKind};
pub use filter::{
    Config, Consistency, Direction, Evidence, Filter, FilterCapacities, History, Ngram, NgramError, NgramLength,
    NgramTable, NgramsFull, Observation, PaperFactors, PaperFilter, Particle, Prior, RobustConfig, RobustFactors,
    RobustFilter, Turn, Update, WeightFactors, WorstNgram,
};
pub use map::{Map, PerVertex, VertexId, VertexSet, VerticesFull};
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
