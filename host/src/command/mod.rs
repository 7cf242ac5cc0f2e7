//! The subcommands, a file each: its arguments and what it does with them. `drive` is what two of them share,
//! `filter` what three of them let choose, `hardship` what `emulate` does with faults.

pub(crate) mod console;
mod drive;
pub(crate) mod emulate;
pub(crate) mod evaluate;
pub(crate) mod explore;
mod filter;
mod hardship;
pub(crate) mod monitor;
mod rails;
pub(crate) mod replay;
pub(crate) mod robot;
pub(crate) mod serve;
pub(crate) mod simulate;
pub(crate) mod soak;
