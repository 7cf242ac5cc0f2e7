//! Ring drivers: every frame is valid and ends within its bounds of messages, polls and waiting time.

use arbitrary::Arbitrary;
use embedded_hal::i2c::I2c;
use toposlam::{
    FaultCounters, FaultKind,
    ring::RingFrame,
    ring::drivers::{
        FiringPlan, HcSr04Config, HcSr04Ring, MaxBotixConfig, MaxBotixRing, SonarRing, Srf08Config, Srf08Ring,
        Vl53l1xBudget, Vl53l1xConfig, Vl53l1xRing,
    },
};

use super::fakes::{Answers, Budget, Clock, Counted, Waited};

const SONARS: usize = 6;
const FRAMES: u32 = 2;

/// The firing groups, one byte for each sensor; missing ones are 0.
fn plan(groups: &[u8]) -> FiringPlan<SONARS> {
    FiringPlan { group_of: std::array::from_fn(|sensor| groups.get(sensor).copied().unwrap_or(0)) }
}

#[derive(Arbitrary, Debug)]
pub(crate) struct Srf08<'a> {
    groups: &'a [u8],
    is_srf10: bool,
    first_address: Option<u8>,
    timeout_ms: u8,
    poll_interval: u8,
    speed_m_per_s: Option<u16>,
    range_mm: Option<(u16, u16)>,
}

pub(crate) fn srf08(settings: &Srf08<'_>, bus: impl I2c) {
    let default = if settings.is_srf10 { Srf08Config::SRF10 } else { Srf08Config::DEFAULT };
    let (min_range_mm, max_range_mm) = settings.range_mm.unwrap_or((default.min_range_mm, default.max_range_mm));
    // The poll interval is coarse, so that a frame has at most some hundreds of polls.
    let config = default
        .with_first_address(settings.first_address.unwrap_or(default.first_address))
        .with_plan(plan(settings.groups))
        .with_timeout_ms(settings.timeout_ms.into())
        .with_poll_interval_us(u16::from(settings.poll_interval) * 257)
        .with_speed_of_sound_m_per_s(settings.speed_m_per_s.unwrap_or(default.speed_of_sound_m_per_s))
        .with_min_range_mm(min_range_mm)
        .with_max_range_mm(max_range_mm);
    let waited = Waited::default();
    let bus = Counted { bus, transactions: 0 };
    let Ok(mut ring) = Srf08Ring::<_, _, SONARS>::new(bus, &waited, config) else { return };
    for _ in 0..FRAMES {
        check_frame(&mut ring, min_range_mm, max_range_mm);
    }
    let (timeout_us, poll_us) = (u32::from(config.timeout_ms) * 1000, u32::from(config.poll_interval_us));
    let rounds = 1 + timeout_us / poll_us;
    assert!(ring.release().0.transactions <= FRAMES * SONARS as u32 * (1 + rounds));
    let group_us = u64::from(timeout_us.max(poll_us));
    assert!(waited.microseconds() <= u64::from(FRAMES) * config.plan.group_count() as u64 * group_us);
}

#[derive(Arbitrary, Debug)]
pub(crate) struct MaxBotix<'a> {
    groups: &'a [u8],
    first_address: Option<u8>,
    ranging_ms: u8,
    cycle_ms: u8,
}

pub(crate) fn max_botix(settings: &MaxBotix<'_>, bus: impl I2c) {
    let config = MaxBotixConfig::DEFAULT
        .with_first_address(settings.first_address.unwrap_or(MaxBotixConfig::<SONARS>::DEFAULT.first_address))
        .with_plan(plan(settings.groups))
        .with_ranging_ms(settings.ranging_ms)
        .with_cycle_ms(settings.cycle_ms);
    let waited = Waited::default();
    let bus = Counted { bus, transactions: 0 };
    let Ok(mut ring) = MaxBotixRing::<_, _, SONARS>::new(bus, &waited, config) else { return };
    for _ in 0..FRAMES {
        check_frame(&mut ring, 200, 7640);
    }
    let rounds = 1 + u32::from(config.cycle_ms - config.ranging_ms) / 2;
    assert!(ring.release().0.transactions <= FRAMES * SONARS as u32 * (1 + rounds));
    let group_us = u64::from(config.cycle_ms) * 1000;
    assert_eq!(waited.microseconds(), u64::from(FRAMES) * config.plan.group_count() as u64 * group_us);
}

#[derive(Arbitrary, Debug)]
pub(crate) struct Vl53l1x<'a> {
    groups: &'a [u8],
    first_address: Option<u8>,
    is_short: bool,
    has_2v8_io: bool,
    timeout_ms: u8,
    range_mm: Option<(u16, u16)>,
}

