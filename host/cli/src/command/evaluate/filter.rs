//! The arguments of `toposlam evaluate` that choose the filters and set their parameters.

use crate::command::filter::FilterArgument;
use anyhow::ensure;
use clap::{Args, ValueEnum};
use toposlam::{Direction, OrderedConfig, PaperConfig, RobustConfig};
use toposlam_eval::settings::Filter;

/// The filter and its parameters. Parameters of other filters are refused.
#[derive(Args)]
pub(super) struct FilterArguments {
    /// Filter to evaluate [default: ordered with hints of ways, otherwise robust].
    #[arg(long)]
    pub(super) filter: Option<FilterArgument>,
    /// Ordered: the robot whose capacities the filter has [default: reference].
    #[arg(long, value_name = "ROBOT")]
    pub(super) robot: Option<RobotChoice>,
    /// Hypotheses (robust) or particles (paper), 1 to 100 [default: 10].
    #[arg(long, alias = "particles", value_name = "N")]
    hypotheses: Option<u8>,
    /// Ordered and robust: initial estimate of the standard deviation of a fingerprint, in millimetres
    /// [default: 30].
    #[arg(long, value_name = "MM")]
    noise_mm: Option<u16>,
    /// Robust: repair moves tried at each place [default: 1].
    #[arg(long, value_name = "R")]
    moves: Option<u8>,
    /// Robust: assumed probability of a wrong turn hint, 0 to 1 in steps of 0.001 [default: 0.02].
    #[arg(long, value_name = "P", value_parser = permille)]
    wrong_turn: Option<u16>,
    /// Robust: assumed probability of a wrong degree hint, 0 to 1 in steps of 0.001 [default: 0.1].
    #[arg(long, value_name = "P", value_parser = permille)]
    wrong_degree: Option<u16>,
    /// Ordered: assumed probability of a wrong exit, 0.001 to 0.5 in steps of 0.001 [default: 0.04].
    #[arg(long, value_name = "P", value_parser = permille)]
    wrong_exit: Option<u16>,
    /// Ordered: assumed probability that a way is not seen, 0.001 to 0.5 in steps of 0.001 [default: 0.05].
    #[arg(long, value_name = "P", value_parser = permille)]
    missed_way: Option<u16>,
    /// Ordered: assumed probability that something is seen that is no way, 0.001 to 0.5 in steps of 0.001 [default: 0.02].
    #[arg(long, value_name = "P", value_parser = permille)]
    false_way: Option<u16>,
    /// Ordered: assumed standard deviation of a bearing, in milliradians [default: 100].
    #[arg(long, value_name = "MRAD")]
    bearing_noise_mrad: Option<u16>,
    /// Ordered: assumed standard deviation of a travel time as a share of it, 0.01 to 0.5 in steps of 0.001 [default: 0.1].
    #[arg(long, value_name = "SHARE", value_parser = permille)]
    travel_noise: Option<u16>,
    /// Paper: consistency measure, both halves of Eq. 2 or one [default: two-sided].
    #[arg(long)]
    consistency: Option<ConsistencyChoice>,
    /// Paper: sigma_l of Eq. 7 and 9, in millimetres [default: 50].
    #[arg(long, value_name = "MM")]
    sigma_label_mm: Option<u16>,
    /// Paper: sigma_c of Eq. 8, in millimetres [default: 30].
    #[arg(long, value_name = "MM")]
    sigma_consistency_mm: Option<u16>,
    /// Paper: phi of Eq. 9, 0 to 1 in steps of 0.001 [default: 0.1].
    #[arg(long, value_name = "PHI", value_parser = permille)]
    penalty: Option<u16>,
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum RobotChoice {
    /// The reference robot.
    Reference,
    /// The small robot (docs/small-robot.md).
    Small,
}

#[derive(Clone, Copy, ValueEnum)]
enum ConsistencyChoice {
    /// Eq. 2 as printed.
    TwoSided,
    /// Every walk of the map is near an observed n-gram.
    MapToHistory,
    /// Every observed n-gram is near a walk of the map.
    HistoryToMap,
}

impl FilterArguments {
    /// The selected filter or the default; for a comparison the default and the paper's filter.
    pub(super) fn chosen(&self, default: FilterArgument, compares: bool) -> anyhow::Result<Vec<Filter>> {
        use FilterArgument::{Ordered, Paper, Robust};
        let names = if compares { vec![default, Paper] } else { vec![self.filter.unwrap_or(default)] };
        let parameters: [(&str, bool, &[FilterArgument]); 14] = [
            ("--hypotheses", self.hypotheses.is_some(), &[Robust, Paper]),
            ("--noise-mm", self.noise_mm.is_some(), &[Ordered, Robust]),
            ("--moves", self.moves.is_some(), &[Robust]),
            ("--wrong-turn", self.wrong_turn.is_some(), &[Robust]),
            ("--wrong-degree", self.wrong_degree.is_some(), &[Robust]),
            ("--wrong-exit", self.wrong_exit.is_some(), &[Ordered]),
            ("--missed-way", self.missed_way.is_some(), &[Ordered]),
            ("--false-way", self.false_way.is_some(), &[Ordered]),
            ("--bearing-noise-mrad", self.bearing_noise_mrad.is_some(), &[Ordered]),
            ("--travel-noise", self.travel_noise.is_some(), &[Ordered]),
            ("--consistency", self.consistency.is_some(), &[Paper]),
            ("--sigma-label-mm", self.sigma_label_mm.is_some(), &[Paper]),
            ("--sigma-consistency-mm", self.sigma_consistency_mm.is_some(), &[Paper]),
            ("--penalty", self.penalty.is_some(), &[Paper]),
        ];
        for (parameter, is_given, filters) in parameters {
            let is_used = names.iter().any(|name| filters.contains(name));
            let filter = filters[0].to_possible_value();
            let filter = filter.as_ref().map_or("", |filter| filter.get_name());
            ensure!(!is_given || is_used, "{parameter} needs --filter {filter}");
        }
        let filter = |name: &FilterArgument| match name {
            Ordered => self.ordered(),
            Robust => self.robust(),
            Paper => self.paper(),
        };
        Ok(names.iter().map(filter).collect())
    }

