//! Command-line option for the filter.

use anyhow::bail;
use clap::ValueEnum;
use toposlam_eval::mapping::FilterChoice;

/// Which filter makes the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FilterArgument {
    /// Ordered filter.
    Ordered,
    /// Robust filter.
    Robust,
    /// Filter of the paper.
    Paper,
}

impl FilterArgument {
    /// The filter for a recording, which does not say by which exits the robot left.
    pub(super) fn for_recording(self) -> anyhow::Result<FilterChoice> {
        match self {
            Self::Ordered => bail!("a recording has no exits: choose the robust filter or that of the paper"),
            Self::Robust => Ok(FilterChoice::Robust),
            Self::Paper => Ok(FilterChoice::Paper),
        }
    }
}
