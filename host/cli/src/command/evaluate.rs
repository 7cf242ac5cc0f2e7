//! `toposlam evaluate`: many random paths through known environments, and how often their maps are right.

use super::filter::FilterArgument;
use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};
use toposlam::{Config, Direction, NgramLength, RobustConfig};
use toposlam_eval::{
    case::{Case, Placements},
    environment::Environment,
    export::export,
    family::Family,
    figure::{Pair, Quantity, draw},
    hints::Hints,
    prior::PriorSource,
    report::{Report, Row, SettingsReport},
    run::evaluate,
    settings::{Filter, Settings},
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
    /// Write what the filter sees on each path, and the truth, as files below this directory.
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Run both filters on the same paths, and draw the paper's Fig. 4 and 5 for both here: fig4.svg and fig5.svg.
    #[arg(long, value_name = "DIR", conflicts_with = "filter")]
    plot: Option<PathBuf>,
    /// What to print on the standard output.
    #[arg(long, default_value = "json")]
    format: Format,
}

/// Where the paths lead.
#[derive(Args)]
#[group(required = true, multiple = true)]
struct CaseArguments {
    /// Environment files.
    #[arg(long = "environment", value_name = "FILE.toml", num_args = 1..)]
    environments: Vec<PathBuf>,
    /// The environment of a file with COUNT other random placements of its labels.
    #[arg(long, value_name = "SEED,COUNT,FILE.toml")]
    placements: Vec<Placements>,
    /// COUNT random environments of V_MIN to V_MAX places. DEGREE (mean number of neighbours), LABELS (number of
    /// categories) and NOISE (standard deviation of fingerprints, in metres) are numbers or ranges A-B. CLASS is
    /// general or right-resolving.
    #[arg(long = "family", value_name = "SEED,COUNT,V_MIN,V_MAX,DEGREE,LABELS,NOISE[,CLASS]")]
    families: Vec<Family>,
}

/// What happens on the paths.
#[derive(Args)]
struct CourseArguments {
    /// How many paths to draw in each environment, or evenly over all environments of a family.
    #[arg(long, value_name = "P", default_value = "500")]
    paths: NonZeroUsize,
    /// After how many places of a path its map is judged. If the last number is 100 or more, paths that miss an edge are
    /// drawn again.
    #[arg(long, alias = "length", value_name = "T,...", default_value = "100", value_delimiter = ',')]
    lengths: Vec<NonZeroUsize>,
    /// The seed of paths, noise, hints and filter.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Where the n-grams of the environment come from.
    #[arg(long, default_value = "none")]
    prior: PriorChoice,
    /// What the filter is told besides fingerprints: none, turn, degree or both; missing and wrong are probabilities.
    #[arg(long, value_name = "HINTS[,missing=P,wrong=P]", default_value = "none")]
    hints: Hints,
    /// How many slices of the time between two places the robust filter uses; on a robot there is one for each ring frame.
    #[arg(long, value_name = "SLICES", default_value_t = 10)]
    polish: u32,
    /// How many slices the robust filter uses after each place of the n-grams of a prior.
    #[arg(long, value_name = "SLICES", default_value_t = 10)]
    polish_prior: u32,
    /// At each check point, also search for so many slices from the true path, and report how often the search leaves it
    /// for a better map: what no search could do better with this score. 0: no search.
    #[arg(long, value_name = "SLICES", default_value_t = 0)]
    from_truth: u32,
    /// How many bits a fingerprint has, 1 to 12.
    #[arg(long, value_name = "B", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=12))]
    fingerprint_bits: u32,
    /// n, how many labels an n-gram has, from 2 to 7.
    #[arg(long, value_name = "n", default_value_t = Config::DEFAULT.ngram_length)]
    ngram_length: u8,
    /// How many threads; as many as there are processors when 0.
    #[arg(long, value_name = "THREADS", default_value_t = 0)]
    threads: usize,
}

/// The filter and its parameters. Those of another filter are refused.
#[derive(Args)]
struct FilterArguments {
    /// The filter to evaluate.
    #[arg(long, default_value = "robust")]
    filter: FilterArgument,
    /// How many hypotheses (robust) or particles (paper) the filter keeps, 1 to 100 [default: 10].
    #[arg(long, alias = "particles", value_name = "N")]
    hypotheses: Option<u8>,
    /// Robust: a first guess at the standard deviation of a fingerprint, in millimetres.
    #[arg(long, value_name = "MM")]
    noise_mm: Option<u16>,
    /// Robust: how many repair moves are tried at each place.
    #[arg(long, value_name = "R")]
    moves: Option<u8>,
    /// Robust: how often the filter takes a turn for wrong, in whole thousandths.
    #[arg(long, value_name = "P", value_parser = permille)]
    wrong_turn: Option<u16>,
    /// Robust: how often the filter takes a degree for wrong, in whole thousandths.
    #[arg(long, value_name = "P", value_parser = permille)]
    wrong_degree: Option<u16>,
    /// Paper: which half of Eq. 2 the filter takes [default: two-sided].
    #[arg(long)]
    consistency: Option<ConsistencyChoice>,
    /// Paper: sigma_l of Eq. 7 and 9, in millimetres [default: 50].
    #[arg(long, value_name = "MM")]
    sigma_label_mm: Option<u16>,
    /// Paper: sigma_c of Eq. 8, in millimetres [default: 30].
    #[arg(long, value_name = "MM")]
    sigma_consistency_mm: Option<u16>,
    /// Paper: phi of Eq. 9, in whole thousandths [default: 0.1].
    #[arg(long, value_name = "PHI", value_parser = permille)]
    penalty: Option<u16>,
}

