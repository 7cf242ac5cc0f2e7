//! Faults between the firmware and its sensors: of each byte on the line to the bridge, and of each transfer on the bus
//! behind it.

use std::fmt;

use super::{Chance, FaultRates};
use crate::chip::{BusAnswer, I2cDevices, Sc18im700};

/// The 7-bit addresses of a bus.
const ADDRESSES: usize = 128;

/// Counts of the injected faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BridgeCounts {
    /// Lost bytes.
    pub dropped_bytes: u64,
    /// Bytes with a flipped bit.
    pub flipped_bits: u64,
    /// Transfers that were not acknowledged.
    pub refused_transfers: u64,
    /// Late answers.
    pub late_answers: u64,
    /// Number of times that the bus got stuck.
    pub stuck_times: u64,
    /// Transfers that failed on the stuck bus.
    pub stuck_transfers: u64,
}

impl fmt::Display for BridgeCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} bytes lost, {} bits flipped, {} transfers refused, {} answers late, bus stuck {} times for {} transfers",
            self.dropped_bytes,
            self.flipped_bits,
            self.refused_transfers,
            self.late_answers,
            self.stuck_times,
            self.stuck_transfers
        )
    }
}

/// The bridge with its devices, and faults on both sides of it.
#[derive(Debug)]
pub struct FaultyBridge<DEVICES> {
    chip: Sc18im700<FaultyDevices<DEVICES>>,
    rates: FaultRates,
    chance: Chance,
    dropped_bytes: u64,
    flipped_bits: u64,
}

impl<DEVICES: I2cDevices> FaultyBridge<DEVICES> {
    /// The bridge after a reset. There are no faults until [`FaultyBridge::set_faulty`].
    pub fn new(devices: DEVICES, rates: FaultRates, seed: u64) -> Self {
        let devices = FaultyDevices {
            devices,
            rates,
            chance: Chance::new(seed, 2),
            is_faulty: false,
            polls_left: [0; ADDRESSES],
            stuck_left: 0,
            counts: BridgeCounts::default(),
        };
        let chance = Chance::new(seed, 3);
        Self { chip: Sc18im700::new(devices), rates, chance, dropped_bytes: 0, flipped_bits: 0 }
    }

    /// Enables or disables the faults.
    pub fn set_faulty(&mut self, is_faulty: bool) {
        self.chip.devices.is_faulty = is_faulty;
    }

    /// The devices behind the bridge.
    pub const fn devices(&self) -> &DEVICES {
        &self.chip.devices.devices
    }

    /// Takes one byte from the UART and returns the part of the chip's answer that arrives.
    pub fn byte(&mut self, byte: u8) -> Vec<u8> {
        if !self.chip.devices.is_faulty {
            return self.chip.byte(byte);
        }
        let answer = self.hurt(byte).map(|byte| self.chip.byte(byte)).unwrap_or_default();
        answer.into_iter().filter_map(|byte| self.hurt(byte)).collect()
    }

    fn hurt(&mut self, byte: u8) -> Option<u8> {
        let (dropped, flipped) = (self.rates.bridge_byte_dropped, self.rates.bridge_bit_flipped);
        self.chance.hurt(byte, dropped, flipped, (&mut self.dropped_bytes, &mut self.flipped_bits))
    }

    /// Counts of the faults so far.
    pub const fn counts(&self) -> BridgeCounts {
        let Self { dropped_bytes, flipped_bits, .. } = *self;
        BridgeCounts { dropped_bytes, flipped_bits, ..self.chip.devices.counts }
    }
}

/// Devices on a bus with random faults.
#[derive(Debug)]
struct FaultyDevices<DEVICES> {
    devices: DEVICES,
    rates: FaultRates,
    chance: Chance,
    is_faulty: bool,
    /// Number of polls for which the device at each address still reads as ranging.
    polls_left: [u32; ADDRESSES],
    stuck_left: u32,
    counts: BridgeCounts,
}

impl<DEVICES> FaultyDevices<DEVICES> {
    /// The answer of a fault, in place of the answer of the device, if a fault occurs.
    fn fault<DATA>(&mut self) -> Option<BusAnswer<DATA>> {
        if !self.is_faulty {
            return None;
        }
        if self.stuck_left == 0 && self.chance.happens(self.rates.transfers_stuck) {
            self.stuck_left = self.chance.within(1, FaultRates::STUCK_TRANSFERS);
            self.counts.stuck_times += 1;
        }
        if self.stuck_left > 0 {
            self.stuck_left -= 1;
            self.counts.stuck_transfers += 1;
            return Some(BusAnswer::TimedOut);
        }
        self.chance.happens(self.rates.transfer_refused).then(|| {
            self.counts.refused_transfers += 1;
            BusAnswer::AddressNotAcknowledged
        })
    }

