//! A robot that drives along the true Voronoi graph at random and reads its sonars at every step.

use std::f64::consts::PI;
use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use toposlam::ring::RingFrame;
use toposlam::{Exit, Passage};

use super::ray_casting::{SONARS, Scene, SonarModel, wrapped};
use super::{BodyModel, Limits, Plan, Point, TrueEdge, TrueMap, VoronoiError, length_mm};

/// Position and heading of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The centre of the ring.
    pub position: Point,
    /// Direction of the first sonar, counter-clockwise from the x axis, in radians.
    pub heading_rad: f64,
}

impl Pose {
    /// The heading in milliradians, −3142 to 3142.
    pub fn heading_mrad(&self) -> i16 {
        (wrapped(self.heading_rad) * 1000.0).round() as i16
    }
}

/// Ground truth of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The frame, counted from 0.
    pub frame_index: u32,
    /// Pose of the robot.
    pub pose: Pose,
    /// The true node that the robot is at: in the frame in which it passes the node, and while it turns there.
    pub node: Option<usize>,
    /// How the robot left the node before the nearest one: it turned back or drove on. The drive knows this without
    /// odometry. `None` when the robot has not visited a node before.
    pub turn: Option<Exit>,
}

impl Truth {
    /// What a drive knows of the way from the node before.
    pub const fn passage(&self) -> Passage {
        Passage { exit: self.turn, ..Passage::UNKNOWN }
    }
}

/// Motion and sonars of the robot. Speeds, rates and times must be above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotModel {
    /// Speed, in millimetres a second. Default 300.
    pub speed_mm_per_s: f64,
    /// Ring frames a second. Default 10 (an SRF08 ring ranging all at once takes 65 ms).
    pub frames_per_s: f64,
    /// How fast the robot turns on the spot, in radians a second. Default π/2.
    pub turn_rad_per_s: f64,
    /// Probability of a turn back at a node with other edges, 0 to 1. Default 0.1. At dead ends it is 1.
    pub u_turn_share: f64,
    /// Standard deviation of the lateral offset from the Voronoi graph, in millimetres. Default 20.
    pub track_sd_mm: f64,
    /// Standard deviation of the heading from the direction of the edge, in radians. Default 0.03.
    pub heading_sd_rad: f64,
    /// Correlation time of the two deviations, in seconds. Default 1.
    pub deviation_s: f64,
    /// Model of the sonars.
    pub sonar: SonarModel,
}

impl Default for RobotModel {
    fn default() -> Self {
        Self {
            speed_mm_per_s: 300.0,
            frames_per_s: 10.0,
            turn_rad_per_s: PI / 2.0,
            u_turn_share: 0.1,
            track_sd_mm: 20.0,
            heading_sd_rad: 0.03,
            deviation_s: 1.0,
            sonar: SonarModel::default(),
        }
    }
}

impl RobotModel {
    /// A robot with a ring of this many sonars. The cones of a small ring are as wide as the gaps between their axes.
    pub fn for_ring(sonars: usize) -> Self {
        let default = Self::default();
        let cone_half_angle_rad = default.sonar.cone_half_angle_rad.max(PI / sonars as f64);
        Self { sonar: SonarModel { cone_half_angle_rad, ..default.sonar }, ..default }
    }

    /// The same robot with every noise scaled: range noise, missed echoes, and deviation from the edge.
    pub fn with_noise(self, factor: f64) -> Self {
        let sonar = SonarModel {
            range_sd_mm: self.sonar.range_sd_mm * factor,
            missed_share: (self.sonar.missed_share * factor).clamp(0.0, 1.0),
            ..self.sonar
        };
        Self { track_sd_mm: self.track_sd_mm * factor, heading_sd_rad: self.heading_sd_rad * factor, sonar, ..self }
    }
}

/// A random deviation of standard deviation 1 that is correlated in time.
struct Drift(f64);

impl Drift {
    /// Advances by a time step, given as a fraction of the correlation time, and returns the new deviation.
    fn step(&mut self, share: f64, random: &mut Xoshiro256PlusPlus) -> f64 {
        let kept = (-share).exp();
        let fresh: f64 = StandardNormal.sample(random);
        self.0 = kept * self.0 + (1.0 - kept * kept).sqrt() * fresh;
        self.0
    }
}

