//! The ordered filter as a candidate, with the capacities of the reference robot or of the small one.

use super::{Candidate, VERTICES, probability, widened};
use crate::{
    rotation::{RotationSystem, partner},
    settings::{Capacities, Filter, Settings},
    trial::{Trial, Truth},
};
use std::f64::consts::TAU;
use toposlam::Filter as _;
use toposlam::reference::{ordered, small};
use toposlam::{Bearing, DartMap, FaultKind, Map, Observation, OrderedConfig, OrderedFilter, VertexId};

pub(super) fn start(settings: &Settings, trial: &Trial) -> Box<dyn Candidate> {
    match settings.capacities {
        Capacities::Reference => start_with(ordered::Filter::new(), settings, trial),
        Capacities::Small => start_with(small::Filter::new(), settings, trial),
    }
}

fn start_with<const N: usize, const V: usize, const D: usize, const T: usize>(
    filter: OrderedFilter<N, V, D, T>,
    settings: &Settings,
    trial: &Trial,
) -> Box<dyn Candidate> {
    let mut filter = Box::new(filter);
    let config = if let Filter::Ordered(config) = settings.filter { config } else { OrderedConfig::DEFAULT };
    let started = filter.start(config, trial.filter_seed);
    assert!(started.is_ok(), "the configuration was checked");
    Box::new(Ordered { filter, path: Vec::new() })
}

/// The filter, and the vertex of every place so far. The filter decides about the places of its history again at every update;
/// for older ones the last decision counts.
struct Ordered<const N: usize, const V: usize, const D: usize, const T: usize> {
    filter: Box<OrderedFilter<N, V, D, T>>,
    path: Vec<Option<VertexId>>,
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> Ordered<N, V, D, T> {
    fn update_path(&mut self) {
        let count = self.path.len();
        for (step, vertex) in self.path.iter_mut().enumerate() {
            let before = vertex.and_then(|before| self.filter.remapped(before));
            *vertex = self.filter.recent(count - 1 - step).or(before);
        }
    }
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> Candidate for Ordered<N, V, D, T> {
    fn observe(&mut self, observation: Observation) {
        self.filter.observe(observation);
        self.path.push(None);
        self.update_path();
    }

    fn refine(&mut self, steps: u32) {
        (0..steps).for_each(|_| self.filter.refine());
    }

    fn search_from(&self, trial: &Trial, truth: &Truth, steps: u32) -> Option<Box<dyn Candidate>> {
        let places = truth.classes.len();
        if places > T || trial.places_before() > 0 {
            return None;
        }
        let (map, number) = true_map(trial)?;
        let path: Vec<u8> = (0..places).map(|step| number[trial.walk.arrival(step)]).collect();
        let mut search = Self { filter: self.filter.clone(), path: vec![None; places] };
        search.filter.assume(&map, &path)?;
        search.refine(steps);
        search.filter.refresh();
        search.update_path();
        Some(Box::new(search))
    }

    fn map(&self) -> Map<VERTICES> {
        widened(self.filter.map())
    }

    fn ways(&self) -> Option<RotationSystem> {
        self.filter.darts().map(RotationSystem::from)
    }

    fn path(&self, places: usize) -> Vec<Option<usize>> {
        let newest = &self.path[self.path.len().saturating_sub(places)..];
        newest.iter().map(|vertex| vertex.map(VertexId::index)).collect()
    }

    fn map_probability(&self) -> f64 {
        probability(self.filter.map_probability_q16())
    }

    fn vertices_full(&self) -> u32 {
        self.filter.faults().count(FaultKind::VerticesFull)
    }
}

/// The environment of a path as a map of the filter, and the number of each of its darts there. `None` without ways, or when
/// the map has no room.
fn true_map<const V: usize, const D: usize>(trial: &Trial) -> Option<(DartMap<V, D>, Vec<u8>)> {
    let corridors = trial.corridors.as_ref()?;
    let rotation = corridors.rotation();
    let mut map = DartMap::EMPTY;
    let mut number = vec![0; rotation.dart_count()];
    for place in 0..rotation.vertex_count() {
        let vertex = map.add_vertex()?;
        for &dart in rotation.ways(place) {
            let bearing = corridors.bearing_rad(dart, rotation.ways(place)[0]) / TAU * 65536.0;
            number[dart] = map.add_way(vertex, bearing as i64 as Bearing)?;
        }
    }
    (0..rotation.dart_count()).for_each(|dart| map.join(number[dart], number[partner(dart)]));
    Some((map, number))
}