    /// Whether the device still reads as ranging.
    fn is_late(&mut self, address: u8) -> bool {
        let Some(polls_left) = self.polls_left.get_mut(usize::from(address)).filter(|_| self.is_faulty) else {
            return false;
        };
        if *polls_left > 0 {
            *polls_left -= 1;
            return true;
        }
        let is_late = self.chance.happens(self.rates.answer_late);
        if is_late {
            *polls_left = self.chance.within(1, FaultRates::LATE_POLLS) - 1;
            self.counts.late_answers += 1;
        }
        is_late
    }
}

impl<DEVICES: I2cDevices> I2cDevices for FaultyDevices<DEVICES> {
    /// The device receives the write even when its acknowledgement is lost: the ranging starts, and with it the next
    /// frame of the world.
    fn write(&mut self, address: u8, bytes: &[u8]) -> BusAnswer<()> {
        let answer = self.devices.write(address, bytes);
        self.fault().unwrap_or(answer)
    }

    fn read(&mut self, address: u8, count: usize) -> BusAnswer<Vec<u8>> {
        if let Some(fault) = self.fault() {
            return fault;
        }
        if self.is_late(address) {
            return BusAnswer::Acknowledged(vec![0xFF; count]);
        }
        self.devices.read(address, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device at every address that answers 7.
    struct Seven;

    impl I2cDevices for Seven {
        fn write(&mut self, _address: u8, _bytes: &[u8]) -> BusAnswer<()> {
            BusAnswer::Acknowledged(())
        }

        fn read(&mut self, _address: u8, count: usize) -> BusAnswer<Vec<u8>> {
            BusAnswer::Acknowledged(vec![7; count])
        }
    }

    /// Reads a byte of a device and the status of the bus, `times` times.
    fn answers(bridge: &mut FaultyBridge<Seven>, times: usize) -> Vec<Vec<u8>> {
        (0..times).map(|_| b"S\xE1\x01PR\x0AP".iter().flat_map(|&byte| bridge.byte(byte)).collect()).collect()
    }

    #[test]
    fn a_bridge_is_transparent_before_faults_are_enabled_and_at_zero_rates() {
        let mut bridge = FaultyBridge::new(Seven, FaultRates::scaled(1.0), 1);
        assert!(answers(&mut bridge, 100).iter().all(|answer| answer == &[7, 0xF0]));
        let mut bridge = FaultyBridge::new(Seven, FaultRates::NONE, 1);
        bridge.set_faulty(true);
        assert!(answers(&mut bridge, 100).iter().all(|answer| answer == &[7, 0xF0]));
        assert_eq!(bridge.counts(), BridgeCounts::default());
    }

    #[test]
    fn failed_transfers_set_the_status_and_are_counted() {
        let rates = FaultRates { transfer_refused: 0.1, transfers_stuck: 0.01, ..FaultRates::NONE };
        let mut bridge = FaultyBridge::new(Seven, rates, 1);
        bridge.set_faulty(true);
        let answers = answers(&mut bridge, 1000);
        let with = |status: u8| answers.iter().filter(|answer| **answer == [status]).count() as u64;
        let counts = bridge.counts();
        assert!(counts.refused_transfers > 0 && counts.stuck_transfers > 0);
        assert_eq!((with(0xF1), with(0xF8)), (counts.refused_transfers, counts.stuck_transfers));
    }

    #[test]
    fn a_late_device_reads_as_ranging_and_then_answers() {
        let mut bridge = FaultyBridge::new(Seven, FaultRates { answer_late: 0.1, ..FaultRates::NONE }, 1);
        bridge.set_faulty(true);
        let answers = answers(&mut bridge, 1000);
        assert!(answers.iter().all(|answer| *answer == [7, 0xF0] || *answer == [0xFF, 0xF0]));
        assert!(answers.contains(&vec![0xFF, 0xF0]) && bridge.counts().late_answers > 0);
    }

    #[test]
    fn lost_and_corrupted_bytes_are_counted() {
        let rates = FaultRates { bridge_byte_dropped: 0.01, bridge_bit_flipped: 0.01, ..FaultRates::NONE };
        let mut bridge = FaultyBridge::new(Seven, rates, 1);
        bridge.set_faulty(true);
        let hurt = answers(&mut bridge, 1000).iter().filter(|answer| **answer != [7, 0xF0]).count();
        let counts = bridge.counts();
        assert!(hurt > 0 && counts.dropped_bytes > 0 && counts.flipped_bits > 0);
    }
}
