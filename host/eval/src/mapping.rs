//! Maps ring frames on the host with the same stages as on the robot, and logs every step.
//!
//! ```
//! use toposlam_eval::mapping::{FilterChoice, Mapping};
//! use toposlam_sim::world::{GroundTruth, Plan, RobotModel, Simulation};
//!
//! let plan = Plan::built_in("ring").expect("a built-in plan");
//! let mut simulation = Simulation::new(&plan, RobotModel::default(), 7)?;
//! let mut ground_truth = GroundTruth::new(simulation.true_map());
//! let mut mapping = Mapping::reference(FilterChoice::Robust)?;
//! while mapping.steps().len() < 20 {
//!     let (frame, truth) = simulation.next().expect("a simulation does not end");
//!     ground_truth.drive(&truth);
//!     if let Some(step) = mapping.observe(&frame, truth.passage()) {
//!         ground_truth.detect(&step.place);
//!     }
//! }
//! let nodes: Vec<Option<usize>> = ground_truth.detections().iter().map(|detection| detection.node).collect();
//! assert!(mapping.score(simulation.true_map(), &nodes).location > 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use toposlam::persist::Persist;
use toposlam::place::Place;
use toposlam::reference::robust::{self, VERTICES};
use toposlam::reference::{self, ordered, paper};
use toposlam::ring::{RingFrame, RingGeometry};
use toposlam::{ConfigError, Darts, FaultCounters, Filter, Map, Mapper, MapperConfig, Passage, Update};

use toposlam::wire::FilterSettings;
use toposlam_sim::Step;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{GroundTruth, ReportedHints, TrueMap};

use crate::ancestry::Ancestry;
use crate::graph::Graph;
use crate::range_csv::{Ring, SONARS_MAX};
use crate::rotation::RotationSystem;
use crate::score::{MapScore, score_map};

/// The filter of a mapping, with the settings of the reference robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterChoice {
    /// The robust filter of the reference robot.
    Robust,
    /// The paper's filter.
    Paper,
}

/// The robot's stages with either filter, for a ring of `SONARS`. It is used as a trait object, so that users of a
/// mapping do not compile the filters again.
trait Stages<const SONARS: usize, const V: usize> {
    fn observe(&mut self, frame: &RingFrame<SONARS>, passage: Passage) -> Option<(Place, Update)>;
    fn map(&self) -> &Map<V>;
    fn is_uncertain(&self) -> bool;
    /// The ways of the map, if the filter knows them.
    fn darts(&self) -> Option<Darts<'_>>;
    fn faults(&self) -> FaultCounters;
    /// The vertices of the newest places.
    fn path(&self) -> Vec<usize>;
}

/// The stages with a filter that has a path.
struct WithPath<const SONARS: usize, const V: usize, F>(Box<Mapper<SONARS, V, F>>);

impl<const SONARS: usize, const V: usize, F: Filter<V>> Stages<SONARS, V> for WithPath<SONARS, V, F> {
    fn observe(&mut self, frame: &RingFrame<SONARS>, passage: Passage) -> Option<(Place, Update)> {
        self.0.observe(frame, passage)
    }

    fn map(&self) -> &Map<V> {
        self.0.map()
    }

    fn is_uncertain(&self) -> bool {
        self.0.filter().is_uncertain()
    }

    fn darts(&self) -> Option<Darts<'_>> {
        self.0.filter().darts()
    }

    fn faults(&self) -> FaultCounters {
        self.0.faults()
    }

    fn path(&self) -> Vec<usize> {
        let mut path: Vec<usize> = (0..).map_while(|ago| self.0.filter().recent(ago)).map(usize::from).collect();
        path.reverse();
        path
    }
}

/// The stages with the paper's filter, whose particles have paths only through a log.
struct Paper<const SONARS: usize>(Box<Mapper<SONARS, VERTICES, paper::Filter>>, Ancestry);

impl<const SONARS: usize> Stages<SONARS, VERTICES> for Paper<SONARS> {
    fn observe(&mut self, frame: &RingFrame<SONARS>, passage: Passage) -> Option<(Place, Update)> {
        let Self(mapper, ancestry) = self;
        let observed = mapper.observe(frame, passage)?;
        let particles = mapper.filter().particles().iter();
        ancestry.advance(particles.map(|particle| (particle.parent.into(), particle.at.into())));
        Some(observed)
    }

