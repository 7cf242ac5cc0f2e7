//! Confirms meet points over several frames, and reports each of them once.

use super::came_by::CameBy;
use super::implausible::Plausibility;
use super::meet_point::MeetPoint;
use super::obstacles::Obstacles;
use super::openings::{MergedOpenings, Openings};
use super::rotation::RotationEstimate;
use super::scan::RingScan;
use super::smoothing::{DEAD_MM, RangeSmoother, SILENT_MM, bridge_dead_sensors};
use super::{Fingerprint, PlaceConfig};
use crate::bearing::{HALF_TURN_MRAD, rotated, turn_mrad};
use crate::config_error::ConfigError;
use crate::fault::{FaultCounters, FaultKind};
use crate::ring::{Echo, RingFrame, RingGeometry};

/// The radius is the mean over at most this many frames.
const AVERAGED_FRAMES: usize = 8;
/// Only frames whose spread is at most this much above the smallest one are averaged, in millimetres.
const AVERAGED_SPREAD_MM: u16 = 30;
/// A door is an opening of a place when at least this many sightings show it: a sensor looks through only while it is in front.
const DOOR_SIGHTINGS: u8 = 3;
/// Where the sonars miss more echoes than this share, in thousandths, silence is less certain,
const MISSED_PERMILLE: u16 = 80;
/// and one more sighting is needed for this share more.
const MISSED_PERMILLE_PER_SIGHTING: u16 = 14;
/// A place that is one only because a sensor looks through a door needs this many sightings: silence may be a missed echo.
const DOOR_CONFIRM_SIGHTINGS: u8 = 8;

/// A place that the robot has visited: a meet point of the Voronoi graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Radius of the largest obstacle-free disc around the meet point.
    pub fingerprint: Fingerprint,
    /// Index of the frame in which the robot was closest to the meet point, counted from 0 since the detector's start.
    pub frame_index: u32,
    /// Number of openings between the equidistant obstacles, 1 to 6, 1 at a dead end; `None` when fewer than three
    /// quarters of the averaged frames agree.
    ///
    /// This is the degree of the vertex. An edge that ends within 1.6 times the radius is not counted. With a door, a way between
    /// two obstacles closer in bearing than `separation_mrad`, it is the number of `ways`.
    pub degree: Option<u8>,
    /// The bearings of the openings that at least half of the averaged frames show, and of the doors that three frames at the
    /// place show, in the frame in which the place is reported. `degree` may be another number: it needs the agreement of more frames.
    pub ways: Openings,
    /// The direction from which the robot came: where straight behind was in the first frame that showed the meet point, as a
    /// bearing in the frame in which the place is reported.
    pub behind_mrad: i16,
    /// Smallest spread of the meet point's frames, in millimetres: 0 is an ideal meet point.
    pub spread_mm: u16,
}

/// A frame that shows a meet point.
#[derive(Clone, Copy, Debug)]
struct Sighting {
    meet_point: MeetPoint,
    frame_index: u32,
    /// The rotation of all bearings from the start to this frame.
    turned_mrad: i16,
}

impl Sighting {
    const UNSET: Self = Self::with_spread(0);
    /// Sorts behind every real sighting.
    const NONE: Self = Self::with_spread(u16::MAX);

    const fn with_spread(spread_mm: u16) -> Self {
        let meet_point = MeetPoint { spread_mm, radius_mm: 0, openings: Openings::NONE };
        Self { meet_point, frame_index: 0, turned_mrad: 0 }
    }
}

/// Detects places in the frames of a ring of `SONARS` sensors.
///
/// Ranges are measured from the robot's centre: a ring of sensors on its rim adds the radius of the ring.
/// Memory: about `16 · SONARS + 200` bytes. Time for each frame: at most six passes over the ring, `O(SONARS)` each; where most
/// sensors are dead, up to `O(SONARS²)`.
#[derive(Clone, Debug)]
pub struct PlaceDetector<const SONARS: usize> {
    config: PlaceConfig,
    /// Index in the frame of each sensor, in ascending order of bearing.
    sensor_order: [u16; SONARS],
    /// The bearings in that order.
    geometry: RingGeometry<SONARS>,
    is_started: bool,
    is_blind: bool,
    plausibility: Plausibility<SONARS>,
    smoother: RangeSmoother<SONARS>,
    /// The newest frame, smoothed.
    smooth_mm: [u16; SONARS],
    /// Its obstacles, as the sonars measure them.
    measured: Obstacles,
    frame_index: u32,
    rotation: RotationEstimate,
    /// The rotation of all bearings since the start, −3142 to 3142.
    turned_mrad: i16,
    /// Whether the robot is still at the place that was reported last.
    is_at_place: bool,
    /// Frames that showed the current meet point.
    sightings: u8,
    /// Those that did so only because a sensor looks through a door.
    door_sightings: u8,
    /// `turned_mrad` in the first of them.
    first_turned_mrad: i16,
    came_by: CameBy,
    /// The doors in the sightings, with bearings at the start. In a ring with wide gaps between the sensors all openings are seen as doors are.
    doors: MergedOpenings,
    /// Frames that contradict the present state minus frames that confirm it, at least 0.
    contrary_frames: u8,
    /// The sightings with the smallest spread, best first.
    best: [Sighting; AVERAGED_FRAMES],
    faults: FaultCounters,
}

