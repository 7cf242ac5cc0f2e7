//! The place detector: ring frames in, meet points of the generalised Voronoi graph out.
//!
//! A robot on the generalised Voronoi graph (Choset and Nagatani, the paper's section IV.A) has its two closest
//! obstacles at equal range. Where a third comes as close it is at a *meet point*: a junction, a bend, or the end of a
//! corridor, whose front wall is then as close as the walls beside. The common range is the place's fingerprint.
//!
//! Each sensor is smoothed by the median of its last three readings, and two echoes among four are heard, so that a
//! missed echo changes nothing; where a sensor is dead between two that hear about the same, it is taken to hear it too.
//! The closest obstacle is the nearest range of the ring, the next the nearest at least `separation_mrad` away from it
//! that is no part of the same wall, heard from along it, and so on. The *spread* is how much farther the third is than
//! the first: it falls to the noise at the meet point and rises again behind it. A frame within `equidistance_mm` shows
//! a meet point; enough of them confirm it; when they end, the place is reported once; the next is looked for after the
//! spread has risen beyond `leave_mm`.
//!
//! The radius is the mean, over the (at most eight) confirming frames with the smallest spread, of the mean range of
//! the equidistant obstacles. While the robot comes nearer to the third obstacle it draws away from the first two, so
//! their mean is nearly constant around the meet point, and averaging over frames costs little bias.
//!
//! ```
//! use toposlam::place::{PlaceConfig, PlaceDetector};
//! use toposlam::ring::{Echo, RingFrame, RingGeometry};
//!
//! let mut detector = PlaceDetector::<4>::new();
//! detector.start(PlaceConfig { live_sensors_min: 4, ..PlaceConfig::DEFAULT }, RingGeometry::even())?;
//! // Along a corridor 1.6 m wide to the wall at its end, and back; nothing to be heard behind.
//! let mut places = Vec::new();
//! for step in -50_i32..=50 {
//!     let [ahead, beside] = [800 + 30 * step.unsigned_abs() as u16, 800].map(|range_mm| Echo::Range { range_mm });
//!     places.extend(detector.observe(&RingFrame { echoes: [ahead, beside, Echo::Silence, beside] }));
//! }
//! assert_eq!(places.len(), 1);
//! assert!((800..=820).contains(&places[0].fingerprint.radius_mm()));
//! # Ok::<(), toposlam::place::PlaceConfigError>(())
//! ```

pub(crate) mod bearing;
mod config;
mod fingerprint;
pub(crate) mod scan;

pub use config::{PlaceConfig, PlaceConfigError};
pub use fingerprint::{Fingerprint, FingerprintError};

use crate::ring::{Echo, RingFrame, RingGeometry};
use crate::{FaultCounters, FaultKind};
use bearing::turn_mrad;
use scan::{DEAD, Meeting, SILENT, Scan, is_echo};

/// How many frames the radius is averaged over.
const KEPT: usize = 8;
/// Frames whose spread is this much above the smallest one do not count for the radius, in millimetres.
const KEPT_SPREAD_MM: u16 = 30;

/// A place that the robot has come by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The radius of the largest obstacle-free disc around the meet point.
    pub fingerprint: Fingerprint,
    /// The frame in which the robot was closest to the meet point, counted from 0 since the start of the detector.
    pub frame_index: u32,
    /// In how many directions the way leads on between the equidistant obstacles, 1 at a dead end; `None` when the
    /// frames disagree. A way that ends within 1.6 times the radius is not seen as one, and neither is one between two
    /// obstacles that are closer in bearing than `separation_mrad`.
    pub degree: Option<u8>,
    /// The smallest spread of the equidistant obstacles, in millimetres: how well the place was seen.
    pub spread_mm: u16,
}

/// A frame that shows a meet point.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    meeting: Meeting,
    frame_index: u32,
}

impl Sighting {
    const UNSET: Self = Self { meeting: Meeting { spread_mm: 0, radius_mm: 0, openings: 0 }, frame_index: 0 };
    /// Sorts behind every real sighting.
    const NONE: Self = Self { meeting: Meeting { spread_mm: SILENT, radius_mm: 0, openings: 0 }, frame_index: 0 };
}

