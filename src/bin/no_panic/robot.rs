//! Calls of the drive, the wheels and the whole robot.

use core::convert::Infallible;
use core::hint::black_box;

use embedded_hal::{digital, pwm};
use static_cell::ConstStaticCell;
use toposlam::drive::{
    DifferentialDrive, Drive, DriveConfig, Goal, MotorError, VelocityCommand, WheelSpeeds, WheelsConfig,
};
use toposlam::persist::snapshot::{Resume, SnapshotError};
use toposlam::reference::{self, ReferenceRobot, VERTICES};
use toposlam::robot::{Board, SaveError};
use toposlam::wire::QueueFull;
use toposlam::{FaultCounters, VertexId};

use super::any::{Opaque, any_frame, show};

/// A board whose answers are hidden from the optimiser.
struct Any;

impl Board for Any {
    fn receive(&mut self) -> Option<u8> {
        black_box(Some(7))
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        black_box(frame);
        black_box(Ok(()))
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        black_box(velocity);
    }

    fn feed_watchdog(&mut self) {
        black_box(0);
    }

    fn now_ms(&mut self) -> u32 {
        black_box(0)
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        black_box(0)
    }

    fn save(&mut self, snapshot: &[u8]) -> Result<(), SaveError> {
        black_box(snapshot);
        black_box(Ok(()))
    }
}

struct AnyMotor;

impl pwm::ErrorType for AnyMotor {
    type Error = Infallible;
}

impl pwm::SetDutyCycle for AnyMotor {
    fn max_duty_cycle(&self) -> u16 {
        black_box(1000)
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        black_box(duty);
        Ok(())
    }
}

impl digital::ErrorType for AnyMotor {
    type Error = Infallible;
}

impl digital::OutputPin for AnyMotor {
    fn set_low(&mut self) -> Result<(), Infallible> {
        black_box(0);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        black_box(1);
        Ok(())
    }
}

pub(crate) fn drive() {
    let velocity = VelocityCommand { heading_mrad: 3, speed_permille: 4 }.opaque();
    black_box(WheelSpeeds::from_velocity(velocity, &WheelsConfig::DEFAULT.opaque()));
    match DifferentialDrive::new((AnyMotor, AnyMotor), (AnyMotor, AnyMotor), WheelsConfig::DEFAULT.opaque()) {
        Ok(mut wheels) => {
            if let Err(error) = wheels.follow(velocity).and(wheels.stop()) {
                show::<MotorError>(error);
            }
            black_box(wheels.release().len());
        }
        Err(error) => show::<toposlam::ConfigError>(error),
    }
    static DRIVE: ConstStaticCell<Drive<VERTICES>> = ConstStaticCell::new(Drive::new());
    let Some(drive) = DRIVE.try_take() else { return };
    if let Err(error) = drive.start(DriveConfig::DEFAULT.opaque(), black_box(1)).and(drive.set_speed(black_box(3))) {
        show::<toposlam::ConfigError>(error);
    }
    drive.set_goal(Goal::Vertex(VertexId::FIRST).opaque());
    drive.kidnapped();
    black_box((
        drive.passage(),
        drive.is_complete(),
        drive.goal(),
        drive.goal_status(),
        drive.state(),
        drive.holds_place(),
        drive.faults(),
    ));
}

pub(crate) fn robot() {
    static ROBOT: ConstStaticCell<ReferenceRobot<'static>> = ConstStaticCell::new(ReferenceRobot::new());
    static BUFFER: ConstStaticCell<[u8; 128]> = ConstStaticCell::new([0; 128]);
    let (Some(robot), Some(buffer)) = (ROBOT.try_take(), BUFFER.try_take()) else { return };
    if let Err(error) = robot.start(&reference::ROBOT.opaque(), buffer) {
        show::<toposlam::ConfigError>(error);
    }
    for _ in 0..black_box(9) {
        black_box(robot.turn(&any_frame(), &FaultCounters::new().opaque(), &mut Any));
    }
    let resume = if black_box(true) { Resume::InPlace } else { Resume::AtUnknownVertex };
    if let Err(error) = robot.restore(black_box(&[1, 2, 3]), resume) {
        show::<SnapshotError>(error);
    }
    show(SaveError::NoStore.opaque());
    black_box((robot.mapper(), robot.drive(), robot.faults(&FaultCounters::new())));
}
