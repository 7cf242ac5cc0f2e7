//! The serial line to the listener: an interrupt takes what comes in, and what goes out is sent while the sonars listen.

use core::cell::RefCell;

use cortex_m::asm;
use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use embedded_hal::delay::DelayNs;
use embedded_hal_nb::{nb, serial};
use heapless::Deque;
use stm32f4xx_hal::pac::{self, interrupt};
use stm32f4xx_hal::serial::{Rx, RxListen, Serial, Tx};
use toposlam::wire::QueueFull;

const TRANSMIT_BYTES: usize = 2048;
/// More than the robot takes in a turn of its loop.
const RECEIVE_BYTES: usize = 512;

/// What is to be sent.
pub(crate) type TransmitQueue = Deque<u8, TRANSMIT_BYTES>;

static RECEIVER: Mutex<RefCell<Option<Rx<pac::USART1>>>> = Mutex::new(RefCell::new(None));
static RECEIVED: Mutex<RefCell<Deque<u8, RECEIVE_BYTES>>> = Mutex::new(RefCell::new(Deque::new()));

/// A byte at 115,200 baud lasts 87 µs, less than a slice of polishing, so an interrupt takes it. What finds no room is lost, and the
/// checksum of its frame tells.
#[interrupt]
fn USART1() {
    free(|section| {
        // Both are borrowed in critical sections only, so they are free.
        let Ok(mut receiver) = RECEIVER.borrow(section).try_borrow_mut() else { return };
        let Ok(mut received) = RECEIVED.borrow(section).try_borrow_mut() else { return };
        let Some(receiver) = receiver.as_mut() else { return };
        loop {
            match serial::Read::read(receiver) {
                Ok(byte) => {
                    let _ = received.push_back(byte);
                }
                // Reading has cleared the error.
                Err(nb::Error::Other(_)) => {}
                Err(nb::Error::WouldBlock) => break,
            }
        }
    });
}

/// The line's end at the robot.
pub(crate) struct Line {
    queue: &'static mut TransmitQueue,
    transmitter: Tx<pac::USART1>,
}

impl Line {
    /// Takes the line into service.
    pub(crate) fn open(line: Serial<pac::USART1>, queue: &'static mut TransmitQueue) -> Self {
        let (transmitter, mut receiver) = line.split();
        receiver.listen();
        free(|section| {
            if let Ok(mut slot) = RECEIVER.borrow(section).try_borrow_mut() {
                *slot = Some(receiver);
            }
        });
        // SAFETY: the handler is prepared, and it shares nothing but what is behind the mutexes.
        #[allow(unsafe_code)]
        unsafe {
            NVIC::unmask(pac::Interrupt::USART1);
        }
        // One zero, so that noise from the start does not spoil the first frame.
        let _ = queue.push_back(0);
        Self { queue, transmitter }
    }

    /// A byte that came in.
    pub(crate) fn receive() -> Option<u8> {
        free(|section| RECEIVED.borrow(section).try_borrow_mut().ok()?.pop_front())
    }

    /// Queues a frame whole, or not at all.
    pub(crate) fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        if self.queue.capacity() - self.queue.len() < frame.len() {
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
            match serial::Write::write(&mut self.transmitter, byte) {
                Err(nb::Error::WouldBlock) => break,
                // A byte that the line refuses is gone; the frame's checksum tells the listener.
                Ok(()) | Err(nb::Error::Other(_)) => self.queue.pop_front(),
            };
        }
    }
}

/// Waits, and uses the time to send.
pub(crate) struct SendingDelay<'a> {
    cycles_per_slice: u32,
    line: &'a RefCell<Line>,
}

impl<'a> SendingDelay<'a> {
    /// Short of the 87 us that a byte lasts at 115,200 baud.
    const SLICES_PER_SECOND: u32 = 20_000;
    const SLICE_NS: u32 = 1_000_000_000 / Self::SLICES_PER_SECOND;

    pub(crate) const fn new(clock_hz: u32, line: &'a RefCell<Line>) -> Self {
        Self { cycles_per_slice: clock_hz / Self::SLICES_PER_SECOND, line }
    }

    fn pump(&self) {
        if let Ok(mut line) = self.line.try_borrow_mut() {
            line.pump();
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
