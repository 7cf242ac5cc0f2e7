//! Any answers of buses, pins, clocks and UARTs to the drivers of the rings, the bridge and the helpers for addresses.
#![no_main]

use std::cell::Cell;

use arbitrary::Arbitrary;
use embedded_hal::{
    delay::DelayNs,
    digital::{self, InputPin, OutputPin},
    i2c::{self, I2c, NoAcknowledgeSource, Operation},
};
use embedded_hal_nb::{nb, serial};
use libfuzzer_sys::fuzz_target;
use toposlam::{
    FaultCounters, FaultKind,
    ring::RingFrame,
    ring::drivers::{
        AddressError, BridgeError, FiringPlan, HcSr04Config, HcSr04Ring, MaxBotixConfig, MaxBotixRing,
        MicrosecondClock, Sc18im700, SonarRing, Srf08Config, Srf08Ring, change_maxbotix_address, change_srf08_address,
    },
};

const SONARS: usize = 6;
const FRAMES: u32 = 2;

#[derive(Arbitrary, Debug)]
enum Input<'a> {
    Srf08 { config: Srf08<'a>, answers: &'a [u8] },
    MaxBotix { config: MaxBotix<'a>, answers: &'a [u8] },
    HcSr04 { config: HcSr04<'a>, clock: &'a [u8], answers: &'a [u8] },
    Bridge { budget: u8, calls: Vec<Call<'a>>, answers: &'a [u8] },
    Srf08OnBridge { config: Srf08<'a>, budget: u8, answers: &'a [u8] },
    MaxBotixOnBridge { config: MaxBotix<'a>, budget: u8, answers: &'a [u8] },
    Srf08Address { from: u8, to: u8, answers: &'a [u8] },
    MaxBotixAddress { from: u8, to: u8, answers: &'a [u8] },
}

#[derive(Arbitrary, Debug)]
enum Call<'a> {
    Start,
    SetBaudRate(u32),
    Transaction { address: u8, operations: Vec<Asked<'a>> },
}

#[derive(Arbitrary, Debug)]
enum Asked<'a> {
    Read(u8),
    Write(&'a [u8]),
}

fuzz_target!(|input: Input<'_>| match input {
    Input::Srf08 { config, answers } => {
        let budget = Budget::of(u32::MAX);
        srf08(&config, Answers::new(answers, &budget));
    }
    Input::MaxBotix { config, answers } => {
        let budget = Budget::of(u32::MAX);
        max_botix(&config, Answers::new(answers, &budget));
    }
    Input::HcSr04 { config, clock, answers } => hc_sr04(&config, clock, answers),
    Input::Bridge { budget, calls, answers } => bridge(budget.into(), &calls, answers),
    Input::Srf08OnBridge { config, budget, answers } => {
        let calls = Budget::of(u32::MAX);
        srf08(&config, Sc18im700::new(Answers::new(answers, &calls), u32::from(budget % 8)));
    }
    Input::MaxBotixOnBridge { config, budget, answers } => {
        let calls = Budget::of(u32::MAX);
        max_botix(&config, Sc18im700::new(Answers::new(answers, &calls), u32::from(budget % 8)));
    }
    Input::Srf08Address { from, to, answers } => {
        let is_address = |address| (0x70..=0x7F).contains(&address);
        address(from, to, answers, 4, is_address, |bus, delay| change_srf08_address(bus, delay, from, to));
    }
    Input::MaxBotixAddress { from, to, answers } => {
        let is_address = |address| (0x08..=0x7F).contains(&address) && ![0x28, 0x52, 0x55].contains(&address);
        address(from, to, answers, 1, is_address, |bus, delay| change_maxbotix_address(bus, delay, from, to));
    }
});

/// The firing groups, one byte for each sensor; all fire together when there are none.
fn plan(groups: &[u8]) -> FiringPlan<SONARS> {
    FiringPlan { group_of: std::array::from_fn(|sensor| groups.get(sensor).copied().unwrap_or(0)) }
}

#[derive(Arbitrary, Debug)]
struct Srf08<'a> {
    groups: &'a [u8],
    is_srf10: bool,
    first_address: Option<u8>,
    timeout_ms: u8,
    poll_interval: u8,
    speed_m_per_s: Option<u16>,
    range_mm: Option<(u16, u16)>,
}

fn srf08(settings: &Srf08<'_>, bus: impl I2c) {
    let default = if settings.is_srf10 { Srf08Config::SRF10 } else { Srf08Config::DEFAULT };
    let (min_range_mm, max_range_mm) = settings.range_mm.unwrap_or((default.min_range_mm, default.max_range_mm));
    // The poll interval is coarse, so that a frame has some hundreds of rounds at most.
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
struct MaxBotix<'a> {
    groups: &'a [u8],
    first_address: Option<u8>,
    ranging_ms: u8,
    cycle_ms: u8,
}

