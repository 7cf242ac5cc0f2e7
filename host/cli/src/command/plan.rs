//! `toposlam plan`: the true map of a floor plan, listed and drawn.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use toposlam::drive::DriveConfig;
use toposlam::reference::VERTICES;
use toposlam_cli::picture::{Drawing, draw};
use toposlam_cli::{outln, output};
use toposlam_link::plural::count;
use toposlam_sim::world::{Limits, Plan, Point, TrueMap};

use super::drive::{load_plan, start};

/// The room that the drive of the reference robot keeps between its body and the walls.
const ROOM_MM: f64 = (DriveConfig::DEFAULT.clearance_mm - DriveConfig::DEFAULT.body_radius_mm) as f64;

/// Arguments of `toposlam plan`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Floor plan: the name of a built-in plan, or a file (docs/plans.md).
    plan: PathBuf,
    /// Start of the robot, in metres in the frame of the plan [default: the start of the plan, or its most open place].
    #[arg(long, value_name = "X,Y", value_parser = start, allow_hyphen_values = true)]
    start: Option<(f64, f64)>,
    /// Write the walls and the true map to an SVG file.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long)]
    force: bool,
    /// Half the width of the robot, in millimetres, 1 to 1000000.
    #[arg(long, value_name = "MM", default_value_t = Limits::default().body_radius_mm, value_parser = millimetres)]
    body_radius_mm: f64,
    /// Largest range of the sonars, in millimetres, 1 to 1000000.
    #[arg(long, value_name = "MM", default_value_t = Limits::default().range_max_mm, value_parser = millimetres)]
    range_max_mm: f64,
}

fn millimetres(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|length: &f64| (1.0..=1e6).contains(length))
        .ok_or_else(|| "must be 1 to 1000000".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let name = arguments.plan.display();
    if let Some(file) = &arguments.svg {
        output::check(file, arguments.force)?;
    }
    let plan = load_plan(&arguments.plan, arguments.start)?;
    let limits =
        Limits { body_radius_mm: arguments.body_radius_mm, range_max_mm: arguments.range_max_mm, ..Limits::default() };
    let truth = plan.true_map(&limits);
    let (x_m, y_m) = plan.in_file_m(plan.start());
    outln!(
        "{name}: {:.2} m by {:.2} m, {} wall surfaces, start {x_m:.2},{y_m:.2}",
        plan.width_mm() / 1000.0,
        plan.height_mm() / 1000.0,
        plan.surfaces()
    )?;
    if !plan.fits(plan.start(), limits.body_radius_mm) {
        outln!("warning: the body does not fit at the start")?;
    }
    let truth = truth.with_context(|| format!("floor plan {name}"))?;
    list(&plan, &truth)?;
    warn(&truth, &limits)?;
    let Some(file) = &arguments.svg else { return Ok(()) };
    let mut drawing = Drawing::of_truth(&truth, format!("{name}: {}", size(&truth)));
    // The ways are drawn as they are.
    drawing.edges.clear();
    output::write_file(file, draw(&plan, &truth, &drawing), arguments.force)
}

/// Prints the places, the edges, what was dropped, and the parts that cannot be reached.
fn list(plan: &Plan, truth: &TrueMap) -> anyhow::Result<()> {
    let place = |point: Point| {
        let (x_m, y_m) = plan.in_file_m(point);
        format!("{x_m:8.2},{y_m:.2}")
    };
    outln!("{}", size(truth))?;
    for (index, node) in truth.nodes.iter().enumerate() {
        let hall = if node.is_hall { ", a hall" } else { "" };
        let merged = match node.meet_points.len() {
            1 => String::new(),
            meet_points => format!(", {meet_points} meet points"),
        };
        let (radius_mm, degree) = (node.radius_mm, node.degree);
        outln!(
            "place {index:3} at {:16} radius {radius_mm:5.0} mm, degree {degree}{merged}{hall}",
            place(node.position)
        )?;
    }
    for edge in &truth.edges {
        outln!("edge {:3} - {:3}, {:.2} m", edge.nodes[0], edge.nodes[1], edge.length_mm() / 1000.0)?;
    }
    let dropped = &truth.dropped;
    outln!(
        "meet points that are no places: {} too narrow, {} unreachable, {} on branches to nothing, {} smooth, {} merged, {} in halls",
        dropped.narrow,
        dropped.unreachable,
        dropped.branches,
        dropped.smooth,
        dropped.merged,
        dropped.halls
    )?;
    for part in &truth.unreachable {
        let meet_points = count(part.meet_points, "meet point", "meet points");
        outln!(
            "unreachable: {meet_points} around {}, radius {:.0} mm",
            place(part.position).trim_start(),
            part.radius_mm
        )?;
    }
    Ok(())
}

fn size(truth: &TrueMap) -> String {
    format!("{}, {}", count(truth.nodes.len(), "place", "places"), count(truth.edges.len(), "edge", "edges"))
}

/// Prints what the reference robot cannot cope with.
fn warn(truth: &TrueMap, limits: &Limits) -> anyhow::Result<()> {
    if truth.nodes.len() > VERTICES {
        outln!("warning: {} places, and the map of the reference robot has room for {VERTICES}", truth.nodes.len())?;
    }
    for (index, node) in truth.nodes.iter().enumerate() {
        let room_mm = node.radius_mm - limits.body_radius_mm;
        if room_mm < ROOM_MM {
            outln!(
                "warning: place {index} leaves {room_mm:.0} mm between the body and the walls; the drive of the reference robot keeps {ROOM_MM:.0} mm"
            )?;
        }
        if node.is_hall {
            outln!(
                "warning: place {index} is farther from its walls than the sonars measure ({:.0} mm)",
                limits.range_max_mm
            )?;
        }
    }
    Ok(())
}
