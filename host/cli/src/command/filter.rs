//! Command-line option for the filter.

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

impl From<FilterArgument> for FilterChoice {
    fn from(argument: FilterArgument) -> Self {
        match argument {
            FilterArgument::Ordered | FilterArgument::Robust => Self::Robust,
            FilterArgument::Paper => Self::Paper,
        }
    }
}