pub(crate) fn vl53l1x(settings: &Vl53l1x<'_>, bus: impl I2c, pins: &[u8]) {
    let default = Vl53l1xConfig::<SONARS>::DEFAULT;
    let (min_range_mm, max_range_mm) = settings.range_mm.unwrap_or((default.min_range_mm, default.max_range_mm));
    let config = default
        .with_first_address(settings.first_address.unwrap_or(default.first_address))
        .with_plan(plan(settings.groups))
        .with_budget(if settings.is_short { Vl53l1xBudget::Ms33 } else { Vl53l1xBudget::Ms100 })
        .with_has_2v8_io(settings.has_2v8_io)
        .with_timeout_ms(settings.timeout_ms.into())
        .with_min_range_mm(min_range_mm)
        .with_max_range_mm(max_range_mm);
    let waited = Waited::default();
    let bus = Counted { bus, transactions: 0 };
    let Ok(mut ring) = Vl53l1xRing::<_, _, SONARS>::new(bus, &waited, config) else { return };
    let pin_calls = Budget::new(3 * SONARS as u32);
    let mut xshut: [_; SONARS] =
        std::array::from_fn(|sensor| Answers { next: sensor, ..Answers::new(pins, &pin_calls) });
    let _ = ring.start(&mut xshut);
    for _ in 0..FRAMES {
        check_frame(&mut ring, min_range_mm, max_range_mm);
    }
    let rounds = 1 + u32::from(config.timeout_ms) / 5;
    assert!(ring.release().0.transactions <= SONARS as u32 * (132 + FRAMES * (1 + 2 * rounds)));
    let frame_us = config.plan.group_count() as u64 * u64::from(config.timeout_ms) * 1000;
    assert!(waited.microseconds() <= 1000 + SONARS as u64 * 550_000 + u64::from(FRAMES) * frame_us);
}

#[derive(Arbitrary, Debug)]
pub(crate) struct HcSr04<'a> {
    groups: &'a [u8],
    trigger_us: u8,
    rise_timeout_us: u8,
    echo_timeout_us: u16,
    cycle_ms: u8,
    stopped_clock_polls: u8,
    speed_m_per_s: Option<u16>,
    range_mm: (u16, u16),
}

pub(crate) fn hc_sr04(settings: &HcSr04<'_>, clock: &[u8], answers: &[u8]) {
    let (min_range_mm, max_range_mm) = settings.range_mm;
    let config = HcSr04Config::DEFAULT
        .with_plan(plan(settings.groups))
        .with_trigger_us(settings.trigger_us)
        .with_rise_timeout_us(settings.rise_timeout_us.into())
        .with_echo_timeout_us(settings.echo_timeout_us)
        .with_cycle_ms(settings.cycle_ms)
        .with_stopped_clock_polls((settings.stopped_clock_polls % 32).into())
        .with_speed_of_sound_m_per_s(settings.speed_m_per_s.unwrap_or(343))
        .with_min_range_mm(min_range_mm)
        .with_max_range_mm(max_range_mm);
    let groups = config.plan.group_count() as u32;
    // At each poll the clock advances by a multiple of 8 µs, stops, or goes back: at most this many polls.
    let steps = (u32::from(config.rise_timeout_us) + u32::from(config.echo_timeout_us)) / 8 + 4;
    let polls = FRAMES * groups * (3 + (steps + 1) * (u32::from(config.stopped_clock_polls) + 1));
    let (pin_calls, clock_calls) = (Budget::new(u32::MAX), Budget::new(polls));
    let pins = std::array::from_fn(|sensor| {
        let pin = || Answers { next: sensor, ..Answers::new(answers, &pin_calls) };
        (pin(), pin())
    });
    let clock = Clock { answers: Answers::new(clock, &clock_calls), now_us: 0 };
    let waited = Waited::default();
    let Ok(mut ring) = HcSr04Ring::<_, _, _, _, SONARS>::new(pins, clock, &waited, config) else { return };
    for _ in 0..FRAMES {
        check_frame(&mut ring, min_range_mm, max_range_mm);
    }
    let group_us = u64::from(config.cycle_ms) * 1000 + u64::from(config.trigger_us);
    assert!(waited.microseconds() <= u64::from(FRAMES * groups) * group_us);
}

/// Asserts that every echo is in range, that exactly the dead sensors are counted, and that the last one is reported.
fn check_frame(ring: &mut impl SonarRing<SONARS>, nearest_mm: u16, farthest_mm: u16) -> RingFrame<SONARS> {
    let mut faults = FaultCounters::new();
    let frame = ring.read(&mut faults);
    for range_mm in frame.echoes.iter().filter_map(|echo| echo.range_mm()) {
        assert!((nearest_mm..=farthest_mm).contains(&range_mm), "{range_mm} mm");
    }
    let counted: u32 = FaultKind::ALL.into_iter().map(|kind| faults.count(kind)).sum();
    assert_eq!(counted as usize, frame.dead_sensors().count());
    let last = frame.dead_sensors().last();
    assert_eq!(ring.last_error().map(|error| usize::from(error.sensor)), last);
    frame
}
