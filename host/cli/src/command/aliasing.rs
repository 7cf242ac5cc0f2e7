//! `toposlam aliasing`: which n-grams distinguish places with equal labels.

use anyhow::ensure;
use clap::Args;
use std::{num::NonZeroUsize, path::PathBuf};
use toposlam_cli::{outln, output};
use toposlam_eval::aliasing::{GraphKind, Study, figure::draw};

/// Arguments of `toposlam aliasing`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Numbers of places.
    #[arg(long, value_name = "V,...", default_value = "6,9,12,16", value_delimiter = ',')]
    places: Vec<usize>,
    /// Mean numbers of neighbours of a place, one kind of planar graphs for each.
    #[arg(long, value_name = "DEGREE,...", default_value = "2,3", value_delimiter = ',')]
    degree: Vec<f64>,
    /// Environments of each kind and size.
    #[arg(long, value_name = "COUNT", default_value = "60")]
    environments: NonZeroUsize,
    /// Seed of the environments.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Nodes that the search expands for each n, at most.
    #[arg(long, value_name = "NODES", default_value_t = 20_000)]
    most_nodes: u64,
    /// Threads; 0 for one per processor.
    #[arg(long, value_name = "THREADS", default_value_t = 0)]
    threads: usize,
    /// Draw the result to this file.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
    /// Print every environment as JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    ensure!(arguments.places.iter().all(|places| (3..=64).contains(places)), "--places: must be 3 to 64");
    ensure!(arguments.degree.iter().all(|degree| (1.0..=5.0).contains(degree)), "--degree: must be 1 to 5");
    if let Some(file) = &arguments.plot {
        output::check(file, arguments.force)?;
    }
    let study = Study {
        kinds: arguments.degree.iter().map(|&degree| GraphKind::Planar(degree)).chain([GraphKind::Grid]).collect(),
        places: arguments.places.clone(),
        environments: arguments.environments.get(),
        seed: arguments.seed,
        most_nodes: arguments.most_nodes,
        threads: arguments.threads,
    };
    let report = study.run()?;
    if let Some(file) = &arguments.plot {
        output::write_file(file, draw(&report), arguments.force)?;
    }
    if arguments.json {
        outln!("{}", serde_json::to_string(&report)?)?;
    } else {
        output::write_bytes(report.to_string().as_bytes())?;
    }
    Ok(())
}
