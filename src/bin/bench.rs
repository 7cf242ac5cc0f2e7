//! The bench image: runs a recorded input through the same core as the robot's and prints what a place costs.
//!
//! Run it in QEMU with `-icount shift=0`: an instruction is then a nanosecond of virtual time, SysTick counts the core
//! clock, and the figures are the same in every run. The ticks of an instruction are measured with loops of known length.
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
    Fingerprint,
    reference::{self, Filter},
};

/// Radii in millimetres, place after place.
const INPUT_MM: [u16; 200] = include!("support/bench_input.rs");
const TICKS_PER_TURN: u32 = 1 << 24;
static TURNS: AtomicU32 = AtomicU32::new(0);

#[exception]
fn SysTick() {
    TURNS.store(TURNS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// SysTick extended to 56 bits by counting its turns.
struct Clock(SYST);

impl Clock {
    fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TICKS_PER_TURN - 1);
        timer.clear_current();
        timer.enable_interrupt();
        timer.enable_counter();
        Self(timer)
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

    fn measure<T>(&self, work: impl FnOnce() -> T) -> (u64, T) {
        let before = self.ticks();
        let result = work();
        (self.ticks() - before, result)
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

/// Ticks of two million instructions, the overhead of measuring taken off.
fn calibrate(clock: &Clock) -> u64 {
    let (short, ()) = clock.measure(|| loop_of_known_length(100_000));
    let (long, ()) = clock.measure(|| loop_of_known_length(1_100_000));
    long - short
}

#[cortex_m_rt::entry]
fn main() -> ! {
    static FILTER: ConstStaticCell<Filter> = ConstStaticCell::new(Filter::new());
    static COSTS: ConstStaticCell<[u64; INPUT_MM.len()]> = ConstStaticCell::new([0; INPUT_MM.len()]);

    let filter = FILTER.take();
    let costs = COSTS.take();
    let Some(core) = cortex_m::Peripherals::take() else { panic!() };
    if filter.start(reference::FILTER, reference::SEED).is_err() {
        panic!()
    }
    let clock = Clock::start(core.SYST);
    let ticks_of_two_million = calibrate(&clock);
    let instructions = |ticks: u64| ticks * 2_000_000 / ticks_of_two_million;
    for (cost, &radius_mm) in costs.iter_mut().zip(&INPUT_MM) {
        let Ok(fingerprint) = Fingerprint::from_radius_mm(radius_mm) else { panic!() };
        let (ticks, update) = clock.measure(|| filter.observe(black_box(fingerprint)));
        black_box(update);
        *cost = instructions(ticks);
    }
    // Before formatting, which is not part of the job, adds to it.
    let stack_bytes = support::stack_high_water_bytes();
    costs.sort_unstable();
    let [median, worst] = [costs.len() / 2, costs.len() - 1].map(|rank| costs.get(rank).copied().unwrap_or(0));
    hprintln!("places {}", INPUT_MM.len());
    hprintln!("instructions_per_place_median {}", median);
    hprintln!("instructions_per_place_worst {}", worst);
    hprintln!("instructions_all_places {}", costs.iter().sum::<u64>());
    hprintln!("ticks_per_million_instructions {}", ticks_of_two_million / 2);
    hprintln!("filter_bytes {}", size_of::<Filter>());
    hprintln!("stack_high_water_bytes {}", stack_bytes);
    hprintln!("vertices {}", filter.map().vertices());
    hprintln!("edges {}", filter.map().edges().count());
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}
