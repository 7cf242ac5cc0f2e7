//! `toposlam evaluate`: the rate of exact maps over many random paths through known environments.

mod filter;

use super::filter::FilterArgument;
use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use filter::{FilterArguments, RobotChoice};
use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};
use toposlam::{NgramLength, PaperConfig};
use toposlam_cli::progress::Progress;
use toposlam_cli::{errln, outln, output};
use toposlam_eval::{
    case::{Case, Placements},
    corridors::Bearings,
    environment::Environment,
    export::export,
    family::Family,
    figure::{Pair, Quantity, draw},
    hints::Hints,
    prior::PriorSource,
    reliability,
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
    /// Run the default filter and the paper's on the same paths, and write the paper's Fig. 4 and 5 as fig4.svg and fig5.svg, and the
    /// reliability of the probability of a map as reliability.svg, to this directory.
    #[arg(long, value_name = "DIR", conflicts_with = "filter")]
    plot: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
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

#[derive(Clone, Copy, ValueEnum)]
enum BearingsChoice {
    /// The gaps between the ways are equal up to a half of the mean gap.
    Spread,
    /// Multiples of a right angle, or of half of one if there are more than four ways.
    RightAngles,
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
enum Format {
    /// One JSON object.
    Json,
    /// A table.
    Table,
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
    for directory in [&arguments.export, &arguments.plot].into_iter().flatten() {
        output::check_directory(directory, arguments.force)?;
    }
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
        plot(directory, &cases, &report, &filters, settings.longest()).context("--plot")?;
    }
    match arguments.format {
        Format::Json => outln!("{}", serde_json::to_string(&report)?)?,
        Format::Table => output::write_bytes(format!("{report}").as_bytes())?,
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
            errln!("{title}: {} of {} paths do not traverse every edge", row.paths_not_exhaustive, row.paths);
        }
        if row.vertices_full > 0 {
            errln!("{title}: a map had no room for a vertex, {} times in all", row.vertices_full);
        }
    }
    Ok(rows)
}

/// Plots two filters side by side at the last check point.
fn plot(directory: &Path, cases: &[Case], report: &Report, filters: &[Filter], length: usize) -> anyhow::Result<()> {
    let judged = |filter: &Filter| {
        let name = filter.name();
        report.rows.iter().filter(move |row| row.filter == name && row.length == length)
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
    let file = directory.join("reliability.svg");
    let diagrams: Vec<_> = report.reliability().collect();
    fs::write(&file, reliability::draw(&diagrams)).with_context(|| file.display().to_string())
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
