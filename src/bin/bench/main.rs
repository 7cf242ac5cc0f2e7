//! The bench image: runs a recorded input through the core of the robot and prints the cost of each stage, one
//! `name: value` per line. `docs/costs.md` explains the names.
//!
//! Run it in QEMU with `-icount shift=0`: an instruction then takes a nanosecond of virtual time, and the figures are the
//! same in every run. Their resolution is one tick of SysTick, about six instructions.

mod clock;
mod costs;
mod grid;
#[path = "../shared/mod.rs"]
mod shared;

use core::{hint::black_box, mem::size_of};

use clock::Clock;
use cortex_m_semihosting::{debug, hprintln};
use costs::Costs;
use defmt_rtt as _;
use grid::Grid;
use static_cell::ConstStaticCell;
use toposlam::{
    Exit, FaultCounters, Filter as _, Fingerprint, Observation, Update, Ways,
    drive::{Drive, VelocityCommand},
    persist::Persist,
    persist::snapshot::Writer,
    reference::{
        self, Detector, Filter, HISTORY, ReferenceRobot, RobotMapper, SNAPSHOT_BYTES, SONARS, VERTICES, paper, robust,
    },
    ring::{Echo, RingFrame},
    robot::{Board, SaveError},
    wire::{
        Capacities, Chunk, Command, Encoder, Hello, Inbox, MAX_FRAME_BYTES, Outcome, QueueFull, Reporter, Request,
        ResetCause,
    },
};

