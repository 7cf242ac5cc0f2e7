//! A model of a bank of VL53L1X rangers in a world of ring frames, with their XSHUT inputs.

use std::{cell::Cell, convert::Infallible, rc::Rc};

use embedded_hal::digital::{ErrorType, OutputPin};
use toposlam::ring::{Echo, RingFrame};

use super::{BusAnswer, I2cDevices, SensorFault, SimulatedTime, surroundings::Surroundings};

const NEW_ADDRESS: u8 = 0x29;
const BOOT_NS: u64 = 1_200_000;
/// The oscillator's periods in a millisecond, as the sensor reports them.
const OSCILLATOR: u16 = 0x2E8;
/// Number of registers that the model has.
const REGISTERS: usize = 0x0111;

const REGISTER_ADDRESS: usize = 0x0001;
const REGISTER_INTERRUPT_STATUS: usize = 0x0031;
const REGISTER_TIMEOUT_A: usize = 0x005E;
const REGISTER_PERIOD: usize = 0x006C;
const REGISTER_INTERRUPT_CLEAR: usize = 0x0086;
const REGISTER_MODE_START: usize = 0x0087;
const REGISTER_RESULT: usize = 0x0089;
const REGISTER_OSCILLATOR: usize = 0x00DE;
const REGISTER_SYSTEM_STATUS: usize = 0x00E5;
const REGISTER_MODEL: usize = 0x010F;
const RESULT_BYTES: usize = 17;

/// Rangers on a bus with simulated time, in reset until their [`Xshut`] is high. The world is a source of ring frames: a
/// new frame begins when a range is read of a ranger whose range was already read in the current one.
#[derive(Debug)]
pub struct Vl53l1xBank<WORLD, const SONARS: usize> {
    surroundings: Surroundings<WORLD, SONARS>,
    time: SimulatedTime,
    xshut: Rc<[Cell<Line>; SONARS]>,
    sensors: [Sensor; SONARS],
}

/// The XSHUT input of a sensor.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    /// When it became high.
    high_since_ns: Option<u64>,
    /// Whether the sensor was reset since it was last on the bus.
    was_reset: bool,
}

#[derive(Clone, Debug)]
struct Sensor {
    fault: Option<SensorFault>,
    registers: Vec<u8>,
    pointer: usize,
    /// When the current measurement ends; none while it waits for the host.
    done_ns: Option<u64>,
}

impl Sensor {
    fn reset(fault: Option<SensorFault>) -> Self {
        let mut registers = vec![0; REGISTERS];
        registers[REGISTER_ADDRESS] = NEW_ADDRESS;
        registers[REGISTER_OSCILLATOR..][..2].copy_from_slice(&OSCILLATOR.to_be_bytes());
        registers[REGISTER_SYSTEM_STATUS] = 3;
        registers[REGISTER_MODEL..].copy_from_slice(&[0xEA, 0xCC]);
        Self { fault, registers, pointer: 0, done_ns: None }
    }

    /// The duration of a measurement, with the settings of the long distance mode.
    fn budget_ns(&self) -> u64 {
        let ms = match self.registers[REGISTER_TIMEOUT_A..][..2] {
            [0x00, 0x60] => 33,
            [0x00, 0xAD] => 50,
            [0x01, 0xCC] => 100,
            [0x02, 0xD9] => 200,
            _ => 500,
        };
        ms * 1_000_000
    }

    /// The time between the starts of two measurements.
    fn period_ns(&self) -> u64 {
        let steps = self.registers[REGISTER_PERIOD..][..4].iter().fold(0, |steps, byte| steps << 8 | u64::from(*byte));
        (steps * 1_000_000 * 40 / 43 / u64::from(OSCILLATOR)).max(self.budget_ns())
    }

    fn is_measuring(&self) -> bool {
        self.registers[REGISTER_MODE_START] == 0x40
    }

