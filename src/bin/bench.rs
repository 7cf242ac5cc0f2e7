//! The bench image: runs a recorded input through the same core as the robot's and prints what each stage costs, one
//! `name: value` a line (`docs/costs.md` says what they are).
//!
//! Run it in QEMU with `-icount shift=0`: an instruction is then a nanosecond of virtual time, SysTick counts the core
//! clock, and the figures are the same in every run. The ticks of an instruction are measured with loops of known length;
//! a tick is about six instructions, which is how fine the figures are.
#![no_std]
#![no_main]

mod support;

use core::{
    arch::asm,
    hint::black_box,
    mem::size_of,
    sync::atomic::{AtomicU32, Ordering},
};

use cortex_m::peripheral::{SCB, SYST, syst::SystClkSource};
use cortex_m_rt::exception;
use cortex_m_semihosting::{debug, hprintln};
use defmt_rtt as _;
use static_cell::ConstStaticCell;
use toposlam::{
    Config, Consistency, Direction, Fingerprint, History,
    reference::{self, Detector, Filter, HISTORY_WORDS, PARTICLES, RobotMapper, SONARS, VERTICES},
    ring::{Echo, RingFrame},
    wire::{Capacities, Encoder, Hello, MAX_FRAME_BYTES, QueueFull, Reporter},
};

/// Radii in millimetres, place after place.
const PLACES_MM: [u16; 400] = include!("support/bench_places.rs");
/// Ranges in millimetres, frame after frame; 0 is silence.
const FRAMES_MM: [[u16; SONARS]; 200] = include!("support/bench_frames.rs");
/// What the robot introduces itself with.
const CAPACITIES: Capacities = Capacities {
    vertices: VERTICES as u8,
    hypotheses: PARTICLES as u16,
    history: History::<HISTORY_WORDS>::CAPACITY as u16,
    ngram_length: reference::FILTER.ngram_length,
    fingerprint_step_mm: Fingerprint::STEP_MM as u8,
    sonars: SONARS as u8,
};
const TICKS_PER_TURN: u32 = 1 << 24;
static TURNS: AtomicU32 = AtomicU32::new(0);

#[exception]
fn SysTick() {
    TURNS.store(TURNS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// SysTick extended to 56 bits by counting its turns, and what a tick of it is in instructions.
struct Clock {
    _timer: SYST,
    ticks_of_two_million: u64,
}

impl Clock {
    fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TICKS_PER_TURN - 1);
        timer.clear_current();
        timer.enable_interrupt();
        timer.enable_counter();
        let uncalibrated = Self { _timer: timer, ticks_of_two_million: 0 };
        // The difference of two loops is free of what measuring itself costs.
        let (short, ()) = uncalibrated.ticks_for(|| loop_of_known_length(100_000));
        let (long, ()) = uncalibrated.ticks_for(|| loop_of_known_length(1_100_000));
        Self { ticks_of_two_million: long - short, ..uncalibrated }
    }

    fn ticks(&self) -> u64 {
        loop {
            let turns = TURNS.load(Ordering::Relaxed);
            let left = SYST::get_current();
            if turns == TURNS.load(Ordering::Relaxed) && !SCB::is_pendst_pending() {
                // A turn begins at 0 and goes on downwards from the reload value.
                let elapsed = (TICKS_PER_TURN - left) % TICKS_PER_TURN;
                return u64::from(turns) * u64::from(TICKS_PER_TURN) + u64::from(elapsed);
            }
        }
    }

    fn ticks_for<T>(&self, work: impl FnOnce() -> T) -> (u64, T) {
        let before = self.ticks();
        let result = work();
        (self.ticks() - before, result)
    }

    /// How many instructions some work takes, and its result.
    fn measure<T>(&self, work: impl FnOnce() -> T) -> (u64, T) {
        let (ticks, result) = self.ticks_for(work);
        (ticks * 2_000_000 / self.ticks_of_two_million, result)
    }
}

/// Executes two instructions for each turn.
fn loop_of_known_length(turns: u32) {
    // SAFETY: the code touches its own register and the flags only.
    #[allow(unsafe_code)]
    unsafe {
        asm!("2: subs {turns}, #1", "bne 2b", turns = inout(reg) turns => _, options(nomem, nostack));
    }
}

const DIRECTIONS: [(&str, Direction); 3] = [
    ("two_sided_instructions_per_place", Direction::TwoSided),
    ("map_to_history_instructions_per_place", Direction::MapToHistory),
    ("history_to_map_instructions_per_place", Direction::HistoryToMap),
];

/// The measurements of one kind, in the order in which they were made.
struct Costs<const LENGTH: usize> {
    values: [u64; LENGTH],
    held: usize,
}

/// One for each place in each direction.
type PlaceCosts = Costs<{ DIRECTIONS.len() * PLACES_MM.len() }>;
type FrameCosts = Costs<{ FRAMES_MM.len() }>;

impl<const LENGTH: usize> Costs<LENGTH> {
    const fn new() -> Self {
        Self { values: [0; LENGTH], held: 0 }
    }

    fn push(&mut self, value: u64) {
        if let Some(slot) = self.values.get_mut(self.held) {
            *slot = value;
            self.held += 1;
        }
    }
}

