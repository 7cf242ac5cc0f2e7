//! The ring of HC-SR04.

use std::collections::VecDeque;

use embedded_hal_mock::eh1::{
    delay::{CheckedDelay, Transaction as Wait},
    digital::{Mock as PinMock, State, Transaction as Pin},
};
use toposlam::{
    FaultCounters,
    ring::drivers::{FiringPlan, HcSr04Config, HcSr04Ring, MicrosecondClock, SonarError, SonarFault, SonarRing},
    ring::{Echo, RingFrame},
};
use toposlam_sim::chip::{EchoPin, HcSr04Bank, HcSr04Fault, SimulatedTime, TriggerPin};

use crate::{World, assert_counted, without};

type Ring = HcSr04Ring<TriggerPin<World, 16>, EchoPin<World, 16>, SimulatedTime, SimulatedTime, 16>;

/// A frame with a different range from 20 to 4000 mm for each sensor, and silence at two of them.
fn near_frame(number: u16) -> RingFrame<16> {
    let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
    for (sensor, echo) in (0_u16..).zip(&mut frame.echoes).filter(|(sensor, _)| sensor % 8 != 5) {
        *echo = Echo::Range { range_mm: 25 + number * 3 + sensor * 255 };
    }
    frame
}

fn near_world() -> impl FnMut() -> Option<RingFrame<16>> {
    let mut numbers = 0..50;
    move || numbers.next().map(near_frame)
}

fn ring(config: HcSr04Config<16>, time: &SimulatedTime) -> (Ring, HcSr04Bank<World, 16>) {
    let bank = HcSr04Bank::new(Box::new(near_world()) as World, time.clone());
    (HcSr04Ring::new(bank.pins(), time.clone(), time.clone(), config).unwrap(), bank)
}

/// The resolution of a range is one iteration of the polling loop: here 2 µs, a third of a millimetre.
fn assert_measured(measured: RingFrame<16>, expected: RingFrame<16>) {
    for (sensor, (measured, expected)) in measured.echoes.into_iter().zip(expected.echoes).enumerate() {
        match (measured.range_mm(), expected.range_mm()) {
            (Some(heard_mm), Some(expected_mm)) => {
                assert!(heard_mm.abs_diff(expected_mm) <= 1, "sensor {sensor}: {heard_mm} for {expected_mm} mm");
            }
            _ => assert_eq!(measured, expected, "sensor {sensor}"),
        }
    }
}

#[test]
fn the_ring_measures_the_world_and_takes_60_ms_for_each_group() {
    // The second clock wraps in the middle of a frame.
    for start_us in [0, (1 << 32) - 100_000] {
        for groups in [1, 2, 4, 16] {
            let time = SimulatedTime::new(start_us, 2000);
            let config = HcSr04Config::DEFAULT.with_plan(FiringPlan::interleaved(groups));
            let (mut ring, bank) = ring(config, &time);
            let mut faults = FaultCounters::new();
            for number in 0..10 {
                assert_measured(ring.read(&mut faults), near_frame(number));
                assert_eq!(ring.last_error(), None);
            }
            assert_eq!(faults, FaultCounters::new());
            assert_eq!(bank.ignored_triggers(), 0);
            let passed_ms = (time.now_ns() - start_us * 1000) / 1_000_000;
            // The last group waits for its pulses only.
            let cycles = 10 * u64::from(groups);
            assert!((60 * (cycles - 1)..60 * cycles + 1).contains(&passed_ms), "{passed_ms} ms in {groups} groups");
        }
    }
}

#[test]
fn a_faulty_sensor_is_dead_and_counted_and_the_others_are_read() {
    let cases = [
        (HcSr04Fault::NeverRises, SonarFault::Silent),
        (HcSr04Fault::HeldHigh, SonarFault::Stuck),
        (HcSr04Fault::Spike, SonarFault::OutOfRange),
        (HcSr04Fault::EchoPinBroken, SonarFault::Bus),
        (HcSr04Fault::TriggerPinBroken, SonarFault::Bus),
    ];
    for sensor in [0_u8, 7, 15] {
        for (defect, fault) in cases {
            let time = SimulatedTime::new(0, 2000);
            let (mut ring, bank) = ring(HcSr04Config::DEFAULT, &time);
            bank.set_fault(sensor.into(), Some(defect));
            let mut faults = FaultCounters::new();
            for number in 0..3 {
                assert_measured(
                    ring.read(&mut faults),
                    without(near_frame(number), |dead| dead == usize::from(sensor)),
                );
                assert_eq!(ring.last_error(), Some(SonarError { sensor, fault }), "{defect:?}");
            }
            assert_counted(&faults, Some(fault), 3);
            assert!(time.now_ns() < 3 * 4 * 60_000_000 + 1_000_000);
        }
    }
}

