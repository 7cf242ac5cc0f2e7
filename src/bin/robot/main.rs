//! The robot image for the STM32F405RG: sonar ring in, wheels out, the map on USART1, snapshots in flash.
//!
//! This file connects the board to `toposlam::robot`, in this order: the `Board` implementation, then `main` (clocks, line,
//! sonars, wheels, store, main loop), then helpers. `docs/firmware.md` lists the pins, `docs/porting.md` the steps for another
//! board. The same image runs on the chip and in the emulator; only a fault uses semihosting.

mod bridge_uart;
mod clock;
#[path = "../shared/frame_queue.rs"]
mod frame_queue;
mod line;
#[path = "../shared/mod.rs"]
mod shared;

use core::cell::RefCell;

use bridge_uart::BridgeUart;
use clock::Clock;
use defmt_rtt as _;
use embedded_hal::delay::DelayNs;
use frame_queue::TransmitQueue;
use heapless::Deque;
use line::{Line, SendingDelay};
use static_cell::{ConstStaticCell, StaticCell};
use stm32f4xx_hal::{
    flash::{FlashExt, LockedFlash, UnlockedFlash},
    gpio::{ErasedPin, Output},
    pac,
    prelude::*,
    rcc::{self, Rcc},
    serial::{Event, Serial},
    timer::ErasedChannel,
    watchdog::IndependentWatchdog,
};
use toposlam::{
    FaultCounters,
    drive::{DifferentialDrive, VelocityCommand, WheelsConfig},
    persist::store::{BootPolicy, Store},
    reference::{SONARS, STORE},
    ring::drivers::{Sc18im700, SonarRing, Srf08Config, Srf08Ring},
    robot::{Board, SaveError},
    wire::{QueueFull, ResetCause},
};

use super::robot::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES};

const BRIDGE_BAUD_AT_RESET: u32 = 9600;
const BAUD: u32 = 115_200;
/// An absent ring returns at once; this pause gives the line time for some 30 bytes.
const PACE_US: u32 = 2500;
/// Longer than the erase of a flash sector (at most 4 s by the data sheet) and than any step of the main loop.
const WATCHDOG_MS: u32 = 10_000;

type Motor = (ErasedChannel<pac::TIM3>, ErasedPin<Output>);

/// The reference board.
struct Stm32f405<'a> {
    line: &'a RefCell<Line>,
    wheels: DifferentialDrive<ErasedChannel<pac::TIM3>, ErasedPin<Output>>,
    watchdog: IndependentWatchdog,
    clock: Clock,
    /// `None` in the emulator, whose flash is read-only.
    store: Option<Store<UnlockedFlash<'static>>>,
}

