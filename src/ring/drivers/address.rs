//! Changes the I2C address of a sensor: new sensors all have the same one.
//!
//! Sources: the data sheets named in the files of the drivers. A sensor stores its address in non-volatile memory. **At most
//! one sensor with the address `from` may be on the bus**; the SRF08's data sheet requires it to be the only sensor.

use core::fmt;

use embedded_hal::{
    delay::DelayNs,
    i2c::{Error as _, ErrorKind, I2c},
};

use super::{maxbotix, srf08};

/// While a sensor stores its address it does not answer: it is polled this many times.
const ATTEMPTS: u8 = 20;
const PAUSE_MS: u32 = 10;
/// Any register serves as a probe.
const PROBE_BYTES: usize = 2;

/// Changes the 7-bit address of an SRF02, SRF08 or SRF10 to one from 0x70 to 0x7F.
///
/// Checks that no device answers at the new address, writes 0xA0, 0xAA, 0xA5 and the new 8-bit address to register 0 in four
/// messages, and polls the new address for at most 200 ms.
///
/// # Errors
/// [`AddressError`] with the reason. With `From`, `To` and `Taken` nothing was changed.
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

/// Changes the 7-bit address of a MaxBotix I2CXL-MaxSonar to one from 0x08 to 0x7F, except 0x28, 0x52 and 0x55.
///
/// Checks that no device answers at the new address, writes 170, 165 and the new 8-bit address in one message, and polls the
/// new address for at most 200 ms.
///
/// # Errors
/// [`AddressError`] with the reason. With `From`, `To` and `Taken` nothing was changed.
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

/// Why the address of a sensor was not changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum AddressError {
    /// `from` is not a 7-bit address of this kind of sensor.
    From,
    /// `to` is not a 7-bit address of this kind of sensor.
    To,
    /// A device already answers at the new address.
    Taken,
    /// No sensor acknowledged the sequence at the present address.
    Silent,
    /// The bus failed.
    Bus,
    /// The sequence was acknowledged, but no device answers at the new address.
    Unchanged,
}

impl fmt::Display for AddressError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::From => "from is not an address of this sensor",
            Self::To => "to is not an address of this sensor",
            Self::Taken => "a device already answers at the new address",
            Self::Silent => "no sensor acknowledged the present address",
            Self::Bus => "bus error",
            Self::Unchanged => "no device answers at the new address afterwards",
        })
    }
}

impl core::error::Error for AddressError {}
