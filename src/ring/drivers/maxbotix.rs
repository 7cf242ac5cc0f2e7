//! MaxBotix I2CXL-MaxSonar ultrasonic rangers (MB12x2) on one I2C bus.
//!
//! Source: MaxBotix, *I2CXL-MaxSonar-EZ series data sheet* PD11848. Writing 81 starts a measurement, during which the ranger
//! does not acknowledge its address. About 80 ms later a read returns two bytes, the range in centimetres, high byte first:
//! 20 to 765, where 765 means no echo. Two measurements are at least 100 ms apart, so that the sound decays.

use crate::setters::setters;
use embedded_hal::i2c::I2c;

use super::{FiringPlan, I2cRanger, I2cRing, RangingTiming, Reading, SonarFault, i2c_ring::check_addresses};
use crate::config_error::ConfigError;
use crate::ring::Echo;

const START_MEASUREMENT: u8 = 81;
const MIN_RANGE_CM: u16 = 20;
const NO_ECHO_CM: u16 = 765;
const POLL_INTERVAL_US: u32 = 2000;

/// All 7-bit addresses that I2C does not reserve, except those of the 8-bit addresses 80, 164 and 170 (data sheet).
pub(super) const fn is_address(address: u8) -> bool {
    matches!(address, 0x08..=0x7F) && !matches!(address << 1, 80 | 164 | 170)
}

/// Addresses, firing plan and times of a ring of I2CXL-MaxSonar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct MaxBotixConfig<const SONARS: usize> {
    /// 7-bit address of sensor 0; sensor *i* has this address plus *i*. All addresses must be from 0x08 to 0x7F, except 0x28,
    /// 0x52 and 0x55. Default 0x70, for at most 16 sensors.
    pub first_address: u8,
    /// Which sensors fire together. Default: two groups, even and odd indices.
    pub plan: FiringPlan<SONARS>,
    /// Time from the start of a measurement to the first poll, in milliseconds, at least 1. Default 80.
    pub ranging_ms: u8,
    /// Time from the start of a group to the start of the next, in milliseconds, at least `ranging_ms`. Default 100. Until
    /// then a pending sensor is polled every 2 ms.
    pub cycle_ms: u8,
}

impl<const SONARS: usize> MaxBotixConfig<SONARS> {
    setters! {
        with_first_address, first_address: u8;
        with_plan, plan: FiringPlan<SONARS>;
        with_ranging_ms, ranging_ms: u8;
        with_cycle_ms, cycle_ms: u8;
    }

    /// The values of the data sheet, two firing groups.
    pub const DEFAULT: Self =
        Self { first_address: 0x70, plan: FiringPlan::interleaved(2), ranging_ms: 80, cycle_ms: 100 };
}

impl<const SONARS: usize> Default for MaxBotixConfig<SONARS> {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Converts a reply to an echo.
fn echo(range_cm: u16) -> Result<Echo, SonarFault> {
    match range_cm {
        NO_ECHO_CM => Ok(Echo::Silence),
        MIN_RANGE_CM..NO_ECHO_CM => Ok(Echo::Range { range_mm: range_cm * 10 }),
        _ => Err(SonarFault::OutOfRange),
    }
}

impl<const SONARS: usize> I2cRanger<SONARS> for MaxBotixConfig<SONARS> {
    fn check(&self) -> Result<(), ConfigError> {
        check_addresses(self.first_address, SONARS, 0x08..=0x7F)?;
        let mut addresses = (self.first_address..=u8::MAX).take(SONARS);
        if let Some(address) = addresses.find(|&address| !is_address(address)) {
            return Err(ConfigError::ReservedAddress { field: "first_address", address });
        }
        ConfigError::check("ranging_ms", self.ranging_ms.into(), 1, self.cycle_ms.into())
    }

    fn first_address(&self) -> u8 {
        self.first_address
    }

    fn plan(&self) -> FiringPlan<SONARS> {
        self.plan
    }

    fn timing(&self) -> RangingTiming {
        let cycle_us = u32::from(self.cycle_ms) * 1000;
        let first_poll_us = u32::from(self.ranging_ms) * 1000;
        RangingTiming { first_poll_us, poll_interval_us: POLL_INTERVAL_US, timeout_us: cycle_us, cycle_us }
    }

    fn start<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<(), BUS::Error> {
        bus.write(address, &[START_MEASUREMENT])
    }

    fn poll<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<Reading, BUS::Error> {
        let mut range_cm = [0; 2];
        bus.read(address, &mut range_cm)?;
        Ok(Reading::Done(echo(u16::from_be_bytes(range_cm))))
    }
}

/// A ring of `SONARS` I2CXL-MaxSonar at consecutive addresses of one I2C bus.
///
/// A frame takes `cycle_ms` for each firing group, plus the time on the bus.
pub type MaxBotixRing<BUS, DELAY, const SONARS: usize> = I2cRing<BUS, DELAY, MaxBotixConfig<SONARS>, SONARS>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centimetres_become_millimetres_and_765_is_silence() {
        for (range_cm, expected) in [
            (0, Err(SonarFault::OutOfRange)),
            (19, Err(SonarFault::OutOfRange)),
            (20, Ok(Echo::Range { range_mm: 200 })),
            (764, Ok(Echo::Range { range_mm: 7640 })),
            (765, Ok(Echo::Silence)),
            (766, Err(SonarFault::OutOfRange)),
            (u16::MAX, Err(SonarFault::OutOfRange)),
        ] {
            assert_eq!(echo(range_cm), expected, "{range_cm} cm");
        }
    }

    #[test]
    fn each_field_out_of_its_range_is_named() {
        let good = MaxBotixConfig::<16>::DEFAULT;
        for first_address in [0x08, 0x18, 0x29, 0x42, 0x56, 0x70] {
            assert_eq!(MaxBotixConfig { first_address, ..good }.check(), Ok(()), "{first_address:#x}");
        }
        for first_address in [0x00, 0x07, 0x19, 0x28, 0x43, 0x52, 0x53, 0x54, 0x55, 0x71, 0x80, 0xFF] {
            let config = MaxBotixConfig { first_address, ..good };
            assert_eq!(config.check().unwrap_err().field(), "first_address", "{first_address:#x}");
        }
        for (ranging_ms, cycle_ms) in [(0, 100), (101, 100)] {
            let config = MaxBotixConfig { ranging_ms, cycle_ms, ..good };
            assert_eq!(config.check().unwrap_err().field(), "ranging_ms");
        }
    }
}
