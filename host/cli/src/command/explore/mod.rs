//! `toposlam explore`: the rates of exact maps and of reached goals over many explorations of a simulated robot.

mod run;
mod table;

use anyhow::ensure;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use toposlam_cli::outln;
use toposlam_cli::progress::Progress;
use toposlam_eval::parallel;
use toposlam_sim::hardware::Hardware;
use toposlam_sim::world::{Plan, RobotModel};

use super::drive::{fault_rate, load_plan, noise_factor, number_in, start};
use super::filter::FilterArgument;
use super::hardware::{HardwareArguments, for_filter_and_ring};
use run::{Run, explore};
use table::{Case, Report};

/// Arguments of `toposlam explore`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Floor plans: names of built-in plans, or files (docs/plans.md).
    #[arg(long, value_name = "PLAN,...", value_delimiter = ',', default_value = "office,ring,flat")]
    plans: Vec<PathBuf>,
    /// Start of the robot, in metres in the frame of the only plan [default: the start of the plan, or its most open place].
    #[arg(long, value_name = "X,Y", value_parser = start, allow_hyphen_values = true)]
    start: Option<(f64, f64)>,
    /// Factors on every noise of the robot, 0 to 100.
    #[arg(long, value_name = "FACTOR,...", value_delimiter = ',', default_value = "1,2", value_parser = noise_factor)]
    noises: Vec<f64>,
    /// Runs for each plan and noise.
    #[arg(long, default_value_t = 100)]
    runs: usize,
    /// Seed of the first run of each plan and noise; every next run has the next seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Places per exploration.
    #[arg(long, default_value_t = 300)]
    places: usize,
    /// Filter that makes the map.
    #[arg(long, value_enum, default_value_t = FilterArgument::Ordered)]
    filter: FilterArgument,
    /// Goals after each exploration that ended with the exact map.
    #[arg(long, alias = "journeys", default_value_t = 5)]
    goals: u64,
    #[command(flatten)]
    hardware: HardwareArguments,
    /// Bit mask of dead sonars; bit 0 is the first sonar, straight ahead in an even ring.
    #[arg(long, value_name = "MASK", default_value_t = 0)]
    dead_sonars: u32,
    /// Probability that an echo is missed, 0 to 1 [default: 0.02 times the noise factor].
    #[arg(long, value_name = "P", value_parser = fault_rate)]
    missed: Option<f64>,
    /// Largest angle of incidence at which a wall returns an echo, in degrees, 0 to 90 [default: 25].
    #[arg(long, value_name = "DEGREES", value_parser = degrees)]
    specular_limit_deg: Option<f64>,
    /// Fault rate of the ring and the line, 0 to 1: the probability that a sonar echo is lost. Every other rate is proportional to it
    /// (docs/faults.md).
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = fault_rate)]
    faults: f64,
    /// Add a row for each run.
    #[arg(long)]
    runs_table: bool,
    /// Output format.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Tables.
    Table,
    /// One JSON object (docs/driving.md).
    Json,
}

/// An angle of incidence.
fn degrees(text: &str) -> Result<f64, String> {
    number_in(text, 0.0..=90.0)
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    ensure!(arguments.runs > 0, "--runs must be at least 1");
    ensure!(arguments.places > 0, "--places must be at least 1");
    ensure!(arguments.start.is_none() || arguments.plans.len() == 1, "--start needs exactly one plan");
    let given = arguments.hardware.load()?;
    // Another robot is compared with the reference robot.
    let name = arguments.hardware.name();
    let mut robots = vec![(name.as_str(), given)];
    if !name.is_empty() {
        robots.push(("", Hardware::reference()));
    }
    let is_table = arguments.format == Format::Table;
    let mut report = Report::new(arguments);
    if is_table {
        Report::print_header()?;
    }
    for plan_name in &arguments.plans {
        let plan = load_plan(plan_name, arguments.start)?;
        let plan_name = plan_name.to_string_lossy();
        for &noise in &arguments.noises {
            for (robot, hardware) in &robots {
                let title =
                    [&*plan_name, *robot, "noise"].iter().filter(|part| !part.is_empty()).copied().collect::<Vec<_>>();
                let title = format!("{} {noise}", title.join(" "));
                let progress = Progress::new(title, arguments.runs * arguments.places, "places");
                let one =
                    |run| one(arguments, &plan, noise, arguments.seed.wrapping_add(run as u64), hardware, &progress);
                let runs = parallel::map(arguments.runs, 0, one)?.into_iter().collect::<anyhow::Result<Vec<Run>>>()?;
                drop(progress);
                let case = Case { plan: plan_name.clone().into_owned(), robot: (*robot).to_owned(), noise, runs };
                if is_table {
                    outln!("{}", case.row(arguments.places))?;
                }
                report.cases.push(case);
            }
        }
    }
    if is_table {
        report.print_details(arguments.runs_table)?;
    } else {
        outln!("{}", report.json(arguments.runs_table))?;
    }
    Ok(())
}

/// One run.
fn one(
    arguments: &Arguments,
    plan: &Plan,
    noise: f64,
    seed: u64,
    hardware: &Hardware,
    progress: &Progress,
) -> anyhow::Result<Run> {
    let model = arguments.model(hardware, noise);
    for_filter_and_ring!(
        arguments.filter,
        hardware.ring.sonars,
        explore(arguments, plan, (&model, hardware), seed, progress)
    )
}

impl Arguments {
    /// The motion and the sonars of the robot, with noise.
    fn model(&self, hardware: &Hardware, noise: f64) -> RobotModel {
        let mut model = hardware.model().with_noise(noise);
        model.sonar.dead_sonars = self.dead_sonars;
        model.sonar.missed_share = self.missed.unwrap_or(model.sonar.missed_share);
        if let Some(limit_deg) = self.specular_limit_deg {
            model.sonar.specular_limit_rad = limit_deg.to_radians();
        }
        model
    }
}
