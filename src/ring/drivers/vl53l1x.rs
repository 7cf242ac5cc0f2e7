//! ST VL53L1X time-of-flight rangers on one I2C bus, each with its XSHUT input on a pin.
//!
//! Sources: ST, *VL53L1X data sheet* DS12385, and *A guide to using the VL53L1X ultra lite driver* UM2510 with that driver,
//! STSW-IMG009: registers, order of the start, timing budgets, status codes. A register has a 16-bit address. A sensor whose
//! XSHUT is low is in reset; then it has the address 0x29 and no settings. Once started, it measures again and again: it
//! sets bit 0 of register 0x31 after a measurement, and waits until the host clears the interrupt. The default is the long
//! distance mode.
//!
//! No published driver fits: `vl53l1x-uld` and `vl53l1` are for `embedded-hal` 0.2, `vl53l1x` needs `std`, and `vl53l1x-simple`
//! divides by a number that it reads from the sensor and does not return the status of a range.

use crate::setters::setters;
use embedded_hal::{delay::DelayNs, digital::OutputPin, i2c::I2c};

use super::{
    FiringPlan, I2cRanger, I2cRing, RangingTiming, Reading, SonarFault,
    i2c_ring::{check_addresses, fault},
    vl53l1x_settings,
};
use crate::config_error::ConfigError;
use crate::ring::Echo;

/// The address after a reset.
const NEW_ADDRESS: u8 = 0x29;
const MODEL: u8 = 0xEA;
const POLL_INTERVAL_US: u32 = 5000;
/// From the release of XSHUT: 1.2 ms by the data sheet.
const BOOT_ATTEMPTS: u8 = 10;
/// The first measurement after the start calibrates the sensor.
const CALIBRATION_ATTEMPTS: u8 = 100;

mod register {
    pub(super) const ADDRESS: u16 = 0x0001;
    pub(super) const VHV_TIMEOUT: u16 = 0x0008;
    pub(super) const VHV_INIT: u16 = 0x000B;
    pub(super) const IO_CONFIG: u16 = 0x002D;
    pub(super) const INTERRUPT_STATUS: u16 = 0x0031;
    pub(super) const RANGE_TIMEOUT_A: u16 = 0x005E;
    pub(super) const RANGE_TIMEOUT_B: u16 = 0x0061;
    pub(super) const PERIOD: u16 = 0x006C;
    pub(super) const INTERRUPT_CLEAR: u16 = 0x0086;
    pub(super) const MODE_START: u16 = 0x0087;
    /// The status of the range; the range follows 13 bytes later.
    pub(super) const RESULT: u16 = 0x0089;
    pub(super) const OSCILLATOR: u16 = 0x00DE;
    pub(super) const SYSTEM_STATUS: u16 = 0x00E5;
    pub(super) const MODEL: u16 = 0x010F;
}

/// Duration of one measurement of a VL53L1X. A longer one measures farther, and with less noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Vl53l1xBudget {
    /// 33 ms, the shortest of the long distance mode.
    Ms33,
    /// 50 ms.
    Ms50,
    /// 100 ms, the default of the ultra lite driver.
    #[default]
    Ms100,
    /// 200 ms. The data sheet names 140 ms for the range of 4 m.
    Ms200,
}

impl Vl53l1xBudget {
    /// The budget in milliseconds.
    pub const fn ms(self) -> u16 {
        match self {
            Self::Ms33 => 33,
            Self::Ms50 => 50,
            Self::Ms100 => 100,
            Self::Ms200 => 200,
        }
    }

    /// The values of the two timeout registers in the long distance mode.
    const fn timeouts(self) -> [u16; 2] {
        match self {
            Self::Ms33 => [0x0060, 0x006E],
            Self::Ms50 => [0x00AD, 0x00C6],
            Self::Ms100 => [0x01CC, 0x01EA],
            Self::Ms200 => [0x02D9, 0x02F8],
        }
    }

    /// Time from the start of a measurement to that of the next.
    const fn period_ms(self) -> u16 {
        self.ms() + 5
    }
}

