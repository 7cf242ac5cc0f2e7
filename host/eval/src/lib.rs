//! Measures how often maps are right, on random paths through known environments, against the best possible map.
//!
//! A [`case`] holds the environments of one row of the report, a [`trial`] one path, a [`candidate`] the filter that
//! maps it, and [`settings`] the parameters. [`judge`] evaluates one path, [`run`] evaluates all paths, and [`report`]
//! summarises the results.
//!
//! [`aliasing`] finds the n-grams that distinguish places with equal labels.
//!
//! [`mapping`] maps ring frames on the host, from a simulation or from a [`range_csv`] recording of a real ring.
//! [`gvg_adherence`] measures how closely a recorded robot followed the Voronoi graph, and [`laps`] compares the laps
//! of a recording, and [`revisits`] judges it by recorded poses. [`soak`] runs a simulated robot with faults for hours.

pub mod aliasing;
pub mod ancestry;
pub mod candidate;
pub mod case;
mod chart;
pub mod corridors;
mod embedding;
pub mod environment;
pub mod equivalence;
pub mod export;
pub mod family;
pub mod faults;
pub mod figure;
pub mod graph;
pub mod gvg_adherence;
pub mod hints;
pub mod judge;
pub mod laps;
pub mod mapping;
pub mod parallel;
mod planar;
pub mod prior;
mod processor_time;
pub mod range_csv;
pub mod reliability;
pub mod report;
pub mod revisits;
pub mod rotation;
pub mod run;
pub mod score;
pub mod settings;
pub mod soak;
pub mod trial;
pub mod walk;
