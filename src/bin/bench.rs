//! The bench image: runs a recorded input through the same core as the robot's and prints what each stage costs, one
//! `name: value` a line (`docs/costs.md` says what they are).
//!
//! Run it in QEMU with `-icount shift=0`: an instruction is then a nanosecond of virtual time, SysTick counts the core
//! clock, and the figures are the same in every run. The ticks of an instruction are measured with loops of known length;
//! a tick is about six instructions, which is how fine the figures are.

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
    FaultCounters, Filter as _, Fingerprint, Observation, RobustConfig, RobustFilter, Turn, Update,
    drive::{Drive, VelocityCommand},
    persist::Persist,
    persist::snapshot::Writer,
    reference::{
        self, Detector, Filter, HISTORY, PaperReference, ReferenceRobot, RobotMapper, SNAPSHOT_BYTES, SONARS, VERTICES,
    },
    ring::{Echo, RingFrame},
    robot::{Board, SaveError},
    wire::{
        Capacities, Chunk, Command, Encoder, Hello, Inbox, MAX_FRAME_BYTES, Outcome, QueueFull, Reporter, Request,
        ResetCause,
    },
};

/// Radii in millimetres, place after place.
const PLACES_MM: [u16; 400] = include!("support/bench_places.rs");
/// What else is known of each place: `b`, `o` or `-` for the turn at the place before, and the degree.
const HINTS: [[u8; 2]; PLACES_MM.len()] = include!("support/bench_hints.rs");
/// Ranges in millimetres, frame after frame; 0 is silence.
const FRAMES_MM: [[u16; SONARS]; 200] = include!("support/bench_frames.rs");
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

/// A filter beyond the reference robot's: more hypotheses and more vertices.
const MORE: usize = 32;
type LargeFilter = RobustFilter<MORE, MORE, HISTORY>;
const LARGE_FILTER: RobustConfig = reference::FILTER.with_hypotheses(MORE as u8);

/// One filter after the other in the same memory: all of them do not fit beside each other.
#[allow(clippy::large_enum_variant)]
enum Filters {
    /// The whole robot.
    Whole(ReferenceRobot<'static>),
    Robot(Filter),
    Paper(PaperReference),
    Large(LargeFilter),
}

/// The measurements of one kind, in the order in which they were made.
struct Costs<const LENGTH: usize> {
    values: [u32; LENGTH],
    held: usize,
}

type PlaceCosts = Costs<{ PLACES_MM.len() }>;
type SliceCosts = Costs<{ SLICES * PLACES_MM.len() }>;
type FrameCosts = Costs<{ FRAMES_MM.len() }>;

impl<const LENGTH: usize> Costs<LENGTH> {
    const fn new() -> Self {
        Self { values: [0; LENGTH], held: 0 }
    }

    fn push(&mut self, value: u64) {
        if let Some(slot) = self.values.get_mut(self.held) {
            *slot = u32::try_from(value).unwrap_or(u32::MAX);
            self.held += 1;
        }
    }

    /// Prints mean, median, 90th percentile and largest.
    fn print(&mut self, name: &str) {
        let total: u64 = self.values.iter().map(|&value| u64::from(value)).sum();
        hprintln!("{}_mean: {}", name, total / LENGTH as u64);
        self.values.sort_unstable();
        for (quantile, percent) in [("median", 50), ("p90", 90), ("worst", 100)] {
            let rank = (LENGTH * percent / 100).min(LENGTH.saturating_sub(1));
            hprintln!("{}_{}: {}", name, quantile, self.values.get(rank).copied().unwrap_or(0));
        }
        self.held = 0;
    }
}

/// How many slices of polishing there are between two places. The robot has one for each ring frame, some hundreds.
const SLICES: usize = 10;

/// What the filter is told of a place.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Told {
    /// The radius alone.
    Radius,
    /// The turn at the place before as well.
    Turn,
    /// Turn and degree.
    TurnAndDegree,
}

fn observation(radius_mm: u16, [turn, degree]: [u8; 2], told: Told) -> Observation {
    let Ok(fingerprint) = Fingerprint::from_radius_mm(radius_mm) else { panic!() };
    let turn = match turn {
        b'b' if told != Told::Radius => Some(Turn::Back),
        b'o' if told != Told::Radius => Some(Turn::On),
        _ => None,
    };
    let degree = Some(degree - b'0').filter(|&degree| degree > 0 && told == Told::TurnAndDegree);
    Observation { turn, degree, ..Observation::new(fingerprint) }
}

/// One recorded place after the other through a filter; after each, `then` has a look at it.
fn run<const V: usize, F: toposlam::Filter<V>>(
    clock: &Clock,
    filter: &mut F,
    config: F::Config,
    told: Told,
    (costs, slices): (&mut PlaceCosts, &mut SliceCosts),
    mut then: impl FnMut(&F, &Update),
) {
    let Ok(()) = filter.start(config, reference::SEED) else { panic!() };
    for (&radius_mm, &hints) in PLACES_MM.iter().zip(&HINTS) {
        let observation = observation(radius_mm, hints, told);
        let (instructions, update) = clock.measure(|| filter.observe(black_box(observation)));
        costs.push(instructions);
        then(filter, &update);
        for _ in 0..SLICES {
            let (instructions, ()) = clock.measure(|| filter.polish());
            slices.push(instructions);
        }
    }
}

