//! The whole way on the robot: ring frame → place → hypotheses → map update → wire.

use crate::persist::snapshot::{FILTER_SECTION, Resume, Snapshot, SnapshotError, Writer};
use crate::place::{Place, PlaceConfig, PlaceConfigError, PlaceDetector};
use crate::ring::{RingFrame, RingGeometry};
use crate::wire::{Capacities, Hello, Message, QueueFull, Reporter, ResetCause};
use crate::{ConfigError, FaultCounters, Filter, Map, Observation, RobustConfig, Turn, Update};
use core::fmt;

/// How often the robot introduces itself, in ring frames.
const FRAMES_PER_HELLO: u16 = 100;

/// How many slices of polishing are made between two places at most: more seldom find anything, and a robot may stand for days.
const SLICES_PER_PLACE: u16 = 64;
/// And how many while the best map does not explain what was observed.
const SLICES_IN_DOUBT: u16 = 400;

/// The settings of every stage; `C` are those of the filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapperConfig<const SONARS: usize, C> {
    /// Where the sonars look.
    pub geometry: RingGeometry<SONARS>,
    /// The place detector.
    pub place: PlaceConfig,
    /// The filter.
    pub filter: C,
    /// The seed of the filter's random draws.
    pub seed: u64,
    /// A number that differs from one start of the robot to the next; 0 when it has none.
    pub boot: u32,
    /// Why the robot started.
    pub reset_cause: ResetCause,
}

impl<const SONARS: usize> MapperConfig<SONARS, RobustConfig> {
    pub(crate) const UNSET: Self = Self {
        geometry: RingGeometry { bearings_mrad: [0; SONARS] },
        place: PlaceConfig::UNSET,
        filter: RobustConfig::UNSET,
        seed: 0,
        boot: 0,
        reset_cause: ResetCause::Unknown,
    };
}

/// The stages from the ring frame to the messages of the wire, in one piece of fixed memory: a ring of `SONARS`, and a
/// filter with maps of `V` vertices.
///
/// The firmware and a simulation on a host run this same code, and the same frames give the same messages.
#[derive(Clone, Debug)]
pub struct Mapper<const SONARS: usize, const V: usize, F> {
    detector: PlaceDetector<SONARS>,
    filter: F,
    reporter: Reporter<V>,
    /// The next place does not follow on the last one.
    begins: bool,
    /// Slices of polishing since the last place.
    slices: u16,
}

impl<const SONARS: usize, const V: usize, F: Filter<V>> Mapper<SONARS, V, F> {
    /// A mapper that waits for [`Mapper::start`].
    pub const fn new() -> Self {
        Self {
            detector: PlaceDetector::new(),
            filter: F::UNSTARTED,
            reporter: Reporter::new(),
            begins: false,
            slices: 0,
        }
    }

    /// Forgets everything and starts anew.
    ///
    /// # Errors
    /// [`MapperError`] names the first setting that is out of its range; the mapper must then be started again.
    pub fn start(&mut self, config: &MapperConfig<SONARS, F::Config>) -> Result<(), MapperError> {
        self.detector.start(config.place, config.geometry).map_err(MapperError::Place)?;
        self.filter.start(config.filter, config.seed).map_err(MapperError::Filter)?;
        self.begins = false;
        self.slices = 0;
        let capacities = Capacities::new(V as u8, F::capacities(&config.filter), SONARS as u8);
        self.reporter.start(Hello::new(config.boot, config.reset_cause, config.seed, capacities), FRAMES_PER_HELLO);
        Ok(())
    }

    /// Sends the whole map with the next frames, several pieces each, as [`Reporter::hurry`] does.
    pub fn hurry(&mut self) {
        self.reporter.hurry();
    }

    /// Forgets the map, as [`Mapper::start`] does, and tells the listener.
    ///
    /// # Errors
    /// As [`Mapper::start`].
    pub fn reset(
        &mut self,
        config: &MapperConfig<SONARS, F::Config>,
        send: impl FnMut(&Message) -> Result<(), QueueFull>,
    ) -> Result<(), MapperError> {
        self.reporter.forget(send);
        self.start(config)
    }