/// Turns the frames of a ring of `SONARS` sensors into places.
///
/// The ranges are taken from the robot's centre; add the radius of the ring if the sensors measure from its rim.
/// Memory: about `12 · SONARS + 160` bytes. Time for each frame: at most six passes over the ring, `O(SONARS)` each; where most
/// sensors are dead, up to `O(SONARS²)`.
#[derive(Clone, Debug)]
pub struct PlaceDetector<const SONARS: usize> {
    config: PlaceConfig,
    /// The sensors counter-clockwise, by their number in the frame, and where they look.
    round: [u16; SONARS],
    geometry: RingGeometry<SONARS>,
    started: bool,
    /// Whether too few sensors of the newest frame live.
    blind: bool,
    /// The newest frame, smoothed.
    smooth_mm: [u16; SONARS],
    /// The three frames before, as smoothing reads them.
    earlier_mm: [[u16; SONARS]; 3],
    frame_index: u32,
    /// Whether the robot is still at the place that was reported last.
    leaving: bool,
    /// Frames that showed the meet point in sight.
    sighted: u8,
    /// Frames that spoke against the present state, less those that spoke for it.
    against: u8,
    /// The sightings with the smallest spread, best first.
    kept: [Sighting; KEPT],
    faults: FaultCounters,
}

impl<const SONARS: usize> PlaceDetector<SONARS> {
    /// A detector that waits for [`start`](Self::start); all zero, so that a `static` of it lies in `.bss`.
    pub const fn new() -> Self {
        Self {
            config: PlaceConfig::UNSET,
            round: [0; SONARS],
            geometry: RingGeometry { bearings_mrad: [0; SONARS] },
            started: false,
            blind: false,
            smooth_mm: [DEAD; SONARS],
            earlier_mm: [[DEAD; SONARS]; 3],
            frame_index: 0,
            leaving: false,
            sighted: 0,
            against: 0,
            kept: [Sighting::UNSET; KEPT],
            faults: FaultCounters::new(),
        }
    }

    /// Forgets everything and starts at frame 0.
    ///
    /// The sensors may be given in any order; sensors that look the same way are one.
    ///
    /// # Errors
    /// The first setting that is out of its range; the detector is then as it was.
    pub fn start(&mut self, config: PlaceConfig, geometry: RingGeometry<SONARS>) -> Result<(), PlaceConfigError> {
        config.check(SONARS)?;
        if geometry.bearings_mrad.iter().any(|bearing_mrad| !(-3142..=3142).contains(bearing_mrad)) {
            return Err(PlaceConfigError::Bearing);
        }
        self.config = config;
        for (sensor, bearing_mrad) in (0_u16..).zip(geometry.bearings_mrad) {
            let before = (0_u16..).zip(geometry.bearings_mrad).filter(|&(other, other_mrad)| {
                other_mrad < bearing_mrad || other_mrad == bearing_mrad && other < sensor
            });
            let position = before.count();
            if let (Some(number), Some(looks_mrad)) =
                (self.round.get_mut(position), self.geometry.bearings_mrad.get_mut(position))
            {
                (*number, *looks_mrad) = (sensor, bearing_mrad);
            }
        }
        self.started = true;
        self.smooth_mm = [DEAD; SONARS];
        self.earlier_mm = [[DEAD; SONARS]; 3];
        self.frame_index = 0;
        self.leaving = false;
        self.faults = FaultCounters::new();
        self.forget();
        Ok(())
    }

    /// Goes on with other settings.
    ///
    /// # Errors
    /// The first setting that is out of its range; the detector is then as it was.
    pub fn set_config(&mut self, config: PlaceConfig) -> Result<(), PlaceConfigError> {
        config.check(SONARS)?;
        self.config = config;
        Ok(())
    }

