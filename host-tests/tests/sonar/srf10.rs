//! The rings of SRF10 and SRF02: the driver of the SRF08, and sensors that do not acknowledge while they measure.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::i2c::{Mock as I2cMock, Transaction};
use toposlam::{
    FaultCounters,
    ring::Echo,
    ring::drivers::{FiringPlan, SonarError, SonarFault, SonarRing, Srf08Config, Srf08Ring},
};
use toposlam_sim::chip::{I2cBus, SensorFault, Srf08Bank};

use crate::{Waited, World, assert_counted, without, world, world_frame};

#[test]
fn sensors_that_do_not_acknowledge_while_they_measure_are_read_with_any_plan() {
    for groups in [1, 2, 3, 16] {
        let config = Srf08Config::SRF10.with_plan(FiringPlan::interleaved(groups));
        let mut waited = Waited::default();
        let bus = I2cBus { devices: Srf08Bank::srf10(world(), 3) };
        let mut ring = Srf08Ring::<_, _, 16>::new(bus, &mut waited, config).unwrap();
        let mut faults = FaultCounters::new();
        for number in 0..5 {
            assert_eq!(ring.read(&mut faults), world_frame(number), "frame {number} in {groups} groups");
        }
        assert_eq!(faults, FaultCounters::new());
    }
}

#[test]
fn a_sensor_that_never_acknowledges_is_dead_after_the_timeout_and_the_others_are_read() {
    for defect in [SensorFault::Absent, SensorFault::NeverDone] {
        let mut devices = Srf08Bank::srf10(Box::new(world()) as World, 3);
        devices.set_fault(9, Some(defect));
        let mut waited = Waited::default();
        let mut ring = Srf08Ring::new(I2cBus { devices }, &mut waited, Srf08Config::SRF10).unwrap();
        let mut faults = FaultCounters::new();
        for number in 0..3 {
            assert_eq!(ring.read(&mut faults), without(world_frame(number), |sensor| sensor == 9), "{defect:?}");
            assert_eq!(ring.last_error(), Some(SonarError { sensor: 9, fault: SonarFault::Silent }));
        }
        assert_counted(&faults, Some(SonarFault::Silent), 3);
        assert!(waited.nanoseconds <= 3 * 2 * 100_000_000);
    }
}

#[test]
fn a_single_group_starts_each_sensor_at_its_own_address() {
    let silent = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    // Register 1 of the SRF10 is unused and reads 0x80.
    let expected = [
        Transaction::write(0x70, vec![0x00, 0x52]),
        Transaction::write(0x71, vec![0x00, 0x52]),
        Transaction::write_read(0x70, vec![0x00], vec![0xFF; 4]).with_error(silent),
        Transaction::write_read(0x71, vec![0x00], vec![0x05, 0x80, 0x16, 0xC7]),
        Transaction::write_read(0x70, vec![0x00], vec![0x05, 0x80, 0x00, 0x00]),
    ];
    let config = Srf08Config::SRF10.with_plan(FiringPlan::together());
    let mut waited = Waited::default();
    let mut ring = Srf08Ring::<_, _, 2>::new(I2cMock::new(&expected), &mut waited, config).unwrap();
    assert_eq!(ring.read(&mut FaultCounters::new()).echoes, [Echo::Silence, Echo::Range { range_mm: 1000 }]);
    ring.release().0.done();
}

#[test]
fn the_srf02_is_read_as_the_srf10_from_150_mm_on() {
    // The round trip of 150 mm at 343 m/s takes 875 us; that of 149 mm takes 869 us.
    let expected = [
        Transaction::write(0x70, vec![0x00, 0x52]),
        Transaction::write(0x71, vec![0x00, 0x52]),
        Transaction::write_read(0x70, vec![0x00], vec![0x05, 0x80, 0x03, 0x6B]),
        Transaction::write_read(0x71, vec![0x00], vec![0x05, 0x80, 0x03, 0x65]),
    ];
    let config = Srf08Config::SRF02.with_plan(FiringPlan::together());
    let mut waited = Waited::default();
    let mut ring = Srf08Ring::<_, _, 2>::new(I2cMock::new(&expected), &mut waited, config).unwrap();
    assert_eq!(ring.read(&mut FaultCounters::new()).echoes, [Echo::Range { range_mm: 150 }, Echo::Dead]);
    assert_eq!(ring.last_error(), Some(SonarError { sensor: 1, fault: SonarFault::OutOfRange }));
    ring.release().0.done();
}