impl<const SONARS: usize> PlaceDetector<SONARS> {
    /// Creates a detector that is not started. It is all zero, so a `static` of it is in `.bss`.
    pub const fn new() -> Self {
        Self {
            config: PlaceConfig::UNSET,
            sensor_order: [0; SONARS],
            geometry: RingGeometry { bearings_mrad: [0; SONARS] },
            is_started: false,
            is_blind: false,
            plausibility: Plausibility::new(),
            smoother: RangeSmoother::new(),
            smooth_mm: [DEAD_MM; SONARS],
            measured: Obstacles::NONE,
            frame_index: 0,
            rotation: RotationEstimate::new(),
            turned_mrad: 0,
            is_at_place: false,
            sightings: 0,
            door_sightings: 0,
            first_turned_mrad: 0,
            came_by: CameBy::new(),
            doors: MergedOpenings::new(),
            contrary_frames: 0,
            best: [Sighting::UNSET; AVERAGED_FRAMES],
            faults: FaultCounters::new(),
        }
    }

    /// Resets the detector and starts it at frame 0.
    ///
    /// The sensors may be in any order of bearing, and several may have the same bearing.
    ///
    /// # Errors
    /// The first setting that is out of its range; the detector does not change then.
    pub fn start(&mut self, config: PlaceConfig, geometry: RingGeometry<SONARS>) -> Result<(), ConfigError> {
        config.check(SONARS)?;
        for bearing_mrad in geometry.bearings_mrad {
            ConfigError::check("bearings_mrad", bearing_mrad.into(), -3142, 3142)?;
        }
        self.config = config;
        for (sensor, bearing_mrad) in (0_u16..).zip(geometry.bearings_mrad) {
            let before = (0_u16..).zip(geometry.bearings_mrad).filter(|&(other, other_mrad)| {
                other_mrad < bearing_mrad || other_mrad == bearing_mrad && other < sensor
            });
            let position = before.count();
            if let (Some(index), Some(sorted_mrad)) =
                (self.sensor_order.get_mut(position), self.geometry.bearings_mrad.get_mut(position))
            {
                (*index, *sorted_mrad) = (sensor, bearing_mrad);
            }
        }
        self.is_started = true;
        self.smooth_mm = [DEAD_MM; SONARS];
        self.measured = Obstacles::NONE;
        self.plausibility.clear();
        self.smoother.clear();
        self.frame_index = 0;
        self.rotation = RotationEstimate::new();
        self.turned_mrad = 0;
        self.is_at_place = false;
        self.came_by.forget();
        self.faults = FaultCounters::new();
        self.forget_sightings();
        Ok(())
    }

    /// Changes the settings and continues.
    ///
    /// # Errors
    /// The first setting that is out of its range; the detector does not change then.
    pub fn set_config(&mut self, config: PlaceConfig) -> Result<(), ConfigError> {
        config.check(SONARS)?;
        self.config = config;
        Ok(())
    }

    /// Processes the next frame, and returns a place when one is complete.
    ///
    /// Each visit of a place is reported once, some frames after the robot was closest to it. Before
    /// [`start`](Self::start) this does nothing.
    pub fn observe(&mut self, frame: &RingFrame<SONARS>) -> Option<Place> {
        if !self.is_started {
            return None;
        }
        let frame_index = self.frame_index;
        self.frame_index = self.frame_index.saturating_add(1);
        let mut ranges_mm = self.valid_ranges_mm(frame);
        for _ in 0..self.plausibility.check(&mut ranges_mm, self.rotation.rotation_mrad()) {
            self.faults.record(FaultKind::SonarImplausible);
        }
        self.smooth_mm = self.smoother.update(ranges_mm);
        let live = ranges_mm.iter().filter(|range_mm| **range_mm != DEAD_MM).count();
        self.is_blind = live < usize::from(self.config.live_sensors_min);
        bridge_dead_sensors(&mut self.smooth_mm, &self.geometry, &self.config);
        if self.is_blind {
            self.faults.record(FaultKind::RingBlind);
            return None;
        }
        let measured = self.scan().measured_obstacles();
        self.measured = measured;
        self.rotation.update(&self.smooth_mm, &self.geometry);
        self.turned_mrad = rotated(self.turned_mrad, self.rotation.rotation_mrad());
        // Near a meet point the robot may turn towards it: the way by which it came is then not straight behind.
        let nearest_mm = (self.config.leave_mm / 2).saturating_mul(3);
        let is_far = measured.spread_mm().is_none_or(|spread_mm| spread_mm > nearest_mm);
        let is_on_edge = !self.is_at_place && self.sightings == 0 && is_far;
        let mut came_by = self.came_by;
        came_by.track(&self.scan(), &measured, self.rotation.rotation_mrad(), is_on_edge);
        self.came_by = came_by;
        if self.is_at_place {
            self.wait_for_departure(measured.spread_mm().unwrap_or(u16::MAX));
            return None;
        }
        let obstacles = self.scan().beside_way(measured);
        let meet_point = self.scan().meet_point(&obstacles);
        self.confirm(Sighting { meet_point, frame_index, turned_mrad: self.turned_mrad }, &obstacles)
    }