/// Addresses, firing plan, times and range limits of a ring of VL53L1X.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Vl53l1xConfig<const SONARS: usize> {
    /// 7-bit address of sensor 0; sensor *i* gets this address plus *i*. All must be from 0x08 to 0x77, except 0x29, the
    /// address after a reset. Default 0x30.
    pub first_address: u8,
    /// Which sensors are read together. Default: all. A plan with more groups only takes longer.
    pub plan: FiringPlan<SONARS>,
    /// Duration of one measurement. Default 100 ms.
    pub budget: Vl53l1xBudget,
    /// Whether SDA, SCL and the interrupt pin of the sensor are pulled up to 2.8 V instead of 1.8 V, as on most breakout
    /// boards. Default true.
    pub has_2v8_io: bool,
    /// Timeout of a firing group, in milliseconds, at least twice the budget and 10. Default 300.
    pub timeout_ms: u16,
    /// Minimum valid range, in millimetres. Default 40, from the data sheet. A shorter one is a fault.
    pub min_range_mm: u16,
    /// Maximum valid range, in millimetres. Default 4000, from the data sheet. A longer one is silence.
    pub max_range_mm: u16,
}

impl<const SONARS: usize> Vl53l1xConfig<SONARS> {
    setters! {
        with_first_address, first_address: u8;
        with_plan, plan: FiringPlan<SONARS>;
        with_budget, budget: Vl53l1xBudget;
        with_has_2v8_io, has_2v8_io: bool;
        with_timeout_ms, timeout_ms: u16;
        with_min_range_mm, min_range_mm: u16;
        with_max_range_mm, max_range_mm: u16;
    }

    /// The long distance mode with 100 ms, all sensors together.
    pub const DEFAULT: Self = Self {
        first_address: 0x30,
        plan: FiringPlan::together(),
        budget: Vl53l1xBudget::Ms100,
        has_2v8_io: true,
        timeout_ms: 300,
        min_range_mm: 40,
        max_range_mm: 4000,
    };

    /// Converts the status and the range of a measurement.
    fn echo(&self, status: u8, range_mm: u16) -> Result<Echo, SonarFault> {
        match status & 0x1F {
            // Valid; valid, but the first one, which is not compared with the one before.
            9 | 19 if range_mm < self.min_range_mm => Err(SonarFault::OutOfRange),
            9 | 19 if range_mm <= self.max_range_mm => Ok(Echo::Range { range_mm }),
            // Beyond the limit; too little signal, a phase out of bounds, too much noise, a target beyond the unambiguous range.
            9 | 19 | 4..=7 => Ok(Echo::Silence),
            _ => Err(SonarFault::OutOfRange),
        }
    }

    /// Sets up a sensor that was released from its reset, and starts its measurements.
    fn start_sensor<BUS: I2c>(&self, bus: &mut BUS, delay: &mut impl DelayNs, address: u8) -> Result<(), SonarFault> {
        await_bit(bus, delay, NEW_ADDRESS, register::SYSTEM_STATUS, BOOT_ATTEMPTS)?;
        let [model] = read(bus, NEW_ADDRESS, register::MODEL)?;
        if model != MODEL {
            return Err(SonarFault::Bus);
        }
        write(bus, NEW_ADDRESS, register::ADDRESS, [address])?;
        let io = u8::from(self.has_2v8_io);
        write(bus, address, register::IO_CONFIG, [0, io, io])?;
        for (register, settings) in vl53l1x_settings::blocks() {
            write(bus, address, register, settings)?;
        }
        write(bus, address, register::MODE_START, [MEASURE])?;
        await_bit(bus, delay, address, register::INTERRUPT_STATUS, CALIBRATION_ATTEMPTS)?;
        write(bus, address, register::INTERRUPT_CLEAR, [1])?;
        write(bus, address, register::MODE_START, [0])?;
        // The calibration of the start serves all later measurements.
        write(bus, address, register::VHV_TIMEOUT, [9])?;
        write(bus, address, register::VHV_INIT, [0])?;
        let [a, b] = self.budget.timeouts();
        write(bus, address, register::RANGE_TIMEOUT_A, a.to_be_bytes())?;
        write(bus, address, register::RANGE_TIMEOUT_B, b.to_be_bytes())?;
        let oscillator = u32::from(u16::from_be_bytes(read(bus, address, register::OSCILLATOR)?) & 0x3FF);
        if oscillator == 0 {
            return Err(SonarFault::Bus);
        }
        // Milliseconds in steps of the oscillator, and 7.5 % more.
        let period = oscillator * u32::from(self.budget.period_ms()) * 43 / 40;
        write(bus, address, register::PERIOD, period.to_be_bytes())?;
        write(bus, address, register::MODE_START, [MEASURE])
    }
}

