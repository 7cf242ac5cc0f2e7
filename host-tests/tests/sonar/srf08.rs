//! The ring of SRF08, on the bridge and on an I2C bus.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::i2c::{Mock as I2cMock, Transaction};
use toposlam::{
    FaultCounters, FaultKind,
    ring::drivers::{FiringPlan, Sc18im700, SonarError, SonarFault, SonarRing, Srf08Config, Srf08Ring},
    ring::{Echo, RingFrame},
};
use toposlam_sim::chip::{self, SensorFault, Srf08Bank};

use crate::{Waited, World, assert_counted, link::Link, world, world_frame};

type Ring<'a> = Srf08Ring<Sc18im700<Link<Srf08Bank<World>>>, &'a mut Waited, 16>;

fn ring(
    world: impl FnMut() -> Option<RingFrame<16>> + 'static,
    config: Srf08Config<16>,
    waited: &mut Waited,
) -> Ring<'_> {
    ring_with_fault(world, config, waited, None)
}

fn ring_with_fault(
    world: impl FnMut() -> Option<RingFrame<16>> + 'static,
    config: Srf08Config<16>,
    waited: &mut Waited,
    fault: Option<(usize, SensorFault)>,
) -> Ring<'_> {
    let mut bank = Srf08Bank::new(Box::new(world) as World, 3);
    if let Some((sensor, fault)) = fault {
        bank.set_fault(sensor, Some(fault));
    }
    let mut bridge = Sc18im700::new(Link::to(chip::Sc18im700::new(bank)), 100);
    bridge.start().unwrap();
    Srf08Ring::new(bridge, waited, config).unwrap()
}

#[test]
fn the_ring_measures_the_world_in_one_group_or_several() {
    for firing_groups in [1, 2, 3, 4, 16] {
        let mut waited = Waited::default();
        let config = Srf08Config::DEFAULT.with_plan(FiringPlan::interleaved(firing_groups));
        let mut ring = ring(world(), config, &mut waited);
        let mut faults = FaultCounters::new();
        for number in 0..50 {
            assert_eq!(ring.read(&mut faults), world_frame(number), "frame {number} in {firing_groups} groups");
            assert_eq!(ring.last_error(), None);
        }
        assert_eq!(faults, FaultCounters::new());
        // Three polls find the sensor busy, the fourth returns the range.
        assert_eq!(waited.nanoseconds, 50 * u64::from(firing_groups) * 4 * 2_000_000);
    }
}

#[test]
fn a_faulty_sensor_is_dead_and_counted_and_the_others_are_read() {
    let cases = [
        (SensorFault::Absent, Echo::Dead, Some(SonarFault::Silent)),
        (SensorFault::NeverDone, Echo::Dead, Some(SonarFault::Silent)),
        (SensorFault::RefusesData, Echo::Dead, Some(SonarFault::Silent)),
        (SensorFault::OutOfRange, Echo::Dead, Some(SonarFault::OutOfRange)),
        (SensorFault::BlocksBus, Echo::Dead, Some(SonarFault::Bus)),
        (SensorFault::Zeros, Echo::Silence, None),
    ];
    for firing_groups in [1, 2] {
        for sensor in [0_u8, 7, 15] {
            for (defect, echo, fault) in cases {
                let mut waited = Waited::default();
                let config = Srf08Config::DEFAULT.with_plan(FiringPlan::interleaved(firing_groups));
                let mut ring = ring_with_fault(world(), config, &mut waited, Some((sensor.into(), defect)));
                let mut faults = FaultCounters::new();
                for number in 0..2 {
                    let mut expected = world_frame(number);
                    expected.echoes[usize::from(sensor)] = echo;
                    assert_eq!(ring.read(&mut faults), expected, "{defect:?} of sensor {sensor}");
                    assert_eq!(ring.last_error(), fault.map(|fault| SonarError { sensor, fault }));
                }
                assert_counted(&faults, fault, 2);
            }
        }
    }
}

#[test]
fn a_sensor_that_never_finishes_takes_at_most_the_timeout() {
    let mut waited = Waited::default();
    let plan = FiringPlan::together();
    let config = Srf08Config::DEFAULT.with_plan(plan).with_timeout_ms(100).with_poll_interval_us(3000);
    let mut ring = ring_with_fault(world(), config, &mut waited, Some((4, SensorFault::NeverDone)));
    ring.read(&mut FaultCounters::new());
    assert_eq!(waited.nanoseconds, 33 * 3_000_000);
}