    fn write(&mut self, register: usize, value: u8, now_ns: u64) {
        let Some(stored) = self.registers.get_mut(register) else { return };
        *stored = value;
        match register {
            REGISTER_MODE_START => self.done_ns = self.is_measuring().then(|| now_ns + self.budget_ns()),
            REGISTER_INTERRUPT_CLEAR if value == 1 && self.is_measuring() => {
                self.done_ns = Some(now_ns + self.period_ns());
            }
            _ => {}
        }
    }
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> Vl53l1xBank<WORLD, SONARS> {
    /// A bank of rangers in a world.
    pub fn new(world: WORLD, time: SimulatedTime) -> Self {
        Self {
            surroundings: Surroundings::new(world),
            time,
            xshut: Rc::new(std::array::from_fn(|_| Cell::default())),
            sensors: std::array::from_fn(|_| Sensor::reset(None)),
        }
    }

    /// The XSHUT input of each sensor.
    pub fn xshut(&self) -> [Xshut<SONARS>; SONARS] {
        std::array::from_fn(|sensor| Xshut { lines: self.xshut.clone(), time: self.time.clone(), sensor })
    }

    /// Injects a fault into a sensor, or clears it.
    pub fn set_fault(&mut self, sensor: usize, fault: Option<SensorFault>) {
        self.sensors[sensor].fault = fault;
    }

    /// The 7-bit address of a sensor.
    pub fn address(&self, sensor: usize) -> u8 {
        self.sensors[sensor].registers[REGISTER_ADDRESS]
    }

    /// Interrupts the supply of a sensor for a moment: it loses its address and its settings.
    pub fn interrupt_supply(&mut self, sensor: usize) {
        self.sensors[sensor] = Sensor::reset(self.sensors[sensor].fault);
    }

    fn is_present(&self, index: usize) -> bool {
        let booted = self.xshut[index].get().high_since_ns.is_some_and(|since| self.time.now_ns() >= since + BOOT_NS);
        booted && self.sensors[index].fault != Some(SensorFault::Absent) && !self.surroundings.is_dead(index)
    }

    /// The sensor with an address, after the resets by the lines.
    fn index_of(&mut self, address: u8) -> Option<usize> {
        for (line, sensor) in self.xshut.iter().zip(&mut self.sensors) {
            if line.get().was_reset {
                *sensor = Sensor::reset(sensor.fault);
                line.set(Line { was_reset: false, ..line.get() });
            }
        }
        (0..SONARS).find(|&index| self.address(index) == address && self.is_present(index))
    }

    /// The registers of the result: the status first, and the range from the 14th byte on.
    fn result(&mut self, index: usize) -> [u8; RESULT_BYTES] {
        let mut result = [0; RESULT_BYTES];
        let (status, range_mm) = match (self.sensors[index].fault, self.surroundings.heard(index)) {
            (Some(SensorFault::OutOfRange), _) => return [0xFF; RESULT_BYTES],
            (_, Echo::Range { range_mm }) => (9, range_mm),
            (_, Echo::Silence | Echo::Dead) => (4, 0),
        };
        result[0] = status;
        result[13..15].copy_from_slice(&range_mm.to_be_bytes());
        result
    }
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> I2cDevices for Vl53l1xBank<WORLD, SONARS> {
    fn write(&mut self, address: u8, bytes: &[u8]) -> BusAnswer<()> {
        let now_ns = self.time.now_ns();
        let Some(index) = self.index_of(address) else { return BusAnswer::AddressNotAcknowledged };
        let sensor = &mut self.sensors[index];
        let [high, low, values @ ..] = bytes else { return BusAnswer::Acknowledged(()) };
        if sensor.fault == Some(SensorFault::RefusesData) && !values.is_empty() {
            return BusAnswer::DataNotAcknowledged;
        }
        sensor.pointer = u16::from_be_bytes([*high, *low]).into();
        for (register, value) in (sensor.pointer..).zip(values) {
            sensor.write(register, *value, now_ns);
        }
        BusAnswer::Acknowledged(())
    }

    fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>> {
        let Some(index) = self.index_of(address) else { return BusAnswer::AddressNotAcknowledged };
        if self.sensors[index].fault == Some(SensorFault::BlocksBus) {
            return BusAnswer::TimedOut;
        }
        let pointer = self.sensors[index].pointer;
        if pointer == REGISTER_RESULT {
            self.surroundings.fire(std::array::from_fn(|sensor| sensor == index), [false; SONARS]);
            if !self.is_present(index) {
                return BusAnswer::AddressNotAcknowledged;
            }
            let result = self.result(index);
            self.sensors[index].registers[REGISTER_RESULT..][..RESULT_BYTES].copy_from_slice(&result);
        }
        let now_ns = self.time.now_ns();
        let sensor = &mut self.sensors[index];
        let is_done =
            sensor.fault != Some(SensorFault::NeverDone) && sensor.done_ns.is_some_and(|done_ns| done_ns <= now_ns);
        sensor.registers[REGISTER_INTERRUPT_STATUS] = 2 | u8::from(is_done);
        if sensor.fault == Some(SensorFault::Zeros) {
            return BusAnswer::Acknowledged(vec![0; count]);
        }
        let read = sensor.registers.iter().skip(pointer).copied().chain(std::iter::repeat(0)).take(count);
        BusAnswer::Acknowledged(read.collect())
    }
}

/// The XSHUT input of a sensor: low is reset.
#[derive(Clone, Debug)]
pub struct Xshut<const SONARS: usize> {
    lines: Rc<[Cell<Line>; SONARS]>,
    time: SimulatedTime,
    sensor: usize,
}

impl<const SONARS: usize> ErrorType for Xshut<SONARS> {
    type Error = Infallible;
}

impl<const SONARS: usize> OutputPin for Xshut<SONARS> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.lines[self.sensor].set(Line { high_since_ns: None, was_reset: true });
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        let line = self.lines[self.sensor].get();
        let high_since_ns = Some(line.high_since_ns.unwrap_or(self.time.now_ns()));
        self.lines[self.sensor].set(Line { high_since_ns, ..line });
        Ok(())
    }
}
