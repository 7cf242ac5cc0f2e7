//! The small robot on the machine `microbit` of QEMU: a Cortex-M0 without floating-point unit, with 16 KiB of RAM.
//!
//! The ring is at the other end of the serial line: a frame is one code of two bytes a sensor, the lower byte first, as in the
//! message `Ring`; then the number of the bytes that follow for the robot, and these. With the number 255 the run is over, and the image
//! prints its figures and ends the emulator. In the other direction the line carries the messages of the robot. For the emulator
//! only: the wheels get no power, and there is no watchdog. `docs/small-robot.md` has the figures.
#![no_std]
#![no_main]

mod chip;
#[path = "../../../src/bin/shared/stack.rs"]
mod stack;

use core::panic::PanicInfo;

use chip::{Clock, Uart};
use cortex_m::asm;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::{debug, hprintln};
use toposlam::{
    FaultCounters,
    drive::VelocityCommand,
    reference::small::{self, SmallRobot},
    ring::{Echo, RingFrame},
    robot::Board,
    wire::QueueFull,
};

/// The number of sensors in the ring.
const SONARS: usize = if cfg!(feature = "ring-of-16") { 16 } else { small::SONARS };
/// In place of a number of bytes: the run is over.
const END: u8 = 255;
const TICKS_PER_MS: u32 = 16_000;

struct Microbit {
    uart: Uart,
    clock: Clock,
    /// How many bytes for the robot the line holds.
    pending: u8,
    last_ticks: u32,
    ticks: u64,
}

impl Microbit {
    /// The ticks since the last call.
    fn lap(&mut self) -> u32 {
        let now = self.clock.ticks();
        let lap = now.wrapping_sub(self.last_ticks);
        self.last_ticks = now;
        self.ticks += u64::from(lap);
        lap
    }

    /// Receives a ring frame, and the number of the bytes for the robot; `None` at the end.
    fn frame(&mut self) -> Option<RingFrame<SONARS>> {
        let mut echoes = [Echo::Dead; SONARS];
        for echo in &mut echoes {
            let code = u16::from_le_bytes([self.uart.receive(), self.uart.receive()]);
            *echo = match code {
                0 => Echo::Dead,
                1 => Echo::Silence,
                code => Echo::Range { range_mm: code - 2 },
            };
        }
        self.pending = self.uart.receive();
        (self.pending != END).then_some(RingFrame { echoes })
    }
}

impl Board for Microbit {
    fn receive(&mut self) -> Option<u8> {
        self.pending = self.pending.checked_sub(1)?;
        Some(self.uart.receive())
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        frame.iter().for_each(|&byte| self.uart.transmit(byte));
        Ok(())
    }

    /// The command is in the message `Velocity`.
    fn follow(&mut self, _: VelocityCommand) {}

    fn now_ms(&mut self) -> u32 {
        (self.ticks / u64::from(TICKS_PER_MS)) as u32
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        stack::stack_high_water_bytes()
    }
}

/// The ticks of some turns of the main loop.
#[derive(Default)]
struct Cost {
    turns: u32,
    sum: u64,
    worst: u32,
}

impl Cost {
    fn add(&mut self, ticks: u32) {
        self.turns += 1;
        self.sum += u64::from(ticks);
        self.worst = self.worst.max(ticks);
    }

    fn print(&self, name: &str) {
        let mean = self.sum.checked_div(self.turns.into()).unwrap_or(0);
        hprintln!("{}_turns: {}", name, self.turns);
        hprintln!("{}_ticks_mean: {}", name, mean);
        hprintln!("{}_ticks_worst: {}", name, self.worst);
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut ROBOT_CELL: SmallRobot<'static, SONARS> = SmallRobot::new();

    let robot = ROBOT_CELL;
    let mut board = Microbit { uart: Uart::open(), clock: Clock::start(), pending: 0, last_ticks: 0, ticks: 0 };
    if robot.start(&small::robot(), &mut []).is_err() {
        // Does not happen: the settings are constants.
        panic!()
    }
    let no_faults = FaultCounters::new();
    let (mut frames, mut places) = (Cost::default(), Cost::default());
    while let Some(frame) = board.frame() {
        board.lap();
        let is_place = robot.turn(&frame, &no_faults, &mut board).is_some();
        let ticks = board.lap();
        if is_place { places.add(ticks) } else { frames.add(ticks) }
    }
    frames.print("frame");
    places.print("place");
    hprintln!("stack_high_water_bytes: {}", stack::stack_high_water_bytes());
    hprintln!("robot_bytes: {}", size_of::<SmallRobot<'static, SONARS>>());
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {
        asm::wfi();
    }
}

// SAFETY: the handler uses no state that the fault may have left inconsistent.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {
        asm::wfi();
    }
}
