//! A whole robot on a simulated ring: it explores an office by its own drive, maps it, and drives to a vertex on command.
//!
//! ```sh
//! cargo run --release --example whole_robot --features wire
//! ```

use std::collections::VecDeque;
use std::error::Error;

use toposlam::FaultCounters;
use toposlam::drive::{GoalStatus, VelocityCommand};
use toposlam::reference::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES};
use toposlam::robot::Board;
use toposlam::wire::{Command, Encoder, MAX_FRAME_BYTES, QueueFull, Request};
use toposlam_sim::world::{BodyModel, Plan, RobotModel, Rover};

/// Half an hour at ten ring frames a second is 18,000 turns.
const MAX_TURNS: u32 = 36_000;

/// What the robot needs of a board. This one has a line, wheels and a clock; it has no watchdog and no flash.
#[derive(Default)]
struct SimulatedBoard {
    received: VecDeque<u8>,
    sent_bytes: usize,
    velocity: VelocityCommand,
    now_ms: u32,
}

impl Board for SimulatedBoard {
    fn receive(&mut self) -> Option<u8> {
        self.received.pop_front()
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        self.sent_bytes += frame.len();
        Ok(())
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        self.velocity = velocity;
    }

    fn now_ms(&mut self) -> u32 {
        self.now_ms
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let plan = Plan::built_in("office").ok_or("the plan is built in")?;
    let mut world = Rover::new(&plan, RobotModel::default(), BodyModel::default(), 1)?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut robot = Box::new(ReferenceRobot::new());
    robot.start(&ROBOT, &mut buffer)?;
    let (mut board, mut places) = (SimulatedBoard::default(), 0);
    for _ in 0..MAX_TURNS {
        // One turn of the main loop: a ring frame in, a velocity command and messages out.
        let (frame, _truth) = world.frame();
        board.now_ms += 100;
        if let Some((place, update)) = robot.turn(&frame, &FaultCounters::new(), &mut board) {
            places += 1;
            println!("place {places}: radius {} mm, vertex {}", place.fingerprint.radius_mm(), update.vertex);
            if places == 40 {
                // What `toposlam command LINE go-to 0` sends.
                let request = Request { id: 1, command: Command::GoTo { vertex: 0 } };
                board.received.extend(Encoder::new(0).encode(&request, &mut [0; MAX_FRAME_BYTES])?);
            }
        }
        world.follow(board.velocity);
        if robot.drive().goal_status() == GoalStatus::Reached {
            break;
        }
    }
    if robot.drive().goal_status() != GoalStatus::Reached {
        return Err("the robot did not reach the vertex".into());
    }
    let map = robot.mapper().map();
    println!("{} vertices, {} edges, {} bytes sent", map.vertices().len(), map.edges().count(), board.sent_bytes);
    Ok(())
}

#[test]
fn the_example_explores_and_obeys() {
    main().unwrap();
}
