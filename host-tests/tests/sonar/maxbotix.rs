//! The ring of MaxBotix I2CXL-MaxSonar.

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::{
    delay::{CheckedDelay, Transaction as Wait},
    i2c::{Mock as I2cMock, Transaction},
};
use toposlam::{
    FaultCounters,
    ring::drivers::{FiringPlan, MaxBotixConfig, MaxBotixRing, SonarError, SonarFault, SonarRing},
    ring::{Echo, RingFrame},
};
use toposlam_sim::chip::{I2cBus, MaxBotixBank, SensorFault, SimulatedTime};

use crate::{World, assert_counted, without, world, world_frame};

/// A frame as these sensors measure it: in whole centimetres, from 20.
fn in_centimetres(mut frame: RingFrame<16>) -> RingFrame<16> {
    for echo in &mut frame.echoes {
        if let Echo::Range { range_mm } = echo {
            *range_mm = ((*range_mm + 5) / 10).max(20) * 10;
        }
    }
    frame
}

fn ring(
    config: MaxBotixConfig<16>,
    time: &SimulatedTime,
    faults: &[(usize, SensorFault)],
) -> MaxBotixRing<I2cBus<MaxBotixBank<World, 16>>, SimulatedTime, 16> {
    let mut devices = MaxBotixBank::new(Box::new(world()) as World, time.clone());
    for &(sensor, fault) in faults {
        devices.set_fault(sensor, Some(fault));
    }
    MaxBotixRing::new(I2cBus { devices }, time.clone(), config).unwrap()
}

#[test]
fn the_ring_measures_in_centimetres_and_takes_100_ms_for_each_group() {
    for groups in [1, 2, 4] {
        let time = SimulatedTime::new(0, 0);
        let config = MaxBotixConfig::DEFAULT.with_plan(FiringPlan::interleaved(groups));
        let mut ring = ring(config, &time, &[]);
        let mut faults = FaultCounters::new();
        for number in 0..50 {
            assert_eq!(
                ring.read(&mut faults),
                in_centimetres(world_frame(number)),
                "frame {number} in {groups} groups"
            );
        }
        assert_eq!(faults, FaultCounters::new());
        assert_eq!(time.now_ns(), 50 * u64::from(groups) * 100_000_000);
    }
}

#[test]
fn a_faulty_sensor_is_dead_and_counted_and_does_not_lengthen_the_frame() {
    let cases = [
        (SensorFault::Absent, SonarFault::Silent),
        (SensorFault::NeverDone, SonarFault::Silent),
        (SensorFault::RefusesData, SonarFault::Silent),
        (SensorFault::Zeros, SonarFault::OutOfRange),
        (SensorFault::OutOfRange, SonarFault::OutOfRange),
        (SensorFault::BlocksBus, SonarFault::Bus),
    ];
    for sensor in [0_u8, 7, 15] {
        for (defect, fault) in cases {
            let time = SimulatedTime::new(0, 0);
            let mut ring = ring(MaxBotixConfig::DEFAULT, &time, &[(sensor.into(), defect)]);
            let mut faults = FaultCounters::new();
            for number in 0..3 {
                let expected = without(in_centimetres(world_frame(number)), |dead| dead == usize::from(sensor));
                assert_eq!(ring.read(&mut faults), expected, "{defect:?} of sensor {sensor}");
                assert_eq!(ring.last_error(), Some(SonarError { sensor, fault }));
            }
            assert_counted(&faults, Some(fault), 3);
            assert_eq!(time.now_ns(), 3 * 2 * 100_000_000);
        }
    }
}

#[test]
fn the_messages_and_their_times_are_those_of_the_data_sheet() {
    let silent = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    // 0x0123 is 291 cm; 0x02FD is 765, no echo.
    let expected = [
        Transaction::write(0x70, vec![81]),
        Transaction::write(0x72, vec![81]),
        Transaction::read(0x70, vec![0x01, 0x23]),
        Transaction::read(0x72, vec![0x00, 0x00]).with_error(silent),
        Transaction::read(0x72, vec![0x02, 0xFD]),
        Transaction::write(0x71, vec![81]).with_error(silent),
        Transaction::write(0x73, vec![81]),
        Transaction::read(0x73, vec![0x00, 0x13]),
    ];
    let waits = [
        Wait::delay_us(80_000),
        Wait::delay_us(2000),
        Wait::delay_us(18_000),
        Wait::delay_us(80_000),
        Wait::delay_us(20_000),
    ];
    let (bus, delay) = (I2cMock::new(&expected), CheckedDelay::new(&waits));
    let mut ring = MaxBotixRing::<_, _, 4>::new(bus, delay, MaxBotixConfig::DEFAULT).unwrap();
    let mut faults = FaultCounters::new();
    let frame = ring.read(&mut faults);
    assert_eq!(frame.echoes, [Echo::Range { range_mm: 2910 }, Echo::Dead, Echo::Silence, Echo::Dead]);
    assert!(frame.dead_sensors().eq([1, 3]));
    assert_eq!(ring.last_error(), Some(SonarError { sensor: 3, fault: SonarFault::OutOfRange }));
    let (mut bus, mut delay) = ring.release();
    bus.done();
    delay.done();
}