fn max_botix(settings: &MaxBotix<'_>, bus: impl I2c) {
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
struct HcSr04<'a> {
    groups: &'a [u8],
    trigger_us: u8,
    rise_timeout_us: u8,
    echo_timeout_us: u16,
    cycle_ms: u8,
    stopped_clock_polls: u8,
    speed_m_per_s: Option<u16>,
    range_mm: (u16, u16),
}

fn hc_sr04(settings: &HcSr04<'_>, clock: &[u8], answers: &[u8]) {
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
    // The clock goes on by some steps of 8 µs at each poll, or stands still, or goes back; each time for so many polls.
    let steps = (u32::from(config.rise_timeout_us) + u32::from(config.echo_timeout_us)) / 8 + 4;
    let polls = FRAMES * groups * (3 + (steps + 1) * (u32::from(config.stopped_clock_polls) + 1));
    let (pin_calls, clock_calls) = (Budget::of(u32::MAX), Budget::of(polls));
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

/// Every echo is in range, every dead sensor is counted and nothing else, and the last one is named.
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

fn bridge(poll_budget: u32, calls: &[Call<'_>], answers: &[u8]) {
    let budget = Budget::of(0);
    let mut bridge = Sc18im700::new(Answers::new(answers, &budget), poll_budget);
    for call in calls.iter().take(8) {
        budget.calls.set(0);
        match call {
            Call::Start => {
                budget.most.set(32 + 7 * 2 * poll_budget);
                let _ = bridge.start();
            }
            Call::SetBaudRate(baud) => {
                budget.most.set(7 * 2 * poll_budget);
                let divides = (113..=460_800).contains(baud);
                assert_eq!(bridge.set_baud_rate(*baud) == Err(BridgeError::BaudRate), !divides, "{baud}");
            }
            Call::Transaction { address, operations } => {
                transaction(&mut bridge, &budget, poll_budget, *address, &operations[..operations.len().min(6)]);
            }
        }
    }
}

fn transaction(
    bridge: &mut Sc18im700<Answers<'_>>,
    budget: &Budget,
    poll_budget: u32,
    address: u8,
    asked: &[Asked<'_>],
) {
    let (mut to_read, mut to_write) = (0, 0);
    let mut buffers: Vec<Vec<u8>> = Vec::new();
    for operation in asked {
        match operation {
            Asked::Read(count) => {
                to_read += usize::from(*count);
                buffers.push(vec![0; usize::from(*count)]);
            }
            Asked::Write(bytes) => to_write += bytes.len(),
        }
    }
    let mut buffers = buffers.iter_mut();
    let mut operations: Vec<Operation<'_>> = asked
        .iter()
        .map(|operation| match operation {
            Asked::Read(_) => Operation::Read(buffers.next().unwrap()),
            Asked::Write(bytes) => Operation::Write(bytes),
        })
        .collect();
    // Each byte to send polls twice; up to 19 bytes come back.
    let sent = 3 * asked.len() as u32 + 16 + 4 + 4;
    budget.most.set(32 + 2 * poll_budget * sent + 19 * poll_budget);
    let result = bridge.transaction(address, &mut operations);
    let is_too_long = to_read > 16 || to_write > 16;
    assert_eq!(result == Err(BridgeError::TooLong), is_too_long, "{to_read} to read, {to_write} to write");
    if is_too_long || asked.is_empty() {
        assert_eq!(budget.calls.get(), 0, "nothing was sent");
    }
}

fn address(
    from: u8,
    to: u8,
    answers: &[u8],
    messages: u32,
    is_address: impl Fn(u8) -> bool,
    change: impl FnOnce(&mut Counted<Answers<'_>>, &mut &Waited) -> Result<(), AddressError>,
) {
    let (budget, waited) = (Budget::of(u32::MAX), Waited::default());
    let mut bus = Counted { bus: Answers::new(answers, &budget), transactions: 0 };
    let changed = change(&mut bus, &mut &waited);
    assert_eq!(changed == Err(AddressError::From), !is_address(from));
    assert_eq!(changed == Err(AddressError::To), is_address(from) && !is_address(to));
    let most = match changed {
        Err(AddressError::From | AddressError::To) => 0,
        Err(AddressError::Taken) => 1,
        _ => 1 + messages + 20,
    };
    assert!(bus.transactions <= most, "{} transactions and {changed:?}", bus.transactions);
    assert!(waited.microseconds() <= 200_000);
}

/// How often something may be asked: what goes on for ever is found at once.
struct Budget {
    calls: Cell<u32>,
    most: Cell<u32>,
}

impl Budget {
    fn of(most: u32) -> Self {
        Self { calls: Cell::new(0), most: Cell::new(most) }
    }

    fn spend(&self) {
        self.calls.set(self.calls.get() + 1);
        assert!(self.calls.get() <= self.most.get(), "more than {} calls", self.most.get());
    }
}

/// A bus, a UART or a pin that answers with some bytes, over and over.
struct Answers<'a> {
    bytes: &'a [u8],
    next: usize,
    budget: &'a Budget,
}

impl<'a> Answers<'a> {
    fn new(bytes: &'a [u8], budget: &'a Budget) -> Self {
        Self { bytes, next: 0, budget }
    }

    fn byte(&mut self) -> u8 {
        self.next += 1;
        self.bytes.get((self.next - 1) % self.bytes.len().max(1)).copied().unwrap_or(0)
    }
}

impl i2c::ErrorType for Answers<'_> {
    type Error = i2c::ErrorKind;
}

impl I2c for Answers<'_> {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            1..=16 => return Err(i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)),
            17..=24 => return Err(i2c::ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data)),
            25..=28 => return Err(i2c::ErrorKind::Bus),
            29..=32 => return Err(i2c::ErrorKind::ArbitrationLoss),
            _ => {}
        }
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                bytes.fill_with(|| self.byte());
            }
        }
        Ok(())
    }
}

