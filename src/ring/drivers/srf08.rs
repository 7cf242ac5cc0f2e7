//! Devantech SRF02, SRF08 and SRF10 ultrasonic rangers: up to 16 on one I2C bus.
//!
//! Source: Devantech, *SRF08 Ultra sonic range finder, Technical Specification*, and the same for the SRF02 and the SRF10.
//! Register 0 is the command register when written and the software revision when read. During a measurement the ranger does
//! not drive the bus, so the revision reads as 255. Register 1 is the light sensor of the SRF08, unused by the others.
//! Registers 2 and 3 are the first echo, high byte first, 0 without an echo. A command to address 0 starts every SRF08 on
//! the bus.

use crate::setters::setters;
use core::ops::RangeInclusive;

use embedded_hal::i2c::I2c;

use super::{
    FiringPlan, I2cRanger, I2cRing, RangingTiming, Reading, SonarFault,
    i2c_ring::check_addresses,
    sound::{check_speed_of_sound, range_mm},
};
use crate::config_error::ConfigError;
use crate::ring::Echo;

/// All SRF08 on the bus listen to this address.
const GENERAL_CALL: u8 = 0;
const COMMAND_REGISTER: u8 = 0;
const REVISION_WHILE_BUSY: u8 = 255;
/// Starts a measurement with the result in microseconds, the finest of the three units.
const RANGE_IN_MICROSECONDS: u8 = 0x52;
/// The 7-bit addresses of these rangers.
pub(super) const ADDRESSES: RangeInclusive<u8> = 0x70..=0x7F;

/// Addresses, firing plan, times and range limits of a ring of SRF02, SRF08 or SRF10.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Srf08Config<const SONARS: usize> {
    /// 7-bit address of sensor 0, 0x70 to 0x7F; sensor *i* has this address plus *i*. Default 0x70.
    pub first_address: u8,
    /// Which sensors fire together. Default: two groups, even and odd indices.
    pub plan: FiringPlan<SONARS>,
    /// Whether one message to address 0 starts all sensors when the plan fires them together. Default true. The data sheets
    /// of the SRF02 and the SRF10 do not mention this address.
    pub has_general_call: bool,
    /// Timeout of a firing group, in milliseconds, at least 1. Default 100; a measurement takes 65.
    pub timeout_ms: u16,
    /// Time between two polls of a sensor, in microseconds, at least 1. Default 2000.
    pub poll_interval_us: u16,
    /// Speed of sound in metres per second, 300 to 400. Default 343: dry air at 20 °C.
    pub speed_of_sound_m_per_s: u16,
    /// Minimum valid range, in millimetres. Default 30, from the data sheet; 150 for the SRF02.
    pub min_range_mm: u16,
    /// Maximum valid range, in millimetres. Default 6000, from the data sheet.
    pub max_range_mm: u16,
}

impl<const SONARS: usize> Srf08Config<SONARS> {
    setters! {
        with_first_address, first_address: u8;
        with_plan, plan: FiringPlan<SONARS>;
        with_has_general_call, has_general_call: bool;
        with_timeout_ms, timeout_ms: u16;
        with_poll_interval_us, poll_interval_us: u16;
        with_speed_of_sound_m_per_s, speed_of_sound_m_per_s: u16;
        with_min_range_mm, min_range_mm: u16;
        with_max_range_mm, max_range_mm: u16;
    }

    /// The values of the SRF08's data sheet, two firing groups.
    pub const DEFAULT: Self = Self {
        first_address: 0x70,
        plan: FiringPlan::interleaved(2),
        has_general_call: true,
        timeout_ms: 100,
        poll_interval_us: 2000,
        speed_of_sound_m_per_s: 343,
        min_range_mm: 30,
        max_range_mm: 6000,
    };

    /// The same for the SRF10, without the common address.
    pub const SRF10: Self = Self { has_general_call: false, ..Self::DEFAULT };

    /// The same for the SRF02. It has one transducer, so it does not receive an echo from nearer than some 150 mm.
    pub const SRF02: Self = Self { min_range_mm: 150, ..Self::SRF10 };

