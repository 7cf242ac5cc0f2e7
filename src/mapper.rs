//! From ring frames to a map: ring frame → place → hypotheses → map update.

use crate::config_error::ConfigError;
use crate::fault::FaultCounters;
use crate::filter::{Filter, Observation, OrderedConfig, Passage, RobustConfig, Update};
use crate::map::Map;
use crate::place::{Place, PlaceConfig, PlaceDetector};
use crate::ring::{RingFrame, RingGeometry};
use crate::setters::setters;

/// The most refinement steps between two places. Later steps rarely improve the map, and a robot may stand for days.
const REFINEMENT_STEPS: u16 = 64;
/// The same while the best map does not explain the observations.
const REFINEMENT_STEPS_IN_DOUBT: u16 = 400;

/// The settings of a [`Mapper`]; `C` are those of the filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct MapperConfig<const SONARS: usize, C> {
    /// The directions of the sensors.
    pub geometry: RingGeometry<SONARS>,
    /// The place detector.
    pub place: PlaceConfig,
    /// The filter.
    pub filter: C,
    /// The seed of the filter's random draws.
    pub seed: u64,
}

impl<const SONARS: usize, C: Copy> MapperConfig<SONARS, C> {
    /// The settings for a ring and a filter: the place detector's for the ring, and seed 1.
    #[must_use]
    pub const fn new(geometry: RingGeometry<SONARS>, filter: C) -> Self {
        Self { geometry, place: PlaceConfig::for_ring(&geometry), filter, seed: 1 }
    }

    setters! {
        with_geometry, geometry: RingGeometry<SONARS>;
        with_place, place: PlaceConfig;
        with_filter, filter: C;
        with_seed, seed: u64;
    }
}

impl<const SONARS: usize> MapperConfig<SONARS, RobustConfig> {
    /// The settings for a ring of 4 to 128 sensors and the robust filter with its defaults.
    ///
    /// ```
    /// use toposlam::ring::RingGeometry;
    /// use toposlam::{Mapper, MapperConfig, RobustFilter};
    ///
    /// let mut mapper = Mapper::<8, 16, RobustFilter<10, 16, 400>>::new();
    /// mapper.start(&MapperConfig::for_ring(RingGeometry::even()))?;
    /// # Ok::<(), toposlam::ConfigError>(())
    /// ```
    #[must_use]
    pub const fn for_ring(geometry: RingGeometry<SONARS>) -> Self {
        Self::new(geometry, RobustConfig::DEFAULT)
    }
}

#[cfg(feature = "wire")]
impl<const SONARS: usize, C: crate::wire::FilterSettings> MapperConfig<SONARS, C> {
    pub(crate) const UNSET: Self = Self {
        geometry: RingGeometry { bearings_mrad: [0; SONARS] },
        place: PlaceConfig::UNSET,
        filter: C::UNSET,
        seed: 0,
    };
}

impl<const SONARS: usize> MapperConfig<SONARS, OrderedConfig> {
    /// The settings for a ring of 4 to 128 sensors and the ordered filter with its defaults.
    #[must_use]
    pub const fn ordered(geometry: RingGeometry<SONARS>) -> Self {
        Self::new(geometry, OrderedConfig::DEFAULT)
    }
}

/// The mapping pipeline: a place detector for a ring of `SONARS` sensors and a filter with maps of at most `V` vertices.
///
/// The same frames, settings and seed give the same map, bit for bit, on every target. Memory: that of the detector and of
/// the filter. Time per frame: that of one place, or of one refinement step.
#[derive(Clone, Debug)]
pub struct Mapper<const SONARS: usize, const V: usize, F> {
    pub(crate) detector: PlaceDetector<SONARS>,
    pub(crate) filter: F,
    /// Whether the next place is not a neighbour of the last one.
    pub(crate) starts_sequence: bool,
    /// Refinement steps since the last place.
    refinement_steps: u16,
}

impl<const SONARS: usize, const V: usize, F: Filter<V>> Mapper<SONARS, V, F> {
    /// A mapper that has to be started with [`Mapper::start`].
    pub const fn new() -> Self {
        Self { detector: PlaceDetector::new(), filter: F::UNSTARTED, starts_sequence: false, refinement_steps: 0 }
    }

    /// Starts with an empty map.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of its range; the mapper must then be started again.
    pub fn start(&mut self, config: &MapperConfig<SONARS, F::Config>) -> Result<(), ConfigError> {
        self.detector.start(config.place, config.geometry)?;
        self.filter.start(config.filter, config.seed)?;
        self.starts_sequence = false;
        self.refinement_steps = 0;
        Ok(())
    }

    /// Processes one ring frame. Returns the place and the map update when the frame completes a visit to a place.
    ///
    /// `passage` is what the drive knows of the way from the previous place; [`Passage::UNKNOWN`] without a drive. Between two places each frame runs one
    /// refinement step of the filter, at most 64 of them, or 400 while the best map does not explain the observations.
    #[inline(never)]
    pub fn observe(&mut self, frame: &RingFrame<SONARS>, passage: Passage) -> Option<(Place, Update)> {
        if let Some(place) = self.detector.observe(frame) {
            if passage.returns {
                return None;
            }
            let starts_sequence = core::mem::take(&mut self.starts_sequence);
            self.refinement_steps = 0;
            let Passage { exit, travel_frames, .. } = passage;
            let ways = passage.ways(&place, self.detector.rotation_mrad());
            let observation =
                Observation { fingerprint: place.fingerprint, ways, exit, travel_frames, starts_sequence };
            return Some((place, self.filter.observe(observation)));
        }
        let most = if self.filter.is_in_doubt() { REFINEMENT_STEPS_IN_DOUBT } else { REFINEMENT_STEPS };
        if self.refinement_steps < most {
            self.refinement_steps += 1;
            self.filter.refine();
        }
        None
    }

    /// Changes the settings and keeps the map.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of its range; nothing has changed then.
    pub fn set_config(&mut self, place: PlaceConfig, filter: F::Config) -> Result<(), ConfigError> {
        place.check(SONARS)?;
        self.filter.set_config(filter)?;
        self.detector.set_config(place)
    }

    /// Announces that the next place may not be a neighbour of the last one: the robot was kidnapped, or its drive lost the
    /// Voronoi graph.
    pub fn kidnapped(&mut self) {
        self.starts_sequence = true;
        self.detector.forget_way();
    }

    /// Announces that the robot has not left the last place; see [`PlaceDetector::hold_place`].
    pub fn hold_place(&mut self) {
        self.detector.hold_place();
    }

    /// Announces that the robot is not on the Voronoi graph; see [`PlaceDetector::forget_sightings`].
    pub fn forget_sightings(&mut self) {
        self.detector.forget_sightings();
    }

    /// The best map.
    pub fn map(&self) -> &Map<V> {
        self.filter.map()
    }

    /// The filter with all its hypotheses.
    pub const fn filter(&self) -> &F {
        &self.filter
    }

    /// The filter, for example to switch it between mapping and localisation. Its published map changes with the next place
    /// only.
    pub const fn filter_mut(&mut self) -> &mut F {
        &mut self.filter
    }

    /// The place detector.
    pub const fn detector(&self) -> &PlaceDetector<SONARS> {
        &self.detector
    }

    /// The faults of the place detector and of the filter since the start.
    pub fn faults(&self) -> FaultCounters {
        let mut faults = *self.detector.faults();
        faults.add(self.filter.faults());
        faults
    }
}

impl<const SONARS: usize, const V: usize, F: Filter<V>> Default for Mapper<SONARS, V, F> {
    fn default() -> Self {
        Self::new()
    }
}