    /// Returns the newest frame, smoothed.
    pub const fn scan(&self) -> RingScan<'_, SONARS> {
        RingScan {
            ranges_mm: &self.smooth_mm,
            geometry: &self.geometry,
            separation_mrad: self.config.separation_mrad,
            equidistance_mm: self.config.equidistance_mm,
            came_by_mrad: self.came_by.bearing_mrad(),
        }
    }

    /// The obstacles of the newest frame, as those of its [`scan`](Self::scan), without a search.
    pub(crate) fn obstacles(&self) -> Obstacles {
        self.scan().beside_way(self.measured)
    }

    /// Change of all bearings between the two newest frames in milliradians, counter-clockwise positive: the negative of the
    /// robot's rotation, estimated from the bearings of the obstacles.
    pub fn rotation_mrad(&self) -> i32 {
        self.rotation.rotation_mrad()
    }

    /// Whether the newest frame has fewer live sensors than `live_sensors_min`: too few to detect a place or to drive.
    pub const fn is_blind(&self) -> bool {
        self.is_blind
    }

    /// Whether the robot is still at the place that was reported last.
    pub const fn is_at_place(&self) -> bool {
        self.is_at_place
    }

    /// Announces that the robot has not left the last reported place.
    ///
    /// Call it after each frame while the robot turns in place: the ranges then change without a departure.
    pub const fn hold_place(&mut self) {
        if self.is_at_place {
            self.contrary_frames = 0;
        }
    }

    /// Announces that the robot may be elsewhere: the way by which it came is unknown.
    pub const fn forget_way(&mut self) {
        self.came_by.forget();
    }

    /// Faults since the start: blind frames, ranges out of range, radii that no fingerprint represents.
    pub const fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    /// The ranges of a frame in ascending order of bearing, each checked against the limits of the configuration.
    fn valid_ranges_mm(&mut self, frame: &RingFrame<SONARS>) -> [u16; SONARS] {
        let mut ranges_mm = [DEAD_MM; SONARS];
        for (range_mm, &sensor) in ranges_mm.iter_mut().zip(&self.sensor_order) {
            *range_mm = match frame.echoes.get(usize::from(sensor)).copied().unwrap_or(Echo::Dead) {
                Echo::Dead => DEAD_MM,
                Echo::Silence => SILENT_MM,
                Echo::Range { range_mm } if range_mm < self.config.range_min_mm => {
                    self.faults.record(FaultKind::SonarOutOfRange);
                    DEAD_MM
                }
                Echo::Range { range_mm } if range_mm > self.config.range_max_mm => SILENT_MM,
                Echo::Range { range_mm } => range_mm,
            };
        }
        ranges_mm
    }

    /// At a reported place: counts the frames that show a departure.
    fn wait_for_departure(&mut self, spread_mm: u16) {
        if spread_mm >= self.config.leave_mm {
            self.contrary_frames = self.contrary_frames.saturating_add(1);
        } else {
            self.contrary_frames = self.contrary_frames.saturating_sub(1);
        }
        if self.contrary_frames >= self.config.leave_frames {
            self.is_at_place = false;
            self.came_by = CameBy::DEPARTED;
            self.forget_sightings();
        }
    }

    /// Between places: collects the frames that show a meet point, and returns the place when it is complete.
    fn confirm(&mut self, sighting: Sighting, obstacles: &Obstacles) -> Option<Place> {
        if sighting.meet_point.spread_mm <= self.config.equidistance_mm {
            if self.sightings == 0 {
                self.first_turned_mrad = self.turned_mrad;
            }
            self.sightings = self.sightings.saturating_add(1);
            self.door_sightings = self.door_sightings.saturating_add(obstacles.is_at_door().into());
            self.contrary_frames = self.contrary_frames.saturating_sub(1);
            let scan = self.scan();
            let doors =
                if scan.has_wide_gaps() { sighting.meet_point.openings } else { scan.narrow_openings(obstacles) };
            let same_mrad = Openings::same_mrad(self.scan().spacing_mrad());
            self.doors.add(&doors, turn_mrad(self.turned_mrad, 0), same_mrad);
            self.insert(sighting);
        } else if self.sightings > 0 {
            self.contrary_frames = self.contrary_frames.saturating_add(1);
        }
        let is_over = self.contrary_frames >= self.config.leave_frames;
        let confirm_sightings =
            DOOR_CONFIRM_SIGHTINGS.saturating_add(self.doubtful_sightings()).max(self.config.confirm_frames);
        let is_confirmed = self.sightings.saturating_sub(self.door_sightings) >= self.config.confirm_frames
            || self.sightings >= confirm_sightings;
        if !is_confirmed {
            if is_over {
                self.forget_sightings();
            }
            return None;
        }
        if !is_over && self.sightings < self.config.settle_frames {
            return None;
        }
        let place = self.place();
        self.is_at_place = true;
        self.forget_sightings();
        place
    }

    /// The sightings of a door that are needed in addition where the sonars miss many echoes.
    fn doubtful_sightings(&self) -> u8 {
        let more_permille = self.smoother.missed_permille().saturating_sub(MISSED_PERMILLE);
        (more_permille / MISSED_PERMILLE_PER_SIGHTING).min(u8::MAX.into()) as u8
    }

    /// Inserts a sighting into the best ones, in ascending order of spread. A sighting that is displaced goes behind those of its
    /// own spread, so the newer ones stay: a stable order, as that of `TopK`, would keep the older ones.
    fn insert(&mut self, mut sighting: Sighting) {
        for slot in &mut self.best {
            if sighting.meet_point.spread_mm < slot.meet_point.spread_mm {
                core::mem::swap(slot, &mut sighting);
            }
        }
    }

    /// Announces that the robot is not on the Voronoi graph: what it has seen of a meet point is void.
    pub fn forget_sightings(&mut self) {
        self.best = [Sighting::NONE; AVERAGED_FRAMES];
        self.doors = MergedOpenings::new();
        self.sightings = 0;
        self.door_sightings = 0;
        self.contrary_frames = 0;
    }

    /// The mean of the best sightings.
    fn place(&mut self) -> Option<Place> {
        let [best, ..] = self.best;
        let limit_mm = best.meet_point.spread_mm.saturating_add(AVERAGED_SPREAD_MM);
        let close = self.best.iter().filter(|sighting| sighting.meet_point.spread_mm <= limit_mm);
        let (count, sum_mm) = close.clone().fold((0u32, 0u32), |(count, sum_mm), sighting| {
            (count.saturating_add(1), sum_mm.saturating_add(u32::from(sighting.meet_point.radius_mm)))
        });
        let radius_mm = sum_mm.saturating_add(count / 2).checked_div(count).unwrap_or(0) as u16;
        let agreed =
            |degree: u8| close.clone().filter(|sighting| sighting.meet_point.openings.count() == degree).count() as u32;
        let degree = (1..=6).find(|degree| agreed(*degree).saturating_mul(4) >= count.saturating_mul(3));
        let Ok(fingerprint) = Fingerprint::from_radius_mm(radius_mm) else {
            self.faults.record(FaultKind::RadiusOutOfRange);
            return None;
        };
        let same_mrad = Openings::same_mrad(self.scan().spacing_mrad());
        let mut ways = MergedOpenings::new();
        close.for_each(|sighting| {
            ways.add(&sighting.meet_point.openings, turn_mrad(sighting.turned_mrad, self.turned_mrad), same_mrad);
        });
        let mut ways = ways.agreed();
        let mut degree = degree;
        let doors = self.doors.shown_by(DOOR_SIGHTINGS.saturating_add(self.doubtful_sightings()));
        for &bearing_mrad in doors.bearings_mrad() {
            let bearing_mrad = rotated(bearing_mrad, self.turned_mrad.into());
            ways.insert(bearing_mrad, same_mrad);
        }
        if doors.count() > 0 {
            degree = Some(ways.count());
        }
        let behind_mrad = rotated(HALF_TURN_MRAD, turn_mrad(self.first_turned_mrad, self.turned_mrad));
        let (frame_index, spread_mm) = (best.frame_index, best.meet_point.spread_mm);
        Some(Place { fingerprint, frame_index, degree, ways, behind_mrad, spread_mm })
    }
}

impl<const SONARS: usize> Default for PlaceDetector<SONARS> {
    fn default() -> Self {
        Self::new()
    }
}
