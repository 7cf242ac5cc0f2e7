//! The robot image for the STM32F405RG: sonar ring in, map updates out on USART1.
//!
//! It only wires the board to the stages; `docs/firmware.md` has the pins. The image is flashable as it is. In the
//! emulator nothing but a fault uses semihosting.
#![no_std]
#![no_main]

mod support;

use core::cell::RefCell;

use cortex_m::{
    asm,
    peripheral::{NVIC, syst::SystClkSource},
};
use cortex_m_rt::exception;
use defmt_rtt as _;
use embedded_hal::delay::DelayNs;
use embedded_hal_nb::{nb, serial};
use heapless::Deque;
use static_cell::ConstStaticCell;
use stm32f4xx_hal::{
    pac,
    prelude::*,
    rcc::{self, Rcc},
    serial::{Event, Serial, Tx},
};
use toposlam::{
    FaultCounters, FaultKind,
    reference::{self, RobotMapper, SONARS},
    sonar::{Sc18im700, SonarRing, Srf08Config, Srf08Ring},
    wire::{Encoder, Health, MAX_FRAME_BYTES, Message, QueueFull},
};

const TRANSMIT_BYTES: usize = 2048;
const BRIDGE_BAUD_AT_RESET: u32 = 9600;
const BAUD: u32 = 115_200;
const FRAMES_PER_HEALTH: u32 = 256;
/// Time for some 30 bytes on the line.
const PACE_US: u32 = 2500;

/// The bytes that wait for USART1, and the line itself.
struct Transmitter {
    queue: &'static mut Deque<u8, TRANSMIT_BYTES>,
    line: Tx<pac::USART1>,
    encoder: Encoder,
    faults: FaultCounters,
}

impl Transmitter {
    /// Queues a whole message, or drops it and counts that.
    fn send(&mut self, message: &Message) -> Result<(), QueueFull> {
        let mut bytes = [0; MAX_FRAME_BYTES];
        let frame = self.encoder.encode(message, &mut bytes).map_err(|_| QueueFull)?;
        if self.queue.capacity() - self.queue.len() < frame.len() {
            self.faults.count(FaultKind::WireFull);
            return Err(QueueFull);
        }
        for &byte in frame {
            // There is room: it was just looked for.
            let _ = self.queue.push_back(byte);
        }
        Ok(())
    }

    /// Hands over what the line takes at once; never waits.
    fn pump(&mut self) {
        while let Some(&byte) = self.queue.front() {
            match serial::Write::write(&mut self.line, byte) {
                Err(nb::Error::WouldBlock) => break,
                // A byte that the line refuses is gone; the frame's checksum tells the listener.
                Ok(()) | Err(nb::Error::Other(_)) => self.queue.pop_front(),
            };
        }
    }
}

/// Waits for the sonars and uses the time to send.
struct SendingDelay<'a> {
    cycles_per_slice: u32,
    transmitter: &'a RefCell<Transmitter>,
}

impl SendingDelay<'_> {
    /// Short of the 87 us that a byte lasts at 115,200 baud.
    const SLICES_PER_SECOND: u32 = 20_000;
    const SLICE_NS: u32 = 1_000_000_000 / Self::SLICES_PER_SECOND;

    fn pump(&self) {
        if let Ok(mut transmitter) = self.transmitter.try_borrow_mut() {
            transmitter.pump();
        }
    }
}

impl DelayNs for SendingDelay<'_> {
    fn delay_ns(&mut self, nanoseconds: u32) {
        for _ in 0..nanoseconds.div_ceil(Self::SLICE_NS) {
            self.pump();
            asm::delay(self.cycles_per_slice);
        }
        self.pump();
    }
}

/// A UART that waits a moment before it says "nothing yet", so that a number of polls is a time.
///
/// While it sends, the moment is short, for the receiver holds one byte only. Otherwise it sleeps until a byte arrives
/// or the clock ticks; the emulator then has the time to bring the byte.
struct SleepingUart<UART> {
    uart: UART,
    cycles_while_sending: u32,
}

impl<UART: serial::ErrorType> serial::ErrorType for SleepingUart<UART> {
    type Error = UART::Error;
}

impl<UART: serial::Read<u8> + serial::Write<u8>> serial::Read<u8> for SleepingUart<UART> {
    fn read(&mut self) -> nb::Result<u8, UART::Error> {
        let answer = self.uart.read();
        if matches!(answer, Err(nb::Error::WouldBlock)) {
            if self.uart.flush().is_ok() {
                sleep_until_a_byte_or_a_tick();
            } else {
                asm::delay(self.cycles_while_sending);
            }
        }
        answer
    }
}

impl<UART: serial::Write<u8>> serial::Write<u8> for SleepingUart<UART> {
    fn write(&mut self, byte: u8) -> nb::Result<(), UART::Error> {
        self.uart.write(byte)
    }

    fn flush(&mut self) -> nb::Result<(), UART::Error> {
        self.uart.flush()
    }
}

