//! Laptop side.
