//! The robot image for the nRF52840 on Nordic's board PCA10056: sonar ring in, wheels out, the map on the serial line of its
//! debugger, snapshots in flash.
//!
//! This file connects the board to `toposlam::robot`, in the order of the reference board's `src/bin/robot/main.rs`: the `Board`
//! implementation, then `main` (clocks, line, sonars, wheels, store, main loop), then helpers. `docs/porting.md` compares the
//! two. Not tested on hardware.
#![no_std]
#![no_main]

mod bus;
mod fault;
#[path = "../../../src/bin/shared/frame_queue.rs"]
mod frame_queue;
mod line;
#[path = "../../../src/bin/shared/stack.rs"]
mod stack;

use core::convert::Infallible;

use bus::Bus;
use defmt_rtt as _;
use embedded_hal::delay::DelayNs;
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use line::Line;
use nrf52840_hal::{
    Clocks, Delay, Timer,
    gpio::{Level, Output, Pin, PushPull, p0, p1},
    nvmc::Nvmc,
    pac::{self, NVMC, PWM0, TIMER0},
    pwm::{Channel, Pwm, PwmChannel},
    time::U32Ext,
    timer::Periodic,
    twim,
    wdt::{Watchdog, WatchdogHandle, count, handles::Hdl0},
};
use static_cell::ConstStaticCell;
use toposlam::{
    FaultCounters,
    drive::{DifferentialDrive, VelocityCommand, WheelsConfig},
    persist::store::{BootPolicy, Store},
    reference::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES, SONARS},
    ring::drivers::{SonarRing, Srf08Config, Srf08Ring},
    robot::{Board, SaveError},
    wire::{QueueFull, ResetCause},
};

/// An absent ring returns at once; this pause gives the line time for some 30 bytes.
const PACE_US: u32 = 2500;
/// Longer than the erase of half the store, 16 pages of 85 ms each, and than any step of the main loop.
const WATCHDOG_TICKS: u32 = 10 * 32_768;

/// The board PCA10056 with a motor driver on its header.
struct Nrf52840<'a> {
    line: Line,
    wheels: DifferentialDrive<Duty<'a>, Pin<Output<PushPull>>>,
    watchdog: WatchdogHandle<Hdl0>,
    clock: Clock,
    /// `None` when the flash cannot be mounted.
    store: Option<Store<Nvmc<NVMC>>>,
}

impl Board for Nrf52840<'_> {
    fn receive(&mut self) -> Option<u8> {
        self.line.receive()
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        self.line.send(frame)
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        // Does not fail on this chip: timer and pins have no errors.
        let _ = self.wheels.follow(velocity);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }

    fn now_ms(&mut self) -> u32 {
        self.clock.now_ms()
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        stack::stack_high_water_bytes()
    }

    fn save(&mut self, snapshot: &[u8]) -> Result<(), SaveError> {
        let store = self.store.as_mut().ok_or(SaveError::NoStore)?;
        store.save(snapshot).map_err(|_| SaveError::Failed)
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static ROBOT_CELL: ConstStaticCell<ReferenceRobot<'static>> = ConstStaticCell::new(ReferenceRobot::new());
    static SNAPSHOT: ConstStaticCell<[u8; SNAPSHOT_BYTES]> = ConstStaticCell::new([0; SNAPSHOT_BYTES]);

    let (Some(device), Some(core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take()) else {
        // Does not happen: this is the first call.
        panic!()
    };
    let reset_cause = reset_cause(&device.POWER);
    let watchdog = start_watchdog(device.WDT);
    // The crystal: the internal oscillator is too inaccurate for the serial line.
    let _ = Clocks::new(device.CLOCK).enable_ext_hfosc();
    let clock = Clock::start(device.TIMER0);
    let port_0 = p0::Parts::new(device.P0);
    let port_1 = p1::Parts::new(device.P1);

    let transmit = port_0.p0_06.into_push_pull_output(Level::High).degrade();
    let receive = port_0.p0_08.into_floating_input().degrade();
    let line = Line::open(device.UART0, transmit, receive);
    let pins = twim::Pins {
        scl: port_0.p0_27.into_floating_input().degrade(),
        sda: port_0.p0_26.into_floating_input().degrade(),
    };
    let bus = Bus::open(device.TWIM0, pins);

    let pwm = Pwm::new(device.PWM0);
    // The pins must be selected while it is off; the first duty cycle switches it on.
    pwm.disable();
    pwm.set_period(20_000_u32.hz());
    pwm.set_output_pin(Channel::C0, port_1.p1_11.into_push_pull_output(Level::Low).degrade());
    pwm.set_output_pin(Channel::C1, port_1.p1_12.into_push_pull_output(Level::Low).degrade());
    let (left, right, ..) = pwm.split_channels();
    let left = (Duty(left), port_1.p1_13.into_push_pull_output(Level::High).degrade());
    let right = (Duty(right), port_1.p1_14.into_push_pull_output(Level::High).degrade());
    let Ok(wheels) = DifferentialDrive::new(left, right, WheelsConfig::DEFAULT) else { panic!() };

    let pages = store_pages();
    let range = 0..pages.len() as u32;
    let mut store = Store::mount(Nvmc::new(device.NVMC, pages), range).ok();
    let boot = store.as_mut().and_then(|store| store.count_start().ok()).unwrap_or(0);
    let config = ROBOT.with_boot(boot).with_reset_cause(reset_cause);
    let robot = ROBOT_CELL.take();
    let started = match &mut store {
        Some(store) => robot.boot(&config, SNAPSHOT.take(), store, BootPolicy::default()).map(|_| ()),
        None => robot.start(&config, SNAPSHOT.take()),
    };
    if started.is_err() {
        defmt::error!("a setting is out of its range");
        panic!()
    }

    let mut pace = Timer::one_shot(device.TIMER1);
    let delay = Delay::new(core.SYST);
    let Ok(mut ring) = Srf08Ring::<_, _, SONARS>::new(bus, delay, Srf08Config::DEFAULT) else { panic!() };
    let mut ring_faults = FaultCounters::new();
    let mut board = Nrf52840 { line, wheels, watchdog, clock, store };
    board.follow(VelocityCommand::STOP);
    defmt::info!("{} sonars", SONARS);
    loop {
        let frame = ring.read(&mut ring_faults);
        if let Some(error) = ring.last_error() {
            defmt::debug!("{}", error);
        }
        if let Some((_, update)) = robot.turn(&frame, &ring_faults, &mut board) {
            defmt::info!("{}", update);
        }
        pace.delay_us(PACE_US);
    }
}

/// The PWM channel of a wheel. The HAL's own `SetDutyCycle` is inverted: its "on" time is the low time of the output (COMPARE
/// without bit 15 in the product specification), so a duty cycle of 0 would be full speed.
struct Duty<'a>(PwmChannel<'a, PWM0>);