    /// Takes one frame of the ring; gives the place and the update when the robot has just been at one. The filter uses
    /// up to 64 of the frames in between to polish its map, 400 while that does not explain what was observed.
    ///
    /// `turn` is what the drive knows of how the robot left the place before the one it may be at, `None` if nothing.
    /// `sonar_faults` are those of the ring's driver so far. Every message goes to `send`, which says whether the transmit
    /// queue took it.
    #[inline(never)]
    pub fn observe(
        &mut self,
        frame: &RingFrame<SONARS>,
        turn: Option<Turn>,
        sonar_faults: &FaultCounters,
        mut send: impl FnMut(&Message) -> Result<(), QueueFull>,
    ) -> Option<(Place, Update)> {
        let seen = self.detector.observe(frame).map(|place| {
            let Place { fingerprint, degree, .. } = place;
            let begins = core::mem::take(&mut self.begins);
            let update = self.filter.observe(Observation { fingerprint, turn, degree, begins });
            // A place is no state: one that the queue refuses is missing in the listener's log, and in nothing else.
            let _ = send(&Message::Place {
                place_index: update.place_index,
                frame_index: place.frame_index,
                radius_mm: place.fingerprint.radius_mm(),
                degree: place.degree,
            });
            self.reporter.update(&self.filter, &update, &mut send);
            (place, update)
        });
        if seen.is_some() {
            self.slices = 0;
        } else if self.slices < if self.filter.is_in_doubt() { SLICES_IN_DOUBT } else { SLICES_PER_PLACE } {
            self.slices += 1;
            self.filter.polish();
        }
        self.tick(sonar_faults, send);
        seen
    }

    /// Sends what is due at a steady pace, as [`Mapper::observe`] does, without a ring frame: for a robot that is paused.
    pub fn tick(&mut self, sonar_faults: &FaultCounters, send: impl FnMut(&Message) -> Result<(), QueueFull>) {
        let mut faults = *sonar_faults;
        faults.add(self.detector.faults());
        faults.add(self.filter.faults());
        self.reporter.tick(self.filter.map(), &faults, send);
    }

    /// Goes on with other settings; the map and what the filter knows stay.
    ///
    /// # Errors
    /// Names the first setting that is out of its range; nothing has changed then.
    pub fn set_config(&mut self, place: PlaceConfig, filter: F::Config) -> Result<(), MapperError> {
        self.filter.set_config(filter).map_err(MapperError::Filter)?;
        self.detector.set_config(place).map_err(MapperError::Place)
    }

    /// After a restore: the listener forgets what it knows, and the map goes out as a whole.
    pub fn retell(&mut self, send: impl FnMut(&Message) -> Result<(), QueueFull>) {
        self.reporter.forget(send);
        self.reporter.hurry();
    }

    /// The robot was carried, or its drive has lost its way: the next place need not be a neighbour of the last one.
    pub fn kidnapped(&mut self) {
        self.begins = true;
    }

    /// The robot has not moved from the place that was reported last; see [`PlaceDetector::hold_place`].
    pub fn hold_place(&mut self) {
        self.detector.hold_place();
    }

    /// Writes a whole snapshot into a buffer and tells its length. It has as many hypotheses as there is room for; the map that
    /// was told stays what it is. `RobustFilter::SNAPSHOT_BYTES` has room for all. For the time between two places.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] when there is no room for the best hypothesis; [`SnapshotError::Unsupported`].
    pub fn snapshot(&mut self, buffer: &mut [u8]) -> Result<usize, SnapshotError> {
        let mut writer = Writer::new(buffer)?;
        self.save(&mut writer)?;
        writer.finish()
    }

    /// Writes the mapper's section of a snapshot, behind those of other stages: it takes the room that is left.
    ///
    /// # Errors
    /// As [`Mapper::snapshot`].
    pub fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.section(FILTER_SECTION, |section| self.filter.save(section))
    }

    /// Goes on with a snapshot, the filter's settings and seed in it included. The mapper must have been started; place
    /// detector and reporter go on as they are, so that a listener hears the restored map in turn.
    ///
    /// # Errors
    /// [`SnapshotError`] says what is wrong with the bytes; nothing has changed then.
    pub fn restore(&mut self, bytes: &[u8], resume: Resume) -> Result<(), SnapshotError> {
        let section = Snapshot::open(bytes)?.section(FILTER_SECTION).ok_or(SnapshotError::Contents)?;
        self.filter.restore(section)?;
        self.begins = resume == Resume::Elsewhere;
        Ok(())
    }

    /// The best map.
    pub fn map(&self) -> &Map<V> {
        self.filter.map()
    }

    /// The filter with all its hypotheses.
    pub const fn filter(&self) -> &F {
        &self.filter
    }

    /// The filter, to be told to localise only, or to go on mapping. What a listener was told about the map holds until the next
    /// place.
    pub fn filter_mut(&mut self) -> &mut F {
        &mut self.filter
    }

    /// The place detector.
    pub const fn detector(&self) -> &PlaceDetector<SONARS> {
        &self.detector
    }
}

impl<const SONARS: usize, const V: usize, F: Filter<V>> Default for Mapper<SONARS, V, F> {
    fn default() -> Self {
        Self::new()
    }
}

/// A setting of one of the stages is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapperError {
    /// The place detector's.
    Place(PlaceConfigError),
    /// The filter's.
    Filter(ConfigError),
}

impl fmt::Display for MapperError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Place(error) => error.fmt(f),
            Self::Filter(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for MapperError {}
