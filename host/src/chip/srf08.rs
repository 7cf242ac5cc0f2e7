//! A model of sixteen SRF08 rangers that stand in a world of ring frames.

use toposlam::ring::{Echo, RingFrame};

use super::{BusAnswer, I2cDevices};

const SENSORS: usize = 16;
const FIRST_ADDRESS: u8 = 0x70;
const REGISTERS: usize = 36;
const REVISION: u8 = 6;

/// A defect that a test gives a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorFault {
    /// It does not acknowledge its address.
    Absent,
    /// It acknowledges and ranges for ever.
    NeverDone,
    /// It answers 0: no echo, whatever is there.
    Zeros,
    /// It answers 65,535.
    Nonsense,
    /// It refuses the data that is written to it.
    RefusesData,
    /// It blocks the bus whenever it is read.
    BlocksBus,
}

/// Sixteen rangers at 0x70 to 0x7F. The world is a source of ring frames: a new frame begins when a ranger fires that
/// has fired in the present one already.
pub struct Srf08Bank<WORLD> {
    world: WORLD,
    /// How often a ranging sensor is asked before it is done.
    ranging_polls: u32,
    frame: Option<RingFrame<SENSORS>>,
    frames: u64,
    blind_frames: u64,
    fired: u16,
    sensors: [Sensor; SENSORS],
}

#[derive(Clone, Copy, Default)]
struct Sensor {
    fault: Option<SensorFault>,
    /// How often it still reads as ranging.
    polls_left: u32,
    pointer: usize,
    echo: u16,
}

impl<WORLD: FnMut() -> Option<RingFrame<SENSORS>>> Srf08Bank<WORLD> {
    /// Rangers in a world. `ranging_polls` stands for the 65 ms of a ranging: so often a sensor reads as still ranging.
    pub fn new(world: WORLD, ranging_polls: u32) -> Self {
        Self {
            world,
            ranging_polls,
            frame: None,
            frames: 0,
            blind_frames: 0,
            fired: u16::MAX,
            sensors: [Sensor::default(); SENSORS],
        }
    }

    /// Gives a sensor a defect, or heals it.
    pub fn set_fault(&mut self, sensor: usize, fault: Option<SensorFault>) {
        self.sensors[sensor].fault = fault;
    }

    /// How many frames the world has given so far.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// How often the ring was fired after the world had no more frames; every sensor is absent then.
    pub fn blind_frames(&self) -> u64 {
        self.blind_frames
    }

    fn is_over(&self) -> bool {
        self.blind_frames > 0
    }

    fn fire(&mut self, which: u16) {
        if self.fired & which != 0 {
            self.fired = 0;
            self.frame = (self.world)();
            match self.frame {
                Some(_) => self.frames += 1,
                None => self.blind_frames += 1,
            }
        }
        self.fired |= which;
        for (index, sensor) in self.sensors.iter_mut().enumerate().filter(|(index, _)| which >> index & 1 == 1) {
            sensor.polls_left = self.ranging_polls;
            sensor.echo = match self.frame.map(|frame| frame.echoes[index]) {
                Some(Echo::Range { range_mm }) => flight_us(range_mm),
                Some(Echo::Silence | Echo::Dead) | None => 0,
            };
        }
    }

    fn is_absent(&self, index: usize) -> bool {
        self.sensors[index].fault == Some(SensorFault::Absent)
            || self.frame.is_some_and(|frame| frame.echoes[index] == Echo::Dead)
            || self.is_over()
    }
}

/// The time of flight there and back at 343 m/s, rounded to the sensor's microsecond.
fn flight_us(range_mm: u16) -> u16 {
    u16::try_from((u32::from(range_mm) * 2000 + 343 / 2) / 343).unwrap_or(u16::MAX)
}

fn index_of(address: u8) -> Option<usize> {
    address.checked_sub(FIRST_ADDRESS).map(usize::from).filter(|&index| index < SENSORS)
}

impl<WORLD: FnMut() -> Option<RingFrame<SENSORS>>> I2cDevices for Srf08Bank<WORLD> {
    fn write(&mut self, address: u8, bytes: &[u8]) -> BusAnswer<()> {
        let is_ranging = matches!(bytes, [0, 0x50..=0x52]);
        if address == 0 {
            if is_ranging {
                self.fire(u16::MAX);
            }
            return if self.is_over() { BusAnswer::AddressNotAcknowledged } else { BusAnswer::Acknowledged(()) };
        }
        let Some(index) = index_of(address) else { return BusAnswer::AddressNotAcknowledged };
        if is_ranging {
            // The sound starts with the frame whether or not this sensor takes part in it.
            self.fire(1 << index);
        }
        if self.is_absent(index) {
            return BusAnswer::AddressNotAcknowledged;
        }
        let sensor = &mut self.sensors[index];
        if sensor.fault == Some(SensorFault::RefusesData) {
            return BusAnswer::DataNotAcknowledged;
        }
        if let Some(&register) = bytes.first() {
            sensor.pointer = register.into();
        }
        BusAnswer::Acknowledged(())
    }

    fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>> {
        let Some(index) = index_of(address).filter(|&index| !self.is_absent(index)) else {
            return BusAnswer::AddressNotAcknowledged;
        };
        let sensor = &mut self.sensors[index];
        if sensor.fault == Some(SensorFault::BlocksBus) {
            return BusAnswer::TimedOut;
        }
        if sensor.polls_left > 0 || sensor.fault == Some(SensorFault::NeverDone) {
            sensor.polls_left = sensor.polls_left.saturating_sub(1);
            return BusAnswer::Acknowledged(vec![0xFF; count]);
        }
        let [high, low] = match sensor.fault {
            Some(SensorFault::Zeros) => 0,
            Some(SensorFault::Nonsense) => u16::MAX,
            _ => sensor.echo,
        }
        .to_be_bytes();
        let mut registers = [0; REGISTERS];
        registers[..4].copy_from_slice(&[REVISION, 0, high, low]);
        let read = registers.into_iter().chain(std::iter::repeat(0xFF)).skip(sensor.pointer).take(count);
        BusAnswer::Acknowledged(read.collect())
    }
}
