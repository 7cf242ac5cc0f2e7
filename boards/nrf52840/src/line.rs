//! The serial line to the listener on UART0: an interrupt takes what comes in, and sends what is queued.
//!
//! The chip has the same line with DMA (UARTE). That tells how much has come in only when its buffer is full or the receiver is
//! stopped, so bytes wait or are lost; this one holds six bytes and raises an interrupt for each.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use heapless::Deque;
use nrf52840_hal::gpio::{Floating, Input, Output, Pin, PushPull};
use nrf52840_hal::pac::{self, UART0, interrupt};
use toposlam::wire::QueueFull;

const TRANSMIT_BYTES: usize = 2048;
/// More than the robot takes in a turn of its loop.
const RECEIVE_BYTES: usize = 512;

static END: Mutex<RefCell<End>> =
    Mutex::new(RefCell::new(End { uart: None, received: Deque::new(), to_send: Deque::new(), is_sending: false }));

/// The line's end at the robot.
struct End {
    uart: Option<UART0>,
    received: Deque<u8, RECEIVE_BYTES>,
    to_send: Deque<u8, TRANSMIT_BYTES>,
    is_sending: bool,
}

impl End {
    /// Takes what the receiver holds.
    fn take(&mut self) {
        let Some(uart) = &self.uart else { return };
        while uart.events_rxdrdy.read().bits() != 0 {
            // Before the byte is read, which raises the event for the next one.
            uart.events_rxdrdy.reset();
            // What finds no room is lost, and the checksum of its frame tells.
            let _ = self.received.push_back(uart.rxd.read().rxd().bits());
        }
    }

    /// Sends the next byte, unless one is on its way.
    fn pump(&mut self) {
        let Some(uart) = &self.uart else { return };
        if uart.events_txdrdy.read().bits() != 0 {
            uart.events_txdrdy.reset();
            self.is_sending = false;
        }
        if !self.is_sending
            && let Some(byte) = self.to_send.pop_front()
        {
            // SAFETY: every byte can be sent.
            #[allow(unsafe_code)]
            uart.txd.write(|w| unsafe { w.txd().bits(byte) });
            self.is_sending = true;
        }
    }
}

/// With interrupts off nobody else has it, so this is never `None`.
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

/// The line, once it is open.
pub(crate) struct Line(());

impl Line {
    /// Takes the line into service at 115,200 baud.
    pub(crate) fn open(uart: UART0, transmit: Pin<Output<PushPull>>, receive: Pin<Input<Floating>>) -> Self {
        // SAFETY: the pins are the line's, and nobody else has them.
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
            // One zero, so that noise from the start does not spoil the first frame.
            let _ = end.to_send.push_back(0);
            end.pump();
        });
        // SAFETY: the handler shares nothing but what is behind the mutex.
        #[allow(unsafe_code)]
        unsafe {
            NVIC::unmask(pac::Interrupt::UARTE0_UART0);
        }
        Self(())
    }

    /// A byte that came in.
    pub(crate) fn receive(&mut self) -> Option<u8> {
        with_end(|end| end.received.pop_front()).flatten()
    }

    /// Queues a frame whole, or not at all.
    pub(crate) fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        with_end(|end| {
            if end.to_send.capacity() - end.to_send.len() < frame.len() {
                return Err(QueueFull);
            }
            for &byte in frame {
                // There is room: it was just looked for.
                let _ = end.to_send.push_back(byte);
            }
            end.pump();
            Ok(())
        })
        .unwrap_or(Err(QueueFull))
    }
}
