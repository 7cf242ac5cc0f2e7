//! The mapper: a place detector and a filter.

use std::collections::BTreeMap;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use toposlam::reference::{ordered, paper, robust};
use toposlam::{FaultCounters, MapperConfig, Passage};

use crate::config::{OrderedConfig, PaperConfig, PlaceConfig, RobustConfig};
use crate::filter::{AnyFilter, Update, probability, seed_or_default};
use crate::hints::{Exit, passage};
use crate::map::Map;
use crate::number::{invalid, type_name};
use crate::place::{Place, faults};
use crate::ring::{Ring, frame, with_sonars};

/// A mapper of the library for one number of sensors and one filter.
trait AnyMapper: Send + Sync {
    fn observe(&mut self, ranges_mm: &Bound<'_, PyAny>, passage: Passage) -> PyResult<Option<(Place, Update)>>;
    fn kidnapped(&mut self);
    fn filter(&self) -> &dyn AnyFilter;
    fn filter_mut(&mut self) -> &mut dyn AnyFilter;
    fn faults(&self) -> FaultCounters;
}

impl<const SONARS: usize, const V: usize, F> AnyMapper for toposlam::Mapper<SONARS, V, F>
where
    F: toposlam::Filter<V> + AnyFilter + 'static,
{
    fn observe(&mut self, ranges_mm: &Bound<'_, PyAny>, passage: Passage) -> PyResult<Option<(Place, Update)>> {
        let observed = self.observe(&frame(ranges_mm)?, passage);
        Ok(observed.map(|(place, update)| (place.into(), update.into())))
    }

    fn kidnapped(&mut self) {
        self.kidnapped();
    }

    fn filter(&self) -> &dyn AnyFilter {
        self.filter()
    }

    fn filter_mut(&mut self) -> &mut dyn AnyFilter {
        self.filter_mut()
    }

    fn faults(&self) -> FaultCounters {
        self.faults()
    }
}

/// The settings of one of the filters.
enum FilterConfig {
    Ordered(OrderedConfig),
    Robust(RobustConfig),
    Paper(PaperConfig),
}

impl<'py> FromPyObject<'_, 'py> for FilterConfig {
    type Error = PyErr;

    fn extract(config: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let ordered = config.extract().map(Self::Ordered);
        let robust = || config.extract().map(Self::Robust);
        let paper = || config.extract().map(Self::Paper);
        ordered.or_else(|_| robust()).or_else(|_| paper()).map_err(|_| {
            let given = type_name(&config);
            PyTypeError::new_err(format!(
                "filter must be an OrderedConfig, a RobustConfig or a PaperConfig, not {given}"
            ))
        })
    }
}

/// Maps ring frames: a place detector and a filter, with the capacities of the reference robot. The same frames, settings and seed
/// give the same map as the robot has, bit for bit.
///
/// ring: number of evenly spaced sensors, 4 to 32, counter-clockwise from straight ahead, or the bearing of each in milliradians.
/// filter: settings of the filter; their class chooses it. By default the robust filter.
/// place: settings of the place detector, by default those for the ring.
/// seed: seed of the random draws of the filter.
#[pyclass(module = "toposlam")]
pub(crate) struct Mapper(Box<dyn AnyMapper>);

#[pymethods]
impl Mapper {
    #[new]
    #[pyo3(signature = (ring, filter = None, *, place = None, seed = None))]
    fn new(
        ring: Ring,
        filter: Option<FilterConfig>,
        place: Option<PlaceConfig>,
        seed: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let place = place.map_or_else(|| ring.place_config(), |place| place.0);
        let seed = seed_or_default(seed)?;
        match filter.unwrap_or(FilterConfig::Robust(RobustConfig(toposlam::RobustConfig::DEFAULT))) {
            FilterConfig::Ordered(filter) => {
                started::<{ ordered::VERTICES }, ordered::Filter>(&ring, filter.0, place, seed)
            }
            FilterConfig::Robust(filter) => {
                started::<{ robust::VERTICES }, robust::Filter>(&ring, filter.0, place, seed)
            }
            FilterConfig::Paper(filter) => started::<{ paper::VERTICES }, paper::Filter>(&ring, filter.0, place, seed),
        }
    }

    /// Processes a frame. Returns the place and the update if the frame completes a visit to a place.
    ///
    /// ranges_mm: a range for each sensor. None, infinity or "silence" mean no echo; NaN or "dead" mean that the sensor did not answer.
    /// exit: the exit by which the robot left the place before, if its drive knows it; so for the others.
    /// travel_frames: number of ring frames since it left that place.
    /// entry_mrad: bearing of the way by which it came to this place.
    /// returns: whether the robot turned back on its way, so that the place is the last one again.
    #[pyo3(signature = (ranges_mm, *, exit = None, travel_frames = None, entry_mrad = None, returns = false))]
    fn observe(
        &mut self,
        ranges_mm: &Bound<'_, PyAny>,
        exit: Option<Exit>,
        travel_frames: Option<&Bound<'_, PyAny>>,
        entry_mrad: Option<&Bound<'_, PyAny>>,
        returns: bool,
    ) -> PyResult<Option<(Place, Update)>> {
        self.0.observe(ranges_mm, passage(exit, travel_frames, entry_mrad, returns)?)
    }

    /// Announces that the next place may not be a neighbour of the last one.
    fn kidnapped(&mut self) {
        self.0.kidnapped();
    }

    /// A copy of the best map.
    #[getter]
    fn map(&self) -> Map {
        self.0.filter().map()
    }

    /// The vertices of the newest places on the best map, the oldest first; as many as the filter remembers.
    #[getter]
    fn path(&self) -> Vec<usize> {
        self.0.filter().path()
    }

    /// The probability of each vertex that the robot is there.
    #[getter]
    fn belief(&self) -> Vec<f64> {
        self.0.filter().belief()
    }

    /// How many places were observed.
    #[getter]
    fn observed(&self) -> u32 {
        self.0.filter().state().observed
    }

    /// The probability that the best map is right.
    #[getter]
    fn map_probability(&self) -> f64 {
        probability(self.0.filter().state().map_probability_q16)
    }

    /// Whether the best map is more probably wrong than right.
    #[getter]
    fn is_uncertain(&self) -> bool {
        self.0.filter().state().is_uncertain
    }

    /// Whether the map stays as it is.
    #[getter]
    fn localise_only(&self) -> bool {
        self.0.filter().state().is_localise_only
    }

    #[setter]
    fn set_localise_only(&mut self, localise_only: bool) {
        self.0.filter_mut().set_localise_only(localise_only);
    }

    /// Number of faults of each kind that occurred.
    #[getter]
    fn faults(&self) -> BTreeMap<String, u32> {
        faults(&self.0.faults())
    }
}

/// A mapper that waits for its first frame.
fn started<const V: usize, F: toposlam::Filter<V> + AnyFilter + 'static>(
    ring: &Ring,
    filter: F::Config,
    place: toposlam::place::PlaceConfig,
    seed: u64,
) -> PyResult<Mapper> {
    Ok(Mapper(with_sonars!(ring.sonars(), SONARS => {
        let mut mapper = Box::new(toposlam::Mapper::<SONARS, V, F>::new());
        mapper.start(&MapperConfig::new(ring.geometry(), filter).with_place(place).with_seed(seed)).map_err(invalid)?;
        mapper
    })))
}