    fn map(&self) -> &Map<VERTICES> {
        self.0.map()
    }

    fn is_uncertain(&self) -> bool {
        self.0.filter().is_uncertain()
    }

    fn darts(&self) -> Option<Darts<'_>> {
        None
    }

    fn faults(&self) -> FaultCounters {
        self.0.faults()
    }

    fn path(&self) -> Vec<usize> {
        let filter = self.0.filter();
        let best = filter.particles().iter().position(|particle| std::ptr::eq(particle, filter.best()));
        best.map_or(Vec::new(), |best| self.1.path(best).to_vec())
    }
}

/// The robot's stages for a ring of `SONARS`, with the capacities of the reference robot, and a log of their steps.
pub struct Mapping<const SONARS: usize, const V: usize = VERTICES> {
    stages: Box<dyn Stages<SONARS, V>>,
    steps: Vec<Step>,
}

impl Mapping<{ reference::SONARS }> {
    /// Starts a mapping with the ring and the settings of the reference robot.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn reference(filter: FilterChoice) -> Result<Self, ConfigError> {
        Self::start(reference::RING, filter)
    }
}

impl Mapping<{ reference::SONARS }, { ordered::VERTICES }> {
    /// Starts a mapping with the ordered filter of the reference robot.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn ordered() -> Result<Self, ConfigError> {
        let mapper: Box<Mapper<_, _, ordered::Filter>> = started(reference::RING, ordered::FILTER)?;
        Ok(Self { stages: Box::new(WithPath(mapper)), steps: Vec::new() })
    }
}

impl Mapping<SONARS_MAX> {
    /// Starts a mapping for the ring of a recording, with the other settings of the reference robot.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn of_recording(ring: &Ring, filter: FilterChoice) -> Result<Self, ConfigError> {
        Self::start(ring.geometry(), filter)
    }
}

impl<const SONARS: usize> Mapping<SONARS> {
    fn start(geometry: RingGeometry<SONARS>, filter: FilterChoice) -> Result<Self, ConfigError> {
        let stages: Box<dyn Stages<SONARS, VERTICES>> = match filter {
            FilterChoice::Robust => {
                Box::new(WithPath::<SONARS, VERTICES, robust::Filter>(started(geometry, robust::FILTER)?))
            }
            FilterChoice::Paper => Box::new(Paper(started(geometry, paper::FILTER)?, Ancestry::new())),
        };
        Ok(Self { stages, steps: Vec::new() })
    }
}

impl<const SONARS: usize, const V: usize> Mapping<SONARS, V> {
    /// Processes one frame and what the drive knows of the way from the previous place. Returns a step when a place was
    /// detected.
    pub fn observe(&mut self, frame: &RingFrame<SONARS>, passage: Passage) -> Option<Step> {
        let (place, update) = self.stages.observe(frame, passage)?;
        let map = self.map();
        let reported = ReportedHints { passage, ways: passage.ways(&place, 0) };
        let (vertices, edges) = (map.vertices().len() as u8, map.edges().count());
        let step = Step { place, reported, update, is_uncertain: self.stages.is_uncertain(), vertices, edges };
        self.steps.push(step);
        Some(step)
    }

    /// One step for every place so far.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The best map.
    pub fn map(&self) -> &Map<V> {
        self.stages.map()
    }

    /// The ways of the best map, if the filter knows them.
    pub fn darts(&self) -> Option<Darts<'_>> {
        self.stages.darts()
    }

    /// Fault counts of the detector and the filter.
    pub fn faults(&self) -> FaultCounters {
        self.stages.faults()
    }

    /// The vertex of each place so far in the best map, according to the current best hypothesis; `None` for a place
    /// that is older than the filter's history.
    pub fn path(&self) -> Vec<Option<usize>> {
        let known = self.stages.path();
        let forgotten = self.steps.len().saturating_sub(known.len());
        std::iter::repeat_n(None, forgotten).chain(known.into_iter().map(Some)).collect()
    }

    /// Scores the best map; see [`score_path`].
    pub fn score(&self, truth: &TrueMap, nodes: &[Option<usize>]) -> MapScore {
        score_path(self.map(), &self.path(), truth, nodes)
    }
}

