//! Gives a sensor another address: sensors leave their factory with the same one, and a ring needs them apart.
//!
//! Sources: the data sheets named in the modules of the drivers. Both kinds keep an address when they lose power. **Only
//! one sensor that listens to `from` may be on the bus**; the SRF08's data sheet wants it to be the only sensor at all.

use core::fmt;

use embedded_hal::{
    delay::DelayNs,
    i2c::{Error as _, ErrorKind, I2c},
};

use super::{maxbotix, srf08};

/// A sensor may be busy storing its address; it is asked so often, with a pause in between.
const ATTEMPTS: u8 = 20;
const PAUSE_MS: u32 = 10;
/// The revision of a ranger, or two bytes of range: who answers, exists.
const PROBE_BYTES: usize = 2;

/// Gives an SRF08 or SRF10 another 7-bit address, 0x70 to 0x7F.
///
/// Asks whether the new address is free, writes 0xA0, 0xAA, 0xA5 and twice the new address to register 0 in four messages,
/// and asks the sensor at its new address, for at most 200 ms of waiting.
///
/// # Errors
/// [`AddressError`] says what failed; after [`Taken`](AddressError::Taken) and before, nothing was changed.
pub fn change_srf08_address<BUS: I2c>(
    bus: &mut BUS,
    delay: &mut impl DelayNs,
    from: u8,
    to: u8,
) -> Result<(), AddressError> {
    let new = to << 1;
    let messages = [[0, 0xA0].as_slice(), &[0, 0xAA], &[0, 0xA5], &[0, new]];
    change(bus, delay, (from, to), |address| srf08::ADDRESSES.contains(&address), &messages)
}

/// Gives a MaxBotix I2CXL-MaxSonar another 7-bit address, 0x08 to 0x7F without 0x28, 0x52 and 0x55, which it refuses.
///
/// Asks whether the new address is free, writes 170, 165 and twice the new address in one message, and asks the sensor at
/// its new address, for at most 200 ms of waiting.
///
/// # Errors
/// [`AddressError`] says what failed; after [`Taken`](AddressError::Taken) and before, nothing was changed.
pub fn change_maxbotix_address<BUS: I2c>(
    bus: &mut BUS,
    delay: &mut impl DelayNs,
    from: u8,
    to: u8,
) -> Result<(), AddressError> {
    change(bus, delay, (from, to), maxbotix::is_address, &[&[170, 165, to << 1]])
}

fn change<BUS: I2c>(
    bus: &mut BUS,
    delay: &mut impl DelayNs,
    (from, to): (u8, u8),
    is_address: impl Fn(u8) -> bool,
    messages: &[&[u8]],
) -> Result<(), AddressError> {
    if !is_address(from) {
        return Err(AddressError::From);
    }
    if !is_address(to) {
        return Err(AddressError::To);
    }
    if from != to && answers(bus, to)? {
        return Err(AddressError::Taken);
    }
    for message in messages {
        bus.write(from, message).map_err(|error| match error.kind() {
            ErrorKind::NoAcknowledge(_) => AddressError::Silent,
            _ => AddressError::Bus,
        })?;
    }
    for _ in 0..ATTEMPTS {
        delay.delay_ms(PAUSE_MS);
        if answers(bus, to)? {
            return Ok(());
        }
    }
    Err(AddressError::Unchanged)
}

/// Whether a device acknowledges an address.
fn answers<BUS: I2c>(bus: &mut BUS, address: u8) -> Result<bool, AddressError> {
    match bus.read(address, &mut [0; PROBE_BYTES]) {
        Ok(()) => Ok(true),
        Err(error) if matches!(error.kind(), ErrorKind::NoAcknowledge(_)) => Ok(false),
        Err(_) => Err(AddressError::Bus),
    }
}

/// Why a sensor did not get another address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AddressError {
    /// `from`: not a 7-bit address that the sensor can have.
    From,
    /// `to`: not a 7-bit address that the sensor can have.
    To,
    /// A device answers at the new address already.
    Taken,
    /// No sensor acknowledged the present address, or not the whole sequence.
    Silent,
    /// The bus failed.
    Bus,
    /// The sequence was sent, and nothing answers at the new address.
    Unchanged,
}

impl fmt::Display for AddressError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::From => "from: not an address that the sensor can have",
            Self::To => "to: not an address that the sensor can have",
            Self::Taken => "a device answers at the new address already",
            Self::Silent => "no sensor acknowledged the present address",
            Self::Bus => "bus error",
            Self::Unchanged => "nothing answers at the new address afterwards",
        })
    }
}

impl core::error::Error for AddressError {}