/// With interrupts off, a pending one still ends the sleep; so no byte slips in between the look and the sleep.
fn sleep_until_a_byte_or_a_tick() {
    cortex_m::interrupt::free(|_| {
        // SAFETY: interrupts are off until it is masked again, so no handler runs.
        #[allow(unsafe_code)]
        unsafe {
            NVIC::unmask(pac::Interrupt::USART2);
        }
        asm::wfi();
        NVIC::mask(pac::Interrupt::USART2);
        NVIC::unpend(pac::Interrupt::USART2);
    });
}

/// Nothing but the end of a sleep.
#[exception]
fn SysTick() {}

#[cortex_m_rt::entry]
fn main() -> ! {
    static QUEUE: ConstStaticCell<Deque<u8, TRANSMIT_BYTES>> = ConstStaticCell::new(Deque::new());
    static MAPPER: ConstStaticCell<RobotMapper> = ConstStaticCell::new(RobotMapper::new());

    let is_emulated = support::is_emulated();
    let (Some(device), Some(mut core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take()) else {
        // They are taken here for the first time.
        panic!()
    };
    let mut rcc = start_clock(device.RCC);
    let port_a = device.GPIOA.split(&mut rcc);
    let Ok(line) = Serial::<_, u8>::new(device.USART1, (port_a.pa9, port_a.pa10), BAUD.bps(), &mut rcc) else {
        panic!()
    };
    let (line, _) = line.split();

    // 200 polls are 4 ms while sending and 50 ms otherwise; the emulator's far end may be slow to be scheduled.
    let clock_hz = rcc.clocks.sysclk().raw();
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(if is_emulated { 0x00FF_FFFF } else { clock_hz / 4000 - 1 });
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    let bridge_on = |uart| Sc18im700::new(SleepingUart { uart, cycles_while_sending: clock_hz / 50_000 }, 200);
    let bridge_pins = (port_a.pa2, port_a.pa3);
    let Ok(uart) = Serial::<_, u8>::new(device.USART2, bridge_pins, BRIDGE_BAUD_AT_RESET.bps(), &mut rcc) else {
        panic!()
    };
    let mut bridge = bridge_on(uart);
    let asked = bridge.set_baud_rate(BAUD);
    let (uart, (Some(bridge_tx), Some(bridge_rx))) = bridge.release().uart.release() else { panic!() };
    let Ok(mut uart) = Serial::<_, u8>::new(uart, (bridge_tx, bridge_rx), BAUD.bps(), &mut rcc) else { panic!() };
    uart.listen(Event::RxNotEmpty);
    let mut bridge = bridge_on(uart);
    if let Err(error) = asked.and_then(|()| bridge.start()) {
        defmt::warn!("the bridge to the sonars: {}", error);
    }

    let mapper = MAPPER.take();
    if let Err(error) = mapper.start(&reference::MAPPER) {
        defmt::error!("{}", error);
        panic!()
    }
    let queue = QUEUE.take();
    // One zero, so that noise from the start does not spoil the first frame.
    let _ = queue.push_back(0);
    let transmitter = Transmitter { queue, line, encoder: Encoder::default(), faults: FaultCounters::new() };
    let transmitter = RefCell::new(transmitter);

    let cycles_per_slice = rcc.clocks.sysclk().raw() / SendingDelay::SLICES_PER_SECOND;
    let delay = SendingDelay { cycles_per_slice, transmitter: &transmitter };
    let mut pace = SendingDelay { cycles_per_slice, transmitter: &transmitter };
    let Ok(mut ring) = Srf08Ring::<_, _, SONARS>::new(bridge, delay, Srf08Config::DEFAULT) else { panic!() };
    let mut ring_faults = FaultCounters::new();
    defmt::info!("{} sonars, clock {} Hz", SONARS, rcc.clocks.sysclk().raw());
    let mut loop_count = 0_u32;
    loop {
        let frame = ring.read(&mut ring_faults);
        if let Some(error) = ring.last_error() {
            defmt::debug!("{}", error);
        }
        if let Ok(mut transmitter) = transmitter.try_borrow_mut() {
            let mut faults = ring_faults;
            faults.add(&transmitter.faults);
            // There is no drive yet that could tell how the robot left the place before.
            if let Some((_, update)) = mapper.observe(&frame, None, &faults, |message| transmitter.send(message)) {
                defmt::info!("{}", update);
            }
            if loop_count.is_multiple_of(FRAMES_PER_HEALTH) {
                // A message that finds no room is counted; the next one comes.
                let _ = transmitter.send(&Message::Health(health(loop_count)));
            }
        }
        // A ring that is not there answers at once; the line still gets its time.
        pace.delay_us(PACE_US);
        loop_count = loop_count.wrapping_add(1);
    }
}

fn health(loop_count: u32) -> Health {
    let stack_high_water_bytes = u32::try_from(support::stack_high_water_bytes()).unwrap_or(u32::MAX);
    Health { loop_count, stack_high_water_bytes, ..Health::default() }
}

/// The internal 16 MHz oscillator, directly or, with the feature `pll`, multiplied to 168 MHz. The emulator has no PLL.
fn start_clock(controller: pac::RCC) -> Rcc {
    let config = rcc::Config::hsi();
    controller.freeze(if cfg!(feature = "pll") { config.sysclk(168.MHz()) } else { config })
}
