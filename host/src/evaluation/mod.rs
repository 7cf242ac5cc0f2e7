//! How often maps are right: random paths through known environments, scored against what can be known at best.
//!
//! A [`case`] gives the environments of one row of the report, a [`trial`] what happens on one path, a [`candidate`] the
//! filter that maps it, and [`settings`] how much of what. [`judge`] brings them together, [`run`] does it for all paths, and
//! [`report`] sums up.

pub mod ancestry;
pub mod candidate;
pub mod case;
pub mod environment;
pub mod equivalence;
pub mod export;
pub mod family;
pub mod figure;
pub mod graph;
pub mod hints;
pub mod judge;
mod planar;
pub mod prior;
pub mod report;
pub mod run;
pub mod score;
pub mod settings;
pub mod trial;
pub mod walk;
