//! A whole robot: it explores a simulated building, sends its map, and is told where to go.
//!
//! The simulation is only the world. What a real robot brings instead is a [`SonarRing`](toposlam::ring::drivers::SonarRing)
//! and a [`Board`].
//!
//! ```sh
//! cargo run --features wire --example whole_robot
//! ```

use std::collections::VecDeque;

use toposlam::FaultCounters;
use toposlam::drive::VelocityCommand;
use toposlam::reference::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES};
use toposlam::robot::{Board, SaveError};
use toposlam::wire::{Command, Decoder, Encoder, GoalState, MAX_FRAME_BYTES, MapReplica, Progress, QueueFull, Request};
use toposlam_sim::world::{BodyModel, Plan, RobotModel, Rover};

/// Time between two ring frames.
const FRAME_MS: u32 = 100;

/// The serial line, wheels, clock and flash of a robot in memory.
#[derive(Default)]
struct MemoryBoard {
    received: VecDeque<u8>,
    sent: Vec<u8>,
    velocity: VelocityCommand,
    now_ms: u32,
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

    fn feed_watchdog(&mut self) {}

    fn now_ms(&mut self) -> u32 {
        self.now_ms
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        0
    }

    fn save(&mut self, _snapshot: &[u8]) -> Result<(), SaveError> {
        Err(SaveError::NoStore)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plan = Plan::built_in("flat").ok_or("no such plan")?;
    let mut rover = Rover::new(&plan, RobotModel::default(), BodyModel::default(), 1)?;
    let mut board = MemoryBoard::default();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut robot = Box::new(ReferenceRobot::new());
    robot.start(&ROBOT, &mut buffer)?;

    // The computer at the other end of the line.
    let (mut decoder, mut replica) = (Decoder::new(), MapReplica::<64>::new());
    let mut places = 0;
    while replica.goal_status().is_none_or(|goal| goal.state != GoalState::Reached) {
        board.now_ms += FRAME_MS;
        let (frame, _truth) = rover.frame();
        places += u32::from(robot.turn(&frame, &FaultCounters::new(), &mut board).is_some());
        rover.follow(board.velocity);

        let sent = std::mem::take(&mut board.sent);
        let mut bytes = sent.as_slice();
        while let Progress::Message { header, message, rest } = decoder.feed(bytes) {
            replica.apply(header, &message);
            bytes = rest;
        }
        if places == 30 && board.received.is_empty() && replica.goal_status().is_none() {
            let request = Request { id: 1, command: Command::GoTo { vertex: 0 } };
            board.received.extend(Encoder::new(0).encode(&request, &mut [0; MAX_FRAME_BYTES])?);
        }
    }
    println!("{places} places, {} vertices, edges {:?}", replica.vertices(), replica.edges().collect::<Vec<_>>());
    println!("the robot is at vertex 0: {:?}", replica.location());
    assert!(replica.is_converged());
    Ok(())
}

#[test]
fn the_example_reaches_its_goal() {
    main().unwrap();
}
