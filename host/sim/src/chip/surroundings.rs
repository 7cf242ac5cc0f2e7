//! The surroundings of the modelled rangers: a world of ring frames, and the cross-talk between rangers.

use toposlam::ring::{Echo, RingFrame};

/// A source of ring frames. A frame begins when a ranger fires that has already fired in the current one.
#[derive(Debug)]
pub(super) struct Surroundings<WORLD, const SONARS: usize> {
    world: WORLD,
    /// Whether neighbours that listen at the same time receive each other's pulse.
    pub(super) cross_talk: bool,
    pub(super) frames: u64,
    pub(super) blind_frames: u64,
    frame: Option<RingFrame<SONARS>>,
    fired: [bool; SONARS],
    heard: [Echo; SONARS],
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> Surroundings<WORLD, SONARS> {
    pub(super) fn new(world: WORLD) -> Self {
        Self {
            world,
            cross_talk: false,
            frames: 0,
            blind_frames: 0,
            frame: None,
            fired: [true; SONARS],
            heard: [Echo::Silence; SONARS],
        }
    }

    /// Fires some rangers at the same moment, while others are still listening.
    pub(super) fn fire(&mut self, who: [bool; SONARS], listening: [bool; SONARS]) {
        if (0..SONARS).any(|sensor| who[sensor] && self.fired[sensor]) {
            self.fired = [false; SONARS];
            self.frame = (self.world)();
            match self.frame {
                Some(_) => self.frames += 1,
                None => self.blind_frames += 1,
            }
        }
        let own = self.frame.map_or([Echo::Silence; SONARS], |frame| frame.echoes);
        for sensor in (0..SONARS).filter(|&sensor| who[sensor]) {
            self.fired[sensor] = true;
            self.heard[sensor] = own[sensor];
        }
        if self.cross_talk {
            for sensor in (0..SONARS).filter(|&sensor| who[sensor] || listening[sensor]) {
                for neighbour in [(sensor + 1) % SONARS, (sensor + SONARS - 1) % SONARS] {
                    if who[neighbour] || (who[sensor] && listening[neighbour]) {
                        self.heard[sensor] = nearer(self.heard[sensor], own[neighbour]);
                    }
                }
            }
        }
    }

    /// The echo of the last pulse of a ranger.
    pub(super) fn heard(&self, sensor: usize) -> Echo {
        self.heard[sensor]
    }

    /// Whether a ranger is dead in the world's frame; all are dead after the last frame.
    pub(super) fn is_dead(&self, sensor: usize) -> bool {
        self.is_over() || self.frame.is_some_and(|frame| frame.echoes[sensor] == Echo::Dead)
    }

    pub(super) fn is_over(&self) -> bool {
        self.blind_frames > 0
    }
}

/// The nearer of two echoes. A dead ranger receives nothing and sends nothing.
fn nearer(own: Echo, other: Echo) -> Echo {
    match (own, other.range_mm()) {
        (Echo::Range { range_mm }, Some(other_mm)) => Echo::Range { range_mm: range_mm.min(other_mm) },
        (Echo::Silence, Some(range_mm)) => Echo::Range { range_mm },
        _ => own,
    }
}

/// Round-trip time of flight at 343 m/s, in microseconds, rounded to the nearest.
pub(super) fn flight_us(range_mm: u16) -> u32 {
    (u32::from(range_mm) * 2000 + 343 / 2) / 343
}