impl serial::ErrorType for Answers<'_> {
    type Error = serial::ErrorKind;
}

impl serial::Read<u8> for Answers<'_> {
    fn read(&mut self) -> nb::Result<u8, serial::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            0..=9 => Err(nb::Error::WouldBlock),
            10 => Err(nb::Error::Other(serial::ErrorKind::Overrun)),
            byte => Ok(byte),
        }
    }
}

impl serial::Write<u8> for Answers<'_> {
    fn write(&mut self, _: u8) -> nb::Result<(), serial::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            0..=9 => Err(nb::Error::WouldBlock),
            10 => Err(nb::Error::Other(serial::ErrorKind::Other)),
            _ => Ok(()),
        }
    }

    fn flush(&mut self) -> nb::Result<(), serial::ErrorKind> {
        serial::Write::write(self, 0)
    }
}

impl digital::ErrorType for Answers<'_> {
    type Error = digital::ErrorKind;
}

impl InputPin for Answers<'_> {
    fn is_high(&mut self) -> Result<bool, digital::ErrorKind> {
        self.budget.spend();
        match self.byte() {
            255 => Err(digital::ErrorKind::Other),
            byte => Ok(byte % 2 == 1),
        }
    }

    fn is_low(&mut self) -> Result<bool, digital::ErrorKind> {
        self.is_high().map(|is_high| !is_high)
    }
}

impl OutputPin for Answers<'_> {
    fn set_low(&mut self) -> Result<(), digital::ErrorKind> {
        self.is_high().map(|_| ())
    }

    fn set_high(&mut self) -> Result<(), digital::ErrorKind> {
        self.is_high().map(|_| ())
    }
}

/// A clock that goes on as the bytes say, stands still, or goes back.
struct Clock<'a> {
    answers: Answers<'a>,
    now_us: u32,
}

impl MicrosecondClock for Clock<'_> {
    fn now_us(&mut self) -> u32 {
        self.answers.budget.spend();
        let step = self.answers.byte();
        self.now_us = match step {
            255 => self.now_us.wrapping_sub(1000),
            step => self.now_us.wrapping_add(8 * u32::from(step)),
        };
        self.now_us
    }
}

/// A bus whose transactions are counted.
struct Counted<BUS> {
    bus: BUS,
    transactions: u32,
}

impl<BUS: I2c> i2c::ErrorType for Counted<BUS> {
    type Error = BUS::Error;
}

impl<BUS: I2c> I2c for Counted<BUS> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), BUS::Error> {
        self.transactions += 1;
        self.bus.transaction(address, operations)
    }
}

/// The time that was waited.
#[derive(Default)]
struct Waited {
    nanoseconds: Cell<u64>,
}

impl Waited {
    fn microseconds(&self) -> u64 {
        self.nanoseconds.get() / 1000
    }
}

impl DelayNs for &Waited {
    fn delay_ns(&mut self, nanoseconds: u32) {
        self.nanoseconds.set(self.nanoseconds.get() + u64::from(nanoseconds));
    }
}
