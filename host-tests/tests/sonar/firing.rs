//! The firing plan: sensors that fire together receive each other's sound, and a plan with separate groups prevents it.

use toposlam::{
    FaultCounters,
    ring::drivers::{
        FiringPlan, HcSr04Config, HcSr04Ring, MaxBotixConfig, MaxBotixRing, SonarRing, Srf08Config, Srf08Ring,
    },
    ring::{Echo, RingFrame},
};
use toposlam_sim::chip::{HcSr04Bank, I2cBus, MaxBotixBank, SimulatedTime, Srf08Bank};

use crate::Waited;

/// Near walls at the even sensors, far walls at the odd ones, in whole centimetres.
fn rough() -> RingFrame<16> {
    let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
    for (sensor, echo) in (0_u16..).zip(&mut frame.echoes) {
        *echo = Echo::Range { range_mm: if sensor % 2 == 0 { 500 + sensor * 20 } else { 3000 + sensor * 20 } };
    }
    frame
}

/// With crosstalk an odd sensor measures the range of its nearer neighbour; an even one receives its own echo first.
fn disturbed() -> RingFrame<16> {
    let (echoes, mut frame) = (rough().echoes, rough());
    for sensor in (1..16).step_by(2) {
        let neighbours = [echoes[sensor - 1], echoes[(sensor + 1) % 16]];
        frame.echoes[sensor] = neighbours.into_iter().min_by_key(|echo| echo.range_mm()).unwrap();
    }
    frame
}

fn assert_separates(name: &str, read: impl Fn(FiringPlan<16>) -> RingFrame<16>) {
    assert_eq!(read(FiringPlan::together()), disturbed(), "{name}, together");
    for groups in [2, 3, 4, 5, 16] {
        assert_eq!(read(FiringPlan::interleaved(groups)), rough(), "{name} in {groups} groups");
    }
    // A plan that fires pairs of neighbours has crosstalk.
    let pairs = FiringPlan { group_of: std::array::from_fn(|sensor| (sensor / 2) as u8) };
    assert_ne!(read(pairs), rough(), "{name} in pairs");
}

#[test]
fn srf08_have_crosstalk_when_fired_together_and_none_in_separate_groups() {
    assert_separates("SRF08", |plan| {
        let mut devices = Srf08Bank::new(|| Some(rough()), 3);
        devices.set_cross_talk(true);
        let config = Srf08Config::DEFAULT.with_plan(plan);
        Srf08Ring::new(I2cBus { devices }, &mut Waited::default(), config).unwrap().read(&mut FaultCounters::new())
    });
}

#[test]
fn maxbotix_have_crosstalk_when_fired_together_and_none_in_separate_groups() {
    assert_separates("MaxBotix", |plan| {
        let time = SimulatedTime::new(0, 0);
        let mut devices = MaxBotixBank::new(|| Some(rough()), time.clone());
        devices.set_cross_talk(true);
        let config = MaxBotixConfig::DEFAULT.with_plan(plan);
        MaxBotixRing::new(I2cBus { devices }, time, config).unwrap().read(&mut FaultCounters::new())
    });
}

#[test]
fn hc_sr04_have_crosstalk_when_fired_together_and_none_in_separate_groups() {
    assert_separates("HC-SR04", |plan| {
        let time = SimulatedTime::new(0, 1000);
        let bank = HcSr04Bank::new(|| Some(rough()), time.clone());
        bank.set_cross_talk(true);
        let config = HcSr04Config::DEFAULT.with_plan(plan);
        let mut ring = HcSr04Ring::new(bank.pins(), time.clone(), time, config).unwrap();
        ring.read(&mut FaultCounters::new())
    });
}
