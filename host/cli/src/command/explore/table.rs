//! The tables and the JSON object of `toposlam explore`.

use serde_json::{Value, json};
use toposlam_cli::outln;
use toposlam_cli::output::OutputError;
use toposlam_sim::world::HintReport;

use super::Arguments;
use super::run::{Journeys, Run};

/// All runs of a plan, a robot and a noise.
pub(super) struct Case {
    pub(super) plan: String,
    /// The files of the robot; empty for the reference robot.
    pub(super) robot: String,
    pub(super) noise: f64,
    pub(super) runs: Vec<Run>,
}

/// All cases.
pub(super) struct Report {
    settings: Value,
    pub(super) cases: Vec<Case>,
}

impl Case {
    /// The plan, and the robot if it is not the reference robot.
    fn name(&self) -> String {
        if self.robot.is_empty() { self.plan.clone() } else { format!("{}, {}", self.plan, self.robot) }
    }

    fn count(&self, of: impl Fn(&Run) -> bool) -> usize {
        self.runs.iter().filter(|run| of(run)).count()
    }

    /// The share of the runs for which something holds.
    fn share(&self, of: impl Fn(&Run) -> bool) -> f64 {
        self.count(of) as f64 / self.runs.len() as f64
    }

    fn mean(&self, of: impl Fn(&Run) -> f64) -> f64 {
        self.runs.iter().map(of).sum::<f64>() / self.runs.len() as f64
    }

    fn sum(&self, of: impl Fn(&Run) -> usize) -> usize {
        self.runs.iter().map(of).sum()
    }

    fn journeys(&self, of: impl Fn(&Journeys) -> u64) -> u64 {
        self.runs.iter().map(|run| of(&run.journeys)).sum()
    }

    /// The row of the first table.
    pub(super) fn row(&self, places: usize) -> String {
        let mut errors_mm: Vec<f64> = self
            .runs
            .iter()
            .flat_map(|run| run.report.radius_errors_mm.iter().map(|error_mm| error_mm.abs()))
            .collect();
        errors_mm.sort_by(f64::total_cmp);
        let rank = |share: f64| errors_mm.get((share * errors_mm.len() as f64) as usize).copied().unwrap_or(0.0);
        let frames = self.runs.iter().map(|run| run.frames).sum::<u64>() / (self.runs.len() * places) as u64;
        format!(
            "| {} | {} | {:.0} % | {:.0} % | {:.0} % | {:.0} % | {:.1} % | {:.2} | {} / {} / {} / {} | {:.0} / {:.0} mm | {} / {} | {} | {} | {} \
             | {frames} | {} / {} / {} |",
            self.name(),
            self.noise,
            100.0 * self.share(|run| run.score.exact),
            100.0 * self.share(|run| run.visited_all),
            100.0 * self.share(|run| run.complete),
            100.0 * self.share(|run| run.exact_and_whole),
            100.0 * self.mean(|run| run.score.location),
            self.mean(|run| run.score.edge_f1),
            self.sum(|run| run.report.found),
            self.sum(|run| run.report.missed),
            self.sum(|run| run.report.doubled),
            self.sum(|run| run.report.phantom),
            rank(0.5),
            rank(0.9),
            self.sum(|run| run.report.degrees.0),
            self.sum(|run| run.report.degrees.1),
            self.sum(|run| run.lost as usize),
            self.sum(|run| run.wall_frames as usize),
            self.count(|run| run.stuck),
            self.journeys(|journeys| journeys.arrived),
            self.journeys(|journeys| journeys.asked),
            self.journeys(|journeys| journeys.elsewhere),
        )
    }

    fn json(&self, with_runs: bool) -> Value {
        let runs = |run: &Run| {
            json!({
                "seed": run.seed, "places": run.places, "exact": run.score.exact, "visited_all": run.visited_all,
                "complete": run.complete, "exact_and_whole": run.exact_and_whole, "located": run.score.location,
                "edge_f1": run.score.edge_f1, "found": run.report.found, "missed": run.report.missed,
                "doubled": run.report.doubled, "phantom": run.report.phantom, "lost": run.lost,
                "wall_frames": run.wall_frames, "stuck": run.stuck, "frames": run.frames,
            })
        };
        let mut row = json!({
            "plan": self.plan,
            "robot": if self.robot.is_empty() { "reference" } else { self.robot.as_str() },
            "noise": self.noise,
            "runs": self.runs.len(),
            "exact": self.share(|run| run.score.exact),
            "visited_all": self.share(|run| run.visited_all),
            "complete": self.share(|run| run.complete),
            "exact_and_whole": self.share(|run| run.exact_and_whole),
            "located": self.mean(|run| run.score.location),
            "edge_f1": self.mean(|run| run.score.edge_f1),
            "found": self.sum(|run| run.report.found),
            "missed": self.sum(|run| run.report.missed),
            "doubled": self.sum(|run| run.report.doubled),
            "phantom": self.sum(|run| run.report.phantom),
            "lost": self.sum(|run| run.lost as usize),
            "wall_frames": self.sum(|run| run.wall_frames as usize),
            "stuck": self.count(|run| run.stuck),
            "frames": self.runs.iter().map(|run| run.frames).sum::<u64>(),
        });
        if with_runs {
            row["runs_table"] = self.runs.iter().map(runs).collect();
        }
        row
    }
}