impl ErrorType for Duty<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for Duty<'_> {
    fn max_duty_cycle(&self) -> u16 {
        self.0.max_duty()
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.set_duty_off(duty);
        Ok(())
    }
}

/// A clock of milliseconds on a timer of microseconds. The timer wraps after 71 minutes; the robot reads it more often.
struct Clock {
    timer: Timer<TIMER0, Periodic>,
    last_us: u32,
    rest_us: u32,
    now_ms: u32,
}

impl Clock {
    fn start(timer: TIMER0) -> Self {
        let mut timer = Timer::periodic(timer);
        timer.start(u32::MAX);
        Self { timer, last_us: 0, rest_us: 0, now_ms: 0 }
    }

    fn now_ms(&mut self) -> u32 {
        let now_us = self.timer.read();
        let since_us = u64::from(now_us.wrapping_sub(self.last_us)) + u64::from(self.rest_us);
        self.last_us = now_us;
        self.rest_us = (since_us % 1000) as u32;
        self.now_ms = self.now_ms.wrapping_add((since_us / 1000) as u32);
        self.now_ms
    }
}

/// Starts the watchdog, or recovers it when it is still running after a software reset.
fn start_watchdog(watchdog: pac::WDT) -> WatchdogHandle<Hdl0> {
    let parts = match Watchdog::try_new(watchdog) {
        Ok(mut watchdog) => {
            watchdog.set_lfosc_ticks(WATCHDOG_TICKS);
            Ok(watchdog.activate::<count::One>())
        }
        Err(running) => Watchdog::try_recover::<count::One>(running),
    };
    // A watchdog with another configuration: nothing feeds it, so it resets the chip and thereby stops.
    let Ok(parts) = parts else { panic!() };
    let (mut handle,) = parts.handles;
    handle.pet();
    handle
}

/// Reads the cause of the last reset (product specification, POWER.RESETREAS) and clears the flags. A power-on and a brown-out
/// both set none.
fn reset_cause(power: &pac::POWER) -> ResetCause {
    let flags = power.resetreas.read();
    // SAFETY: writing a flag clears it and has no other effect.
    #[allow(unsafe_code)]
    power.resetreas.write(|w| unsafe { w.bits(flags.bits()) });
    match () {
        () if flags.dog().is_detected() => ResetCause::Watchdog,
        () if flags.sreq().is_detected() => ResetCause::Software,
        () if flags.resetpin().is_detected() => ResetCause::ResetPin,
        () if flags.bits() == 0 => ResetCause::PowerOn,
        () => ResetCause::Unknown,
    }
}

/// The flash pages that `memory.x` reserves for snapshots.
fn store_pages() -> &'static mut [u8] {
    #[allow(unsafe_code)]
    unsafe extern "C" {
        static mut _store_start: u8;
        static mut _store_end: u8;
    }
    let (start, end) = (&raw mut _store_start, &raw mut _store_end);
    // SAFETY: the linker places nothing there, and this is called once.
    #[allow(unsafe_code)]
    unsafe {
        core::slice::from_raw_parts_mut(start, end.addr() - start.addr())
    }
}
