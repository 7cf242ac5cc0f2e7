//! The toposlam command.
fn main() {}