/// Prints median, 90th percentile and largest of some measurements.
fn print_quantiles(name: &str, values: &mut [u64]) {
    values.sort_unstable();
    for (quantile, percent) in [("median", 50), ("p90", 90), ("worst", 100)] {
        let rank = (values.len() * percent / 100).min(values.len().saturating_sub(1));
        hprintln!("{}_{}: {}", name, quantile, values.get(rank).copied().unwrap_or(0));
    }
}

/// The stages under measurement and what they cost.
struct Bench {
    clock: Clock,
    filter: &'static mut Filter,
    detector: &'static mut Detector,
    reporter: &'static mut Reporter<VERTICES>,
    filter_costs: &'static mut PlaceCosts,
    report_costs: &'static mut PlaceCosts,
    detector_costs: &'static mut FrameCosts,
    largest_report_bytes: usize,
}

impl Bench {
    /// One recorded place after the other through the filter with one direction of Eq. 2, and what it found on to the
    /// wire.
    fn filter(&mut self, direction: Direction) {
        let Ok(()) = self.filter.start(Config { direction, ..reference::FILTER }, reference::SEED) else { panic!() };
        self.reporter.start(Hello::new(0, reference::SEED, CAPACITIES), u16::MAX);
        let mut encoder = Encoder::new(0);
        for &radius_mm in &PLACES_MM {
            let Ok(fingerprint) = Fingerprint::from_radius_mm(radius_mm) else { panic!() };
            let (instructions, update) = self.clock.measure(|| self.filter.observe(black_box(fingerprint)));
            self.filter_costs.push(instructions);
            let (instructions, bytes) = self.clock.measure(|| {
                let mut bytes = 0;
                self.reporter.update(self.filter.map(), black_box(&update), |message| {
                    let mut frame = [0; MAX_FRAME_BYTES];
                    let frame = encoder.encode(message, &mut frame).map_err(|_| QueueFull)?;
                    bytes += black_box(frame).len();
                    Ok(())
                });
                bytes
            });
            self.report_costs.push(instructions);
            self.largest_report_bytes = self.largest_report_bytes.max(bytes);
        }
    }

    /// Recorded frames through the place detector. Returns how many places there were.
    fn detector(&mut self) -> usize {
        let Ok(()) = self.detector.start(reference::PLACE, reference::RING) else { panic!() };
        let mut places = 0;
        for ranges_mm in &FRAMES_MM {
            let echo = |range_mm| if range_mm == 0 { Echo::Silence } else { Echo::Range { range_mm } };
            let frame = RingFrame { echoes: ranges_mm.map(echo) };
            let (instructions, place) = self.clock.measure(|| self.detector.observe(black_box(&frame)));
            places += usize::from(place.is_some());
            self.detector_costs.push(instructions);
        }
        places
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static FILTER: ConstStaticCell<Filter> = ConstStaticCell::new(Filter::new());
    static DETECTOR: ConstStaticCell<Detector> = ConstStaticCell::new(Detector::new());
    static REPORTER: ConstStaticCell<Reporter<VERTICES>> = ConstStaticCell::new(Reporter::new());
    static FILTER_COSTS: ConstStaticCell<PlaceCosts> = ConstStaticCell::new(Costs::new());
    static REPORT_COSTS: ConstStaticCell<PlaceCosts> = ConstStaticCell::new(Costs::new());
    static DETECTOR_COSTS: ConstStaticCell<FrameCosts> = ConstStaticCell::new(Costs::new());

    let Some(core) = cortex_m::Peripherals::take() else { panic!() };
    let mut bench = Bench {
        clock: Clock::start(core.SYST),
        filter: FILTER.take(),
        detector: DETECTOR.take(),
        reporter: REPORTER.take(),
        filter_costs: FILTER_COSTS.take(),
        report_costs: REPORT_COSTS.take(),
        detector_costs: DETECTOR_COSTS.take(),
        largest_report_bytes: 0,
    };
    let places_detected = bench.detector();
    for (_, direction) in DIRECTIONS {
        bench.filter(direction);
    }
    // Before sorting and formatting, which are no part of the job, add to it.
    let stack_bytes = support::stack_high_water_bytes();

    hprintln!("places: {}", PLACES_MM.len());
    hprintln!("history_places: {}", History::<HISTORY_WORDS>::CAPACITY);
    for ((name, _), costs) in DIRECTIONS.iter().zip(bench.filter_costs.values.chunks_mut(PLACES_MM.len())) {
        print_quantiles(name, costs);
    }
    print_quantiles("report_instructions_per_place", &mut bench.report_costs.values);
    hprintln!("report_bytes_per_place_worst: {}", bench.largest_report_bytes);
    hprintln!("frames: {}", FRAMES_MM.len());
    hprintln!("frames_places_detected: {}", places_detected);
    print_quantiles("detector_instructions_per_frame", &mut bench.detector_costs.values);
    hprintln!("ticks_per_million_instructions: {}", bench.clock.ticks_of_two_million / 2);
    hprintln!("filter_bytes: {}", size_of::<Filter>());
    hprintln!("mapper_bytes: {}", size_of::<RobotMapper>());
    hprintln!("consistency_scratch_bytes: {}", size_of::<Consistency<VERTICES, HISTORY_WORDS, 1>>());
    hprintln!("stack_high_water_bytes: {}", stack_bytes);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