    /// Converts the time of the first echo to a range.
    fn echo(&self, flight_us: u16) -> Result<Echo, SonarFault> {
        if flight_us == 0 {
            return Ok(Echo::Silence);
        }
        match u16::try_from(range_mm(flight_us.into(), self.speed_of_sound_m_per_s)) {
            Ok(range_mm) if (self.min_range_mm..=self.max_range_mm).contains(&range_mm) => Ok(Echo::Range { range_mm }),
            _ => Err(SonarFault::OutOfRange),
        }
    }
}

impl<const SONARS: usize> Default for Srf08Config<SONARS> {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl<const SONARS: usize> I2cRanger<SONARS> for Srf08Config<SONARS> {
    fn check(&self) -> Result<(), ConfigError> {
        let most = u16::MAX.into();
        check_addresses(self.first_address, SONARS, ADDRESSES)?;
        ConfigError::check("timeout_ms", self.timeout_ms.into(), 1, most)?;
        ConfigError::check("poll_interval_us", self.poll_interval_us.into(), 1, most)?;
        check_speed_of_sound(self.speed_of_sound_m_per_s)?;
        ConfigError::check("min_range_mm", self.min_range_mm.into(), 0, self.max_range_mm.into())
    }

    fn first_address(&self) -> u8 {
        self.first_address
    }

    fn plan(&self) -> FiringPlan<SONARS> {
        self.plan
    }

    fn timing(&self) -> RangingTiming {
        let poll_interval_us = self.poll_interval_us.into();
        let timeout_us = u32::from(self.timeout_ms) * 1000;
        RangingTiming { first_poll_us: poll_interval_us, poll_interval_us, timeout_us, cycle_us: 0 }
    }

    fn broadcast_address(&self) -> Option<u8> {
        self.has_general_call.then_some(GENERAL_CALL)
    }

    fn start<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<(), BUS::Error> {
        bus.write(address, &[COMMAND_REGISTER, RANGE_IN_MICROSECONDS])
    }

    /// One message reads the revision, which shows whether the sensor is done, and the first echo.
    fn poll<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<Reading, BUS::Error> {
        let mut registers = [REVISION_WHILE_BUSY; 4];
        bus.write_read(address, &[COMMAND_REGISTER], &mut registers)?;
        let [revision, _light, high, low] = registers;
        Ok(if revision == REVISION_WHILE_BUSY {
            Reading::Pending
        } else {
            Reading::Done(self.echo(u16::from_be_bytes([high, low])))
        })
    }
}

/// A ring of `SONARS` SRF02, SRF08 or SRF10 at consecutive addresses of one I2C bus, at most 16.
///
/// A frame takes one measurement (65 ms by the data sheet) for each firing group, and waits at most `timeout_ms` for each.
pub type Srf08Ring<BUS, DELAY, const SONARS: usize> = I2cRing<BUS, DELAY, Srf08Config<SONARS>, SONARS>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_valid_range_is_exact_in_the_unit_of_the_sensor() {
        let config = Srf08Config::<16>::DEFAULT;
        for range_mm in config.min_range_mm..=config.max_range_mm {
            let flight_us = (u32::from(range_mm) * 2000 + 171) / 343;
            assert_eq!(config.echo(flight_us as u16), Ok(Echo::Range { range_mm }));
        }
    }

    #[test]
    fn a_time_outside_the_data_sheet_is_out_of_range_and_zero_is_silence() {
        let config = Srf08Config::<16>::DEFAULT;
        assert_eq!(config.echo(0), Ok(Echo::Silence));
        for flight_us in [1, 160, 35_000, u16::MAX] {
            assert_eq!(config.echo(flight_us), Err(SonarFault::OutOfRange));
        }
    }

    #[test]
    fn each_field_out_of_its_range_is_named() {
        let good = Srf08Config::<16>::DEFAULT;
        assert_eq!(good.check(), Ok(()));
        let wrong = [
            (Srf08Config { first_address: 0x6F, ..good }, "first_address"),
            (Srf08Config { first_address: 0x71, ..good }, "first_address"),
            (Srf08Config { timeout_ms: 0, ..good }, "timeout_ms"),
            (Srf08Config { poll_interval_us: 0, ..good }, "poll_interval_us"),
            (Srf08Config { speed_of_sound_m_per_s: 299, ..good }, "speed_of_sound_m_per_s"),
            (Srf08Config { min_range_mm: 6001, ..good }, "min_range_mm"),
        ];
        for (config, field) in wrong {
            assert_eq!(config.check().unwrap_err().field(), field);
        }
    }
}
