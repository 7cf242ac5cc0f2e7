//! A complete robot that explores a simulated building, and the ground truth of its drive.
//!
//! ```
//! use toposlam::reference::SNAPSHOT_BYTES;
//! use toposlam_sim::exploration::Exploration;
//! use toposlam_sim::world::{Plan, RobotModel};
//!
//! let plan = Plan::built_in("flat").expect("a built-in plan");
//! let mut buffer = [0; SNAPSHOT_BYTES];
//! let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer)?;
//! while exploration.places() < 3 {
//!     exploration.advance();
//! }
//! assert!(exploration.robot().mapper().map().vertices().len() >= 2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::collections::VecDeque;

use toposlam::drive::{Goal, VelocityCommand};
use toposlam::persist::Persist;
use toposlam::place::Place;
use toposlam::reference::{self, ROBOT, SONARS, VERTICES};
use toposlam::ring::RingFrame;
use toposlam::robot::{Board, Robot, RobotConfig, SaveError, Seen};
use toposlam::wire::{Encoder, FilterSettings, MAX_FRAME_BYTES, QueueFull, Request};
use toposlam::{FaultCounters, FaultKind, Filter};

use crate::Step;
use crate::injector::{FaultRates, LineInjector, RingInjector};
use crate::world::{BodyModel, GroundTruth, Plan, ReportedHints, RobotModel, Rover, VoronoiError};

/// Duration of a ring frame on the simulated board, in milliseconds.
const FRAME_MS: u32 = 100;

/// A board in memory: its serial line is a pair of queues, its flash holds the last snapshot, and its clock is set from
/// outside.
#[derive(Clone, Debug, Default)]
pub struct MemoryBoard {
    /// Bytes on their way to the robot.
    pub received: VecDeque<u8>,
    /// Bytes that the robot has sent.
    pub sent: Vec<u8>,
    /// The last velocity command.
    pub velocity: VelocityCommand,
    /// Time since the start, in milliseconds.
    pub now_ms: u32,
    /// The newest snapshot.
    pub kept: Vec<u8>,
    /// Number of times that the watchdog was fed.
    pub fed: u64,
}

impl Board for MemoryBoard {
    fn receive(&mut self) -> Option<u8> {
        self.received.pop_front()
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        self.sent.extend_from_slice(frame);
        Ok(())
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        self.velocity = velocity;
    }

    fn feed_watchdog(&mut self) {
        self.fed += 1;
    }

    fn now_ms(&mut self) -> u32 {
        self.now_ms
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        0
    }

    fn save(&mut self, snapshot: &[u8]) -> Result<(), SaveError> {
        self.kept = snapshot.to_vec();
        Ok(())
    }
}

/// A robot with any filter and a ring of up to 24 sensors, its world and the ground truth of its drive.
pub struct Exploration<'buffer, const V: usize = VERTICES, F: Filter<V> = reference::Filter, const S: usize = SONARS> {
    rover: Rover,
    robot: Box<Robot<'buffer, S, V, F>>,
    board: MemoryBoard,
    encoder: Encoder,
    requests: u16,
    ring_faults: FaultCounters,
    /// The fault injectors of the frames and the received bytes, when faults are enabled.
    injectors: Option<(RingInjector<S>, LineInjector)>,
    ground_truth: GroundTruth,
    nodes: Vec<Option<usize>>,
    steps: Vec<Step>,
    frames: u64,
    /// Number of frames during pauses, which the detector does not number.
    frames_not_taken: u32,
}

impl<'buffer> Exploration<'buffer> {
    /// Places the reference robot at the start of the plan. `buffer` holds its snapshots.
    ///
    /// # Errors
    /// When the plan has no true map.
    ///
    /// # Panics
    /// Never: the settings of the reference robot are valid.
    pub fn start(plan: &Plan, model: RobotModel, seed: u64, buffer: &'buffer mut [u8]) -> Result<Self, VoronoiError> {
        Self::with_robot(plan, model, seed, &ROBOT, buffer)
    }
}

