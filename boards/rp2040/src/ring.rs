//! The ring of eight HC-SR04 as an async task: it measures while the main loop computes, and hands over whole frames.

use embassy_futures::join::join;
use embassy_rp::gpio::{Input, Output};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, signal::Signal};
use embassy_time::{Duration, Instant, Timer, block_for, with_timeout};
use toposlam::{
    FaultCounters,
    ring::{
        Echo, RingFrame,
        drivers::{HcSr04Config, SonarFault},
    },
};

use crate::SONARS;

/// Sensors that fire together are opposite each other: four pairs, one after the other.
const PAIRS: usize = SONARS / 2;
/// The times and limits of the sensors.
const CONFIG: HcSr04Config<SONARS> = HcSr04Config::DEFAULT;
const TRIGGER: Duration = Duration::from_micros(CONFIG.trigger_us as u64);
const RISE_TIMEOUT: Duration = Duration::from_micros(CONFIG.rise_timeout_us as u64);
const ECHO_TIMEOUT: Duration = Duration::from_micros(CONFIG.echo_timeout_us as u64);
const CYCLE: Duration = Duration::from_millis(CONFIG.cycle_ms as u64);

/// The newest frame, with the faults since the start. The main loop waits for it; a frame that it did not take is replaced.
pub(crate) static FRAMES: Signal<CriticalSectionRawMutex, (RingFrame<SONARS>, FaultCounters)> = Signal::new();

/// The pins of a sensor. The echo line needs a voltage divider to 3.3 V.
pub(crate) struct Sonar {
    trigger: Output<'static>,
    echo: Input<'static>,
}

impl Sonar {
    pub(crate) const fn new(trigger: Output<'static>, echo: Input<'static>) -> Self {
        Self { trigger, echo }
    }

    /// Triggers the sensor and times its echo. The task wakes some µs after an edge; the delays of the two edges cancel.
    async fn range(&mut self) -> Result<Echo, SonarFault> {
        if self.echo.is_high() {
            return Err(SonarFault::Stuck);
        }
        self.trigger.set_high();
        block_for(TRIGGER);
        self.trigger.set_low();
        with_timeout(RISE_TIMEOUT, self.echo.wait_for_high()).await.map_err(|_| SonarFault::Silent)?;
        let rise = Instant::now();
        if with_timeout(ECHO_TIMEOUT, self.echo.wait_for_low()).await.is_err() {
            return Ok(Echo::Silence);
        }
        CONFIG.echo(rise.elapsed().as_micros() as u32)
    }
}

/// Measures without end.
#[embassy_executor::task]
pub(crate) async fn measure(mut sonars: [Sonar; SONARS]) {
    let mut faults = FaultCounters::new();
    let mut cycle = Instant::now();
    loop {
        let mut frame = RingFrame { echoes: [Echo::Dead; SONARS] };
        let (front, back) = sonars.split_at_mut(PAIRS);
        let (front_echoes, back_echoes) = frame.echoes.split_at_mut(PAIRS);
        let pairs = front.iter_mut().zip(back).zip(front_echoes.iter_mut().zip(back_echoes));
        for ((sonar, opposite), (echo, opposite_echo)) in pairs {
            let (measured, opposite_measured) = join(sonar.range(), opposite.range()).await;
            for (measured, echo) in [(measured, echo), (opposite_measured, opposite_echo)] {
                match measured {
                    Ok(measured) => *echo = measured,
                    Err(fault) => faults.record(fault.kind()),
                }
            }
            // The sound decays.
            cycle += CYCLE;
            Timer::at(cycle).await;
        }
        FRAMES.signal((frame, faults));
    }
}