impl Board for Stm32f405<'_> {
    fn receive(&mut self) -> Option<u8> {
        Line::receive()
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        self.line.try_borrow_mut().map_err(|_| QueueFull)?.send(frame)
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        // Does not fail on this chip: timer and pins have no errors.
        let _ = self.wheels.follow(velocity);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn now_ms(&mut self) -> u32 {
        self.clock.now_ms()
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        shared::stack_high_water_bytes()
    }

    fn save(&mut self, snapshot: &[u8]) -> Result<(), SaveError> {
        let store = self.store.as_mut().ok_or(SaveError::NoStore)?;
        store.save(snapshot).map_err(|_| SaveError::Failed)
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static QUEUE: ConstStaticCell<TransmitQueue> = ConstStaticCell::new(Deque::new());
    static ROBOT_CELL: ConstStaticCell<ReferenceRobot<'static>> = ConstStaticCell::new(ReferenceRobot::new());
    static SNAPSHOT: ConstStaticCell<[u8; SNAPSHOT_BYTES]> = ConstStaticCell::new([0; SNAPSHOT_BYTES]);
    static FLASH: StaticCell<LockedFlash> = StaticCell::new();

    let is_emulated = shared::is_emulated();
    let (Some(device), Some(mut core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take()) else {
        // Does not happen: this is the first call.
        panic!()
    };
    let reset_cause = reset_cause(&device.RCC);
    let mut rcc = start_clock(device.RCC);
    let clock_hz = rcc.clocks.sysclk().raw();
    let clock = Clock::start(&mut core.SYST, clock_hz, is_emulated);
    let port_a = device.GPIOA.split(&mut rcc);

    let Ok(line) = Serial::<_, u8>::new(device.USART1, (port_a.pa9, port_a.pa10), BAUD.bps(), &mut rcc) else {
        panic!()
    };
    let line = RefCell::new(Line::open(line, QUEUE.take()));

    // 200 polls are 4 ms while transmitting and 50 ms otherwise; in the emulator the peer on the line may be slow.
    let bridge_on = |uart| Sc18im700::new(BridgeUart { uart, cycles_while_sending: clock_hz / 50_000 }, 200);
    let bridge_pins = (port_a.pa2, port_a.pa3);
    let Ok(uart) = Serial::<_, u8>::new(device.USART2, bridge_pins, BRIDGE_BAUD_AT_RESET.bps(), &mut rcc) else {
        panic!()
    };
    let mut bridge = bridge_on(uart);
    let baud_rate_set = bridge.set_baud_rate(BAUD);
    let (uart, (Some(bridge_tx), Some(bridge_rx))) = bridge.release().uart.release() else { panic!() };
    let Ok(mut uart) = Serial::<_, u8>::new(uart, (bridge_tx, bridge_rx), BAUD.bps(), &mut rcc) else { panic!() };
    uart.listen(Event::RxNotEmpty);
    let mut bridge = bridge_on(uart);
    if let Err(error) = baud_rate_set.and_then(|()| bridge.start()) {
        defmt::warn!("sonar bridge: {}", error);
    }

    let (_, (left, right, ..)) = device.TIM3.pwm_hz(20.kHz(), &mut rcc);
    let [mut left, mut right] = [left.with(port_a.pa6).erase(), right.with(port_a.pa7).erase()];
    left.enable();
    right.enable();
    let left: Motor = (left, port_a.pa4.into_push_pull_output().erase());
    let right: Motor = (right, port_a.pa5.into_push_pull_output().erase());
    let Ok(wheels) = DifferentialDrive::new(left, right, WheelsConfig::DEFAULT) else { panic!() };

    let flash = FLASH.init(LockedFlash::new(device.FLASH));
    let mut store = if is_emulated { None } else { Store::mount(flash.unlocked(), STORE).ok() };
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

    let delay = SendingDelay::new(clock_hz, &line);
    let mut pace = SendingDelay::new(clock_hz, &line);
    let Ok(mut ring) = Srf08Ring::<_, _, SONARS>::new(bridge, delay, Srf08Config::DEFAULT) else { panic!() };
    let mut ring_faults = FaultCounters::new();
    let mut watchdog = IndependentWatchdog::new(device.IWDG);
    watchdog.start(WATCHDOG_MS.millis());
    let mut board = Stm32f405 { line: &line, wheels, watchdog, clock, store };
    defmt::info!("{} sonars, clock {} Hz", SONARS, clock_hz);
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

/// Reads the cause of the last reset (RM0090, RCC_CSR) and clears the flags. A power-on also sets the brown-out flag, and
/// every reset also sets the pin flag.
fn reset_cause(controller: &pac::RCC) -> ResetCause {
    let flags = controller.csr().read();
    controller.csr().modify(|_, w| w.rmvf().set_bit());
    match () {
        () if flags.lpwrrstf().bit() => ResetCause::LowPower,
        () if flags.wdgrstf().bit() || flags.wwdgrstf().bit() => ResetCause::Watchdog,
        () if flags.sftrstf().bit() => ResetCause::Software,
        () if flags.porrstf().bit() => ResetCause::PowerOn,
        () if flags.borrstf().bit() => ResetCause::BrownOut,
        () if flags.padrstf().bit() => ResetCause::ResetPin,
        () => ResetCause::Unknown,
    }
}

/// Selects the internal 16 MHz oscillator or, with the feature `pll`, 168 MHz from the PLL, which the emulator lacks.
fn start_clock(controller: pac::RCC) -> Rcc {
    let config = rcc::Config::hsi();
    controller.freeze(if cfg!(feature = "pll") { config.sysclk(168.MHz()) } else { config })
}
