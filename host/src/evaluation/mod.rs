//! How often maps are right: random paths through known environments, scored against what can be known at best.

pub mod ancestry;
pub mod environment;
pub mod equivalence;
pub mod graph;
pub mod prior;
pub mod report;
pub mod run;
pub mod score;
pub mod walk;
