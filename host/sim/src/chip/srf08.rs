//! A model of sixteen SRF08 or SRF10 rangers in a world of ring frames.

use toposlam::ring::{Echo, RingFrame};

use super::{
    BusAnswer, I2cDevices, SensorFault,
    surroundings::{Surroundings, flight_us},
};

const SENSORS: usize = 16;
const FIRST_ADDRESS: u8 = 0x70;
const REVISION: u8 = 6;
/// The commands that must precede a new address.
const UNLOCKING: [u8; 3] = [0xA0, 0xAA, 0xA5];

/// Sixteen rangers, initially at addresses 0x70 to 0x7F. The world is a source of ring frames: a new frame begins when
/// a ranger fires that has already fired in the current one.
#[derive(Debug)]
pub struct Srf08Bank<WORLD> {
    surroundings: Surroundings<WORLD, SENSORS>,
    /// Number of polls before a ranging sensor is done.
    ranging_polls: u32,
    is_srf10: bool,
    sensors: [Sensor; SENSORS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Sensor {
    fault: Option<SensorFault>,
    address: u8,
    /// Number of commands of [`UNLOCKING`] received in a row.
    unlocked: usize,
    /// Number of polls for which it still reads as ranging.
    polls_left: u32,
    pointer: usize,
}

impl<WORLD: FnMut() -> Option<RingFrame<SENSORS>>> Srf08Bank<WORLD> {
    /// A bank of SRF08 in a world. `ranging_polls` stands for the 65 ms of a ranging: a sensor reads as ranging for
    /// this number of polls.
    pub fn new(world: WORLD, ranging_polls: u32) -> Self {
        let sensors = std::array::from_fn(|index| Sensor { address: FIRST_ADDRESS + index as u8, ..Sensor::default() });
        Self { surroundings: Surroundings::new(world), ranging_polls, is_srf10: false, sensors }
    }

    /// A bank of SRF10 in a world: four registers, no answer on the bus while ranging, no general call.
    pub fn srf10(world: WORLD, ranging_polls: u32) -> Self {
        Self { is_srf10: true, ..Self::new(world, ranging_polls) }
    }

    /// Injects a fault into a sensor, or clears it.
    pub fn set_fault(&mut self, sensor: usize, fault: Option<SensorFault>) {
        self.sensors[sensor].fault = fault;
    }

    /// Enables cross-talk: neighbours that range at the same time both report the shorter range.
    pub fn set_cross_talk(&mut self, cross_talk: bool) {
        self.surroundings.cross_talk = cross_talk;
    }

    /// The 7-bit address of a sensor.
    pub fn address(&self, sensor: usize) -> u8 {
        self.sensors[sensor].address
    }

    /// Sets the 7-bit address of a sensor, as if it was configured elsewhere.
    pub fn set_address(&mut self, sensor: usize, address: u8) {
        self.sensors[sensor].address = address;
    }

    /// Number of frames read from the world.
    pub fn frames(&self) -> u64 {
        self.surroundings.frames
    }

    /// Number of times that the ring fired after the last frame of the world; every sensor is absent then.
    pub fn blind_frames(&self) -> u64 {
        self.surroundings.blind_frames
    }

    fn fire(&mut self, who: impl Fn(usize) -> bool) {
        let who = std::array::from_fn(who);
        self.surroundings.fire(who, self.sensors.map(|sensor| sensor.polls_left > 0));
        for (sensor, _) in self.sensors.iter_mut().zip(who).filter(|(_, fires)| *fires) {
            sensor.polls_left = self.ranging_polls;
        }
    }

    fn is_absent(&self, index: usize) -> bool {
        self.sensors[index].fault == Some(SensorFault::Absent) || self.surroundings.is_dead(index)
    }

    /// The sensor with an address; if several share it, one that is present.
    fn index_of(&self, address: u8) -> Option<usize> {
        let mut with_address = (0..SENSORS).filter(|&index| self.sensors[index].address == address);
        let first = with_address.clone().next();
        with_address.find(|&index| !self.is_absent(index)).or(first)
    }
}

impl Sensor {
    fn command(&mut self, command: u8) {
        self.unlocked = match UNLOCKING.get(self.unlocked) {
            None => {
                if command.is_multiple_of(2) && command >= FIRST_ADDRESS << 1 {
                    self.address = command >> 1;
                }
                0
            }
            Some(&next) if command == next => self.unlocked + 1,
            Some(_) => usize::from(command == UNLOCKING[0]),
        };
    }
}

impl<WORLD: FnMut() -> Option<RingFrame<SENSORS>>> I2cDevices for Srf08Bank<WORLD> {
    fn write(&mut self, address: u8, bytes: &[u8]) -> BusAnswer<()> {
        let is_ranging = matches!(bytes, [0, 0x50..=0x52]);
        if address == 0 && !self.is_srf10 {
            if is_ranging {
                self.fire(|_| true);
            }
            let is_over = self.surroundings.is_over();
            return if is_over { BusAnswer::AddressNotAcknowledged } else { BusAnswer::Acknowledged(()) };
        }
        let Some(index) = self.index_of(address) else { return BusAnswer::AddressNotAcknowledged };
        if self.is_srf10 && self.sensors[index].polls_left > 0 {
            self.sensors[index].polls_left -= 1;
            return BusAnswer::AddressNotAcknowledged;
        }
        if is_ranging {
            // The frame begins whether or not this sensor fires in it.
            self.fire(|sensor| sensor == index);
        }
        if self.is_absent(index) {
            return BusAnswer::AddressNotAcknowledged;
        }
        let sensor = &mut self.sensors[index];
        if sensor.fault == Some(SensorFault::RefusesData) {
            return BusAnswer::DataNotAcknowledged;
        }
        if let [0, command] = *bytes {
            sensor.command(command);
        }
        if let Some(&register) = bytes.first() {
            sensor.pointer = register.into();
        }
        BusAnswer::Acknowledged(())
    }

    fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>> {
        let Some(index) = self.index_of(address).filter(|&index| !self.is_absent(index)) else {
            return BusAnswer::AddressNotAcknowledged;
        };
        let sensor = &mut self.sensors[index];
        if sensor.fault == Some(SensorFault::BlocksBus) {
            return BusAnswer::TimedOut;
        }
        if sensor.polls_left > 0 || sensor.fault == Some(SensorFault::NeverDone) {
            sensor.polls_left = sensor.polls_left.saturating_sub(1);
            let keeps_silent = self.is_srf10;
            return if keeps_silent {
                BusAnswer::AddressNotAcknowledged
            } else {
                BusAnswer::Acknowledged(vec![0xFF; count])
            };
        }
        let echo_us = match (sensor.fault, self.surroundings.heard(index)) {
            (Some(SensorFault::Zeros), _) => 0,
            (Some(SensorFault::OutOfRange), _) => u16::MAX,
            (_, Echo::Range { range_mm }) => u16::try_from(flight_us(range_mm)).unwrap_or(u16::MAX),
            (_, Echo::Silence | Echo::Dead) => 0,
        };
        let [high, low] = echo_us.to_be_bytes();
        // The model provides only the first of the SRF08's seventeen echoes.
        let registers = if self.is_srf10 {
            vec![REVISION, 0x80, high, low]
        } else {
            [&[REVISION, 0, high, low][..], &[0; 32]].concat()
        };
        let read = registers.into_iter().chain(std::iter::repeat(0xFF)).skip(sensor.pointer).take(count);
        BusAnswer::Acknowledged(read.collect())
    }
}
