//! NXP SC18IM700 UART-to-I2C bridge: an I2C bus for a board with a free UART and no free I2C peripheral.
//!
//! Source: NXP, *SC18IM700, Master I2C-bus controller with UART interface*, rev. 2, and application note AN10397. The chip
//! takes ASCII commands. `S` address-with-direction count data… `P` is a bus message; another `S` in place of the `P` is a
//! repeated start. `R` register… `P` reads and `W` register value … `P` writes the chip's own registers. Its buffers are 16
//! bytes long. It starts at 9600 baud, 8 data bits, no parity, one stop bit.

use core::fmt;

use embedded_hal::i2c::{Error, ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use embedded_hal_nb::{
    nb,
    serial::{Read, Write},
};
use heapless::{Deque, Vec};

const START: u8 = b'S';
const STOP: u8 = b'P';
const READ_REGISTER: u8 = b'R';
const WRITE_REGISTER: u8 = b'W';

const BAUD_LOW: u8 = 0x00;
const BAUD_HIGH: u8 = 0x01;
const OWN_ADDRESS: u8 = 0x06;
const BUS_TIMEOUT: u8 = 0x09;
const BUS_STATUS: u8 = 0x0A;

const STATUS_OK: u8 = 0xF0;
const STATUS_ADDRESS_NOT_ACKNOWLEDGED: u8 = 0xF1;
const STATUS_DATA_NOT_ACKNOWLEDGED: u8 = 0xF2;
const STATUS_TIMEOUT: u8 = 0xF8;

/// The chip's own address after a reset. It is written again so that it can serve as a marker.
const OWN_ADDRESS_MARKER: u8 = 0x26;
/// The reset value 0x66 with the enable bit set, so that a stuck bus ends in [`STATUS_TIMEOUT`].
const BUS_TIMEOUT_MARKER: u8 = 0x67;

const BUFFER_BYTES: usize = 16;
/// Data, status and the two markers.
const REPLY_BYTES: usize = BUFFER_BYTES + 3;
/// Bytes that may arrive while a message is sent.
const EARLY_BYTES: usize = 32;
const CRYSTAL_HZ: u32 = 7_372_800;

/// An SC18IM700 on a UART: an I2C bus with 7-bit addresses.
///
/// After each message the driver reads the bus status. A failed read returns the status without data before it. Where the
/// first byte may be either, the driver reads two registers of known content, and their position decides. (A successful
/// read whose data begins with a failure code and both contents, for example 0xF1 0x26 0x67, is taken for a failure.)
///
/// Each byte has a budget of polls, so a call takes at most its number of bytes times the budget. A message writes at most 16
/// bytes and reads at most 16. Adjacent operations of the same kind are merged, as `embedded-hal` requires.
#[derive(Debug)]
pub struct Sc18im700<UART> {
    uart: UART,
    poll_budget: u32,
    early: Deque<u8, EARLY_BYTES>,
}

impl<UART: Read<u8> + Write<u8>> Sc18im700<UART> {
    /// Creates a bridge. `poll_budget` is how many times in a row the UART may return `WouldBlock` for one byte: at least the
    /// duration of 40 bytes on the UART plus 20 on the bus, in polls.
    pub const fn new(uart: UART, poll_budget: u32) -> Self {
        Self { uart, poll_budget, early: Deque::new() }
    }

    /// Configures the chip: its bus timeout, and the registers that mark the end of a reply. Call it once before use.
    ///
    /// # Errors
    /// [`BridgeError::Silent`] or [`BridgeError::Line`] when the UART does not accept the message.
    pub fn start(&mut self) -> Result<(), BridgeError> {
        self.discard_stale();
        self.send(&[WRITE_REGISTER, OWN_ADDRESS, OWN_ADDRESS_MARKER, BUS_TIMEOUT, BUS_TIMEOUT_MARKER, STOP])?;
        self.flush()
    }

    /// Changes the chip's baud rate, 113 to 460,800. The UART must follow: `release` it, configure it, and call `new`.
    ///
    /// # Errors
    /// [`BridgeError::BaudRate`] when the chip has no divider for the rate.
    pub fn set_baud_rate(&mut self, baud: u32) -> Result<(), BridgeError> {
        let divider = CRYSTAL_HZ.checked_div(baud).and_then(|divider| divider.checked_sub(16));
        let divider = divider.and_then(|divider| u16::try_from(divider).ok()).ok_or(BridgeError::BaudRate)?;
        let [low, high] = divider.to_le_bytes();
        self.send(&[WRITE_REGISTER, BAUD_LOW, low, BAUD_HIGH, high, STOP])?;
        self.flush()
    }

    /// Returns the UART.
    pub fn release(self) -> UART {
        self.uart
    }

    fn discard_stale(&mut self) {
        self.early.clear();
        for _ in 0..EARLY_BYTES {
            match self.uart.read() {
                Ok(_) | Err(nb::Error::Other(_)) => {}
                Err(nb::Error::WouldBlock) => break,
            }
        }
    }

    /// Sends bytes, and stores what arrives meanwhile: most UARTs buffer one byte only.
    fn send(&mut self, bytes: &[u8]) -> Result<(), BridgeError> {
        for &byte in bytes {
            self.send_byte(byte)?;
        }
        Ok(())
    }

    fn send_byte(&mut self, byte: u8) -> Result<(), BridgeError> {
        for _ in 0..self.poll_budget {
            match self.uart.write(byte) {
                Ok(()) => return Ok(()),
                Err(nb::Error::Other(_)) => return Err(BridgeError::Line),
                Err(nb::Error::WouldBlock) => self.keep_early()?,
            }
        }
        Err(BridgeError::Silent)
    }

    fn flush(&mut self) -> Result<(), BridgeError> {
        for _ in 0..self.poll_budget {
            match self.uart.flush() {
                Ok(()) => return Ok(()),
                Err(nb::Error::Other(_)) => return Err(BridgeError::Line),
                Err(nb::Error::WouldBlock) => self.keep_early()?,
            }
        }
        Err(BridgeError::Silent)
    }

    fn keep_early(&mut self) -> Result<(), BridgeError> {
        match self.uart.read() {
            Ok(byte) => self.early.push_back(byte).map_err(|_| BridgeError::OutOfStep),
            Err(nb::Error::Other(_)) => Err(BridgeError::Line),
            Err(nb::Error::WouldBlock) => Ok(()),
        }
    }

    fn receive(&mut self) -> Result<u8, BridgeError> {
        if let Some(byte) = self.early.pop_front() {
            return Ok(byte);
        }
        for _ in 0..self.poll_budget {
            match self.uart.read() {
                Ok(byte) => return Ok(byte),
                Err(nb::Error::Other(_)) => return Err(BridgeError::Line),
                Err(nb::Error::WouldBlock) => {}
            }
        }
        Err(BridgeError::Silent)
    }

    fn send_message(&mut self, address: u8, operations: &[Operation<'_>]) -> Result<(), BridgeError> {
        let mut previous = None;
        let mut rest = operations;
        while let Some((operation, behind)) = rest.split_first() {
            let reads = is_read(operation);
            if previous != Some(reads) {
                let run = rest.iter().take_while(|operation| is_read(operation) == reads);
                let count = run.fold(0, |sum: usize, operation| sum.saturating_add(length(operation)));
                let count = u8::try_from(count).map_err(|_| BridgeError::TooLong)?;
                self.send(&[START, address << 1 | u8::from(reads), count])?;
            }
            if let Operation::Write(bytes) = operation {
                self.send(bytes)?;
            }
            previous = Some(reads);
            rest = behind;
        }
        self.send(&[STOP, READ_REGISTER, BUS_STATUS, STOP])
    }

    /// The data of a successful message.
    fn receive_reply(&mut self, data_bytes: usize) -> Result<Vec<u8, REPLY_BYTES>, BridgeError> {
        let mut reply: Vec<u8, REPLY_BYTES> = Vec::new();
        let mut expected = data_bytes.saturating_add(1);
        while reply.len() < expected {
            let byte = self.receive()?;
            reply.push(byte).map_err(|_| BridgeError::TooLong)?;
            match *reply.as_slice() {
                // Either data or the status of a failed read: read two registers of known content.
                [first] if data_bytes > 0 && is_failure(first) => {
                    self.send(&[READ_REGISTER, OWN_ADDRESS, BUS_TIMEOUT, STOP])?;
                    expected = expected.saturating_add(2);
                }
                [status, OWN_ADDRESS_MARKER, BUS_TIMEOUT_MARKER] if is_failure(status) => {
                    return verdict(status).map(|()| reply);
                }
                _ => {}
            }
        }
        let status = reply.get(data_bytes).copied();
        status.ok_or(BridgeError::OutOfStep).and_then(verdict).map(|()| reply)
    }
}

fn is_read(operation: &Operation<'_>) -> bool {
    matches!(operation, Operation::Read(_))
}

fn length(operation: &Operation<'_>) -> usize {
    match operation {
        Operation::Read(bytes) => bytes.len(),
        Operation::Write(bytes) => bytes.len(),
    }
}

fn is_failure(status: u8) -> bool {
    matches!(status, STATUS_ADDRESS_NOT_ACKNOWLEDGED | STATUS_DATA_NOT_ACKNOWLEDGED | STATUS_TIMEOUT)
}

fn verdict(status: u8) -> Result<(), BridgeError> {
    match status {
        STATUS_OK => Ok(()),
        STATUS_ADDRESS_NOT_ACKNOWLEDGED => Err(BridgeError::AddressNotAcknowledged),
        STATUS_DATA_NOT_ACKNOWLEDGED => Err(BridgeError::DataNotAcknowledged),
        STATUS_TIMEOUT => Err(BridgeError::BusTimeout),
        _ => Err(BridgeError::OutOfStep),
    }
}

impl<UART> ErrorType for Sc18im700<UART> {
    type Error = BridgeError;
}

impl<UART: Read<u8> + Write<u8>> I2c for Sc18im700<UART> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BridgeError> {
        if operations.is_empty() {
            return Ok(());
        }
        let total = |reads: bool| {
            let same = operations.iter().filter(|operation| is_read(operation) == reads);
            same.fold(0, |sum: usize, operation| sum.saturating_add(length(operation)))
        };
        let data_bytes = total(true);
        if data_bytes > BUFFER_BYTES || total(false) > BUFFER_BYTES {
            return Err(BridgeError::TooLong);
        }
        self.discard_stale();
        self.send_message(address, operations)?;
        let reply = self.receive_reply(data_bytes)?;
        let mut data = reply.iter().copied();
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                for (byte, received) in bytes.iter_mut().zip(&mut data) {
                    *byte = received;
                }
            }
        }
        Ok(())
    }
}

