//! Laptop side.

pub mod chip;
pub mod emulator;