    fn ordered(&self) -> Filter {
        let default = OrderedConfig::DEFAULT;
        Filter::Ordered(
            default
                .with_noise_mm(self.noise_mm.unwrap_or(default.noise_mm))
                .with_wrong_exit_permille(self.wrong_exit.unwrap_or(default.wrong_exit_permille))
                .with_missed_way_permille(self.missed_way.unwrap_or(default.missed_way_permille))
                .with_false_way_permille(self.false_way.unwrap_or(default.false_way_permille))
                .with_bearing_noise_mrad(self.bearing_noise_mrad.unwrap_or(default.bearing_noise_mrad))
                .with_travel_noise_permille(self.travel_noise.unwrap_or(default.travel_noise_permille)),
        )
    }

    fn robust(&self) -> Filter {
        let default = RobustConfig::DEFAULT;
        Filter::Robust(
            default
                .with_hypotheses(self.hypotheses.unwrap_or(default.hypotheses))
                .with_noise_mm(self.noise_mm.unwrap_or(default.noise_mm))
                .with_moves(self.moves.unwrap_or(default.moves))
                .with_wrong_turn_permille(self.wrong_turn.unwrap_or(default.wrong_turn_permille))
                .with_wrong_degree_permille(self.wrong_degree.unwrap_or(default.wrong_degree_permille)),
        )
    }

    fn paper(&self) -> Filter {
        let default = PaperConfig::DEFAULT;
        Filter::Paper(
            default
                .with_particles(self.hypotheses.unwrap_or(default.particles))
                .with_penalty_permille(self.penalty.unwrap_or(default.penalty_permille))
                .with_sigma_label_mm(self.sigma_label_mm.unwrap_or(default.sigma_label_mm))
                .with_sigma_consistency_mm(self.sigma_consistency_mm.unwrap_or(default.sigma_consistency_mm))
                .with_direction(match self.consistency {
                    None | Some(ConsistencyChoice::TwoSided) => Direction::TwoSided,
                    Some(ConsistencyChoice::MapToHistory) => Direction::MapToHistory,
                    Some(ConsistencyChoice::HistoryToMap) => Direction::HistoryToMap,
                }),
        )
    }
}

/// A probability in thousandths.
fn permille(text: &str) -> Result<u16, String> {
    let share: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let permille = (share * 1000.0).round();
    let whole = (permille / 1000.0 - share).abs() < 1e-9;
    if whole && (0.0..1000.0).contains(&permille) {
        Ok(permille as u16)
    } else {
        Err("whole thousandths from 0 up to 0.999".to_owned())
    }
}
