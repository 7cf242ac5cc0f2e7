//! The three filters.

use std::collections::BTreeMap;

use pyo3::prelude::*;
use toposlam::reference::{ordered, paper, robust};
use toposlam::{FaultCounters, Filter as _, Observation, VertexId};
use toposlam_link::topology::TopologicalMap;

use crate::config::{OrderedConfig, PaperConfig, RobustConfig};
use crate::hints::{Exit, observation};
use crate::map::Map;
use crate::number::{invalid, seed};
use crate::place::faults;

/// The best hypothesis after a place.
///
/// place_index: how many places were observed before.
/// vertex: the vertex of the robot.
/// is_new: whether this place added the vertex.
/// consistency_mm: the distance of Eq. 2, 65535 if it is infinite.
/// lead_q16: by how much the best hypothesis leads, as a natural logarithm times 65536.
/// distinct: number of different hypotheses.
#[pyclass(frozen, eq, get_all, module = "toposlam")]
#[derive(Clone, PartialEq)]
pub(crate) struct Update {
    place_index: u32,
    vertex: u8,
    is_new: bool,
    consistency_mm: u16,
    lead_q16: i32,
    distinct: u8,
}

#[pymethods]
impl Update {
    fn __repr__(&self) -> String {
        let new = if self.is_new { ", new" } else { "" };
        format!("<Update: place {} is vertex {}{new}>", self.place_index, self.vertex)
    }
}

impl From<toposlam::Update> for Update {
    fn from(update: toposlam::Update) -> Self {
        Self {
            place_index: update.place_index,
            vertex: update.vertex.into(),
            is_new: update.is_new,
            consistency_mm: update.consistency_mm,
            lead_q16: update.lead_q16,
            distinct: update.distinct,
        }
    }
}

/// A filter of the library, with the capacities of the reference robot.
pub(crate) trait AnyFilter: Send + Sync {
    fn observe(&mut self, observation: Observation) -> Update;
    fn refine(&mut self);
    /// Publishes the result of the refinement, if the filter has one.
    fn refresh(&mut self) -> Option<Update>;
    fn state(&self) -> State<'_>;
    fn topology(&self) -> TopologicalMap;
    fn recent(&self, ago: usize) -> Option<VertexId>;
    fn vertex_probability_q16(&self, vertex: VertexId) -> u32;
    fn set_localise_only(&mut self, localise_only: bool);
}

/// The state of a filter.
pub(crate) struct State<'a> {
    pub(crate) observed: u32,
    pub(crate) map_probability_q16: u32,
    pub(crate) is_uncertain: bool,
    pub(crate) is_localise_only: bool,
    pub(crate) faults: &'a FaultCounters,
}

impl dyn AnyFilter + '_ {
    /// The best map.
    pub(crate) fn map(&self) -> Map {
        Map::new(self.topology(), self.recent(0).map(u8::from))
    }

    /// The vertices of the newest places, the oldest first.
    pub(crate) fn path(&self) -> Vec<usize> {
        let mut path: Vec<usize> = (0..).map_while(|ago| self.recent(ago)).map(usize::from).collect();
        path.reverse();
        path
    }

    /// The probability of each vertex to be the robot's.
    pub(crate) fn belief(&self) -> Vec<f64> {
        let vertices = VertexId::first(self.topology().vertices.len());
        vertices.map(|vertex| probability(self.vertex_probability_q16(vertex))).collect()
    }
}

/// From units of 2⁻¹⁶.
pub(crate) fn probability(probability_q16: u32) -> f64 {
    f64::from(probability_q16) / 65536.0
}

macro_rules! any_filter {
    ($filter:ty, $refresh:expr) => {
        impl AnyFilter for $filter {
            fn observe(&mut self, observation: Observation) -> Update {
                toposlam::Filter::observe(self, observation).into()
            }

            fn refine(&mut self) {
                toposlam::Filter::refine(self);
            }

            fn refresh(&mut self) -> Option<Update> {
                let refresh: fn(&mut Self) -> Option<toposlam::Update> = $refresh;
                refresh(self).map(Update::from)
            }

            fn state(&self) -> State<'_> {
                State {
                    observed: self.observed(),
                    map_probability_q16: self.map_probability_q16(),
                    is_uncertain: self.is_uncertain(),
                    is_localise_only: self.is_localise_only(),
                    faults: self.faults(),
                }
            }

            fn topology(&self) -> TopologicalMap {
                TopologicalMap::of(self)
            }

            fn recent(&self, ago: usize) -> Option<VertexId> {
                toposlam::Filter::recent(self, ago)
            }

            fn vertex_probability_q16(&self, vertex: VertexId) -> u32 {
                toposlam::Filter::vertex_probability_q16(self, vertex)
            }

            fn set_localise_only(&mut self, localise_only: bool) {
                toposlam::Filter::set_localise_only(self, localise_only);
            }
        }
    };
}