/// Scores a map. `path` holds the vertex of each place, and `nodes` its true node; phantoms have none and do not count.
/// The truth is the traversed part of the true map: the visited nodes, and the edges between successive ones.
pub fn score_path<const V: usize>(
    map: &Map<V>,
    path: &[Option<usize>],
    truth: &TrueMap,
    nodes: &[Option<usize>],
) -> MapScore {
    let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b)));
    let map = Graph::from_edges(map.vertices().len(), edges);
    let mut visited: Vec<usize> = nodes.iter().copied().flatten().collect();
    visited.sort_unstable();
    visited.dedup();
    let class = |node: usize| visited.binary_search(&node).ok();
    let real = path.iter().zip(nodes).filter_map(|(&vertex, &node)| Some((vertex?, class(node?)?)));
    let (path, classes): (Vec<usize>, Vec<usize>) = real.unzip();
    if classes.is_empty() {
        return MapScore { exact: false, isomorphic: false, edge_f1: 0.0, location: 0.0 };
    }
    let is_edge = |&(from, to): &(usize, usize)| {
        let ends = [visited[from], visited[to]];
        truth.edges.iter().any(|edge| edge.nodes == ends || edge.nodes == [ends[1], ends[0]])
    };
    let traversed = classes.iter().zip(classes.iter().skip(1)).map(|(&from, &to)| (from, to)).filter(is_edge);
    let truth = Graph::from_edges(visited.len(), traversed);
    score_map(&map, &path, &truth, &classes)
}

/// Scores the best map of a robot. A map with ways is exact if it has the driven edges in the order of the ways of the true map,
/// parallel edges and loops included, up to a symmetry of the building.
pub fn score_exploration<const V: usize, F, const S: usize>(exploration: &Exploration<'_, V, F, S>) -> MapScore
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    let mapper = exploration.robot().mapper();
    let truth = exploration.rover().true_map();
    let score = score_path(mapper.map(), &exploration.path(), truth, exploration.nodes());
    let Some(darts) = mapper.filter().darts() else { return score };
    let exact = has_driven_ways(darts, exploration.ground_truth());
    MapScore { exact, isomorphic: exact, ..score }
}

/// Whether a map has the driven edges, in the order of the ways of the true map and up to a symmetry of the building. Frontiers do
/// not count. Without a detected place no map is right.
pub fn has_driven_ways(darts: Darts<'_>, ground_truth: &GroundTruth) -> bool {
    let truth = ground_truth.true_map();
    if ground_truth.detections().is_empty() {
        return false;
    }
    let mut is_driven = vec![false; truth.edges.len()];
    ground_truth.driven().into_iter().flatten().for_each(|(edge, _)| is_driven[edge] = true);
    let is_visited = |node: &usize| truth.ways(*node).iter().any(|way| is_driven[way.edge]);
    let visited: Vec<usize> = (0..truth.nodes.len()).filter(is_visited).collect();
    let driven = RotationSystem::from(truth).part(&visited, |edge| is_driven[edge]);
    RotationSystem::from(darts).is_isomorphic_to(&driven)
}

/// Whether the robot visited all nodes and drove all edges of the true map.
pub fn is_whole(ground_truth: &GroundTruth) -> bool {
    let truth = ground_truth.true_map();
    let mut is_driven = vec![false; truth.edges.len()];
    ground_truth.driven().into_iter().flatten().for_each(|(edge, _)| is_driven[edge] = true);
    let visited: std::collections::BTreeSet<usize> =
        ground_truth.detections().iter().filter_map(|detection| detection.node).collect();
    visited.len() == truth.nodes.len() && !is_driven.contains(&false)
}

fn started<const SONARS: usize, const V: usize, F: Filter<V>>(
    geometry: RingGeometry<SONARS>,
    filter: F::Config,
) -> Result<Box<Mapper<SONARS, V, F>>, ConfigError> {
    let mut mapper = Box::new(Mapper::new());
    let (place, seed) = (reference::PLACE, reference::SEED);
    mapper.start(&MapperConfig::new(geometry, filter).with_place(place).with_seed(seed))?;
    Ok(mapper)
}