/// Measures with the period of [`register::PERIOD`].
const MEASURE: u8 = 0x40;

fn write<BUS: I2c, const BYTES: usize>(
    bus: &mut BUS,
    address: u8,
    register: u16,
    bytes: [u8; BYTES],
) -> Result<(), SonarFault> {
    const { assert!(BYTES <= vl53l1x_settings::BLOCK_BYTES) };
    let mut message = [0; 2 + vl53l1x_settings::BLOCK_BYTES];
    for (byte, value) in message.iter_mut().zip(register.to_be_bytes().into_iter().chain(bytes)) {
        *byte = value;
    }
    bus.write(address, message.get(..2 + BYTES).unwrap_or(&[])).map_err(|error| fault(&error))
}

fn read<BUS: I2c, const BYTES: usize>(bus: &mut BUS, address: u8, register: u16) -> Result<[u8; BYTES], SonarFault> {
    let mut bytes = [0; BYTES];
    bus.write_read(address, &register.to_be_bytes(), &mut bytes).map_err(|error| fault(&error))?;
    Ok(bytes)
}

/// Polls a register until its bit 0 is set. A sensor that boots does not acknowledge its address.
fn await_bit<BUS: I2c>(
    bus: &mut BUS,
    delay: &mut impl DelayNs,
    address: u8,
    register: u16,
    attempts: u8,
) -> Result<(), SonarFault> {
    for _ in 0..attempts {
        delay.delay_us(POLL_INTERVAL_US);
        match read(bus, address, register) {
            Ok([status]) if status & 1 == 1 => return Ok(()),
            Ok(_) | Err(SonarFault::Silent) => {}
            Err(fault) => return Err(fault),
        }
    }
    Err(SonarFault::Silent)
}

impl<const SONARS: usize> Default for Vl53l1xConfig<SONARS> {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl<const SONARS: usize> I2cRanger<SONARS> for Vl53l1xConfig<SONARS> {
    fn check(&self) -> Result<(), ConfigError> {
        check_addresses(self.first_address, SONARS, 0x08..=0x77)?;
        if (self.first_address..=u8::MAX).take(SONARS).any(|address| address == NEW_ADDRESS) {
            return Err(ConfigError::ReservedAddress { field: "first_address", address: NEW_ADDRESS });
        }
        let shortest_ms = 2 * i32::from(self.budget.period_ms());
        ConfigError::check("timeout_ms", self.timeout_ms.into(), shortest_ms, u16::MAX.into())?;
        ConfigError::check("min_range_mm", self.min_range_mm.into(), 0, self.max_range_mm.into())
    }

    fn first_address(&self) -> u8 {
        self.first_address
    }

    fn plan(&self) -> FiringPlan<SONARS> {
        self.plan
    }

    fn timing(&self) -> RangingTiming {
        RangingTiming {
            first_poll_us: POLL_INTERVAL_US,
            poll_interval_us: POLL_INTERVAL_US,
            timeout_us: u32::from(self.timeout_ms) * 1000,
            cycle_us: 0,
        }
    }

    /// The sensor measures already: discards the measurement before.
    fn start<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<(), BUS::Error> {
        let [high, low] = register::INTERRUPT_CLEAR.to_be_bytes();
        bus.write(address, &[high, low, 1])
    }

