//! A robot whose ring is read by an async task: the task builds whole frames, and the main task takes a turn with each.
//!
//! Measuring waits, and other tasks run meanwhile; a turn never waits. On a microcontroller the executor and the timers are those
//! of `embassy` or `rtic`; `boards/rp2040` shows that. Here both tasks run on the few lines of `block_on`.
//!
//! ```sh
//! cargo run --release --example async_ring --features wire
//! ```

use std::cell::{Cell, RefCell};
use std::error::Error;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use toposlam::FaultCounters;
use toposlam::drive::VelocityCommand;
use toposlam::reference::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES, SONARS};
use toposlam::ring::{Echo, RingFrame};
use toposlam::robot::Board;
use toposlam::wire::QueueFull;
use toposlam_sim::world::{BodyModel, Plan, RobotModel, Rover};

const PLACES: usize = 10;

/// What the tasks share: the newest frame, and the velocity that the robot commands.
#[derive(Default)]
struct Shared {
    frame: RefCell<Option<(RingFrame<SONARS>, FaultCounters)>>,
    velocity: Cell<VelocityCommand>,
    now_ms: Cell<u32>,
}

/// The board. It has neither watchdog nor store.
struct AsyncBoard<'a>(&'a Shared);

impl Board for AsyncBoard<'_> {
    fn receive(&mut self) -> Option<u8> {
        None
    }

    fn send(&mut self, _frame: &[u8]) -> Result<(), QueueFull> {
        Ok(())
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        self.0.velocity.set(velocity);
    }

    fn now_ms(&mut self) -> u32 {
        self.0.now_ms.get()
    }
}

/// One sensor. On a board: start it, and await its interrupt with a timeout.
async fn measure_one(echo: Echo) -> Result<Echo, toposlam::FaultKind> {
    pause().await;
    if echo == Echo::Dead { Err(toposlam::FaultKind::SonarSilent) } else { Ok(echo) }
}

/// Measures frame after frame.
async fn measure(shared: &Shared, mut world: Rover) {
    let mut faults = FaultCounters::new();
    loop {
        world.follow(shared.velocity.get());
        let (truth, _) = world.frame::<SONARS>();
        let mut frame = RingFrame { echoes: [Echo::Dead; SONARS] };
        for (echo, heard) in frame.echoes.iter_mut().zip(truth.echoes) {
            match measure_one(heard).await {
                Ok(measured) => *echo = measured,
                Err(kind) => faults.record(kind),
            }
        }
        shared.now_ms.set(shared.now_ms.get() + 100);
        *shared.frame.borrow_mut() = Some((frame, faults));
        // The main task takes the frame before the next one is measured.
        pause().await;
    }
}

/// Takes a turn of the robot with each frame, until it has detected some places.
async fn map(shared: &Shared, robot: &mut ReferenceRobot<'_>) -> usize {
    let (mut board, mut places) = (AsyncBoard(shared), 0);
    while places < PLACES {
        let (frame, faults) = poll_fn(|_| shared.frame.take().map_or(Poll::Pending, Poll::Ready)).await;
        places += usize::from(robot.turn(&frame, &faults, &mut board).is_some());
    }
    robot.mapper().map().vertices().len()
}

/// Lets the other task run once.
async fn pause() {
    let mut is_over = false;
    poll_fn(|_| if std::mem::replace(&mut is_over, true) { Poll::Ready(()) } else { Poll::Pending }).await;
}

/// Runs a task in the background until the main one is done.
fn block_on<T>(main: impl Future<Output = T>, background: impl Future<Output = ()>) -> T {
    let (mut main, mut background) = (pin!(main), pin!(background));
    let mut context = Context::from_waker(Waker::noop());
    loop {
        let _ = background.as_mut().poll(&mut context);
        if let Poll::Ready(value) = main.as_mut().poll(&mut context) {
            return value;
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let plan = Plan::built_in("office").ok_or("the plan is built in")?;
    let world = Rover::new(&plan, RobotModel::default(), BodyModel::default(), 1)?;
    let mut robot = Box::new(ReferenceRobot::new());
    let mut buffer = [0; SNAPSHOT_BYTES];
    robot.start(&ROBOT, &mut buffer)?;
    let shared = Shared::default();
    let vertices = block_on(map(&shared, &mut robot), measure(&shared, world));
    println!("{PLACES} places, {vertices} vertices");
    Ok(())
}

#[test]
fn a_robot_maps_the_frames_of_an_async_task() {
    main().unwrap();
}
