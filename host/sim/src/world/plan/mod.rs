//! Floor plans: walls at any angle, read from text, from a map_server YAML file with its image, or from SVG (docs/plans.md).

mod bitmap;
mod contour;
mod error;
mod map_server;
mod pgm;
mod rings;
mod start;
mod svg;
mod text;

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

pub use error::{PlanError, PlanFileError};

use super::voronoi::VoronoiError;
use super::walls::{Segment, Vertex, Walls};
use super::{Limits, Point, TrueMap};

/// Sides of a cell that are allowed, in millimetres.
const CELL_MM: RangeInclusive<f64> = 10.0..=1000.0;

/// A floor plan: walls, and where the robot starts.
///
/// A clone shares the walls and the true map with the original.
#[derive(Clone, Debug)]
pub struct Plan {
    drawn: Arc<Drawn>,
    start: Point,
    truth: Arc<Mutex<Option<Truth>>>,
}

/// The true map, and for which robot.
type Truth = (Limits, Result<Arc<TrueMap>, VoronoiError>);

/// The part of a plan that does not depend on the start.
#[derive(Debug)]
struct Drawn {
    walls: Walls,
    width_mm: f64,
    height_mm: f64,
    /// The coordinates of the lower left corner in the frame of the file.
    origin_mm: Point,
    start: Point,
}

impl Drawn {
    /// `row_free` says which points of a horizontal line are free. Without a start the robot starts at the most open place.
    fn new(
        segments: Vec<Segment>,
        (width_mm, height_mm): (f64, f64),
        origin_mm: Point,
        start: Option<Point>,
        row_free: impl FnMut(f64, &[f64]) -> Vec<bool>,
    ) -> Result<Self, PlanError> {
        if segments.is_empty() {
            return Err(PlanError::NoFreeSpace);
        }
        let walls = Walls::new(segments, (width_mm, height_mm), row_free);
        let most_open = || start::most_open(&walls, width_mm, height_mm);
        let start = start.or_else(most_open).ok_or(PlanError::NoFreeSpace)?;
        Ok(Self { walls, width_mm, height_mm, origin_mm, start })
    }
}

/// A segment in cells as one in millimetres.
fn scaled(segment: Segment, cell_mm: f64) -> Segment {
    let scaled = |at: Vertex| ((f64::from(at.0) * cell_mm).round() as i32, (f64::from(at.1) * cell_mm).round() as i32);
    Segment { from: scaled(segment.from), to: scaled(segment.to) }
}

impl Plan {
    /// The plans that are compiled in: their names and texts.
    pub const BUILT_IN: [(&'static str, &'static str); 17] = [
        ("ring", include_str!("../../../plans/ring.txt")),
        ("office", include_str!("../../../plans/office.txt")),
        ("flat", include_str!("../../../plans/flat.txt")),
        ("grid", include_str!("../../../plans/grid.txt")),
        ("plus", include_str!("../../../plans/plus.txt")),
        ("comb", include_str!("../../../plans/comb.txt")),
        ("ladder", include_str!("../../../plans/ladder.txt")),
        ("apartment", include_str!("../../../plans/apartment.svg")),
        ("rooms", include_str!("../../../plans/rooms.svg")),
        ("school", include_str!("../../../plans/school.svg")),
        ("lhall", include_str!("../../../plans/lhall.svg")),
        ("ward", include_str!("../../../plans/ward.svg")),
        ("rotunda", include_str!("../../../plans/rotunda.svg")),
        ("wing", include_str!("../../../plans/wing.svg")),
        ("workshop", include_str!("../../../plans/workshop.svg")),
        ("hshape", include_str!("../../../plans/hshape.svg")),
        ("maze", include_str!("../../../plans/maze.svg")),
    ];

    /// The built-in plan of this name.
    pub fn built_in(name: &str) -> Option<Self> {
        let (_, text) = Self::BUILT_IN.iter().find(|(built_in, _)| *built_in == name)?;
        Self::parse(text).ok()
    }

