//! A bus, UART, pin, clock and delay under the control of the fuzzer.

use std::cell::Cell;

use embedded_hal::{
    delay::DelayNs,
    digital::{self, InputPin, OutputPin},
    i2c::{self, I2c, NoAcknowledgeSource, Operation},
};
use embedded_hal_nb::{nb, serial};
use toposlam::ring::drivers::MicrosecondClock;

/// Maximum number of calls: an endless loop fails at once.
pub(crate) struct Budget {
    pub(crate) calls: Cell<u32>,
    pub(crate) most: Cell<u32>,
}

impl Budget {
    pub(crate) fn new(most: u32) -> Self {
        Self { calls: Cell::new(0), most: Cell::new(most) }
    }

    pub(crate) fn spend(&self) {
        self.calls.set(self.calls.get() + 1);
        assert!(self.calls.get() <= self.most.get(), "more than {} calls", self.most.get());
    }
}

/// A bus, a UART or a pin whose answers follow from a cyclic sequence of bytes.
pub(crate) struct Answers<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) next: usize,
    pub(crate) budget: &'a Budget,
}

impl<'a> Answers<'a> {
    pub(crate) fn new(bytes: &'a [u8], budget: &'a Budget) -> Self {
        Self { bytes, next: 0, budget }
    }

    fn byte(&mut self) -> u8 {
        self.next += 1;
        self.bytes.get((self.next - 1) % self.bytes.len().max(1)).copied().unwrap_or(0)
    }
}

impl i2c::ErrorType for Answers<'_> {
    type Error = i2c::ErrorKind;
}

impl I2c for Answers<'_> {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            1..=16 => return Err(i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)),
            17..=24 => return Err(i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data)),
            25..=28 => return Err(i2c::ErrorKind::Bus),
            29..=32 => return Err(i2c::ErrorKind::ArbitrationLoss),
            _ => {}
        }
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                bytes.fill_with(|| self.byte());
            }
        }
        Ok(())
    }
}

impl serial::ErrorType for Answers<'_> {
    type Error = serial::ErrorKind;
}

impl serial::Read<u8> for Answers<'_> {
    fn read(&mut self) -> nb::Result<u8, serial::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            0..=9 => Err(nb::Error::WouldBlock),
            10 => Err(nb::Error::Other(serial::ErrorKind::Overrun)),
            byte => Ok(byte),
        }
    }
}

impl serial::Write<u8> for Answers<'_> {
    fn write(&mut self, _: u8) -> nb::Result<(), serial::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            0..=9 => Err(nb::Error::WouldBlock),
            10 => Err(nb::Error::Other(serial::ErrorKind::Other)),
            _ => Ok(()),
        }
    }

    fn flush(&mut self) -> nb::Result<(), serial::ErrorKind> {
        serial::Write::write(self, 0)
    }
}

impl digital::ErrorType for Answers<'_> {
    type Error = digital::ErrorKind;
}

impl InputPin for Answers<'_> {
    fn is_high(&mut self) -> Result<bool, digital::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            255 => Err(digital::ErrorKind::Other),
            byte => Ok(byte % 2 == 1),
        }
    }

    fn is_low(&mut self) -> Result<bool, digital::ErrorKind> {
        self.is_high().map(|is_high| !is_high)
    }
}

impl OutputPin for Answers<'_> {
    fn set_low(&mut self) -> Result<(), digital::ErrorKind> {
        self.is_high().map(|_| ())
    }

    fn set_high(&mut self) -> Result<(), digital::ErrorKind> {
        self.is_high().map(|_| ())
    }
}

/// A clock that advances as the bytes determine, stops, or goes back.
pub(crate) struct Clock<'a> {
    pub(crate) answers: Answers<'a>,
    pub(crate) now_us: u32,
}

impl MicrosecondClock for Clock<'_> {
    fn now_us(&mut self) -> u32 {
        self.answers.budget.spend();
        let step = self.answers.byte();
        self.now_us = match step {
            255 => self.now_us.wrapping_sub(1000),
            step => self.now_us.wrapping_add(8 * u32::from(step)),
        };
        self.now_us
    }
}

/// Counts the transactions of a bus.
pub(crate) struct Counted<BUS> {
    pub(crate) bus: BUS,
    pub(crate) transactions: u32,
}

impl<BUS: I2c> i2c::ErrorType for Counted<BUS> {
    type Error = BUS::Error;
}

impl<BUS: I2c> I2c for Counted<BUS> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BUS::Error> {
        self.transactions += 1;
        self.bus.transaction(address, operations)
    }
}

/// Sums the delays.
#[derive(Default)]
pub(crate) struct Waited {
    pub(crate) nanoseconds: Cell<u64>,
}

impl Waited {
    pub(crate) fn microseconds(&self) -> u64 {
        self.nanoseconds.get() / 1000
    }
}

impl DelayNs for &Waited {
    fn delay_ns(&mut self, nanoseconds: u32) {
        self.nanoseconds.set(self.nanoseconds.get() + u64::from(nanoseconds));
    }
}