#[test]
fn with_the_bridge_disconnected_every_sensor_is_dead_and_a_repaired_line_works_again() {
    let mut waited = Waited::default();
    let mut ring = ring(world(), Srf08Config::DEFAULT, &mut waited);
    let mut faults = FaultCounters::new();
    assert_eq!(ring.read(&mut faults), world_frame(0));
    let (mut bridge, waited) = ring.release();
    let mut link = bridge.release();
    link.cut = true;
    let mut ring = Srf08Ring::new(Sc18im700::new(link, 100), waited, Srf08Config::DEFAULT).unwrap();
    assert_eq!(ring.read(&mut faults), RingFrame { echoes: [Echo::Dead; 16] });
    assert_eq!(faults.count(FaultKind::BusError), 16);
    let (cut, waited) = ring.release();
    bridge = Sc18im700::new(Link { cut: false, ..cut.release() }, 100);
    bridge.start().unwrap();
    let mut ring = Srf08Ring::new(bridge, waited, Srf08Config::DEFAULT).unwrap();
    assert_eq!(ring.read(&mut faults), world_frame(1));
    assert_eq!(faults.count(FaultKind::BusError), 16);
}

#[test]
fn after_the_last_frame_of_the_world_all_sensors_are_dead_and_the_ring_does_not_hang() {
    let mut waited = Waited::default();
    let mut frames = [world_frame(0)].into_iter();
    let mut ring = ring(move || frames.next(), Srf08Config::DEFAULT, &mut waited);
    let mut faults = FaultCounters::new();
    ring.read(&mut faults);
    assert_eq!(ring.read(&mut faults), RingFrame { echoes: [Echo::Dead; 16] });
    assert_eq!(faults.count(FaultKind::SonarSilent), 16);
}

#[test]
fn the_messages_are_those_of_the_data_sheet() {
    let nack = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    // The round trip of 1000 mm at 343 m/s takes 5831 us; that of 2000 mm takes 11,662 us.
    let expected = [
        Transaction::write(0x70, vec![0x00, 0x52]),
        Transaction::write(0x72, vec![0x00, 0x52]),
        Transaction::write_read(0x70, vec![0x00], vec![0xFF; 4]),
        Transaction::write_read(0x72, vec![0x00], vec![0xFF; 4]).with_error(nack),
        Transaction::write_read(0x70, vec![0x00], vec![0x06, 0x80, 0x16, 0xC7]),
        Transaction::write_read(0x72, vec![0x00], vec![0x06, 0x80, 0x00, 0x00]),
        Transaction::write(0x71, vec![0x00, 0x52]),
        Transaction::write(0x73, vec![0x00, 0x52]).with_error(nack),
        Transaction::write_read(0x71, vec![0x00], vec![0x06, 0x80, 0x2D, 0x8E]),
    ];
    let mut waited = Waited::default();
    let mut ring = Srf08Ring::<_, _, 4>::new(I2cMock::new(&expected), &mut waited, Srf08Config::DEFAULT).unwrap();
    let mut faults = FaultCounters::new();
    let frame = ring.read(&mut faults);
    let echoes = [Echo::Range { range_mm: 1000 }, Echo::Range { range_mm: 2000 }, Echo::Silence, Echo::Dead];
    assert_eq!(frame, RingFrame { echoes });
    assert_counted(&faults, Some(SonarFault::Silent), 1);
    ring.release().0.done();
}

#[test]
fn a_single_group_starts_with_one_message_to_the_general_call_address() {
    let expected = [
        Transaction::write(0x00, vec![0x00, 0x52]),
        Transaction::write_read(0x70, vec![0x00], vec![0x06, 0x80, 0x16, 0xC7]),
        Transaction::write_read(0x71, vec![0x00], vec![0x06, 0x80, 0xFF, 0xFF]),
    ];
    let config = Srf08Config::DEFAULT.with_plan(FiringPlan::together());
    let mut waited = Waited::default();
    let mut ring = Srf08Ring::<_, _, 2>::new(I2cMock::new(&expected), &mut waited, config).unwrap();
    let mut faults = FaultCounters::new();
    assert_eq!(ring.read(&mut faults).echoes, [Echo::Range { range_mm: 1000 }, Echo::Dead]);
    assert_eq!(ring.last_error(), Some(SonarError { sensor: 1, fault: SonarFault::OutOfRange }));
    ring.release().0.done();
}
