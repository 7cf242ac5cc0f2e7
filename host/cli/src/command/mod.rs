//! The subcommands, a file each: its arguments and what it does with them. `drive` is what two of them share,
//! `filter` what three of them let choose, `hardship` what `emulate` does with faults, `interrupt` Ctrl-C.

pub(crate) mod console;
mod drive;
pub(crate) mod emulate;
pub(crate) mod evaluate;
pub(crate) mod explore;
pub(crate) mod export;
mod filter;
pub(crate) mod fleet;
mod hardship;
mod heard;
mod interrupt;
pub(crate) mod monitor;
pub(crate) mod play;
#[cfg(feature = "mqtt")]
pub(crate) mod publish;
mod rails;
pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod robot;
pub(crate) mod robots;
pub(crate) mod serve;
pub(crate) mod simulate;
pub(crate) mod soak;
