//! The robot image for the STM32F405RG: sonar ring in, map updates out on USART1.
//!
//! It only wires the board to the stages; `docs/firmware.md` has the pins. The image is flashable as it is. In the
//! emulator nothing but a fault uses semihosting.
#![no_std]
#![no_main]

mod support;

use core::cell::RefCell;

use cortex_m::asm;
use defmt_rtt as _;
use embedded_hal::delay::DelayNs;
use embedded_hal_nb::{nb, serial};
use heapless::Deque;
use static_cell::ConstStaticCell;
use stm32f4xx_hal::{
    pac,
    prelude::*,
    rcc::{self, Rcc},
    serial::{Serial, Tx},
};
use toposlam::{
    FaultCounters, FaultKind,
    ring::{Echo, RingFrame},
    sonar::{Sc18im700, SonarRing, Srf08Config, Srf08Ring},
};

const SONARS: usize = 16;
const TRANSMIT_BYTES: usize = 2048;
const BRIDGE_BAUD_AT_RESET: u32 = 9600;
const BAUD: u32 = 115_200;
const EMULATED_PAUSE_CYCLES: u32 = 2000;

/// The bytes that wait for USART1.
struct Transmitter {
    queue: Deque<u8, TRANSMIT_BYTES>,
}

impl Transmitter {
    const fn new() -> Self {
        Self { queue: Deque::new() }
    }

    /// Queues a whole message, or drops it and counts that.
    fn send(&mut self, message: &[u8], faults: &mut FaultCounters) {
        if self.queue.capacity() - self.queue.len() < message.len() {
            faults.count(FaultKind::WireFull);
            return;
        }
        for &byte in message {
            // There is room: it was just looked for.
            let _ = self.queue.push_back(byte);
        }
    }

    /// Hands over what the line takes at once; never waits.
    fn pump(&mut self, line: &mut impl serial::Write<u8>) {
        while let Some(&byte) = self.queue.front() {
            match line.write(byte) {
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
    line: Tx<pac::USART1>,
    transmitter: &'a RefCell<&'static mut Transmitter>,
}

impl SendingDelay<'_> {
    /// Short of the 87 us that a byte lasts at 115,200 baud.
    const SLICES_PER_SECOND: u32 = 20_000;
    const SLICE_NS: u32 = 1_000_000_000 / Self::SLICES_PER_SECOND;

    fn pump(&mut self) {
        if let Ok(mut transmitter) = self.transmitter.try_borrow_mut() {
            transmitter.pump(&mut self.line);
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

/// A UART that pauses before it says "nothing yet", so that a number of polls is a time.
///
/// Without the pause the emulator would do nothing but serve the polls, and bytes would reach it late.
struct PausingUart<UART> {
    uart: UART,
    pause_cycles: u32,
}

impl<UART: serial::ErrorType> serial::ErrorType for PausingUart<UART> {
    type Error = UART::Error;
}

impl<UART: serial::Read<u8>> serial::Read<u8> for PausingUart<UART> {
    fn read(&mut self) -> nb::Result<u8, UART::Error> {
        self.uart.read().inspect_err(|error| {
            if matches!(error, nb::Error::WouldBlock) {
                asm::delay(self.pause_cycles);
            }
        })
    }
}

impl<UART: serial::Write<u8>> serial::Write<u8> for PausingUart<UART> {
    fn write(&mut self, byte: u8) -> nb::Result<(), UART::Error> {
        self.uart.write(byte)
    }

    fn flush(&mut self) -> nb::Result<(), UART::Error> {
        self.uart.flush()
    }
}

/// A raw frame: a marker and for each sonar the range in millimetres, 0 for silence and 65,535 for a dead one.
fn raw(frame: &RingFrame<SONARS>) -> [u8; 2 + 2 * SONARS] {
    let mut bytes = [0xA5; 2 + 2 * SONARS];
    for (pair, echo) in bytes.chunks_exact_mut(2).skip(1).zip(frame.echoes) {
        let value = match echo {
            Echo::Range { range_mm } => range_mm,
            Echo::Silence => 0,
            Echo::Dead => u16::MAX,
        };
        for (byte, part) in pair.iter_mut().zip(value.to_be_bytes()) {
            *byte = part;
        }
    }
    bytes
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static TRANSMITTER: ConstStaticCell<Transmitter> = ConstStaticCell::new(Transmitter::new());

    let is_emulated = support::is_emulated();
    let Some(device) = pac::Peripherals::take() else {
        // They are taken here for the first time.
        panic!()
    };
    let mut rcc = start_clock(device.RCC);
    let port_a = device.GPIOA.split(&mut rcc);
    let Ok(line) = Serial::<_, u8>::new(device.USART1, (port_a.pa9, port_a.pa10), BAUD.bps(), &mut rcc) else {
        panic!()
    };
    let (line, _) = line.split();

    // 4000 polls of 5 us: 20 ms. The emulator's far end may be slow to be scheduled, so there it is seconds.
    let pause_cycles = if is_emulated { EMULATED_PAUSE_CYCLES } else { rcc.clocks.sysclk().raw() / 200_000 };
    let poll_budget = if is_emulated { 400_000 } else { 4000 };
    let bridge_pins = (port_a.pa2, port_a.pa3);
    let Ok(uart) = Serial::<_, u8>::new(device.USART2, bridge_pins, BRIDGE_BAUD_AT_RESET.bps(), &mut rcc) else {
        panic!()
    };
    let mut bridge = Sc18im700::new(PausingUart { uart, pause_cycles }, poll_budget);
    let asked = bridge.set_baud_rate(BAUD);
    let (uart, (Some(bridge_tx), Some(bridge_rx))) = bridge.release().uart.release() else { panic!() };
    let Ok(uart) = Serial::<_, u8>::new(uart, (bridge_tx, bridge_rx), BAUD.bps(), &mut rcc) else { panic!() };
    let mut bridge = Sc18im700::new(PausingUart { uart, pause_cycles }, poll_budget);
    if let Err(error) = asked.and_then(|()| bridge.start()) {
        defmt::warn!("the bridge to the sonars: {}", error);
    }

    let transmitter = RefCell::new(TRANSMITTER.take());
    let cycles_per_slice = rcc.clocks.sysclk().raw() / SendingDelay::SLICES_PER_SECOND;
    let delay = SendingDelay { cycles_per_slice, line, transmitter: &transmitter };
    let Ok(mut ring) = Srf08Ring::<_, _, SONARS>::new(bridge, delay, Srf08Config::DEFAULT) else { panic!() };
    let mut faults = FaultCounters::new();
    defmt::info!("{} sonars, clock {} Hz", SONARS, rcc.clocks.sysclk().raw());
    loop {
        let frame = ring.read(&mut faults);
        if let Some(error) = ring.last_error() {
            defmt::warn!("{}", error);
        }
        if let Ok(mut transmitter) = transmitter.try_borrow_mut() {
            transmitter.send(&raw(&frame), &mut faults);
        }
    }
}

/// The internal 16 MHz oscillator, directly or, with the feature `pll`, multiplied to 168 MHz. The emulator has no PLL.
fn start_clock(controller: pac::RCC) -> Rcc {
    let config = rcc::Config::hsi();
    controller.freeze(if cfg!(feature = "pll") { config.sysclk(168.MHz()) } else { config })
}