any_filter!(ordered::Filter, |filter| Some(filter.refresh()));
any_filter!(robust::Filter, |filter| Some(filter.refresh()));
any_filter!(paper::Filter, |_| None);

/// What the three filters have in common: places in, maps out. The capacities are those of the reference robot.
#[pyclass(subclass, module = "toposlam")]
pub(crate) struct Filter(Box<dyn AnyFilter>);

#[pymethods]
impl Filter {
    /// Takes the next place and publishes the best map. Without `refine` between two places the map is rarely right.
    ///
    /// radius_mm: radius of the largest free disc around the place, at most 8188.
    /// ways: number of ways, 1 to 7, or the bearings of all ways but the one by which the robot came, counter-clockwise from that
    /// one, ascending, 1 to 6282 mrad.
    /// exit: the exit by which the robot left the place before.
    /// travel_frames: number of ring frames, or of other equal units of time, since it left that place.
    /// starts_sequence: whether this place is not a neighbour of the one before.
    #[pyo3(signature = (radius_mm, *, ways = None, exit = None, travel_frames = None, starts_sequence = false))]
    fn observe(
        &mut self,
        radius_mm: &Bound<'_, PyAny>,
        ways: Option<&Bound<'_, PyAny>>,
        exit: Option<Exit>,
        travel_frames: Option<&Bound<'_, PyAny>>,
        starts_sequence: bool,
    ) -> PyResult<Update> {
        Ok(self.0.observe(observation(radius_mm, ways, exit, travel_frames, starts_sequence)?))
    }

    /// Runs refinement steps. The next `observe` or `refresh` publishes the result.
    #[pyo3(signature = (steps = 1))]
    fn refine(&mut self, steps: u32) {
        (0..steps).for_each(|_| self.0.refine());
    }

    /// Publishes the result of the refinement. The paper's filter has none: None.
    fn refresh(&mut self) -> Option<Update> {
        self.0.refresh()
    }

    /// A copy of the best map.
    #[getter]
    fn map(&self) -> Map {
        self.0.map()
    }

    /// The vertices of the newest places on the best map, the oldest first; as many as the filter remembers.
    #[getter]
    fn path(&self) -> Vec<usize> {
        self.0.path()
    }

    /// The probability of each vertex that the robot is there.
    #[getter]
    fn belief(&self) -> Vec<f64> {
        self.0.belief()
    }

    /// How many places were observed.
    #[getter]
    fn observed(&self) -> u32 {
        self.0.state().observed
    }

    /// The probability that the best map is right.
    #[getter]
    fn map_probability(&self) -> f64 {
        probability(self.0.state().map_probability_q16)
    }

    /// Whether the best map is more probably wrong than right.
    #[getter]
    fn is_uncertain(&self) -> bool {
        self.0.state().is_uncertain
    }

    /// Whether the map stays as it is.
    #[getter]
    fn localise_only(&self) -> bool {
        self.0.state().is_localise_only
    }

    #[setter]
    fn set_localise_only(&mut self, localise_only: bool) {
        self.0.set_localise_only(localise_only);
    }

    /// Number of faults of each kind that occurred.
    #[getter]
    fn faults(&self) -> BTreeMap<String, u32> {
        faults(self.0.state().faults)
    }
}

macro_rules! filter_class {
    ($(#[$attribute:meta])* $name:ident, $config:ident, $filter:ty) => {
        $(#[$attribute])*
        #[pyclass(extends = Filter, module = "toposlam")]
        pub(crate) struct $name;

        #[pymethods]
        impl $name {
            #[new]
            #[pyo3(signature = (config = None, *, seed = None))]
            fn new(config: Option<$config>, seed: Option<&Bound<'_, PyAny>>) -> PyResult<PyClassInitializer<Self>> {
                let config = config.map_or(<$filter as toposlam::Filter<_>>::Config::DEFAULT, |config| config.0);
                let mut filter = Box::new(<$filter>::new());
                filter.start(config, seed_or_default(seed)?).map_err(invalid)?;
                Ok(PyClassInitializer::from(Filter(filter)).add_subclass(Self))
            }
        }
    };
}

filter_class! {
    /// The ordered filter, for places with ways, exits and travel times: maps of up to 64 vertices with the order of their ways.
    OrderedFilter, OrderedConfig, ordered::Filter
}
filter_class! {
    /// The robust filter, for radii alone, or with degrees: maps of up to 16 vertices.
    RobustFilter, RobustConfig, robust::Filter
}
filter_class! {
    /// The particle filter of the paper: maps of up to 16 vertices.
    PaperFilter, PaperConfig, paper::Filter
}

/// The seed that was given, or that of the library.
pub(crate) fn seed_or_default(value: Option<&Bound<'_, PyAny>>) -> PyResult<u64> {
    value.map_or(Ok(toposlam::reference::SEED), seed)
}