#[test]
fn a_clone_that_holds_its_line_is_silent_once_and_then_stuck_until_repaired() {
    let time = SimulatedTime::new(0, 2000);
    let (mut ring, bank) = ring(HcSr04Config::DEFAULT, &time);
    bank.set_fault(3, Some(HcSr04Fault::NeverFalls));
    let mut faults = FaultCounters::new();
    let mut expected = near_frame(0);
    expected.echoes[3] = Echo::Silence;
    assert_measured(ring.read(&mut faults), expected);
    assert_eq!(ring.last_error(), None);
    for number in 1..4 {
        assert_measured(ring.read(&mut faults), without(near_frame(number), |sensor| sensor == 3));
        assert_eq!(ring.last_error(), Some(SonarError { sensor: 3, fault: SonarFault::Stuck }));
    }
    assert_counted(&faults, Some(SonarFault::Stuck), 3);
    assert!(time.now_ns() < 4 * 4 * 60_000_000 + 1_000_000);
    bank.set_fault(3, None);
    assert_measured(ring.read(&mut faults), near_frame(4));
}

#[test]
fn a_clone_with_a_long_pulse_is_silent_in_every_frame() {
    let time = SimulatedTime::new(0, 2000);
    let (mut ring, bank) = ring(HcSr04Config::DEFAULT, &time);
    bank.set_fault(3, Some(HcSr04Fault::GivesUpLate));
    let mut faults = FaultCounters::new();
    for number in 0..5 {
        let mut expected = near_frame(number);
        expected.echoes[3] = Echo::Silence;
        assert_measured(ring.read(&mut faults), expected);
    }
    assert_eq!(faults, FaultCounters::new());
}

#[test]
fn a_stopped_clock_is_detected_in_bounded_time() {
    let mut time = SimulatedTime::new(0, 0);
    let (mut ring, _bank) = ring(HcSr04Config::DEFAULT.with_stopped_clock_polls(500), &time);
    let mut faults = FaultCounters::new();
    let frame = ring.read(&mut faults);
    assert_eq!(frame, RingFrame { echoes: [Echo::Dead; 16] });
    assert_eq!(ring.last_error(), Some(SonarError { sensor: 15, fault: SonarFault::Clock }));
    assert_counted(&faults, Some(SonarFault::Clock), 16);
    assert!(time.now_us() < 4 * 61_000);
}

/// A clock that returns given times.
struct Recited(VecDeque<u32>);

impl MicrosecondClock for Recited {
    fn now_us(&mut self) -> u32 {
        self.0.pop_front().expect("the driver looks at the clock as often as was written down")
    }
}

#[test]
fn the_signals_on_the_pins_are_those_of_the_data_sheet() {
    use State::{High, Low};
    let trigger = || PinMock::new(&[Pin::set(High), Pin::set(Low)]);
    // Low before the trigger; then one read in each iteration until it is done. 5831 us are 1000 mm, 11,662 us are 2000 mm.
    let echo = |levels: &[State]| PinMock::new(&levels.iter().map(|&level| Pin::get(level)).collect::<Vec<_>>());
    let pins = [
        (trigger(), echo(&[Low, Low, High, High, Low])),
        (trigger(), echo(&[Low, High, Low])),
        (trigger(), echo(&[Low, High, High, High, Low])),
        (PinMock::new(&[]), echo(&[High])),
    ];
    // The first group: start, four iterations. Then a read for the cycle time, and the second group.
    let clock = Recited([100, 500, 600, 6331, 12_262, 30_100, 60_100, 60_600, 66_431].into());
    let waits = [Wait::delay_us(12), Wait::delay_us(30_000), Wait::delay_us(12)];
    let config = HcSr04Config::DEFAULT.with_plan(FiringPlan::interleaved(2));
    let mut ring = HcSr04Ring::new(pins, clock, CheckedDelay::new(&waits), config).unwrap();
    let mut faults = FaultCounters::new();
    let frame = ring.read(&mut faults);
    let range = |range_mm| Echo::Range { range_mm };
    assert_eq!(frame.echoes, [range(2000), range(1000), range(2017), Echo::Dead]);
    assert_eq!(ring.last_error(), Some(SonarError { sensor: 3, fault: SonarFault::Stuck }));
    let (pins, clock, mut delay) = ring.release();
    assert!(clock.0.is_empty());
    delay.done();
    for (mut trigger, mut echo) in pins {
        trigger.done();
        echo.done();
    }
}