/// An endless drive: an iterator over the ring frames and their ground truth.
///
/// The same plan, model and seed give the same drive.
pub struct Simulation {
    scene: Scene,
    map: Arc<TrueMap>,
    model: RobotModel,
    random: Xoshiro256PlusPlus,
    frame_index: u32,
    /// The current edge, whether it is driven from its second node to its first, and the node it leads to.
    way: Vec<Point>,
    edge: usize,
    reversed: bool,
    target: usize,
    /// Position on the edge: the leg, and the distance driven on it.
    leg: usize,
    driven_mm: f64,
    /// How the robot left the last node, and the one before that.
    turns: [Option<Exit>; 2],
    heading_rad: f64,
    at_node: Option<usize>,
    sideways: Drift,
    askew: Drift,
}

impl Simulation {
    /// Places the robot on the point of the Voronoi graph that is nearest to the start of the plan.
    ///
    /// # Errors
    /// When the plan has no true map.
    pub fn new(plan: &Plan, model: RobotModel, seed: u64) -> Result<Self, VoronoiError> {
        let map = plan.true_map(&Limits::of(&BodyModel::default(), &model.sonar))?;
        let legs = map.edges.iter().enumerate().flat_map(|(edge, true_edge)| {
            true_edge.way.windows(2).enumerate().map(move |(leg, ends)| (edge, leg, along(ends, plan.start())))
        });
        let gap_mm = |edge: usize, leg: usize, driven_mm: f64| {
            let ends = &map.edges[edge].way[leg..leg + 2];
            ends[0].towards(ends[1], driven_mm / ends[0].distance_mm(ends[1])).distance_mm(plan.start())
        };
        let nearest =
            legs.min_by(|one, other| gap_mm(one.0, one.1, one.2).total_cmp(&gap_mm(other.0, other.1, other.2)));
        let (edge, leg, driven_mm) = nearest.ok_or(VoronoiError::NoPlace)?;
        let way = map.edges[edge].way.clone();
        Ok(Self {
            scene: Scene::new(plan),
            target: map.edges[edge].nodes[1],
            model,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            frame_index: 0,
            heading_rad: way[leg].direction_to(way[leg + 1]),
            way,
            edge,
            reversed: false,
            leg,
            driven_mm,
            turns: [None; 2],
            map,
            at_node: None,
            sideways: Drift(0.0),
            askew: Drift(0.0),
        })
    }

    /// The true map of the building.
    pub fn true_map(&self) -> &TrueMap {
        &self.map
    }

    /// The current pose of the robot, with its lateral and heading deviations.
    fn pose(&mut self) -> Pose {
        let ends = &self.way[self.leg..self.leg + 2];
        let on_way = ends[0].towards(ends[1], self.driven_mm / ends[0].distance_mm(ends[1]));
        let share = 1.0 / (self.model.frames_per_s * self.model.deviation_s);
        let sideways_mm = self.model.track_sd_mm * self.sideways.step(share, &mut self.random);
        let askew_rad = self.model.heading_sd_rad * self.askew.step(share, &mut self.random);
        let (sine, cosine) = self.heading_rad.sin_cos();
        let position = Point::new(on_way.x_mm - sine * sideways_mm, on_way.y_mm + cosine * sideways_mm);
        Pose { position, heading_rad: wrapped(self.heading_rad + askew_rad) }
    }

    /// Advances the robot by the time between two frames.
    fn step(&mut self) {
        self.at_node = None;
        let mut left_s = 1.0 / self.model.frames_per_s;
        while left_s > 1e-9 {
            let ends = &self.way[self.leg..self.leg + 2];
            let leg_mm = ends[0].distance_mm(ends[1]);
            let ahead_rad = ends[0].direction_to(ends[1]);
            let turn_rad = wrapped(ahead_rad - self.heading_rad);
            // The robot stops to turn only at a node.
            if self.leg == 0 && self.driven_mm == 0.0 && turn_rad.abs() > 1e-6 {
                let can_rad = self.model.turn_rad_per_s * left_s;
                self.at_node = Some(self.node_behind());
                self.heading_rad = wrapped(self.heading_rad + turn_rad.clamp(-can_rad, can_rad));
                left_s -= turn_rad.abs().min(can_rad) / self.model.turn_rad_per_s;
                continue;
            }
            self.heading_rad = ahead_rad;
            let can_mm = self.model.speed_mm_per_s * left_s;
            if self.driven_mm + can_mm < leg_mm {
                self.driven_mm += can_mm;
                return;
            }
            left_s -= (leg_mm - self.driven_mm) / self.model.speed_mm_per_s;
            self.driven_mm = 0.0;
            self.leg += 1;
            if self.leg + 1 == self.way.len() {
                self.at_node = Some(self.target);
                self.choose();
            }
        }
    }

