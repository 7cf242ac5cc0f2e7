//! Changing the addresses of new sensors, which all have the same one.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::i2c::{Mock as I2cMock, Transaction};
use toposlam::{
    FaultCounters,
    ring::drivers::{
        AddressError, MaxBotixConfig, MaxBotixRing, SonarRing, Srf08Config, Srf08Ring, change_maxbotix_address,
        change_srf08_address,
    },
};
use toposlam_sim::chip::{I2cBus, MaxBotixBank, SensorFault, SimulatedTime, Srf08Bank};

use crate::{Waited, world, world_frame};

const SILENT: ErrorKind = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);

#[test]
fn sixteen_new_srf08_become_a_ring_when_connected_one_by_one() {
    let mut bus = I2cBus { devices: Srf08Bank::new(world(), 3) };
    for sensor in 0..16 {
        bus.devices.set_address(sensor, 0x70);
        bus.devices.set_fault(sensor, Some(SensorFault::Absent));
    }
    let mut waited = Waited::default();
    // The sensor that keeps the factory address is connected last.
    for sensor in (0..16).rev() {
        bus.devices.set_fault(sensor, None);
        let address = 0x70 + sensor as u8;
        change_srf08_address(&mut bus, &mut &mut waited, 0x70, address).unwrap();
        assert_eq!(bus.devices.address(sensor), address);
    }
    assert_eq!(waited.nanoseconds, 16 * 10_000_000);
    let mut ring = Srf08Ring::<_, _, 16>::new(bus, &mut waited, Srf08Config::DEFAULT).unwrap();
    let mut faults = FaultCounters::new();
    assert_eq!(ring.read(&mut faults), world_frame(0));
    assert_eq!(faults, FaultCounters::new());
}

#[test]
fn new_maxbotix_sensors_become_a_ring_at_other_addresses() {
    let time = SimulatedTime::new(0, 0);
    let mut devices = MaxBotixBank::<_, 16>::new(world(), time.clone());
    for sensor in 0..16 {
        devices.set_address(sensor, 0x70);
        devices.set_fault(sensor, Some(SensorFault::Absent));
    }
    let mut bus = I2cBus { devices };
    for sensor in 0..16 {
        bus.devices.set_fault(sensor, None);
        change_maxbotix_address(&mut bus, &mut time.clone(), 0x70, 0x30 + sensor as u8).unwrap();
        assert_eq!(bus.devices.address(sensor), 0x30 + sensor as u8);
    }
    let config = MaxBotixConfig::DEFAULT.with_first_address(0x30);
    let mut ring = MaxBotixRing::<_, _, 16>::new(bus, time, config).unwrap();
    assert_eq!(ring.read(&mut FaultCounters::new()).dead_sensors().count(), 0);
}

#[test]
fn the_messages_to_an_srf08_are_those_of_the_data_sheet() {
    let expected = [
        Transaction::read(0x79, vec![0; 2]).with_error(SILENT),
        Transaction::write(0x70, vec![0x00, 0xA0]),
        Transaction::write(0x70, vec![0x00, 0xAA]),
        Transaction::write(0x70, vec![0x00, 0xA5]),
        Transaction::write(0x70, vec![0x00, 0xF2]),
        Transaction::read(0x79, vec![0; 2]).with_error(SILENT),
        Transaction::read(0x79, vec![6, 0]),
    ];
    let mut bus = I2cMock::new(&expected);
    change_srf08_address(&mut bus, &mut &mut Waited::default(), 0x70, 0x79).unwrap();
    bus.done();
}

#[test]
fn the_message_to_a_maxbotix_sensor_is_that_of_the_data_sheet() {
    let expected = [
        Transaction::read(0x65, vec![0; 2]).with_error(SILENT),
        Transaction::write(0x70, vec![170, 165, 0xCA]),
        Transaction::read(0x65, vec![0x12, 0x02]),
    ];
    let mut bus = I2cMock::new(&expected);
    change_maxbotix_address(&mut bus, &mut &mut Waited::default(), 0x70, 0x65).unwrap();
    bus.done();
}

#[test]
fn an_invalid_address_sends_nothing() {
    let mut bus = I2cMock::new(&[]);
    let mut waited = Waited::default();
    for wrong in [0x00, 0x6F, 0x80, 0xE0, 0xFF] {
        let outcome = change_srf08_address(&mut bus, &mut &mut waited, wrong, 0x71);
        assert_eq!(outcome, Err(AddressError::From), "from {wrong:#x}");
        let outcome = change_srf08_address(&mut bus, &mut &mut waited, 0x70, wrong);
        assert_eq!(outcome, Err(AddressError::To), "to {wrong:#x}");
    }
    for wrong in [0x00, 0x07, 0x28, 0x52, 0x55, 0x80, 0xFF] {
        let outcome = change_maxbotix_address(&mut bus, &mut &mut waited, wrong, 0x71);
        assert_eq!(outcome, Err(AddressError::From), "from {wrong:#x}");
        let outcome = change_maxbotix_address(&mut bus, &mut &mut waited, 0x70, wrong);
        assert_eq!(outcome, Err(AddressError::To), "to {wrong:#x}");
    }
    assert_eq!(waited.nanoseconds, 0);
    bus.done();
}

#[test]
fn each_bus_failure_has_its_error_and_ends_in_bounded_time() {
    let bank = || I2cBus { devices: Srf08Bank::new(world(), 3) };
    let mut waited = Waited::default();
    assert_eq!(change_srf08_address(&mut bank(), &mut &mut waited, 0x70, 0x71), Err(AddressError::Taken));

    let mut bus = bank();
    for sensor in 0..16 {
        bus.devices.set_fault(sensor, Some(SensorFault::Absent));
    }
    assert_eq!(change_srf08_address(&mut bus, &mut &mut waited, 0x70, 0x71), Err(AddressError::Silent));
    bus.devices.set_fault(1, Some(SensorFault::BlocksBus));
    assert_eq!(change_srf08_address(&mut bus, &mut &mut waited, 0x70, 0x71), Err(AddressError::Bus));
    assert_eq!(waited.nanoseconds, 0);

    // Another device at the address: it acknowledges the messages and keeps its address.
    let mut stubborn: Vec<_> = [vec![0, 0xA0], vec![0, 0xAA], vec![0, 0xA5], vec![0, 0xE2]]
        .into_iter()
        .map(|bytes| Transaction::write(0x70, bytes))
        .collect();
    let absent = Transaction::read(0x71, vec![0; 2]).with_error(SILENT);
    stubborn.insert(0, absent.clone());
    stubborn.extend(std::iter::repeat_n(absent, 20));
    let mut bus = I2cMock::new(&stubborn);
    assert_eq!(change_srf08_address(&mut bus, &mut &mut waited, 0x70, 0x71), Err(AddressError::Unchanged));
    assert_eq!(waited.nanoseconds, 200_000_000);
    bus.done();
}
