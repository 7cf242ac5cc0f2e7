//! A model of a bank of MaxBotix I2CXL-MaxSonar rangers in a world of ring frames.

use toposlam::ring::{Echo, RingFrame};

use super::{BusAnswer, I2cDevices, SensorFault, SimulatedTime, surroundings::Surroundings};

const FIRST_ADDRESS: u8 = 0x70;
const TAKE_A_RANGE: u8 = 81;
/// Duration of a ranging at full range, somewhat less than the recommended 80 ms before a read.
const RANGING_NS: u64 = 78_000_000;
const PART_INFORMATION: u16 = 0x1202;
const NEAREST_CM: u16 = 20;
const NOTHING_HEARD_CM: u16 = 765;

/// Rangers on a bus with simulated time, initially at addresses from 0x70 on. The world is a source of ring frames: a
/// new frame begins when a ranger fires that has already fired in the current one.
#[derive(Debug)]
pub struct MaxBotixBank<WORLD, const SONARS: usize> {
    surroundings: Surroundings<WORLD, SONARS>,
    time: SimulatedTime,
    sensors: [Sensor; SONARS],
}

#[derive(Clone, Copy, Debug)]
struct Sensor {
    fault: Option<SensorFault>,
    address: u8,
    /// When its latest ranging ends.
    done_ns: Option<u64>,
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> MaxBotixBank<WORLD, SONARS> {
    /// A bank of rangers in a world.
    pub fn new(world: WORLD, time: SimulatedTime) -> Self {
        let sensors =
            std::array::from_fn(|index| Sensor { fault: None, address: FIRST_ADDRESS + index as u8, done_ns: None });
        Self { surroundings: Surroundings::new(world), time, sensors }
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

    fn is_ranging(&self, index: usize) -> bool {
        let Sensor { fault, done_ns, .. } = self.sensors[index];
        done_ns.is_some_and(|done_ns| fault == Some(SensorFault::NeverDone) || self.time.now_ns() < done_ns)
    }

    fn is_absent(&self, index: usize) -> bool {
        self.sensors[index].fault == Some(SensorFault::Absent) || self.surroundings.is_dead(index)
    }

    /// The sensor with an address; if several share it, one that is present.
    fn index_of(&self, address: u8) -> Option<usize> {
        let mut with_address = (0..SONARS).filter(|&index| self.sensors[index].address == address);
        let first = with_address.clone().next();
        with_address.find(|&index| !self.is_absent(index)).or(first)
    }
}

/// The range that a sensor reports for an echo, in centimetres.
fn range_cm(heard: Echo) -> u16 {
    match heard {
        Echo::Range { range_mm } => ((range_mm + 5) / 10).clamp(NEAREST_CM, NOTHING_HEARD_CM),
        Echo::Silence | Echo::Dead => NOTHING_HEARD_CM,
    }
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> I2cDevices for MaxBotixBank<WORLD, SONARS> {
    fn write(&mut self, address: u8, bytes: &[u8]) -> BusAnswer<()> {
        let Some(index) = self.index_of(address) else { return BusAnswer::AddressNotAcknowledged };
        if self.is_ranging(index) {
            return BusAnswer::AddressNotAcknowledged;
        }
        if *bytes == [TAKE_A_RANGE] {
            // The frame begins whether or not this sensor fires in it.
            let listening = std::array::from_fn(|sensor| self.is_ranging(sensor));
            self.surroundings.fire(std::array::from_fn(|sensor| sensor == index), listening);
        }
        if self.is_absent(index) {
            return BusAnswer::AddressNotAcknowledged;
        }
        let now_ns = self.time.now_ns();
        let sensor = &mut self.sensors[index];
        if sensor.fault == Some(SensorFault::RefusesData) {
            return BusAnswer::DataNotAcknowledged;
        }
        match *bytes {
            [TAKE_A_RANGE] => sensor.done_ns = Some(now_ns + RANGING_NS),
            [170, 165, new] if !matches!(new & !1, 0 | 80 | 164 | 170) => sensor.address = new >> 1,
            _ => {}
        }
        BusAnswer::Acknowledged(())
    }

    fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>> {
        let here = self.index_of(address).filter(|&index| !self.is_absent(index) && !self.is_ranging(index));
        let Some(index) = here else { return BusAnswer::AddressNotAcknowledged };
        let sensor = &self.sensors[index];
        let word = match (sensor.fault, sensor.done_ns) {
            (Some(SensorFault::BlocksBus), _) => return BusAnswer::TimedOut,
            (_, None) => PART_INFORMATION,
            (Some(SensorFault::Zeros), _) => 0,
            (Some(SensorFault::OutOfRange), _) => u16::MAX,
            _ => range_cm(self.surroundings.heard(index)),
        };
        BusAnswer::Acknowledged(word.to_be_bytes().into_iter().chain(std::iter::repeat(0xFF)).take(count).collect())
    }
}
