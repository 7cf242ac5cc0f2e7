//! Command-line options for the ring and the body of the robot.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use toposlam_sim::hardware::{Body, Hardware, Ring};

/// The ring and the body of the robot.
#[derive(Args)]
pub(super) struct HardwareArguments {
    /// TOML file that describes the ring (docs/rings.md) [default: the ring of the reference robot].
    #[arg(long, value_name = "FILE")]
    ring: Option<PathBuf>,
    /// TOML file that describes the body and the wheels (docs/rings.md) [default: the reference robot].
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
}

impl HardwareArguments {
    /// Reads the files.
    pub(super) fn load(&self) -> anyhow::Result<Hardware> {
        let mut hardware = Hardware::reference();
        if let Some(file) = &self.ring {
            hardware.ring = Ring::parse(&text(file)?).with_context(|| format!("ring {}", file.display()))?;
        }
        if let Some(file) = &self.robot {
            hardware.body = Body::parse(&text(file)?).with_context(|| format!("robot {}", file.display()))?;
        }
        Ok(hardware)
    }

    /// The names of the given files; empty for the reference robot.
    pub(super) fn name(&self) -> String {
        let stem = |file: &PathBuf| file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let names: Vec<String> = [&self.ring, &self.robot].into_iter().flatten().filter_map(stem).collect();
        names.join(" ")
    }
}

fn text(file: &Path) -> anyhow::Result<String> {
    read_to_string(file).with_context(|| format!("reading {}", file.display()))
}

/// Calls a generic function for the number of sensors of a ring, which becomes the constant `S`. The other filters than the ordered
/// one run with the ring of the reference robot only.
macro_rules! for_filter_and_ring {
    ($filter:expr, $sonars:expr, $call:ident ( $($argument:expr),* )) => {{
        use toposlam::reference::{ordered, paper, robust};
        use $crate::command::filter::FilterArgument;
        macro_rules! call {
            ($module:ident, $s:literal) => {
                $call::<{ $module::VERTICES }, $module::Filter, $s>(
                    $($argument,)* $module::FILTER, &mut [0; $module::SNAPSHOT_BYTES]
                )
            };
        }
        match ($filter, $sonars) {
            (FilterArgument::Ordered, 4) => call!(ordered, 4),
            (FilterArgument::Ordered, 5) => call!(ordered, 5),
            (FilterArgument::Ordered, 8) => call!(ordered, 8),
            (FilterArgument::Ordered, 12) => call!(ordered, 12),
            (FilterArgument::Ordered, 16) => call!(ordered, 16),
            (FilterArgument::Ordered, 24) => call!(ordered, 24),
            (FilterArgument::Robust, 16) => call!(robust, 16),
            (FilterArgument::Paper, 16) => call!(paper, 16),
            (_, sonars) => Err(anyhow::anyhow!("a ring of {sonars} sensors needs --filter ordered")),
        }
    }};
}
pub(super) use for_filter_and_ring;
