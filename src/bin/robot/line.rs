//! The serial line to the host: received by interrupt, transmitted while the firmware waits for the sonars.

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

use super::frame_queue::{TransmitQueue, push_frame};

/// More than the robot reads in one step of its main loop.
const RECEIVE_BYTES: usize = 512;

static RECEIVER: Mutex<RefCell<Option<Rx<pac::USART1>>>> = Mutex::new(RefCell::new(None));
static RECEIVED: Mutex<RefCell<Deque<u8, RECEIVE_BYTES>>> = Mutex::new(RefCell::new(Deque::new()));

/// A byte at 115,200 baud takes 87 µs, less than a refinement step of the filter, so an interrupt receives it. A byte that does
/// not fit is lost, and the checksum of its frame detects that.
#[interrupt]
fn USART1() {
    free(|section| {
        // Does not fail: both are borrowed in critical sections only.
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

/// The robot's end of the line.
pub(crate) struct Line {
    queue: &'static mut TransmitQueue,
    transmitter: Tx<pac::USART1>,
}

impl Line {
    /// Opens the line.
    pub(crate) fn open(line: Serial<pac::USART1>, queue: &'static mut TransmitQueue) -> Self {
        let (transmitter, mut receiver) = line.split();
        receiver.listen();
        free(|section| {
            if let Ok(mut slot) = RECEIVER.borrow(section).try_borrow_mut() {
                *slot = Some(receiver);
            }
        });
        // SAFETY: the handler's state is initialised, and all shared state is behind mutexes.
        #[allow(unsafe_code)]
        unsafe {
            NVIC::unmask(pac::Interrupt::USART1);
        }
        // A zero ends a frame, so noise at the start does not corrupt the first one.
        let _ = queue.push_back(0);
        Self { queue, transmitter }
    }

    /// Returns the next received byte.
    pub(crate) fn receive() -> Option<u8> {
        free(|section| RECEIVED.borrow(section).try_borrow_mut().ok()?.pop_front())
    }

    /// Queues a frame, whole or not at all.
    pub(crate) fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        push_frame(self.queue, frame)
    }

    /// Transmits as many bytes as the UART accepts without waiting.
    fn pump(&mut self) {
        while let Some(&byte) = self.queue.front() {
            match serial::Write::write(&mut self.transmitter, byte) {
                Err(nb::Error::WouldBlock) => break,
                // On an error the byte is lost, and the checksum of its frame detects that.
                Ok(()) | Err(nb::Error::Other(_)) => self.queue.pop_front(),
            };
        }
    }
}

/// A delay that transmits meanwhile.
pub(crate) struct SendingDelay<'a> {
    cycles_per_slice: u32,
    line: &'a RefCell<Line>,
}

impl<'a> SendingDelay<'a> {
    /// A slice is shorter than the 87 µs of a byte at 115,200 baud.
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
