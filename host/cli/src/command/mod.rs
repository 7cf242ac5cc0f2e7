//! The subcommands, one file each, with arguments and implementation. `drive` has the options shared by `simulate` and
//! `emulate`, `filter` the choice of a filter, `hardship` the emulation with faults, `interrupt` Ctrl-C, `machine` the
//! emulated machine, `ring_recording` the ring frames of an MCAP file.

pub(crate) mod aliasing;
pub(crate) mod console;
mod drive;
pub(crate) mod emulate;
mod emulate_small;
pub(crate) mod evaluate;
pub(crate) mod explore;
pub(crate) mod export;
mod filter;
pub(crate) mod fleet;
mod hardship;
mod hardware;
mod interrupt;
mod machine;
pub(crate) mod merge;
#[cfg(not(all(any(feature = "mqtt", feature = "zenoh"), feature = "recording")))]
mod missing;
pub(crate) mod monitor;
mod on_graph;
pub(crate) mod plan;
#[cfg(feature = "recording")]
pub(crate) mod play;
#[cfg(any(feature = "mqtt", feature = "zenoh"))]
pub(crate) mod publish;
mod received;
#[cfg(feature = "recording")]
pub(crate) mod record;
pub(crate) mod replay;
#[cfg(feature = "recording")]
mod ring_recording;
pub(crate) mod robot;
pub(crate) mod robots;
pub(crate) mod serve;
pub(crate) mod simulate;
pub(crate) mod soak;

#[cfg(not(any(feature = "mqtt", feature = "zenoh")))]
pub(crate) use missing::publish;
#[cfg(not(feature = "recording"))]
pub(crate) use missing::{play, record};
