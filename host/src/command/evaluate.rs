//! `toposlam evaluate`: many random paths through known environments, and how often their maps are right.

use anyhow::{Context, ensure};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use std::{num::NonZeroUsize, path::PathBuf};
use toposlam::{Config, Direction};
use toposlam_host::evaluation::{
    environment::Environment,
    prior::PriorSource,
    report::Report,
    run::{Settings, VERTICES, evaluate},
};

/// Arguments of `toposlam evaluate`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Environment files.
    #[arg(long = "environment", value_name = "FILE.toml", required = true, num_args = 1..)]
    environments: Vec<PathBuf>,
    /// How many paths to draw in each environment.
    #[arg(long, value_name = "P", default_value = "500")]
    paths: NonZeroUsize,
    /// How many places a path visits; from 100 on, paths that miss an edge are drawn again.
    #[arg(long, value_name = "T", default_value = "100")]
    length: NonZeroUsize,
    /// How many particles the filter draws.
    #[arg(long, value_name = "N", default_value_t = Config::default().particles)]
    particles: u8,
    /// The seed of paths, noise and filter.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// The filter to evaluate.
    #[arg(long, default_value = "paper")]
    filter: FilterChoice,
    /// Where the n-grams of the environment come from.
    #[arg(long, default_value = "path")]
    prior: PriorChoice,
    /// Which half of Eq. 2 the filter takes.
    #[arg(long, default_value = "two-sided")]
    consistency: ConsistencyChoice,
    /// sigma_l of Eq. 7 and 9, in millimetres.
    #[arg(long, value_name = "MM", default_value_t = Config::default().sigma_label_mm)]
    sigma_label_mm: u16,
    /// sigma_c of Eq. 8, in millimetres.
    #[arg(long, value_name = "MM", default_value_t = Config::default().sigma_consistency_mm)]
    sigma_consistency_mm: u16,
    /// phi of Eq. 9, in whole thousandths from 0 up to 0.999.
    #[arg(long, value_name = "PHI", default_value_t = f64::from(Config::default().penalty_permille) / 1000.0)]
    penalty: f64,
    /// n, from 2 to 7.
    #[arg(long, value_name = "n", default_value_t = Config::default().ngram_length)]
    ngram_length: u8,
    /// What to print on the standard output.
    #[arg(long, default_value = "json")]
    format: Format,
}

#[derive(Clone, Copy, ValueEnum)]
enum FilterChoice {
    /// The particle filter of the paper, Eq. 2 to 9.
    Paper,
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

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let settings = settings(arguments)?;
    // Everything that can be wrong with the files is known before the first path is driven.
    let environments = arguments
        .environments
        .iter()
        .map(|file| Environment::load(file).with_context(|| file.display().to_string()))
        .collect::<anyhow::Result<Vec<_>>>()?;

    let mut report = Report { environments: Vec::new() };
    for environment in &environments {
        let name = environment.name();
        let bar = ProgressBar::new(settings.paths as u64).with_message(name.to_owned());
        bar.set_style(ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} paths {eta}")?);
        let outcome = evaluate(environment, &settings, || bar.inc(1)).with_context(|| name.to_owned())?;
        bar.finish_and_clear();
        if outcome.paths_not_exhaustive > 0 {
            let missed = outcome.paths_not_exhaustive;
            eprintln!("{name}: {missed} of {} paths do not traverse every edge", settings.paths);
        }
        if outcome.vertices_full > 0 {
            let full = outcome.vertices_full;
            eprintln!("{name}: a map wanted more than {VERTICES} vertices, {full} times in all");
        }
        report.environments.push(outcome.report);
    }
    match arguments.format {
        Format::Json => println!("{}", serde_json::to_string(&report)?),
        Format::Table => print!("{report}"),
    }
    Ok(())
}

fn settings(arguments: &Arguments) -> anyhow::Result<Settings> {
    let FilterChoice::Paper = arguments.filter;
    let penalty_permille = (arguments.penalty * 1000.0).round();
    let whole = (penalty_permille / 1000.0 - arguments.penalty).abs() < 1e-9;
    ensure!(whole && (0.0..1000.0).contains(&penalty_permille), "--penalty: whole thousandths from 0 up to 0.999");
    Ok(Settings {
        paths: arguments.paths.get(),
        length: arguments.length.get(),
        seed: arguments.seed,
        prior: match arguments.prior {
            PriorChoice::Path => PriorSource::Path,
            PriorChoice::Exploration => PriorSource::Exploration,
            PriorChoice::None => PriorSource::None,
        },
        config: Config {
            ngram_length: arguments.ngram_length,
            particles: arguments.particles,
            penalty_permille: penalty_permille as u16,
            sigma_label_mm: arguments.sigma_label_mm,
            sigma_consistency_mm: arguments.sigma_consistency_mm,
            direction: match arguments.consistency {
                ConsistencyChoice::TwoSided => Direction::TwoSided,
                ConsistencyChoice::MapToHistory => Direction::MapToHistory,
                ConsistencyChoice::HistoryToMap => Direction::HistoryToMap,
            },
        },
    })
}