/// Puts on the wire what a filter found, and measures that.
struct Wire {
    reporter: &'static mut Reporter<VERTICES>,
    encoder: Encoder,
    costs: &'static mut PlaceCosts,
    largest_bytes: usize,
}

impl Wire {
    fn report(&mut self, clock: &Clock, filter: &Filter, update: &Update) {
        let (instructions, bytes) = clock.measure(|| {
            let mut bytes = 0;
            self.reporter.update(filter, black_box(update), |message| {
                let mut frame = [0; MAX_FRAME_BYTES];
                let frame = self.encoder.encode(message, &mut frame).map_err(|_| QueueFull)?;
                bytes += black_box(frame).len();
                Ok(())
            });
            bytes
        });
        self.costs.push(instructions);
        self.largest_bytes = self.largest_bytes.max(bytes);
    }
}

/// Recorded frames through the place detector. Returns how many places there were.
fn detect(clock: &Clock, detector: &mut Detector, costs: &mut FrameCosts) -> usize {
    let Ok(()) = detector.start(reference::PLACE, reference::RING) else { panic!() };
    let mut places = 0;
    for ranges_mm in &FRAMES_MM {
        let echo = |range_mm| if range_mm == 0 { Echo::Silence } else { Echo::Range { range_mm } };
        let frame = RingFrame { echoes: ranges_mm.map(echo) };
        let (instructions, place) = clock.measure(|| detector.observe(black_box(&frame)));
        places += usize::from(place.is_some());
        costs.push(instructions);
    }
    places
}

/// A board that takes everything and does nothing.
struct Bare;

impl Board for Bare {
    fn receive(&mut self) -> Option<u8> {
        None
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        black_box(frame);
        Ok(())
    }

    fn follow(&mut self, velocity: VelocityCommand) {
        black_box(velocity);
    }

    fn feed_watchdog(&mut self) {}

    fn now_ms(&mut self) -> u32 {
        0
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        0
    }

    fn save(&mut self, _: &[u8]) -> Result<(), SaveError> {
        Err(SaveError::NoStore)
    }
}

/// Recorded frames through the whole robot, drive and messages included; the turns at places are those of the filter.
fn turns(clock: &Clock, robot: &mut ReferenceRobot<'static>, costs: &mut FrameCosts) {
    let Ok(()) = robot.start(&reference::ROBOT, &mut []) else { panic!() };
    for ranges_mm in &FRAMES_MM {
        let echo = |range_mm| if range_mm == 0 { Echo::Silence } else { Echo::Range { range_mm } };
        let frame = RingFrame { echoes: ranges_mm.map(echo) };
        let (instructions, seen) = clock.measure(|| robot.turn(black_box(&frame), &FaultCounters::new(), &mut Bare));
        if seen.is_none() {
            costs.push(instructions);
        }
    }
}

/// Saves a filter with a full history; tells what that costs and how many bytes the snapshot has.
fn save(clock: &Clock, filter: &mut Filter, buffer: &mut [u8]) -> (u64, usize) {
    clock.measure(|| {
        let Ok(mut writer) = Writer::new(buffer) else { panic!() };
        let Ok(()) = filter.save(&mut writer) else { panic!() };
        writer.finish().unwrap_or(0)
    })
}

