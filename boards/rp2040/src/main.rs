//! The robot image for the Raspberry Pi Pico: a ring of eight HC-SR04, wheels, and the map on UART0. Snapshots on
//! request, none in flash.
//!
//! Async tasks measure and move the bytes of the line, on an executor that interrupts the main loop; a turn of the robot is
//! an ordinary call in between. `docs/porting.md` has the pins and the figures. Not tested on hardware.
#![no_std]
#![no_main]

mod line;
mod ring;
#[path = "../../../src/bin/shared/stack.rs"]
mod stack;

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use embassy_executor::InterruptExecutor;
use embassy_futures::block_on;
use embassy_rp::{
    bind_interrupts,
    gpio::{Input, Level, Output, Pull},
    interrupt,
    interrupt::{InterruptExt, Priority},
    peripherals::UART0,
    pwm::{Config as PwmConfig, Pwm, PwmOutput},
    uart::{BufferedInterruptHandler, BufferedUart, Config as UartConfig},
    watchdog::{ResetReason, Watchdog},
};
use embassy_time::{Duration, Instant};
use ring::Sonar;
use static_cell::ConstStaticCell;
use toposlam::{
    drive::{DifferentialDrive, VelocityCommand, WheelsConfig},
    persist::snapshot::SnapshotPolicy,
    reference::{self, SNAPSHOT_BYTES},
    ring::RingGeometry,
    robot::{Board, Robot, RobotConfig},
    wire::{QueueFull, ResetCause},
};

/// Sensors of the ring, 45° apart, counter-clockwise from straight ahead.
const SONARS: usize = 8;
/// Longer than any turn; the chip's watchdog counts to 8.3 s.
const WATCHDOG: Duration = Duration::from_secs(8);
/// A processor without a floating-point unit takes longer than the reference board.
const TURN_BOUND_MS: u16 = 5000;
/// 125 MHz / 20 kHz.
const PWM_TOP: u16 = 6249;

type PicoRobot = Robot<'static, SONARS, { reference::VERTICES }, reference::Filter>;

bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<UART0>;
});

/// Runs the tasks of the ring and of the line.
static TASKS: InterruptExecutor = InterruptExecutor::new();

#[allow(unsafe_code)]
#[interrupt]
unsafe fn SWI_IRQ_1() {
    // SAFETY: this is the interrupt with which the executor was started.
    unsafe { TASKS.on_interrupt() }
}

/// The Pico with a motor driver.
struct Pico {
    wheels: DifferentialDrive<PwmOutput<'static>, Output<'static>>,
    watchdog: Watchdog,
}

impl Board for Pico {
    fn receive(&mut self) -> Option<u8> {
        line::receive()
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        line::send(frame)
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        // Does not fail on this chip: timer and pins have no errors.
        let _ = self.wheels.follow(velocity);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed(WATCHDOG);
    }

    fn now_ms(&mut self) -> u32 {
        Instant::now().as_millis() as u32
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        stack::stack_high_water_bytes()
    }
}

#[entry]
fn main() -> ! {
    static ROBOT_CELL: ConstStaticCell<PicoRobot> = ConstStaticCell::new(PicoRobot::new());
    static SNAPSHOT: ConstStaticCell<[u8; SNAPSHOT_BYTES]> = ConstStaticCell::new([0; SNAPSHOT_BYTES]);
    static RECEIVE_BUFFER: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; 64]);
    static TRANSMIT_BUFFER: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; 64]);

    let device = embassy_rp::init(embassy_rp::config::Config::default());
    let mut watchdog = Watchdog::new(device.WATCHDOG);
    let reset_cause = match watchdog.reset_reason() {
        Some(ResetReason::TimedOut) => ResetCause::Watchdog,
        Some(ResetReason::Forced) => ResetCause::Software,
        // Power-on and the reset pin are not distinguished.
        None => ResetCause::Unknown,
    };
    watchdog.start(WATCHDOG);

    let uart = BufferedUart::new(
        device.UART0,
        device.PIN_0,
        device.PIN_1,
        Interrupts,
        TRANSMIT_BUFFER.take(),
        RECEIVE_BUFFER.take(),
        UartConfig::default(),
    );
    let sonars = [
        Sonar::new(Output::new(device.PIN_2, Level::Low), Input::new(device.PIN_10, Pull::Down)),
        Sonar::new(Output::new(device.PIN_3, Level::Low), Input::new(device.PIN_11, Pull::Down)),
        Sonar::new(Output::new(device.PIN_4, Level::Low), Input::new(device.PIN_12, Pull::Down)),
        Sonar::new(Output::new(device.PIN_5, Level::Low), Input::new(device.PIN_13, Pull::Down)),
        Sonar::new(Output::new(device.PIN_6, Level::Low), Input::new(device.PIN_14, Pull::Down)),
        Sonar::new(Output::new(device.PIN_7, Level::Low), Input::new(device.PIN_15, Pull::Down)),
        Sonar::new(Output::new(device.PIN_8, Level::Low), Input::new(device.PIN_16, Pull::Down)),
        Sonar::new(Output::new(device.PIN_9, Level::Low), Input::new(device.PIN_17, Pull::Down)),
    ];

    let mut pwm_config = PwmConfig::default();
    pwm_config.top = PWM_TOP;
    let (Some(left), Some(right)) =
        Pwm::new_output_ab(device.PWM_SLICE1, device.PIN_18, device.PIN_19, pwm_config).split()
    else {
        panic!()
    };
    let left = (left, Output::new(device.PIN_20, Level::High));
    let right = (right, Output::new(device.PIN_21, Level::High));
    let Ok(wheels) = DifferentialDrive::new(left, right, WheelsConfig::DEFAULT) else { panic!() };
    let mut board = Pico { wheels, watchdog };
    board.follow(VelocityCommand::STOP);

    let robot = ROBOT_CELL.take();
    let config = RobotConfig::new(RingGeometry::even(), reference::FILTER)
        .with_reset_cause(reset_cause)
        .with_snapshot(SnapshotPolicy::DEFAULT.with_every_places(0))
        .with_turn_bound_ms(TURN_BOUND_MS);
    if robot.start(&config, SNAPSHOT.take()).is_err() {
        panic!()
    }

    interrupt::SWI_IRQ_1.set_priority(Priority::P3);
    let spawner = TASKS.start(interrupt::SWI_IRQ_1);
    let (transmitter, receiver) = uart.split();
    let (Ok(measure), Ok(transmit), Ok(receive)) =
        (ring::measure(sonars), line::transmit(transmitter), line::receive_bytes(receiver))
    else {
        panic!()
    };
    spawner.spawn(measure);
    spawner.spawn(transmit);
    spawner.spawn(receive);
    loop {
        let (frame, faults) = block_on(ring::FRAMES.wait());
        robot.turn(&frame, &faults, &mut board);
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}

// SAFETY: the handler uses no state that the fault may have left inconsistent.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    SCB::sys_reset()
}
