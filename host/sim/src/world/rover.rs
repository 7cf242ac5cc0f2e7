//! A robot that drives where it is told: two wheels, a body that walls stop, and a ring of sonars.

use std::sync::Arc;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use toposlam::drive::{VelocityCommand, WheelSpeeds, WheelsConfig};
use toposlam::ring::RingFrame;

use super::ray_casting::{SONARS, Scene, wrapped};
use super::{Limits, Plan, Point, Pose, RobotModel, TrueMap, Truth, VoronoiError};

/// The robot is at a true node within this distance, in millimetres.
const AT_NODE_MM: f64 = 200.0;
/// Steps of the motion between two frames.
const STEPS: u32 = 4;

/// The body of the robot and how well its wheels obey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyModel {
    /// Half the robot's width, in millimetres. Default 150. No wall comes nearer to its centre.
    pub radius_mm: f64,
    /// The distance between the wheels, in millimetres. Default 200.
    pub track_mm: f64,
    /// How the robot turns a velocity into wheel speeds.
    pub wheels: WheelsConfig,
    /// Standard deviation by which each wheel is faster or slower than it should be, as a share. Default 0.05. It lasts as
    /// long as the deviations of [`RobotModel`].
    pub slip_share: f64,
}

impl Default for BodyModel {
    fn default() -> Self {
        Self { radius_mm: 150.0, track_mm: 200.0, wheels: WheelsConfig::DEFAULT, slip_share: 0.05 }
    }
}

/// A robot in a floor plan. Read a frame, follow a velocity, and so on; the same plan, model, seed and velocities give the
/// same frames.
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
    /// Puts the robot on the plan's start, looking anywhere.
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

    /// The building's true places and connections.
    pub fn true_map(&self) -> &TrueMap {
        &self.map
    }

    /// In how many frames the robot was stopped by a wall.
    pub const fn bumps(&self) -> u32 {
        self.bumps
    }

    /// Reads the ring once, and says what is true in that frame.
    pub fn frame(&mut self) -> (RingFrame<SONARS>, Truth) {
        let frame = self.scene.frame(&self.pose, &self.model.sonar, &mut self.random);
        let node = self.map.nearest_node(self.pose.position).filter(|(_, distance_mm)| *distance_mm <= AT_NODE_MM);
        let truth =
            Truth { frame_index: self.frame_index, pose: self.pose, node: node.map(|(node, _)| node), turn: None };
        self.frame_index += 1;
        (frame, truth)
    }

    /// Where the robot is.
    pub const fn position(&self) -> Point {
        self.pose.position
    }

    /// Drives on until the next frame.
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

    /// Lifts the robot up and puts it somewhere else, looking another way.
    pub fn carry_to(&mut self, pose: Pose) {
        self.pose = pose;
    }
}
