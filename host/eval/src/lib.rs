//! How often maps are right: random paths through known environments, scored against what can be known at best.
//!
//! A [`case`] gives the environments of one row of the report, a [`trial`] what happens on one path, a [`candidate`] the
//! filter that maps it, and [`settings`] how much of what. [`judge`] brings them together, [`run`] does it for all paths, and
//! [`report`] sums up.
//!
//! [`mapping`] makes a map of ring frames on this computer, from a simulation or from a [`range_csv`] of a real ring; [`gvg_adherence`] says
//! how near to the Voronoi graph a recorded robot drove, and [`laps`] compares the laps of a round. [`soak`] lets a simulated robot live
//! with faults for hours.

pub mod ancestry;
pub mod candidate;
pub mod case;
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
pub mod range_csv;
pub mod report;
pub mod run;
pub mod score;
pub mod settings;
pub mod soak;
pub mod trial;
pub mod walk;
