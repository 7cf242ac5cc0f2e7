//! The image and the emulator of `toposlam emulate`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of an emulated machine.
#[derive(Args)]
pub(super) struct MachineArguments {
    /// Firmware image with this filter [default: built with `cargo firmware`].
    #[arg(long, value_name = "FILE")]
    pub(super) elf: Option<PathBuf>,
    /// Emulator to run.
    #[arg(long, value_name = "PROGRAM", default_value = "qemu-system-arm")]
    pub(super) qemu: PathBuf,
    /// Timeout of the whole run, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 800)]
    pub(super) timeout_s: u64,
}