    fn poll<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<Reading, BUS::Error> {
        let mut ready = [0];
        bus.write_read(address, &register::INTERRUPT_STATUS.to_be_bytes(), &mut ready)?;
        if ready[0] & 1 == 0 {
            return Ok(Reading::Pending);
        }
        let mut result = [0; 15];
        bus.write_read(address, &register::RESULT.to_be_bytes(), &mut result)?;
        let [status, .., high, low] = result;
        Ok(Reading::Done(self.echo(status, u16::from_be_bytes([high, low]))))
    }
}

/// A ring of `SONARS` VL53L1X on one I2C bus. [`start`](Self::start) comes before the first frame.
///
/// A frame takes one to two measurements for each firing group, and waits at most `timeout_ms` for each. A sensor that was
/// not started, or that lost its supply since, is [`SonarFault::Silent`] in every frame; start the ring again.
pub type Vl53l1xRing<BUS, DELAY, const SONARS: usize> = I2cRing<BUS, DELAY, Vl53l1xConfig<SONARS>, SONARS>;

impl<BUS: I2c, DELAY: DelayNs, const SONARS: usize> Vl53l1xRing<BUS, DELAY, SONARS> {
    /// Starts all sensors, and returns the outcome for each.
    ///
    /// Resets them through their XSHUT inputs, releases one after the other, gives it its address and its settings. A sensor
    /// that fails stays in reset, so that it does not disturb the others. Takes about 0.1 s for each sensor, at most 0.6 s
    /// and the time on the bus.
    pub fn start(&mut self, xshut: &mut [impl OutputPin; SONARS]) -> [Result<(), SonarFault>; SONARS] {
        let mut outcomes = [Ok(()); SONARS];
        for (pin, outcome) in xshut.iter_mut().zip(&mut outcomes) {
            *outcome = pin.set_low().map_err(|_| SonarFault::Bus);
        }
        self.delay.delay_us(1000);
        for (sensor, (pin, outcome)) in xshut.iter_mut().zip(&mut outcomes).enumerate() {
            let address = self.address(sensor);
            *outcome = outcome.and_then(|()| pin.set_high().map_err(|_| SonarFault::Bus));
            *outcome = outcome.and_then(|()| self.ranger.start_sensor(&mut self.bus, &mut self.delay, address));
            if outcome.is_err() {
                // It may be this pin that failed.
                let _ = pin.set_low();
            }
        }
        outcomes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_valid_range_within_the_limits_is_an_echo_and_no_target_is_silence() {
        let config = Vl53l1xConfig::<16>::DEFAULT;
        for (status, range_mm, expected) in [
            (9, 39, Err(SonarFault::OutOfRange)),
            (9, 40, Ok(Echo::Range { range_mm: 40 })),
            (0xE9, 4000, Ok(Echo::Range { range_mm: 4000 })),
            (19, 1200, Ok(Echo::Range { range_mm: 1200 })),
            (9, 4001, Ok(Echo::Silence)),
            (4, 1200, Ok(Echo::Silence)),
            (5, 1200, Ok(Echo::Silence)),
            (6, 1200, Ok(Echo::Silence)),
            (7, 1200, Ok(Echo::Silence)),
            (3, 1200, Err(SonarFault::OutOfRange)),
            (8, 10, Err(SonarFault::OutOfRange)),
            (0xFF, u16::MAX, Err(SonarFault::OutOfRange)),
        ] {
            assert_eq!(config.echo(status, range_mm), expected, "status {status}, {range_mm} mm");
        }
    }

    #[test]
    fn each_field_out_of_its_range_is_named() {
        let good = Vl53l1xConfig::<16>::DEFAULT;
        for first_address in [0x08, 0x19, 0x2A, 0x68] {
            assert_eq!(Vl53l1xConfig { first_address, ..good }.check(), Ok(()), "{first_address:#x}");
        }
        for first_address in [0x00, 0x07, 0x1A, 0x29, 0x69, 0x78, 0xFF] {
            let config = Vl53l1xConfig { first_address, ..good };
            assert_eq!(config.check().unwrap_err().field(), "first_address", "{first_address:#x}");
        }
        let config = good.with_budget(Vl53l1xBudget::Ms200);
        assert_eq!(config.check().unwrap_err().field(), "timeout_ms");
        assert_eq!(config.with_timeout_ms(410).check(), Ok(()));
        assert_eq!(good.with_min_range_mm(4001).check().unwrap_err().field(), "min_range_mm");
    }
}