impl Report {
    /// A report without cases.
    pub(super) fn new(arguments: &Arguments) -> Self {
        let settings = json!({
            "places": arguments.places, "seed": arguments.seed, "filter": format!("{:?}", arguments.filter).to_lowercase(),
            "goals": arguments.goals, "dead_sonars": arguments.dead_sonars, "missed": arguments.missed,
            "specular_limit_deg": arguments.specular_limit_deg, "faults": arguments.faults,
        });
        Self { settings, cases: Vec::new() }
    }

    /// Prints the head of the first table.
    pub(super) fn print_header() -> Result<(), OutputError> {
        outln!(
            "| Plan | Noise | Exact maps | Visited all | Complete | Exact and whole | Located | Edge F1 | Found / missed / doubled / phantom \
             | Radius error, median / 90 % | Degree seen / right | Way lost | Frames at a wall | Stuck runs | Frames per place \
             | Goals reached / commanded / reached elsewhere |"
        )?;
        outln!("|{}", "---|".repeat(16))
    }

    /// Prints what comes after the first table: the hints, the cost of another robot, and the runs.
    pub(super) fn print_details(&self, with_runs: bool) -> Result<(), OutputError> {
        outln!(
            "\n| Plan | Noise | Exits wrong / unknown | Ways missed / false, of the true ones | Ways unknown | Bearing error, \
             sd / 90 % | Travel time error, sd / 90 %; each direction apart, sd |"
        )?;
        outln!("|{}", "---|".repeat(7))?;
        self.cases.iter().try_for_each(|case| outln!("{}", hint_row(case)))?;
        if self.cases.iter().any(|case| !case.robot.is_empty()) {
            outln!("\n| Robot | Plan | Noise | Exact maps, this robot / the reference robot |\n|---|---|---|---|")?;
        }
        for pair in self.cases.chunks(2).filter(|pair| !pair[0].robot.is_empty()) {
            let exact = |case: &Case| 100.0 * case.share(|run| run.score.exact);
            if let [case, reference] = pair {
                let Case { robot, plan, noise, .. } = case;
                outln!("| {robot} | {plan} | {noise} | {:.0} / {:.0} % |", exact(case), exact(reference))?;
            }
        }
        if with_runs { self.print_runs() } else { Ok(()) }
    }

    fn print_runs(&self) -> Result<(), OutputError> {
        outln!(
            "\n| Plan | Noise | Seed | Exact | Visited all | Complete | Exact and whole | Located | Edge F1 \
             | Found / missed / doubled / phantom | Way lost | Frames at a wall | Stuck | Places | Frames |"
        )?;
        outln!("|{}", "---|".repeat(15))?;
        let yes = |answer: bool| if answer { "yes" } else { "no" };
        for case in &self.cases {
            for run in &case.runs {
                outln!(
                    "| {} | {} | {} | {} | {} | {} | {} | {:.1} % | {:.2} | {} / {} / {} / {} | {} | {} | {} | {} | {} |",
                    case.name(),
                    case.noise,
                    run.seed,
                    yes(run.score.exact),
                    yes(run.visited_all),
                    yes(run.complete),
                    yes(run.exact_and_whole),
                    100.0 * run.score.location,
                    run.score.edge_f1,
                    run.report.found,
                    run.report.missed,
                    run.report.doubled,
                    run.report.phantom,
                    run.lost,
                    run.wall_frames,
                    yes(run.stuck),
                    run.places,
                    run.frames,
                )?;
            }
        }
        Ok(())
    }

    /// One JSON object with the settings and a row for each plan, noise and robot.
    pub(super) fn json(&self, with_runs: bool) -> Value {
        let rows: Vec<Value> = self.cases.iter().map(|case| case.json(with_runs)).collect();
        json!({ "settings": self.settings, "rows": rows })
    }
}

/// The error rates of the hints.
fn hint_row(case: &Case) -> String {
    let mut all = HintReport::default();
    case.runs.iter().for_each(|run| all.add(&run.hints));
    let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    let deviation =
        |errors: &[f64]| (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt();
    let rank = |errors: &[f64]| {
        let mut sizes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get((0.9 * sizes.len() as f64) as usize).copied().unwrap_or(0.0)
    };
    let HintReport { exits, places, ways, bearing_errors_rad, travel_errors, one_way_travel_errors, .. } = &all;
    format!(
        "| {} | {} | {:.2} / {:.2} % | {:.2} / {:.2} % | {:.2} % | {:.0} / {:.0} mrad | {:.1} / {:.1} %; {:.1} % |",
        case.name(),
        case.noise,
        percent(exits.1, exits.0),
        percent(exits.2, exits.0 + exits.2),
        percent(ways.1, ways.0),
        percent(ways.2, ways.0),
        percent(places.1, places.0 + places.1),
        1000.0 * deviation(bearing_errors_rad),
        1000.0 * rank(bearing_errors_rad),
        100.0 * deviation(travel_errors),
        100.0 * rank(travel_errors),
        100.0 * deviation(one_way_travel_errors),
    )
}