impl<'buffer, const V: usize, F, const S: usize> Exploration<'buffer, V, F, S>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    /// As [`Exploration::start`], with a robot of these settings and another filter.
    ///
    /// # Errors
    /// As [`Exploration::start`].
    ///
    /// # Panics
    /// If a setting of the robot is out of its range.
    pub fn with_robot(
        plan: &Plan,
        model: RobotModel,
        seed: u64,
        config: &RobotConfig<S, F::Config>,
        buffer: &'buffer mut [u8],
    ) -> Result<Self, VoronoiError> {
        Self::with_body(plan, model, BodyModel::default(), seed, config, buffer)
    }

    /// As [`Exploration::with_robot`], with another body and other wheels.
    ///
    /// # Errors
    /// As [`Exploration::start`].
    ///
    /// # Panics
    /// If a setting of the robot is out of its range.
    pub fn with_body(
        plan: &Plan,
        model: RobotModel,
        body: BodyModel,
        seed: u64,
        config: &RobotConfig<S, F::Config>,
        buffer: &'buffer mut [u8],
    ) -> Result<Self, VoronoiError> {
        let rover = Rover::new(plan, model, body, seed)?;
        let mut robot = Box::new(Robot::new());
        robot.start(config, buffer).expect("the settings of the robot are valid");
        let ground_truth = GroundTruth::new(rover.true_map());
        Ok(Self {
            rover,
            robot,
            board: MemoryBoard::default(),
            encoder: Encoder::new(0),
            requests: 0,
            ring_faults: FaultCounters::new(),
            injectors: None,
            ground_truth,
            nodes: Vec::new(),
            steps: Vec::new(),
            frames: 0,
            frames_not_taken: 0,
        })
    }

    /// Enables faults in [`Exploration::advance`].
    pub fn set_faults(&mut self, rates: FaultRates, seed: u64) {
        self.injectors = Some((RingInjector::new(rates, seed), LineInjector::new(rates, seed)));
    }

    /// Returns the next frame of the world. [`Exploration::map`] must follow.
    pub fn frame(&mut self) -> RingFrame<S> {
        let (frame, truth) = self.rover.frame();
        self.ground_truth.drive(&truth);
        frame
    }

    /// Runs one turn of the robot's main loop with a frame, which a fault may have changed.
    pub fn map(&mut self, frame: &RingFrame<S>) -> Seen {
        self.board.now_ms = self.board.now_ms.wrapping_add(FRAME_MS);
        self.frames += 1;
        let passage = self.robot.drive().passage();
        let seen = self.robot.turn(frame, &self.ring_faults, &mut self.board);
        self.frames_not_taken += u32::from(self.robot.is_paused());
        if let Some((place, update)) = &seen {
            let frame_index = place.frame_index.saturating_add(self.frames_not_taken);
            self.note(&Place { frame_index, ..*place });
            let map = self.robot.mapper().map();
            let (vertices, edges) = (map.vertices().len() as u8, map.edges().count());
            let ways = passage.ways(place, self.robot.mapper().detector().rotation_mrad());
            self.steps.push(Step {
                place: *place,
                reported: ReportedHints { passage, ways },
                update: *update,
                is_uncertain: self.robot.mapper().filter().is_uncertain(),
                vertices,
                edges,
            });
        }
        seen
    }

    /// Logs a place that another robot detected in this world. The place counts frames as this world does.
    pub fn note(&mut self, place: &Place) {
        self.nodes.push(self.ground_truth.detect(place).node);
    }

    /// Drives until the next frame.
    pub fn drive(&mut self, velocity: VelocityCommand) {
        self.rover.follow(velocity);
    }

    /// Takes a frame, runs one turn of the robot's main loop and drives to the next frame. Afterwards, the board holds
    /// the bytes that the robot sent in this turn.
    pub fn advance(&mut self) -> Seen {
        self.board.sent.clear();
        let mut frame = self.frame();
        if let Some((ring, line)) = &mut self.injectors {
            frame = ring.disturb(frame, &mut self.ring_faults);
            let sent = Vec::from(std::mem::take(&mut self.board.received));
            self.board.received.extend(line.carry(&sent));
            self.board.received.extend(line.noise());
        }
        let seen = self.map(&frame);
        self.drive(self.board.velocity);
        seen
    }

    /// Sends the robot a command over its serial line.
    pub fn command(&mut self, command: toposlam::wire::Command) {
        self.requests = self.requests.wrapping_add(1);
        let mut buffer = [0; MAX_FRAME_BYTES];
        let request = Request { id: self.requests, command };
        // A buffer of that size is always enough.
        let bytes = self.encoder.encode(&request, &mut buffer).unwrap_or(&[]);
        self.board.received.extend(bytes);
    }

    /// Whether the robot has a goal vertex that it has not reached.
    pub fn is_underway(&self) -> bool {
        let drive = self.robot.drive();
        matches!(drive.goal(), Goal::Vertex(_)) && drive.goal_status() == toposlam::drive::GoalStatus::Active
    }

    /// The robot.
    pub const fn robot(&self) -> &Robot<'buffer, S, V, F> {
        &self.robot
    }

    /// The robot, for restoring or restarting it.
    pub const fn robot_mut(&mut self) -> &mut Robot<'buffer, S, V, F> {
        &mut self.robot
    }

    /// Its board.
    pub const fn board(&mut self) -> &mut MemoryBoard {
        &mut self.board
    }

    /// The fault counters of the ring, for an external source of faults.
    pub const fn ring_faults(&mut self) -> &mut FaultCounters {
        &mut self.ring_faults
    }

    /// Its world.
    pub const fn rover(&self) -> &Rover {
        &self.rover
    }

    /// The log of its drive.
    pub const fn ground_truth(&self) -> &GroundTruth {
        &self.ground_truth
    }

    /// Number of places detected so far.
    pub fn places(&self) -> usize {
        self.nodes.len()
    }

    /// Number of ring frames processed so far.
    pub const fn frames(&self) -> u64 {
        self.frames
    }

    /// The true node of each place, in the order of the places; `None` for a phantom.
    pub fn nodes(&self) -> &[Option<usize>] {
        &self.nodes
    }

    /// One step for each place.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Counts of all faults so far.
    pub fn faults(&self) -> FaultCounters {
        self.robot.faults(&self.ring_faults)
    }

    /// Number of times that the drive lost its way.
    pub fn times_lost(&self) -> u32 {
        self.robot.drive().faults().count(FaultKind::DriveLost)
    }

    /// The vertex of each place in the best map; `None` for a place that has left the history.
    pub fn path(&self) -> Vec<Option<usize>> {
        let filter = self.robot.mapper().filter();
        (0..self.nodes.len()).rev().map(|ago| filter.recent(ago).map(usize::from)).collect()
    }
}
