//! The I2C bus of the sonars on TWIM0. Every message has a timeout; the HAL's messages have none.

use core::sync::atomic::{Ordering, compiler_fence};

use cortex_m::asm;
use embedded_hal::i2c::{Error, ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use nrf52840_hal::pac::{TWIM0, twim0::RegisterBlock};
use nrf52840_hal::twim::{Frequency, Pins, Twim};

/// The longest message in each direction.
const BUFFER_BYTES: usize = 16;
const CYCLES_PER_US: u32 = 64;
/// Longer than the longest message takes at 100 kHz, 34 bytes of 9 bits.
const TIMEOUT_US: u32 = 5000;

/// Why a message failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BusError {
    /// No device acknowledged the address.
    Address,
    /// The device did not acknowledge a byte.
    Data,
    /// A byte was lost.
    Overrun,
    /// The message timed out.
    TimedOut,
    /// The message is not a write, a read, or a write and a read, of 1 to 16 bytes each.
    Unsupported,
}

impl Error for BusError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Address => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address),
            Self::Data => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data),
            Self::Overrun => ErrorKind::Overrun,
            Self::TimedOut => ErrorKind::Bus,
            Self::Unsupported => ErrorKind::Other,
        }
    }
}

/// The bus controller. A message is a write, a read, or a write and a read, which is all that the sonars need.
pub(crate) struct Bus {
    controller: Twim<TWIM0>,
    // The DMA reads RAM only, and constants are in flash.
    to_write: [u8; BUFFER_BYTES],
    was_read: [u8; BUFFER_BYTES],
}

impl Bus {
    /// Opens the bus at 100 kHz, the maximum of the SRF08's data sheet.
    pub(crate) fn open(controller: TWIM0, pins: Pins) -> Self {
        let controller = Twim::new(controller, pins, Frequency::K100);
        Self { controller, to_write: [0; BUFFER_BYTES], was_read: [0; BUFFER_BYTES] }
    }

    fn registers(&self) -> &RegisterBlock {
        // SAFETY: the registers always exist, and `self` owns the controller.
        #[allow(unsafe_code)]
        unsafe {
            &*TWIM0::PTR
        }
    }

    /// Writes and reads this many bytes of the buffers.
    fn message(&mut self, address: u8, write_bytes: usize, read_bytes: usize) -> Result<(), BusError> {
        let (from, to) = (self.to_write.as_ptr() as u32, self.was_read.as_mut_ptr() as u32);
        let bus = self.registers();
        bus.events_stopped.reset();
        bus.events_error.reset();
        bus.errorsrc.write(|w| w.anack().bit(true).dnack().bit(true).overrun().bit(true));
        // SAFETY: the buffers have at least that many bytes, and the DMA no longer uses them when this function returns: the
        // controller is stopped or disabled then.
        #[allow(unsafe_code)]
        unsafe {
            bus.address.write(|w| w.address().bits(address));
            bus.txd.ptr.write(|w| w.ptr().bits(from));
            bus.txd.maxcnt.write(|w| w.maxcnt().bits(write_bytes as u16));
            bus.rxd.ptr.write(|w| w.ptr().bits(to));
            bus.rxd.maxcnt.write(|w| w.maxcnt().bits(read_bytes as u16));
        }
        compiler_fence(Ordering::SeqCst);
        bus.shorts.write(|w| match read_bytes {
            0 => w.lasttx_stop().enabled(),
            _ => w.lasttx_startrx().enabled().lastrx_stop().enabled(),
        });
        match write_bytes {
            0 => bus.tasks_startrx.write(|w| w.tasks_startrx().set_bit()),
            _ => bus.tasks_starttx.write(|w| w.tasks_starttx().set_bit()),
        }
        let has_stopped = wait_for_stop(bus);
        let errors = bus.errorsrc.read();
        let received = usize::from(bus.rxd.amount.read().amount().bits());
        if !has_stopped {
            self.controller.disable();
            self.controller.enable();
        }
        compiler_fence(Ordering::SeqCst);
        match () {
            () if errors.anack().is_received() => Err(BusError::Address),
            () if errors.dnack().is_received() => Err(BusError::Data),
            () if !has_stopped => Err(BusError::TimedOut),
            () if errors.overrun().is_received() || received < read_bytes => Err(BusError::Overrun),
            () => Ok(()),
        }
    }
}

/// Waits until the controller has stopped; `false` after the timeout. After an error it stops only on request.
fn wait_for_stop(bus: &RegisterBlock) -> bool {
    for _ in 0..TIMEOUT_US {
        if bus.events_stopped.read().bits() != 0 {
            return true;
        }
        if bus.events_error.read().bits() != 0 {
            bus.events_error.reset();
            bus.tasks_stop.write(|w| w.tasks_stop().set_bit());
        }
        asm::delay(CYCLES_PER_US);
    }
    false
}

impl ErrorType for Bus {
    type Error = BusError;
}

impl I2c for Bus {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BusError> {
        let (write, read): (&[u8], &mut [u8]) = match operations {
            [Operation::Write(write)] => (write, &mut []),
            [Operation::Read(read)] => (&[], read),
            [Operation::Write(write), Operation::Read(read)] => (write, read),
            _ => return Err(BusError::Unsupported),
        };
        let is_empty = write.is_empty() && read.is_empty();
        let (Some(to_write), true) = (self.to_write.get_mut(..write.len()), read.len() <= BUFFER_BYTES && !is_empty)
        else {
            return Err(BusError::Unsupported);
        };
        to_write.copy_from_slice(write);
        self.message(address, write.len(), read.len())?;
        read.iter_mut().zip(self.was_read).for_each(|(to, byte)| *to = byte);
        Ok(())
    }
}