/// Radius of each recorded place, in millimetres.
const PLACES_MM: [u16; 400] = include!("places.rs");
/// Hints of each place: bearings of the ways other than the one the robot came by, the exit from the place before, and the travel
/// time in ring frames; 0 if it is unknown. Bearings are in milliradians from the way the robot came by.
const HINTS: [RecordedHints; PLACES_MM.len()] = include!("hints.rs");
type RecordedHints = (Option<&'static [u16]>, Option<u16>, u16);
/// Ranges of each recorded frame, in millimetres; 0 is silence.
const FRAMES_MM: [[u16; SONARS]; 200] = include!("frames.rs");

/// The filters share one memory: together they do not fit.
#[allow(clippy::large_enum_variant)]
enum Filters {
    /// The whole robot.
    Whole(ReferenceRobot<'static>),
    Robot(Filter),
    Robust(robust::Filter),
    Paper(paper::Filter),
}

type PlaceCosts = Costs<{ PLACES_MM.len() }>;
type RefinementCosts = Costs<{ SLICES * PLACES_MM.len() }>;
type FrameCosts = Costs<{ FRAMES_MM.len() }>;

/// Refinement steps between two places. The robot runs one for each ring frame, some hundreds.
const SLICES: usize = 10;
/// The long run repeats the recorded places this often.
const REPETITIONS: usize = 25;

/// What an observation contains.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Hints {
    /// The radius only.
    Radius,
    /// Radius and exit.
    Exit,
    /// Radius, exit and ways.
    Ways,
    /// All of these and the travel time.
    All,
}

fn observation(radius_mm: u16, (others_mrad, exit_mrad, travel_frames): RecordedHints, hints: Hints) -> Observation {
    let Ok(fingerprint) = Fingerprint::from_radius_mm(radius_mm) else { panic!() };
    let exit = exit_mrad.and_then(|exit_mrad| Exit::from_bearing_mrad(exit_mrad).ok());
    let ways = others_mrad.and_then(|others_mrad| Ways::from_bearings_mrad(others_mrad).ok());
    let travel = Some(travel_frames).filter(|&frames| frames > 0);
    Observation {
        exit: exit.filter(|_| hints != Hints::Radius),
        ways: ways.filter(|_| matches!(hints, Hints::Ways | Hints::All)),
        travel_frames: travel.filter(|_| hints == Hints::All),
        ..Observation::new(fingerprint)
    }
}

/// Runs the recorded places through a filter, and calls `then` after each.
fn run<const V: usize, F: toposlam::Filter<V>>(
    clock: &Clock,
    filter: &mut F,
    config: F::Config,
    hints: Hints,
    (costs, refinements): (&mut PlaceCosts, &mut RefinementCosts),
    mut then: impl FnMut(&F, &Update),
) {
    let Ok(()) = filter.start(config, reference::SEED) else { panic!() };
    for (&radius_mm, &recorded) in PLACES_MM.iter().zip(&HINTS) {
        let observation = observation(radius_mm, recorded, hints);
        let (instructions, update) = clock.measure(|| filter.observe(black_box(observation)));
        costs.push(instructions);
        then(filter, &update);
        for _ in 0..SLICES {
            let (instructions, ()) = clock.measure(|| filter.refine());
            refinements.push(instructions);
        }
    }
}

/// Runs the recorded places through the filter again and again, with one refinement step after each place. The robot is carried
/// back to the first place after each repetition. Prints the costs of each thousand places.
fn run_long(clock: &Clock, filter: &mut Filter) {
    let Ok(()) = filter.start(reference::FILTER, reference::SEED) else { panic!() };
    let (mut sum, mut worst, mut places) = (0, 0, 0);
    for repetition in 0..REPETITIONS {
        for (index, (&radius_mm, &recorded)) in PLACES_MM.iter().zip(&HINTS).enumerate() {
            let starts_sequence = repetition > 0 && index == 0;
            let observation = Observation { starts_sequence, ..observation(radius_mm, recorded, Hints::All) };
            let (instructions, _) = clock.measure(|| filter.observe(black_box(observation)));
            filter.refine();
            sum += instructions;
            worst = instructions.max(worst);
            places += 1;
            if places % 1000 == 0 {
                hprintln!("long_{}_instructions_per_place_mean: {}", places, sum / 1000);
                hprintln!("long_{}_instructions_per_place_worst: {}", places, worst);
                (sum, worst) = (0, 0);
            }
        }
    }
    hprintln!("long_vertices: {}", filter.map().vertices().len());
}

/// Runs a walk through a large building through the filter.
fn run_large(clock: &Clock, filter: &mut Filter, (costs, refinements): (&mut PlaceCosts, &mut RefinementCosts)) {
    let Ok(()) = filter.start(reference::FILTER, reference::SEED) else { panic!() };
    let mut grid = Grid::new();
    for _ in 0..PLACES_MM.len() {
        let observation = grid.step();
        let (instructions, _) = clock.measure(|| filter.observe(black_box(observation)));
        costs.push(instructions);
        for _ in 0..SLICES {
            let (instructions, ()) = clock.measure(|| filter.refine());
            refinements.push(instructions);
        }
    }
}

/// Encodes the messages of each place, and measures that.
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

/// Runs the recorded frames through the place detector. Returns the number of places.
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

/// A board that does nothing.
struct NullBoard;

impl Board for NullBoard {
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

/// Runs the recorded frames through the whole robot, drive and messages included. Frames with a place are not counted.
fn turns(clock: &Clock, robot: &mut ReferenceRobot<'static>, costs: &mut FrameCosts) {
    let Ok(()) = robot.start(&reference::ROBOT, &mut []) else { panic!() };
    for ranges_mm in &FRAMES_MM {
        let echo = |range_mm| if range_mm == 0 { Echo::Silence } else { Echo::Range { range_mm } };
        let frame = RingFrame { echoes: ranges_mm.map(echo) };
        let (instructions, seen) =
            clock.measure(|| robot.turn(black_box(&frame), &FaultCounters::new(), &mut NullBoard));
        if seen.is_none() {
            costs.push(instructions);
        }
    }
}

/// Saves a filter with a full history. Returns the cost and the number of bytes.
fn save(clock: &Clock, filter: &mut Filter, buffer: &mut [u8]) -> (u64, usize) {
    clock.measure(|| {
        let Ok(mut writer) = Writer::new(buffer) else { panic!() };
        let Ok(()) = filter.save(&mut writer) else { panic!() };
        writer.finish().unwrap_or(0)
    })
}

/// Largest cost of the inbox for the bytes that a line of 115,200 baud delivers in a step of 130 ms: the shortest and the
/// longest requests, and invalid bytes.
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
    static COSTS: ConstStaticCell<[PlaceCosts; 7]> = ConstStaticCell::new([const { PlaceCosts::new() }; 7]);
    static REFINEMENT_COSTS: ConstStaticCell<RefinementCosts> = ConstStaticCell::new(Costs::new());
    static TURN_COSTS: ConstStaticCell<FrameCosts> = ConstStaticCell::new(Costs::new());
    static SNAPSHOT: ConstStaticCell<[u8; SNAPSHOT_BYTES]> = ConstStaticCell::new([0; SNAPSHOT_BYTES]);
    static INBOX: ConstStaticCell<Inbox> = ConstStaticCell::new(Inbox::new());
    static DETECTOR_COSTS: ConstStaticCell<FrameCosts> = ConstStaticCell::new(Costs::new());

    let Some(core) = cortex_m::Peripherals::take() else { panic!() };
    let clock = &Clock::start(core.SYST);
    let (filters, detector_costs) = (FILTERS.take(), DETECTOR_COSTS.take());
    let [ordered_costs, large_costs, turn_costs, costs, both_costs, paper_costs, report_costs] = COSTS.take();
    let refinements = REFINEMENT_COSTS.take();
    let mut wire = Wire { reporter: REPORTER.take(), encoder: Encoder::new(0), costs: report_costs, largest_bytes: 0 };
    let capacities = Capacities::new(VERTICES as u8, Filter::capacities(&reference::FILTER), SONARS as u8);
    wire.reporter.start(Hello::new(0, ResetCause::Unknown, reference::SEED, capacities), u16::MAX);

    let places_detected = detect(clock, DETECTOR.take(), detector_costs);
    if let Filters::Robot(filter) = filters {
        let report = |filter: &Filter, update: &Update| wire.report(clock, filter, update);
        run(clock, filter, reference::FILTER, Hints::All, (ordered_costs, refinements), report);
        refinements.print("ordered_instructions_per_refinement");
        let (instructions, bytes) = save(clock, filter, SNAPSHOT.take());
        hprintln!("snapshot_instructions: {}", instructions);
        hprintln!("snapshot_bytes: {}", bytes);
        hprintln!("ordered_vertices: {}", filter.map().vertices().len());
        let stack_bytes = shared::stack_high_water_bytes();
        hprintln!("ordered_stack_high_water_bytes: {}", stack_bytes);
        run_large(clock, filter, (large_costs, refinements));
        refinements.print("large_instructions_per_refinement");
        hprintln!("large_vertices: {}", filter.map().vertices().len());
    }
    *filters = const { Filters::Robust(robust::Filter::new()) };
    if let Filters::Robust(filter) = filters {
        run(clock, filter, robust::FILTER, Hints::Radius, (costs, refinements), |_, _| {});
        refinements.print("robust_instructions_per_refinement");
        run(clock, filter, robust::FILTER, Hints::Exit, (turn_costs, refinements), |_, _| {});
        refinements.print("robust_turn_instructions_per_refinement");
        run(clock, filter, robust::FILTER, Hints::Ways, (both_costs, refinements), |_, _| {});
        refinements.print("robust_both_instructions_per_refinement");
    }
    *filters = const { Filters::Paper(paper::Filter::new()) };
    if let Filters::Paper(filter) = filters {
        run(clock, filter, paper::FILTER, Hints::Radius, (paper_costs, refinements), |_, _| {});
    }
    // Measured here, before sorting and formatting use more stack than the robot does.
    let stack_bytes = shared::stack_high_water_bytes();

    hprintln!("places: {}", PLACES_MM.len());
    hprintln!("history_places: {}", HISTORY);
    ordered_costs.print("ordered_instructions_per_place");
    large_costs.print("large_instructions_per_place");
    turn_costs.print("robust_turn_instructions_per_place");
    costs.print("robust_instructions_per_place");
    both_costs.print("robust_both_instructions_per_place");
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
    hprintln!("drive_bytes: {}", size_of::<Drive<VERTICES>>());
    hprintln!("inbox_bytes: {}", size_of::<Inbox>());
    hprintln!("frames: {}", FRAMES_MM.len());
    hprintln!("frames_places_detected: {}", places_detected);
    detector_costs.print("detector_instructions_per_frame");
    hprintln!("ticks_per_million_instructions: {}", clock.ticks_per_million_instructions());
    hprintln!("filter_bytes: {}", size_of::<Filter>());
    hprintln!("robust_filter_bytes: {}", size_of::<robust::Filter>());
    hprintln!("paper_filter_bytes: {}", size_of::<paper::Filter>());
    hprintln!("mapper_bytes: {}", size_of::<RobotMapper>());
    hprintln!("stack_high_water_bytes: {}", stack_bytes);
    *filters = const { Filters::Robot(Filter::new()) };
    if let Filters::Robot(filter) = filters {
        run_long(clock, filter);
    }
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
