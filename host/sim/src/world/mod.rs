//! A simulated building, and a robot with a ring of sonars that drives along the building's Voronoi graph.
//!
//! ```
//! use toposlam::place::{PlaceConfig, PlaceDetector};
//! use toposlam::ring::RingGeometry;
//! use toposlam_sim::world::{GroundTruth, Plan, RobotModel, SONARS, Simulation};
//!
//! let plan = Plan::built_in("ring").expect("a built-in plan");
//! let mut simulation = Simulation::new(&plan, RobotModel::default(), 7)?;
//! let mut ground_truth = GroundTruth::new(simulation.true_map());
//! let mut detector = PlaceDetector::<SONARS>::new();
//! detector.start(PlaceConfig::DEFAULT, RingGeometry::even())?;
//! for (frame, truth) in simulation.by_ref().take(2000) {
//!     ground_truth.drive(&truth);
//!     if let Some(place) = detector.observe(&frame) {
//!         ground_truth.detect(&place);
//!     }
//! }
//! assert!(ground_truth.report().found > 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod branches;
mod graph;
mod grid;
mod ground_truth;
mod hints;
mod limits;
mod obstacles;
mod plan;
mod ray_casting;
mod rover;
mod simulation;
mod true_map;
mod truth;
mod voronoi;
mod walls;

pub use ground_truth::{Detection, GroundTruth, Report};
pub use hints::{HintReport, ReportedHints};
pub use limits::Limits;
pub use plan::{Plan, PlanError, PlanFileError};
pub(crate) use ray_casting::wrapped;
pub use ray_casting::{SONARS, SONARS_MAX, SonarModel};
pub use rover::{BodyModel, Rover};
pub use simulation::{Pose, RobotModel, Simulation, Truth};
pub use true_map::{Dropped, TrueEdge, TrueMap, TrueNode, TrueWay, UnreachablePart};
pub use voronoi::VoronoiError;

/// A point of the floor plan, in millimetres from its lower left corner; x to the right, y up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// To the right, in millimetres.
    pub x_mm: f64,
    /// Up, in millimetres.
    pub y_mm: f64,
}

impl Point {
    /// A point from its coordinates.
    pub const fn new(x_mm: f64, y_mm: f64) -> Self {
        Self { x_mm, y_mm }
    }

    /// The distance to another point, in millimetres.
    pub fn distance_mm(self, other: Self) -> f64 {
        (self.x_mm - other.x_mm).hypot(self.y_mm - other.y_mm)
    }

    /// The direction to another point, counter-clockwise from the x axis, in radians.
    fn direction_to(self, other: Self) -> f64 {
        (other.y_mm - self.y_mm).atan2(other.x_mm - self.x_mm)
    }

    /// The point at this fraction of the line to another point.
    fn towards(self, other: Self, share: f64) -> Self {
        Self::new(self.x_mm + (other.x_mm - self.x_mm) * share, self.y_mm + (other.y_mm - self.y_mm) * share)
    }
}

/// The length of a polyline, in millimetres.
pub fn length_mm(way: &[Point]) -> f64 {
    // The sum of no numbers is −0.
    way.windows(2).map(|ends| ends[0].distance_mm(ends[1])).sum::<f64>() + 0.0
}
