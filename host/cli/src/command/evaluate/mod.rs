//! `toposlam evaluate`: the rate of exact maps over many random paths through known environments.

use super::filter::FilterArgument;
use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};
use toposlam::{Direction, NgramLength, OrderedConfig, PaperConfig, RobustConfig};
use toposlam_cli::progress::Progress;
use toposlam_eval::{
    case::{Case, Placements},
    corridors::Bearings,
    environment::Environment,
    export::export,
    family::Family,
    figure::{Pair, Quantity, draw},
    hints::Hints,
    prior::PriorSource,
    report::{Report, Row, SettingsReport},
    run::evaluate,
    settings::{Capacities, Filter, Settings},
    walk::WalkKind,
};

/// Arguments of `toposlam evaluate`.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    cases: CaseArguments,
    #[command(flatten)]
    course: CourseArguments,
    #[command(flatten)]
    filter: FilterArguments,
    /// Write the observations and the ground truth of each path to files in this directory.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Run the default filter and the paper's on the same paths, and write the paper's Fig. 4 and 5 as fig4.svg and fig5.svg to this
    /// directory.
    #[arg(long, value_name = "DIR", conflicts_with = "filter")]
    plot: Option<PathBuf>,
    /// Output format.
    #[arg(long, default_value = "json")]
    format: Format,
}

/// The environments.
#[derive(Args)]
#[group(required = true, multiple = true)]
struct CaseArguments {
    /// Environment files (docs/evaluation.md).
    #[arg(long = "environment", value_name = "FILE.toml", num_args = 1..)]
    environments: Vec<PathBuf>,
    /// Environment of a file with its labels placed at random, COUNT times.
    #[arg(long, value_name = "SEED,COUNT,FILE.toml")]
    placements: Vec<Placements>,
    /// COUNT random environments of V_MIN to V_MAX places. DEGREE (mean number of neighbours), LABELS (number of
    /// categories) and NOISE (standard deviation of fingerprints, in metres) are numbers or ranges A-B. CLASS is
    /// general [default], right-resolving or multigraph.
    #[arg(long = "family", value_name = "SEED,COUNT,V_MIN,V_MAX,DEGREE,LABELS,NOISE[,CLASS]")]
    families: Vec<Family>,
}

/// The paths and what the filter gets on them.
#[derive(Args)]
struct CourseArguments {
    /// Paths per environment, or per family, over whose environments they are distributed evenly.
    #[arg(long, value_name = "P", default_value = "500")]
    paths: NonZeroUsize,
    /// Places after which the map is scored, in ascending order. If the last number is 100 or more, a path that misses an edge is
    /// drawn again.
    #[arg(long, alias = "length", value_name = "T,...", default_value = "100", value_delimiter = ',')]
    lengths: Vec<NonZeroUsize>,
    /// How a path is drawn: uniform, forward (turns back at dead ends only) or explore (towards the nearest way that was not driven).
    #[arg(long, value_name = "KIND", default_value = "uniform")]
    walk: WalkKind,
    /// Seed of paths, noise, hints and filter.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Source of the prior n-grams of the environment.
    #[arg(long, default_value = "none")]
    prior: PriorChoice,
    /// Hints besides fingerprints: none, turn, degree, both, ways, or ways with travel times. Ways have further settings: missed=P for
    /// the probability that one is not seen, bearing_mrad=B and travel=SHARE for the noise. All settings are 0 by default.
    #[arg(long, value_name = "HINTS[,missing=P,wrong=P]", default_value = "none")]
    hints: Hints,
    /// Bearings of the ways of a place, if the hints are ways.
    #[arg(long, default_value = "spread")]
    bearings: BearingsChoice,
    /// Ordered and robust: refinement steps after each place; a robot does one per ring frame.
    #[arg(long, alias = "polish", value_name = "STEPS", default_value_t = 10)]
    refinement_steps: u32,
    /// Ordered and robust: refinement steps after each place of the prior n-grams.
    #[arg(long, alias = "polish-prior", value_name = "STEPS", default_value_t = 10)]
    prior_refinement_steps: u32,
    /// Ordered and robust: refinement steps of a search that starts at the true path, after each length of --lengths. Reports how often it prefers
    /// another map, which is a bound for every search with this score. 0 for no search.
    #[arg(long, value_name = "STEPS", default_value_t = 0)]
    from_truth: u32,
    /// Bits per fingerprint, 1 to 12.
    #[arg(long, value_name = "B", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=12))]
    fingerprint_bits: u32,
    /// Labels per n-gram, 2 to 7.
    #[arg(long, value_name = "n", default_value_t = PaperConfig::DEFAULT.ngram_length)]
    ngram_length: u8,
    /// Threads; 0 for one per processor.
    #[arg(long, value_name = "THREADS", default_value_t = 0)]
    threads: usize,
}