/// What the full rate of a line of 115,200 baud costs the inbox in a turn of 130 ms, at worst: requests of the shortest and
/// of the longest kind, and garbage.
fn flood(clock: &Clock, inbox: &mut Inbox) -> u64 {
    let mut buffer = [0; MAX_FRAME_BYTES];
    let mut worst = 0;
    let longest = Command::RestoreChunk { offset: u16::MAX, bytes: Chunk::new([0; 64]) };
    for command in [Some(Command::Info), Some(longest), None] {
        let frame = match command {
            Some(command) => Encoder::new(0).encode(&Request { id: 1, command }, &mut buffer).unwrap_or(&[]),
            None => &[1, 0],
        };
        for _ in 0..3 {
            let (instructions, _) = clock.measure(|| {
                for &byte in black_box(frame).iter().cycle().take(1500) {
                    inbox.take(byte);
                }
                black_box(inbox.turn(|_| Outcome::Done))
            });
            worst = worst.max(instructions);
        }
    }
    worst
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static FILTERS: ConstStaticCell<Filters> = ConstStaticCell::new(Filters::Robot(Filter::new()));
    static DETECTOR: ConstStaticCell<Detector> = ConstStaticCell::new(Detector::new());
    static REPORTER: ConstStaticCell<Reporter<VERTICES>> = ConstStaticCell::new(Reporter::new());
    static COSTS: ConstStaticCell<[PlaceCosts; 6]> = ConstStaticCell::new([const { PlaceCosts::new() }; 6]);
    static SLICE_COSTS: ConstStaticCell<SliceCosts> = ConstStaticCell::new(Costs::new());
    static TURN_COSTS: ConstStaticCell<FrameCosts> = ConstStaticCell::new(Costs::new());
    static SNAPSHOT: ConstStaticCell<[u8; SNAPSHOT_BYTES]> = ConstStaticCell::new([0; SNAPSHOT_BYTES]);
    static INBOX: ConstStaticCell<Inbox> = ConstStaticCell::new(Inbox::new());
    static DETECTOR_COSTS: ConstStaticCell<FrameCosts> = ConstStaticCell::new(Costs::new());

    let Some(core) = cortex_m::Peripherals::take() else { panic!() };
    let clock = &Clock::start(core.SYST);
    let (filters, detector_costs) = (FILTERS.take(), DETECTOR_COSTS.take());
    let [turn_costs, costs, both_costs, large_costs, paper_costs, report_costs] = COSTS.take();
    let slices = SLICE_COSTS.take();
    let mut wire = Wire { reporter: REPORTER.take(), encoder: Encoder::new(0), costs: report_costs, largest_bytes: 0 };
    let capacities = Capacities::new(VERTICES as u8, Filter::capacities(&reference::FILTER), SONARS as u8);
    wire.reporter.start(Hello::new(0, ResetCause::Unknown, reference::SEED, capacities), u16::MAX);

    let places_detected = detect(clock, DETECTOR.take(), detector_costs);
    if let Filters::Robot(filter) = filters {
        run(clock, filter, reference::FILTER, Told::Radius, (costs, slices), |_, _| {});
        slices.print("robust_instructions_per_slice");
        run(clock, filter, reference::FILTER, Told::Turn, (turn_costs, slices), |_, _| {});
        slices.print("robust_turn_instructions_per_slice");
        let report = |filter: &Filter, update: &Update| wire.report(clock, filter, update);
        run(clock, filter, reference::FILTER, Told::TurnAndDegree, (both_costs, slices), report);
        slices.print("robust_both_instructions_per_slice");
        let (instructions, bytes) = save(clock, filter, SNAPSHOT.take());
        hprintln!("snapshot_instructions: {}", instructions);
        hprintln!("snapshot_bytes: {}", bytes);
    }
    *filters = const { Filters::Paper(PaperReference::new()) };
    if let Filters::Paper(filter) = filters {
        run(clock, filter, reference::PAPER_FILTER, Told::Radius, (paper_costs, slices), |_, _| {});
    }
    // Of the robot's own stages, before the larger filter, sorting and formatting add to it.
    let stack_bytes = support::stack_high_water_bytes();
    *filters = const { Filters::Large(LargeFilter::new()) };
    if let Filters::Large(filter) = filters {
        run(clock, filter, LARGE_FILTER, Told::Turn, (large_costs, slices), |_, _| {});
    }

    hprintln!("places: {}", PLACES_MM.len());
    hprintln!("history_places: {}", HISTORY);
    turn_costs.print("robust_turn_instructions_per_place");
    costs.print("robust_instructions_per_place");
    both_costs.print("robust_both_instructions_per_place");
    large_costs.print("robust_32_turn_instructions_per_place");
    paper_costs.print("history_to_map_instructions_per_place");
    wire.costs.print("report_instructions_per_place");
    hprintln!("report_bytes_per_place_worst: {}", wire.largest_bytes);
    hprintln!("inbox_instructions_per_turn_worst: {}", flood(clock, INBOX.take()));
    let turn_frames = TURN_COSTS.take();
    *filters = const { Filters::Whole(ReferenceRobot::new()) };
    if let Filters::Whole(robot) = filters {
        turns(clock, robot, turn_frames);
    }
    turn_frames.print("turn_instructions_per_frame");
    hprintln!("robot_bytes: {}", size_of::<ReferenceRobot<'_>>());
    hprintln!("drive_bytes: {}", size_of::<Drive<VERTICES, HISTORY>>());
    hprintln!("inbox_bytes: {}", size_of::<Inbox>());
    hprintln!("frames: {}", FRAMES_MM.len());
    hprintln!("frames_places_detected: {}", places_detected);
    detector_costs.print("detector_instructions_per_frame");
    hprintln!("ticks_per_million_instructions: {}", clock.ticks_of_two_million / 2);
    hprintln!("filter_bytes: {}", size_of::<Filter>());
    hprintln!("large_filter_bytes: {}", size_of::<LargeFilter>());
    hprintln!("paper_filter_bytes: {}", size_of::<PaperReference>());
    hprintln!("mapper_bytes: {}", size_of::<RobotMapper>());
    hprintln!("stack_high_water_bytes: {}", stack_bytes);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