/// Why a message over the bridge failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BridgeError {
    /// No device acknowledged the address.
    AddressNotAcknowledged,
    /// The device did not acknowledge a data byte.
    DataNotAcknowledged,
    /// The bus was stuck until the chip's timeout.
    BusTimeout,
    /// The bridge did not answer within the poll budget.
    Silent,
    /// The UART reported an error: overrun, framing, noise or parity.
    Line,
    /// The reply is invalid: bytes were lost or added.
    OutOfStep,
    /// More than 16 bytes in one direction.
    TooLong,
    /// The chip has no divider for this baud rate.
    BaudRate,
}

impl Error for BridgeError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::AddressNotAcknowledged => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address),
            Self::DataNotAcknowledged => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data),
            Self::BusTimeout => ErrorKind::Bus,
            Self::Line => ErrorKind::Overrun,
            Self::Silent | Self::OutOfStep | Self::TooLong | Self::BaudRate => ErrorKind::Other,
        }
    }
}

impl fmt::Display for BridgeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AddressNotAcknowledged => "no device acknowledged the address",
            Self::DataNotAcknowledged => "the device did not acknowledge a data byte",
            Self::BusTimeout => "the bus is stuck",
            Self::Silent => "the bridge does not answer",
            Self::Line => "UART error on the line to the bridge",
            Self::OutOfStep => "the reply of the bridge is invalid",
            Self::TooLong => "more than 16 bytes in one direction",
            Self::BaudRate => "no divider for this baud rate",
        })
    }
}

impl core::error::Error for BridgeError {}