#[derive(Clone, Copy, ValueEnum)]
enum PriorChoice {
    /// All of the path itself, known before it starts.
    Path,
    /// One noisy n-gram for every walk of n places, from an earlier exploration of the whole environment.
    Exploration,
    /// Only what the path has brought so far.
    None,
}

#[derive(Clone, Copy, ValueEnum)]
enum ConsistencyChoice {
    /// Eq. 2 as printed.
    TwoSided,
    /// Every walk of the map must be near something observed.
    MapToHistory,
    /// Everything observed must be near a walk of the map.
    HistoryToMap,
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// One JSON object.
    Json,
    /// A table to read.
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
    let filters = arguments.filter.chosen(arguments.plot.is_some())?;
    let evaluations =
        filters.iter().map(|&filter| arguments.course.settings(filter)).collect::<anyhow::Result<Vec<_>>>()?;
    let settings = &evaluations[0];
    // Everything that can be wrong with the files is known before the first path is driven.
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
        plot(directory, &cases, &report.rows, settings.longest()).context("--plot")?;
    }
    match arguments.format {
        Format::Json => println!("{}", serde_json::to_string(&report)?),
        Format::Table => print!("{report}"),
    }
    Ok(())
}

/// Evaluates one filter in one case, with a bar on the standard error, and says there what a reader should know.
fn evaluate_with_progress(case: &Case, settings: &Settings) -> anyhow::Result<Vec<Row>> {
    let title = format!("{}, {} filter", case.name, settings.filter.name());
    let bar = ProgressBar::new(settings.paths as u64).with_message(title.clone());
    bar.set_style(ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} paths {eta}")?);
    let rows = evaluate(case, settings, || bar.inc(1)).with_context(|| title.clone())?;
    bar.finish_and_clear();
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

/// Draws both filters side by side at the last check point.
fn plot(directory: &Path, cases: &[Case], rows: &[Row], length: usize) -> anyhow::Result<()> {
    let judged = |filter| rows.iter().filter(move |row| row.filter == filter && row.length == length);
    let pairs: Vec<Pair> = cases
        .iter()
        .zip(judged("robust").zip(judged("paper")))
        .map(|(case, (robust, paper))| {
            let mut places = case.environments.iter().map(|environment| environment.places().len());
            let first = places.next();
            Pair { rows: [robust, paper], places: first.filter(|&first| places.all(|places| places == first)) }
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
    fn settings(&self, filter: Filter) -> anyhow::Result<Settings> {
        let ngram_length = NgramLength::new(self.ngram_length).context("--ngram-length")?;
        let lengths: Vec<usize> = self.lengths.iter().map(|length| length.get()).collect();
        ensure!(lengths.is_sorted_by(|shorter, longer| shorter < longer), "--lengths: must be in ascending order");
        let filter = match filter {
            Filter::Paper(config) => Filter::Paper(config.with_ngram_length(self.ngram_length)),
            Filter::Robust(config) => Filter::Robust(config),
        };
        Ok(Settings {
            paths: self.paths.get(),
            lengths,
            seed: self.seed,
            filter,
            prior: match self.prior {
                PriorChoice::Path => PriorSource::Path,
                PriorChoice::Exploration => PriorSource::Exploration,
                PriorChoice::None => PriorSource::None,
            },
            polish: self.polish,
            polish_prior: self.polish_prior,
            search_from_truth: self.from_truth,
            hints: self.hints,
            fingerprint_bits: self.fingerprint_bits,
            ngram_length,
            threads: self.threads,
        })
    }
}

impl FilterArguments {
    /// The filter that was asked for, or both, ours first.
    fn chosen(&self, both: bool) -> anyhow::Result<Vec<Filter>> {
        let of_robust = [
            ("--noise-mm", self.noise_mm.is_some()),
            ("--moves", self.moves.is_some()),
            ("--wrong-turn", self.wrong_turn.is_some()),
            ("--wrong-degree", self.wrong_degree.is_some()),
        ];
        let of_paper = [
            ("--consistency", self.consistency.is_some()),
            ("--sigma-label-mm", self.sigma_label_mm.is_some()),
            ("--sigma-consistency-mm", self.sigma_consistency_mm.is_some()),
            ("--penalty", self.penalty.is_some()),
        ];
        if both {
            return Ok(vec![self.robust(), self.paper()]);
        }
        let (filter, other, foreign) = match self.filter {
            FilterArgument::Robust => (self.robust(), "paper", of_paper),
            FilterArgument::Paper => (self.paper(), "robust", of_robust),
        };
        let given = foreign.iter().find(|(_, given)| *given);
        ensure!(given.is_none(), "{} needs --filter {other}", given.map_or("", |(name, _)| name));
        Ok(vec![filter])
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
        let default = Config::DEFAULT;
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