    /// How the robot left the node before the nearer end of its edge.
    fn turn(&self) -> Option<Exit> {
        let driven_mm = length_mm(&self.way[..=self.leg]) + self.driven_mm;
        self.turns[usize::from(2.0 * driven_mm < length_mm(&self.way))]
    }

    /// The node at which the current edge begins.
    fn node_behind(&self) -> usize {
        self.map.edges[self.edge].nodes[usize::from(self.reversed)]
    }

    /// Chooses the next edge at the node that was reached.
    fn choose(&mut self) {
        let here = self.target;
        // Each edge, once for each of its ends at this node: a loop can be driven both ways.
        let mut ways: Vec<(usize, bool)> = Vec::new();
        for (index, edge) in self.map.edges.iter().enumerate() {
            ways.extend(
                edge.nodes.iter().zip([false, true]).filter(|(node, _)| **node == here).map(|(_, r)| (index, r)),
            );
        }
        let u_turn = (self.edge, !self.reversed);
        let onward: Vec<_> = ways.iter().copied().filter(|way| *way != u_turn).collect();
        let turn_back = onward.is_empty() || self.random.random_bool(self.model.u_turn_share);
        let (edge, reversed) = if turn_back { u_turn } else { onward[self.random.random_range(0..onward.len())] };
        let TrueEdge { nodes, way, .. } = &self.map.edges[edge];
        self.way = if reversed { way.iter().rev().copied().collect() } else { way.clone() };
        self.target = nodes[usize::from(!reversed)];
        self.turns = [Some(if turn_back { Exit::Back } else { Exit::On }), self.turns[0]];
        self.edge = edge;
        self.reversed = reversed;
        self.leg = 0;
        self.driven_mm = 0.0;
    }
}

/// Distance along a leg of the point nearest to another point, in millimetres.
fn along(ends: &[Point], point: Point) -> f64 {
    let length_mm = ends[0].distance_mm(ends[1]);
    let dot = (point.x_mm - ends[0].x_mm) * (ends[1].x_mm - ends[0].x_mm)
        + (point.y_mm - ends[0].y_mm) * (ends[1].y_mm - ends[0].y_mm);
    // Excludes both ends of the leg; its very beginning is where a robot at a node stands.
    (dot / length_mm).clamp(1e-3 * length_mm, 0.999 * length_mm)
}

impl Iterator for Simulation {
    type Item = (RingFrame<SONARS>, Truth);

    fn next(&mut self) -> Option<Self::Item> {
        let pose = self.pose();
        let frame = self.scene.frame(&pose, &self.model.sonar, &mut self.random);
        let truth = Truth { frame_index: self.frame_index, pose, node: self.at_node, turn: self.turn() };
        self.frame_index += 1;
        self.step();
        Some((frame, truth))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_robot_keeps_its_speed_and_stays_off_the_walls() {
        let plan = Plan::built_in("flat").unwrap();
        let truths: Vec<Truth> = Simulation::new(&plan, RobotModel::default().with_noise(0.0), 3)
            .unwrap()
            .map(|(_, truth)| truth)
            .take(1500)
            .collect();
        for pair in truths.windows(2) {
            let moved_mm = pair[0].pose.position.distance_mm(pair[1].pose.position);
            assert!(moved_mm < 30.1, "{pair:?}");
            assert!(!plan.is_wall_at(pair[1].pose.position));
        }
        assert!(truths.iter().any(|truth| truth.node.is_some()));
    }

    #[test]
    fn the_reported_node_is_at_the_position_of_the_robot() {
        let plan = Plan::built_in("office").unwrap();
        let mut simulation = Simulation::new(&plan, RobotModel::default().with_noise(0.0), 4).unwrap();
        let map = simulation.true_map().clone();
        for (_, truth) in simulation.by_ref().take(1500) {
            if let Some(node) = truth.node {
                assert!(map.nodes[node].position.distance_mm(truth.pose.position) < 31.0, "{truth:?}");
            }
        }
    }
}