    /// Reads a plan from a file: `.yaml` or `.yml` is a map_server file, `.svg` a drawing, anything else a text plan.
    ///
    /// # Errors
    /// Which file is no plan, and why.
    pub fn load(file: &Path) -> Result<Self, PlanFileError> {
        let at = |error| PlanFileError { file: file.to_owned(), error };
        let extension = file.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("pgm" | "png") => return Err(at(PlanError::NoYaml)),
            Some("yaml" | "yml") => return map_server::load(file).map(Self::from),
            _ => {}
        }
        let text = std::fs::read_to_string(file).map_err(|error| at(PlanError::Read(error.to_string())))?;
        Self::parse(&text).map_err(at)
    }

    /// Reads a plan from the text of a text plan or of an SVG drawing.
    ///
    /// # Errors
    /// What is wrong with the text, and where.
    pub fn parse(text: &str) -> Result<Self, PlanError> {
        let text = text.trim_start_matches('\u{feff}');
        if text.trim_start().starts_with('<') { svg::parse(text) } else { text::parse(text) }.map(Self::from)
    }

    /// The same plan with another start: metres in the frame of the file, whose origin is the lower left corner of a text plan and
    /// of a drawing, and given by the YAML file of an image.
    pub fn with_start_m(self, x_m: f64, y_m: f64) -> Self {
        let Point { x_mm, y_mm } = self.drawn.origin_mm;
        let start = Point::new(1000.0 * x_m - x_mm, 1000.0 * y_m - y_mm);
        Self { start, truth: Arc::default(), ..self }
    }

    /// A point of the plan in metres in the frame of the file, as [`Plan::with_start_m`] takes it.
    pub fn in_file_m(&self, at: Point) -> (f64, f64) {
        let Point { x_mm, y_mm } = self.drawn.origin_mm;
        ((at.x_mm + x_mm) / 1000.0, (at.y_mm + y_mm) / 1000.0)
    }

    /// Width of the plan, in millimetres.
    pub fn width_mm(&self) -> f64 {
        self.drawn.width_mm
    }

    /// Height of the plan, in millimetres.
    pub fn height_mm(&self) -> f64 {
        self.drawn.height_mm
    }

    /// Where the robot starts.
    pub const fn start(&self) -> Point {
        self.start
    }

    /// Whether a point lies in a wall. Everything outside the plan is wall.
    pub fn is_wall_at(&self, at: Point) -> bool {
        !self.walls().is_free(at)
    }

    /// Whether a round body has room at a point.
    pub fn fits(&self, centre: Point, radius_mm: f64) -> bool {
        self.walls().fits(centre, radius_mm)
    }

    /// How many straight pieces the surfaces of the walls have.
    pub fn surfaces(&self) -> usize {
        self.walls().segments().len()
    }

    /// The surfaces of the walls as closed rings of corners, free space on the left.
    pub fn outlines(&self) -> Vec<Vec<Point>> {
        self.walls().rings()
    }

    /// The true map for a robot, computed once for the plan and its clones.
    ///
    /// # Errors
    /// When the start does not reach any place.
    pub fn true_map(&self, limits: &Limits) -> Result<Arc<TrueMap>, VoronoiError> {
        let mut truth = self.truth.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, map)) = &*truth
            && known == limits
        {
            return map.clone();
        }
        let map = TrueMap::of(self, limits).map(Arc::new);
        *truth = Some((*limits, map.clone()));
        map
    }

    pub(super) fn walls(&self) -> &Walls {
        &self.drawn.walls
    }
}

impl From<Drawn> for Plan {
    fn from(drawn: Drawn) -> Self {
        Self { start: drawn.start, drawn: Arc::new(drawn), truth: Arc::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closet_has_four_faces_and_four_corners() {
        let plan = Plan::parse("cell_mm 500\n####\n#S.#\n####\n").unwrap();
        assert_eq!((plan.start().x_mm, plan.start().y_mm), (750.0, 750.0));
        let faces = plan.walls().segments();
        assert_eq!(faces.len(), 4);
        assert!(faces.contains(&Segment { from: (500, 500), to: (1500, 500) }));
        assert_eq!(plan.walls().corners_near(plan.start(), 2000.0).count(), 4);
        assert_eq!(plan.walls().clearance_mm(Point::new(800.0, 900.0)), 100.0);
    }

    #[test]
    fn an_invalid_plan_is_rejected_with_its_error() {
        assert_eq!(Plan::parse("#S#").unwrap_err(), PlanError::Header);
        assert_eq!(Plan::parse("cell_mm 9\n#S#").unwrap_err(), PlanError::Header);
        assert_eq!(Plan::parse("cell_mm 250\n###").unwrap_err(), PlanError::NoFreeSpace);
        assert_eq!(Plan::parse("cell_mm 250\n#SS").unwrap_err(), PlanError::Start);
        let wrong = PlanError::Character { character: 'x', line: 3 };
        assert_eq!(Plan::parse("cell_mm 250\n#S#\n#x#").unwrap_err(), wrong);
    }

    #[test]
    fn a_plan_without_a_start_starts_at_the_most_open_place() {
        let narrow = ".".repeat(30);
        let wide = format!("{}{}", "#".repeat(20), ".".repeat(10));
        let rows = [wide.as_str(), &wide, &wide, &wide, &narrow, &narrow, &wide, &wide, &wide, &wide].join("\n");
        let plan = Plan::parse(&format!("cell_mm 250\n{rows}")).unwrap();
        assert!(plan.start().distance_mm(Point::new(6250.0, 1250.0)) < 100.0, "{:?}", plan.start());
        let moved = plan.with_start_m(1.0, 1.25);
        assert_eq!(moved.start(), Point::new(1000.0, 1250.0));
    }

    #[test]
    fn points_outside_the_plan_are_wall() {
        let plan = Plan::parse("cell_mm 500\nS").unwrap();
        let is_wall = |x_mm, y_mm| plan.is_wall_at(Point::new(x_mm, y_mm));
        assert!(is_wall(-1.0, 100.0) && is_wall(100.0, 600.0) && is_wall(600.0, 100.0) && !is_wall(100.0, 100.0));
        assert_eq!(plan.surfaces(), 4);
    }

    #[test]
    fn every_built_in_plan_parses_and_the_robot_fits_at_its_start() {
        for (name, text) in Plan::BUILT_IN {
            let plan = Plan::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(plan.fits(plan.start(), Limits::default().body_radius_mm), "{name}");
            let map = plan.true_map(&Limits::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(map.nodes.len() >= 5 && map.unreachable.is_empty(), "{name}: {:?}", map.unreachable);
            assert!(Plan::built_in(name).is_some());
        }
    }
}
