//! The subcommands, a file each: its arguments and what it does with them. `drive` is what two of them share.

mod drive;
pub(crate) mod emulate;
pub(crate) mod evaluate;
pub(crate) mod replay;
pub(crate) mod simulate;
