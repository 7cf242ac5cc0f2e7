//! A differential-drive robot that follows velocity commands, with a body that walls stop and a ring of sonars.

use std::sync::Arc;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use toposlam::drive::{VelocityCommand, WheelSpeeds, WheelsConfig};
use toposlam::ring::RingFrame;

use super::ray_casting::{Scene, wrapped};
use super::{Limits, Plan, Point, Pose, RobotModel, TrueMap, Truth, VoronoiError};

/// Distance within which the robot is at a true node, in millimetres.
const AT_NODE_MM: f64 = 200.0;
/// Integration steps of the motion between two frames.
const STEPS: u32 = 4;

/// The body of the robot and the errors of its wheels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyModel {
    /// Half the robot's width, in millimetres; no wall comes nearer to its centre. Default 150.
    pub radius_mm: f64,
    /// The distance between the wheels, in millimetres. Default 200.
    pub track_mm: f64,
    /// Conversion of a velocity command into wheel speeds.
    pub wheels: WheelsConfig,
    /// Standard deviation of the relative speed error of each wheel. Default 0.05. The error lasts as long as the
    /// deviations of [`RobotModel`].
    pub slip_share: f64,
}

impl Default for BodyModel {
    fn default() -> Self {
        Self { radius_mm: 150.0, track_mm: 200.0, wheels: WheelsConfig::DEFAULT, slip_share: 0.05 }
    }
}

/// A robot in a floor plan: read a frame, follow a velocity command, and repeat. The same plan, model, seed and
/// velocity commands give the same frames.
pub struct Rover {
    scene: Scene,
    plan: Plan,
    map: Arc<TrueMap>,
    model: RobotModel,
    body: BodyModel,
    random: Xoshiro256PlusPlus,
    pose: Pose,
    slips: [f64; 2],
    frame_index: u32,
    bumps: u32,
}

impl Rover {
    /// Places the robot at the start of the plan, with a random heading.
    ///
    /// # Errors
    /// When the plan has no true map.
    pub fn new(plan: &Plan, model: RobotModel, body: BodyModel, seed: u64) -> Result<Self, VoronoiError> {
        let map = plan.true_map(&Limits::of(&body, &model.sonar))?;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let anywhere: f64 = StandardNormal.sample(&mut random);
        Ok(Self {
            scene: Scene::new(plan),
            plan: plan.clone(),
            map,
            model,
            body,
            random,
            pose: Pose { position: plan.start(), heading_rad: wrapped(10.0 * anywhere) },
            slips: [0.0; 2],
            frame_index: 0,
            bumps: 0,
        })
    }

    /// The true map of the building.
    pub fn true_map(&self) -> &TrueMap {
        &self.map
    }

    /// Number of frames in which a wall stopped the robot.
    pub const fn bumps(&self) -> u32 {
        self.bumps
    }

    /// Reads the ring of up to 24 sonars once and returns the ground truth of that frame.
    pub fn frame<const SONARS: usize>(&mut self) -> (RingFrame<SONARS>, Truth) {
        let frame = self.scene.frame(&self.pose, &self.model.sonar, &mut self.random);
        let node = self.map.nearest_node(self.pose.position).filter(|(_, distance_mm)| *distance_mm <= AT_NODE_MM);
        let truth =
            Truth { frame_index: self.frame_index, pose: self.pose, node: node.map(|(node, _)| node), turn: None };
        self.frame_index += 1;
        (frame, truth)
    }

    /// Position of the robot.
    pub const fn position(&self) -> Point {
        self.pose.position
    }

    /// Heading of the robot in milliradians, counter-clockwise from the x axis, −3142 to 3142.
    pub fn heading_mrad(&self) -> i16 {
        self.pose.heading_mrad()
    }

    /// Follows a velocity command until the next frame.
    pub fn follow(&mut self, velocity: VelocityCommand) {
        let WheelSpeeds { left_permille, right_permille } = WheelSpeeds::from_velocity(velocity, &self.body.wheels);
        let kept = (-1.0 / (self.model.frames_per_s * self.model.deviation_s)).exp();
        let [left, right] = [(0, left_permille), (1, right_permille)].map(|(wheel, permille)| {
            let fresh: f64 = StandardNormal.sample(&mut self.random);
            self.slips[wheel] = kept * self.slips[wheel] + (1.0 - kept * kept).sqrt() * fresh;
            let slip = 1.0 + self.body.slip_share * self.slips[wheel];
            f64::from(permille) / 1000.0 * self.model.speed_mm_per_s * slip
        });
        let step_s = 1.0 / (self.model.frames_per_s * f64::from(STEPS));
        let mut bumped = false;
        for _ in 0..STEPS {
            let heading_rad = self.pose.heading_rad + (right - left) / self.body.track_mm * step_s / 2.0;
            let way_mm = (left + right) / 2.0 * step_s;
            let (sine, cosine) = heading_rad.sin_cos();
            let Point { x_mm, y_mm } = self.pose.position;
            let position = Point::new(x_mm + cosine * way_mm, y_mm + sine * way_mm);
            if self.plan.fits(position, self.body.radius_mm) {
                self.pose.position = position;
            } else {
                bumped = true;
            }
            self.pose.heading_rad = wrapped(self.pose.heading_rad + (right - left) / self.body.track_mm * step_s);
        }
        self.bumps += u32::from(bumped);
    }

    /// Moves the robot to another pose without driving, as in the kidnapped-robot problem.
    pub fn carry_to(&mut self, pose: Pose) {
        self.pose = pose;
    }
}
