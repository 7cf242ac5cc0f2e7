//! The ring of VL53L1X: the start through the XSHUT inputs, and measurements that repeat by themselves.

use toposlam::{
    FaultCounters,
    ring::drivers::{FiringPlan, SonarError, SonarFault, SonarRing, Vl53l1xBudget, Vl53l1xConfig, Vl53l1xRing},
    ring::{Echo, RingFrame},
};
use toposlam_sim::chip::{I2cBus, SensorFault, SimulatedTime, Vl53l1xBank, Xshut};

use crate::{World, assert_counted, without, world, world_frame};

type Ring = Vl53l1xRing<I2cBus<Vl53l1xBank<World, 16>>, SimulatedTime, 16>;

/// A ring that is not started, and its XSHUT inputs.
fn ring(config: Vl53l1xConfig<16>, time: &SimulatedTime, faults: &[(usize, SensorFault)]) -> (Ring, [Xshut<16>; 16]) {
    let mut devices = Vl53l1xBank::new(Box::new(world()) as World, time.clone());
    for &(sensor, fault) in faults {
        devices.set_fault(sensor, Some(fault));
    }
    let xshut = devices.xshut();
    (Vl53l1xRing::new(I2cBus { devices }, time.clone(), config).unwrap(), xshut)
}

/// A frame as these sensors measure it: from 40 mm to 4 m.
fn in_limits(mut frame: RingFrame<16>) -> RingFrame<16> {
    for echo in &mut frame.echoes {
        match echo.range_mm() {
            Some(0..40) => *echo = Echo::Dead,
            Some(4001..) => *echo = Echo::Silence,
            _ => {}
        }
    }
    frame
}

#[test]
fn the_started_ring_measures_the_world_with_any_budget_and_plan() {
    for budget in [Vl53l1xBudget::Ms33, Vl53l1xBudget::Ms50, Vl53l1xBudget::Ms100, Vl53l1xBudget::Ms200] {
        for groups in [1, 2] {
            let config = Vl53l1xConfig::DEFAULT.with_budget(budget).with_timeout_ms(500);
            let time = SimulatedTime::new(0, 0);
            let (mut ring, mut xshut) = ring(config.with_plan(FiringPlan::interleaved(groups)), &time, &[]);
            assert_eq!(ring.start(&mut xshut), [Ok(()); 16]);
            let start_ns = time.now_ns();
            for number in 0..20 {
                let frame = ring.read(&mut FaultCounters::new());
                assert_eq!(frame, in_limits(world_frame(number)), "frame {number} with {budget:?} in {groups} groups");
            }
            // One period of each group, to the next poll.
            let frame_ms = u64::from(groups) * u64::from(budget.ms() + 10);
            assert!(time.now_ns() - start_ns <= 20 * frame_ms * 1_000_000, "{} ns", time.now_ns() - start_ns);
        }
    }
}

#[test]
fn each_sensor_gets_its_own_address_one_after_the_other_and_the_start_can_be_repeated() {
    let time = SimulatedTime::new(0, 0);
    let (mut ring, mut xshut) = ring(Vl53l1xConfig::DEFAULT.with_first_address(0x40), &time, &[]);
    for _ in 0..2 {
        let start_ns = time.now_ns();
        assert_eq!(ring.start(&mut xshut), [Ok(()); 16]);
        // The calibration takes one measurement with the default settings.
        assert!(time.now_ns() - start_ns <= 16 * 600_000_000);
        assert_eq!(ring.read(&mut FaultCounters::new()).dead_sensors().count(), 1);
    }
    let bus = ring.release().0;
    assert!((0..16).all(|sensor| usize::from(bus.devices.address(sensor)) == 0x40 + sensor));
}

#[test]
fn a_sensor_that_does_not_start_stays_in_reset_and_the_others_are_read() {
    let cases = [
        (SensorFault::Absent, SonarFault::Silent),
        (SensorFault::NeverDone, SonarFault::Silent),
        (SensorFault::Zeros, SonarFault::Silent),
        (SensorFault::RefusesData, SonarFault::Silent),
        (SensorFault::BlocksBus, SonarFault::Bus),
    ];
    for sensor in [1_u8, 7, 15] {
        for (defect, fault) in cases {
            let time = SimulatedTime::new(0, 0);
            let (mut ring, mut xshut) = ring(Vl53l1xConfig::DEFAULT, &time, &[(sensor.into(), defect)]);
            let mut expected = [Ok(()); 16];
            expected[usize::from(sensor)] = Err(fault);
            assert_eq!(ring.start(&mut xshut), expected, "{defect:?}");
            let mut faults = FaultCounters::new();
            let frame = without(in_limits(world_frame(1)), |dead| dead == usize::from(sensor));
            ring.read(&mut faults);
            assert_eq!(ring.read(&mut faults), frame, "{defect:?} of sensor {sensor}");
            assert_eq!(ring.last_error(), Some(SonarError { sensor, fault: SonarFault::Silent }));
        }
    }
}

#[test]
fn a_sensor_that_fails_later_is_dead_and_counted_within_the_timeout() {
    let cases = [
        (SensorFault::Absent, SonarFault::Silent),
        (SensorFault::NeverDone, SonarFault::Silent),
        (SensorFault::RefusesData, SonarFault::Silent),
        (SensorFault::Zeros, SonarFault::Silent),
        (SensorFault::OutOfRange, SonarFault::OutOfRange),
        (SensorFault::BlocksBus, SonarFault::Bus),
    ];
    for (defect, fault) in cases {
        let time = SimulatedTime::new(0, 0);
        let (mut ring, mut xshut) = ring(Vl53l1xConfig::DEFAULT, &time, &[]);
        assert_eq!(ring.start(&mut xshut), [Ok(()); 16]);
        // Sensor 0 is too near in the first two frames.
        ring.read(&mut FaultCounters::new());
        ring.read(&mut FaultCounters::new());
        let (mut bus, delay) = ring.release();
        bus.devices.set_fault(3, Some(defect));
        let mut ring = Vl53l1xRing::<_, _, 16>::new(bus, delay, Vl53l1xConfig::DEFAULT).unwrap();
        let (mut faults, start_ns) = (FaultCounters::new(), time.now_ns());
        for number in 2..4 {
            let expected = without(in_limits(world_frame(number)), |dead| dead == 3);
            assert_eq!(ring.read(&mut faults), expected, "{defect:?}");
            assert_eq!(ring.last_error(), Some(SonarError { sensor: 3, fault }), "{defect:?}");
        }
        assert!(time.now_ns() - start_ns <= 2 * 300_000_000);
        assert_counted(&faults, Some(fault), 2);
    }
}

#[test]
fn a_sensor_without_supply_for_a_moment_is_dead_until_the_ring_is_started_again() {
    let time = SimulatedTime::new(0, 0);
    let (mut ring, mut xshut) = ring(Vl53l1xConfig::DEFAULT, &time, &[]);
    assert_eq!(ring.start(&mut xshut), [Ok(()); 16]);
    ring.read(&mut FaultCounters::new());
    ring.read(&mut FaultCounters::new());
    let (mut bus, delay) = ring.release();
    bus.devices.interrupt_supply(9);
    let mut ring = Vl53l1xRing::<_, _, 16>::new(bus, delay, Vl53l1xConfig::DEFAULT).unwrap();
    assert!(ring.read(&mut FaultCounters::new()).dead_sensors().eq([9]));
    assert_eq!(ring.start(&mut xshut), [Ok(()); 16]);
    assert_eq!(ring.read(&mut FaultCounters::new()).dead_sensors().count(), 0);
}