/// The filter and its parameters. Parameters of other filters are refused.
#[derive(Args)]
struct FilterArguments {
    /// Filter to evaluate [default: ordered with hints of ways, otherwise robust].
    #[arg(long)]
    filter: Option<FilterArgument>,
    /// Ordered: the robot whose capacities the filter has [default: reference].
    #[arg(long, value_name = "ROBOT")]
    robot: Option<RobotChoice>,
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
enum BearingsChoice {
    /// The gaps between the ways are equal up to a half of the mean gap.
    Spread,
    /// Multiples of a right angle, or of half of one if there are more than four ways.
    RightAngles,
}

#[derive(Clone, Copy, ValueEnum)]
enum RobotChoice {
    /// The reference robot.
    Reference,
    /// The small robot (docs/small-robot.md).
    Small,
}

#[derive(Clone, Copy, ValueEnum)]
enum PriorChoice {
    /// All n-grams of the path itself.
    Path,
    /// One noisy n-gram for every walk of n places, from an earlier exploration of the whole environment.
    Exploration,
    /// No prior: only the n-grams of the path so far.
    None,
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

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// One JSON object.
    Json,
    /// A table.
    Table,
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

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let default = if arguments.course.hints.ways { FilterArgument::Ordered } else { FilterArgument::Robust };
    let filters = arguments.filter.chosen(default, arguments.plot.is_some())?;
    let evaluations = filters
        .iter()
        .map(|&filter| arguments.course.settings(filter, arguments.filter.robot))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let settings = &evaluations[0];
    // All errors in the files are reported before the first path starts.
    let cases = arguments.cases.load()?;
    if let Some(directory) = &arguments.export {
        export(directory, &cases, settings).context("--export")?;
    }
    let mut report = Report { settings: SettingsReport::of(settings, &filters), rows: Vec::new() };
    for case in &cases {
        for settings in &evaluations {
            report.rows.extend(evaluate_with_progress(case, settings)?);
        }
    }
    if let Some(directory) = &arguments.plot {
        plot(directory, &cases, &report.rows, &filters, settings.longest()).context("--plot")?;
    }
    match arguments.format {
        Format::Json => println!("{}", serde_json::to_string(&report)?),
        Format::Table => print!("{report}"),
    }
    Ok(())
}

/// Evaluates one filter in one case, with progress and warnings on the standard error.
fn evaluate_with_progress(case: &Case, settings: &Settings) -> anyhow::Result<Vec<Row>> {
    let title = format!("{}, {} filter", case.name, settings.filter.name());
    let bar = Progress::new(title.clone(), settings.paths, "paths");
    let rows = evaluate(case, settings, || bar.increment()).with_context(|| title.clone())?;
    drop(bar);
    if let Some(row) = rows.first() {
        if row.paths_not_exhaustive > 0 {
            eprintln!("{title}: {} of {} paths do not traverse every edge", row.paths_not_exhaustive, row.paths);
        }
        if row.vertices_full > 0 {
            eprintln!("{title}: a map had no room for a vertex, {} times in all", row.vertices_full);
        }
    }
    Ok(rows)
}

/// Plots two filters side by side at the last check point.
fn plot(directory: &Path, cases: &[Case], rows: &[Row], filters: &[Filter], length: usize) -> anyhow::Result<()> {
    let judged = |filter: &Filter| {
        let name = filter.name();
        rows.iter().filter(move |row| row.filter == name && row.length == length)
    };
    let [first, second] = filters else { return Ok(()) };
    let pairs: Vec<Pair> = cases
        .iter()
        .zip(judged(first).zip(judged(second)))
        .map(|(case, (first_row, second_row))| {
            let mut places = case.environments.iter().map(|environment| environment.places().len());
            let first = places.next();
            Pair { rows: [first_row, second_row], places: first.filter(|&first| places.all(|places| places == first)) }
        })
        .collect();
    fs::create_dir_all(directory).with_context(|| directory.display().to_string())?;
    for (name, quantity) in [("fig4.svg", Quantity::Consistency), ("fig5.svg", Quantity::Vertices)] {
        let file = directory.join(name);
        fs::write(&file, draw(quantity, &pairs)).with_context(|| file.display().to_string())?;
    }
    Ok(())
}

impl CaseArguments {
    fn load(&self) -> anyhow::Result<Vec<Case>> {
        let environments = self.environments.iter().map(|file| {
            Environment::load(file).map(Case::from).with_context(|| format!("--environment {}", file.display()))
        });
        let placements = self
            .placements
            .iter()
            .map(|placements| placements.load().with_context(|| format!("--placements {}", placements.file.display())));
        let families =
            self.families.iter().map(|family| Case::of_family(family).with_context(|| format!("--family {family}")));
        environments.chain(placements).chain(families).collect()
    }
}

impl CourseArguments {
    fn settings(&self, filter: Filter, robot: Option<RobotChoice>) -> anyhow::Result<Settings> {
        let ngram_length = NgramLength::new(self.ngram_length).context("--ngram-length")?;
        let lengths: Vec<usize> = self.lengths.iter().map(|length| length.get()).collect();
        ensure!(lengths.is_sorted_by(|shorter, longer| shorter < longer), "--lengths: must be in ascending order");
        let filter = match filter {
            Filter::Paper(config) => Filter::Paper(config.with_ngram_length(self.ngram_length)),
            Filter::Robust(_) | Filter::Ordered(_) => filter,
        };
        Ok(Settings {
            paths: self.paths.get(),
            lengths,
            walk: self.walk,
            seed: self.seed,
            filter,
            capacities: match robot {
                None | Some(RobotChoice::Reference) => Capacities::Reference,
                Some(RobotChoice::Small) => Capacities::Small,
            },
            prior: match self.prior {
                PriorChoice::Path => PriorSource::Path,
                PriorChoice::Exploration => PriorSource::Exploration,
                PriorChoice::None => PriorSource::None,
            },
            refinement_steps: self.refinement_steps,
            prior_refinement_steps: self.prior_refinement_steps,
            search_from_truth: self.from_truth,
            hints: self.hints,
            bearings: match self.bearings {
                BearingsChoice::Spread => Bearings::Spread,
                BearingsChoice::RightAngles => Bearings::RightAngles,
            },
            fingerprint_bits: self.fingerprint_bits,
            ngram_length,
            threads: self.threads,
        })
    }
}

impl FilterArguments {
    /// The selected filter or the default; for a comparison the default and the paper's filter.
    fn chosen(&self, default: FilterArgument, compares: bool) -> anyhow::Result<Vec<Filter>> {
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
