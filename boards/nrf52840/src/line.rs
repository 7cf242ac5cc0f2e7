//! The serial line to the host on UART0, received and transmitted by interrupt.
//!
//! The chip's UART with DMA (UARTE) reports the number of received bytes only when its buffer is full or the receiver is
//! stopped, so bytes are delayed or lost. This one has a FIFO of six bytes and raises an interrupt for each.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use heapless::Deque;
use nrf52840_hal::gpio::{Floating, Input, Output, Pin, PushPull};
use nrf52840_hal::pac::{self, UART0, interrupt};
use toposlam::wire::QueueFull;

use crate::frame_queue::{TransmitQueue, push_frame};

/// More than the robot reads in one step of its main loop.
const RECEIVE_BYTES: usize = 512;

static END: Mutex<RefCell<End>> =
    Mutex::new(RefCell::new(End { uart: None, received: Deque::new(), to_send: Deque::new(), is_sending: false }));

/// The robot's end of the line.
struct End {
    uart: Option<UART0>,
    received: Deque<u8, RECEIVE_BYTES>,
    to_send: TransmitQueue,
    is_sending: bool,
}

impl End {
    /// Reads the receiver's FIFO.
    fn take(&mut self) {
        let Some(uart) = &self.uart else { return };
        while uart.events_rxdrdy.read().bits() != 0 {
            // Before the byte is read: reading raises the event for the next one.
            uart.events_rxdrdy.reset();
            // A byte that does not fit is lost, and the checksum of its frame detects that.
            let _ = self.received.push_back(uart.rxd.read().rxd().bits());
        }
    }

    /// Transmits the next byte, unless one is being transmitted.
    fn pump(&mut self) {
        let Some(uart) = &self.uart else { return };
        if uart.events_txdrdy.read().bits() != 0 {
            uart.events_txdrdy.reset();
            self.is_sending = false;
        }
        if !self.is_sending
            && let Some(byte) = self.to_send.pop_front()
        {
            // SAFETY: every value of a byte is valid.
            #[allow(unsafe_code)]
            uart.txd.write(|w| unsafe { w.txd().bits(byte) });
            self.is_sending = true;
        }
    }
}

/// Runs `work` on the line's state with interrupts disabled. Nothing else borrows it then, so this is never `None`.
fn with_end<OUTCOME>(work: impl FnOnce(&mut End) -> OUTCOME) -> Option<OUTCOME> {
    free(|section| END.borrow(section).try_borrow_mut().ok().map(|mut end| work(&mut end)))
}

#[interrupt]
fn UARTE0_UART0() {
    with_end(|end| {
        end.take();
        end.pump();
    });
}

/// The open line.
pub(crate) struct Line(());

impl Line {
    /// Opens the line at 115,200 baud.
    pub(crate) fn open(uart: UART0, transmit: Pin<Output<PushPull>>, receive: Pin<Input<Floating>>) -> Self {
        // SAFETY: this function owns the pins.
        #[allow(unsafe_code)]
        unsafe {
            uart.psel.txd.write(|w| w.bits(transmit.psel_bits()));
            uart.psel.rxd.write(|w| w.bits(receive.psel_bits()));
        }
        uart.baudrate.write(|w| w.baudrate().baud115200());
        uart.intenset.write(|w| w.rxdrdy().set().txdrdy().set());
        uart.enable.write(|w| w.enable().enabled());
        uart.tasks_startrx.write(|w| w.tasks_startrx().set_bit());
        uart.tasks_starttx.write(|w| w.tasks_starttx().set_bit());
        with_end(|end| {
            end.uart = Some(uart);
            // A zero ends a frame, so noise at the start does not corrupt the first one.
            let _ = end.to_send.push_back(0);
            end.pump();
        });
        // SAFETY: all state shared with the handler is behind the mutex.
        #[allow(unsafe_code)]
        unsafe {
            NVIC::unmask(pac::Interrupt::UARTE0_UART0);
        }
        Self(())
    }

    /// Returns the next received byte.
    pub(crate) fn receive(&mut self) -> Option<u8> {
        with_end(|end| end.received.pop_front()).flatten()
    }

    /// Queues a frame, whole or not at all.
    pub(crate) fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        with_end(|end| {
            push_frame(&mut end.to_send, frame)?;
            end.pump();
            Ok(())
        })
        .unwrap_or(Err(QueueFull))
    }
}