    /// Takes the next frame; gives a place when the robot has just been at one.
    ///
    /// A place is reported some frames after the robot was closest to it, and once for each visit. Before the start
    /// nothing happens.
    pub fn observe(&mut self, frame: &RingFrame<SONARS>) -> Option<Place> {
        if !self.started {
            return None;
        }
        let frame_index = self.frame_index;
        self.frame_index = self.frame_index.saturating_add(1);
        self.smooth_mm = self.smooth(frame);
        let live = self.smooth_mm.iter().filter(|range_mm| **range_mm != DEAD).count();
        self.blind = live < usize::from(self.config.live_sensors_min);
        self.bridge();
        if self.blind {
            self.faults.record(FaultKind::RingBlind);
            return None;
        }
        let meeting = self.scan().meeting();
        if self.leaving { self.leave(meeting) } else { self.look(Sighting { meeting, frame_index }) }
    }

    /// What the ring hears, smoothed.
    pub(crate) fn scan(&self) -> Scan<'_, SONARS> {
        Scan {
            ranges_mm: &self.smooth_mm,
            geometry: &self.geometry,
            separation_mrad: self.config.separation_mrad,
            equidistance_mm: self.config.equidistance_mm,
        }
    }

    /// Whether too few sensors of the newest frame live to look for a place, or to drive by.
    pub(crate) const fn is_blind(&self) -> bool {
        self.blind
    }

    /// Whether the robot is still at the place that was reported last.
    pub const fn is_at_place(&self) -> bool {
        self.leaving
    }

    /// The robot has not moved from the place that was reported last: what the ring hears while it turns on the spot does not
    /// mean that it leaves.
    pub const fn hold_place(&mut self) {
        if self.leaving {
            self.against = 0;
        }
    }

    /// The faults seen since the start: blind frames, nonsense ranges, radii that no fingerprint holds.
    pub const fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    /// Between two sensors that hear something about as near a dead one is taken to hear it as well: a wall must not fall into two
    /// obstacles where a sensor is missing.
    fn bridge(&mut self) {
        let ranges_mm = self.smooth_mm;
        let beside = |index: usize| Some((*ranges_mm.get(index)?, *self.geometry.bearings_mrad.get(index)?));
        for (index, range_mm) in self.smooth_mm.iter_mut().enumerate() {
            if *range_mm != DEAD {
                continue;
            }
            let (before, after) = ((index + SONARS - 1) % SONARS, (index + 1) % SONARS);
            let (Some((before_mm, from_mrad)), Some((after_mm, to_mrad))) = (beside(before), beside(after)) else {
                continue;
            };
            let is_gap_narrow = turn_mrad(from_mrad, to_mrad).abs() <= i32::from(self.config.separation_mrad);
            let hear_the_same =
                is_echo(before_mm) && is_echo(after_mm) && before_mm.abs_diff(after_mm) <= self.config.equidistance_mm;
            if is_gap_narrow && hear_the_same {
                *range_mm = before_mm / 2 + after_mm / 2;
            }
        }
    }

    /// What each sensor has heard lately.
    fn smooth(&mut self, frame: &RingFrame<SONARS>) -> [u16; SONARS] {
        let mut now_mm = [DEAD; SONARS];
        for (now_mm, &sensor) in now_mm.iter_mut().zip(&self.round) {
            *now_mm = match frame.echoes.get(usize::from(sensor)).copied().unwrap_or(Echo::Dead) {
                Echo::Dead => DEAD,
                Echo::Silence => SILENT,
                Echo::Range { range_mm } if range_mm < self.config.range_min_mm => {
                    self.faults.record(FaultKind::SonarOutOfRange);
                    DEAD
                }
                Echo::Range { range_mm } if range_mm > self.config.range_max_mm => SILENT,
                Echo::Range { range_mm } => range_mm,
            };
        }
        let [before_mm, long_before_mm, first_mm] = self.earlier_mm;
        self.earlier_mm = [now_mm, before_mm, long_before_mm];
        let mut smooth_mm = now_mm;
        let earlier_mm = before_mm.into_iter().zip(long_before_mm).zip(first_mm);
        for (smooth_mm, ((before_mm, long_before_mm), first_mm)) in smooth_mm.iter_mut().zip(earlier_mm) {
            *smooth_mm = smoothed(*smooth_mm, before_mm, long_before_mm, first_mm);
        }
        smooth_mm
    }

    /// Waits until the robot has left the place that was reported.
    fn leave(&mut self, meeting: Meeting) -> Option<Place> {
        if meeting.spread_mm >= self.config.leave_mm {
            self.against = self.against.saturating_add(1);
        } else {
            self.against = self.against.saturating_sub(1);
        }
        if self.against >= self.config.leave_frames {
            self.leaving = false;
            self.forget();
        }
        None
    }

    /// Looks for a meet point, and gathers its frames while it is in sight.
    fn look(&mut self, sighting: Sighting) -> Option<Place> {
        if sighting.meeting.spread_mm <= self.config.equidistance_mm {
            self.sighted = self.sighted.saturating_add(1);
            self.against = self.against.saturating_sub(1);
            self.keep(sighting);
        } else if self.sighted > 0 {
            self.against = self.against.saturating_add(1);
        }
        let over = self.against >= self.config.leave_frames;
        if self.sighted < self.config.confirm_frames {
            if over {
                self.forget();
            }
            return None;
        }
        if !over && self.sighted < self.config.settle_frames {
            return None;
        }
        let place = self.place();
        self.leaving = true;
        self.forget();
        place
    }

    /// Keeps a sighting among the best, in order of their spread.
    fn keep(&mut self, sighting: Sighting) {
        let mut carried = sighting;
        for kept in &mut self.kept {
            if carried.meeting.spread_mm < kept.meeting.spread_mm {
                core::mem::swap(kept, &mut carried);
            }
        }
    }

    /// Forgets the sightings.
    fn forget(&mut self) {
        self.kept = [Sighting::NONE; KEPT];
        self.sighted = 0;
        self.against = 0;
    }

    /// The place that the kept sightings add up to.
    fn place(&mut self) -> Option<Place> {
        let [best, ..] = self.kept;
        let limit_mm = best.meeting.spread_mm.saturating_add(KEPT_SPREAD_MM);
        let close = self.kept.iter().map(|kept| kept.meeting).filter(|meeting| meeting.spread_mm <= limit_mm);
        let (count, sum_mm) = close.clone().fold((0u32, 0u32), |(count, sum_mm), meeting| {
            (count.saturating_add(1), sum_mm.saturating_add(u32::from(meeting.radius_mm)))
        });
        let radius_mm = sum_mm.saturating_add(count / 2).checked_div(count).unwrap_or(0) as u16;
        let agreed = |degree: u8| close.clone().filter(|meeting| meeting.openings == degree).count() as u32;
        let degree = (1..=6).find(|degree| agreed(*degree).saturating_mul(4) >= count.saturating_mul(3));
        let Ok(fingerprint) = Fingerprint::from_radius_mm(radius_mm) else {
            self.faults.record(FaultKind::RadiusOutOfRange);
            return None;
        };
        Some(Place { fingerprint, frame_index: best.frame_index, degree, spread_mm: best.meeting.spread_mm })
    }
}

impl<const SONARS: usize> Default for PlaceDetector<SONARS> {
    fn default() -> Self {
        Self::new()
    }
}

/// The median of a sensor's last three readings, the newest first, or the shortest where the median is silence but two of the last
/// four are echoes: a sensor misses an obstacle more often than it invents one.
fn smoothed(now_mm: u16, before_mm: u16, long_before_mm: u16, first_mm: u16) -> u16 {
    match (now_mm, before_mm, long_before_mm) {
        (DEAD, _, _) => DEAD,
        (_, DEAD, DEAD) => now_mm,
        (_, DEAD, other_mm) | (_, other_mm, DEAD) => now_mm.min(other_mm),
        _ => {
            let median_mm = now_mm.min(before_mm).max(now_mm.max(before_mm).min(long_before_mm));
            let is_missed = median_mm == SILENT && is_echo(first_mm);
            if is_missed { now_mm.min(before_mm).min(long_before_mm) } else { median_mm }
        }
    }
}

#[cfg(test)]
mod tests;
