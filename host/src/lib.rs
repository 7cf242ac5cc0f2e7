//! Laptop side.

pub mod evaluation;
