//! A map made on this computer by the very stages that run on the robot, with the log that a person wants of it.
//!
//! ```
//! use toposlam::reference;
//! use toposlam_eval::mapping::{FilterChoice, Mapping};
//! use toposlam_sim::world::{Journal, Plan, RobotModel, Simulation};
//!
//! let plan = Plan::built_in("ring").expect("it is built in");
//! let mut simulation = Simulation::new(&plan, RobotModel::default(), 7)?;
//! let mut journal = Journal::new(simulation.true_map());
//! let mut mapping = Mapping::start(reference::RING, FilterChoice::Robust)?;
//! while mapping.steps().len() < 20 {
//!     let (frame, truth) = simulation.next().expect("a simulation does not end");
//!     journal.drive(&truth);
//!     if let Some(step) = mapping.observe(&frame, truth.turn) {
//!         journal.detect(&step.place);
//!     }
//! }
//! let nodes: Vec<Option<usize>> = journal.detections().iter().map(|detection| detection.node).collect();
//! assert!(mapping.score(simulation.true_map(), &nodes).location > 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use toposlam::reference::{self, PaperReference, VERTICES};
use toposlam::ring::{RingFrame, RingGeometry};
use toposlam::wire::{Belief, Worst};
use toposlam::{ConfigError, FaultCounters, Filter, Map, Mapper, MapperConfig, Turn};

use toposlam_sim::Step;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::TrueMap;

use crate::ancestry::Ancestry;
use crate::graph::Graph;
use crate::score::{MapScore, score_map};

/// Which filter maps, with the settings of the reference robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterChoice {
    /// The reference robot's own.
    Robust,
    /// The paper's, in its place.
    Paper,
}

/// The stages with one filter or the other; the paper's needs a log of its particles to tell their paths.
enum Stages<const SONARS: usize> {
    Robust(Box<Mapper<SONARS, VERTICES, reference::Filter>>),
    Paper(Box<Mapper<SONARS, VERTICES, PaperReference>>, Ancestry),
}

/// Says the same of either mapper.
macro_rules! either {
    ($stages:expr, $mapper:ident => $answer:expr) => {
        match $stages {
            Stages::Robust($mapper) => $answer,
            Stages::Paper($mapper, _) => $answer,
        }
    };
}

/// The robot's stages for a ring of `SONARS`, with the capacities of the reference robot, and their log.
pub struct Mapping<const SONARS: usize> {
    stages: Stages<SONARS>,
    steps: Vec<Step>,
}

impl<const SONARS: usize> Mapping<SONARS> {
    /// Starts a mapping with the settings of the reference robot, for a ring and with a filter.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn start(geometry: RingGeometry<SONARS>, filter: FilterChoice) -> Result<Self, ConfigError> {
        let stages = match filter {
            FilterChoice::Robust => Stages::Robust(started(geometry, reference::FILTER)?),
            FilterChoice::Paper => Stages::Paper(started(geometry, reference::PAPER_FILTER)?, Ancestry::new()),
        };
        Ok(Self { stages, steps: Vec::new() })
    }

    /// Takes one frame, and what the drive knows of how the robot left the place before; gives a step when the robot has
    /// just been at a place.
    pub fn observe(&mut self, frame: &RingFrame<SONARS>, turn: Option<Turn>) -> Option<Step> {
        let (place, update) = either!(&mut self.stages, mapper => mapper.observe(frame, turn))?;
        if let Stages::Paper(mapper, ancestry) = &mut self.stages {
            let particles = mapper.filter().particles().iter();
            ancestry.advance(particles.map(|particle| (particle.parent.into(), particle.at.into())));
        }
        let map = self.map();
        let step = Step { place, update, vertices: map.vertices().len() as u8, edges: map.edges().count() };
        self.steps.push(step);
        Some(step)
    }

    /// One step for every place so far.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The best map.
    pub fn map(&self) -> &Map<VERTICES> {
        either!(&self.stages, mapper => mapper.map())
    }

    /// What went wrong: in the detector and in the filter.
    pub fn faults(&self) -> FaultCounters {
        either!(&self.stages, mapper => mapper.faults())
    }

    /// Where the robot may be after the last place, and how far the map is to be trusted.
    pub fn belief(&self) -> Option<Belief> {
        let place_index = self.steps.last()?.update.place_index;
        Some(either!(&self.stages, mapper => Belief::of(mapper.filter(), place_index)))
    }

    /// What the map explains worst after the last place.
    pub fn worst(&self) -> Option<Worst> {
        let place_index = self.steps.last()?.update.place_index;
        Some(either!(&self.stages, mapper => Worst::of(mapper.filter(), place_index)))
    }

    /// The vertex of the best map that each place so far was taken for, by the best hypothesis of now; `None` for a place
    /// that is older than the filter's history.
    pub fn path(&self) -> Vec<Option<usize>> {
        let known: Vec<usize> = match &self.stages {
            Stages::Robust(mapper) => mapper.filter().path().map(usize::from).collect(),
            Stages::Paper(mapper, ancestry) => {
                let filter = mapper.filter();
                let best = filter.particles().iter().position(|particle| std::ptr::eq(particle, filter.best()));
                best.map_or(Vec::new(), |best| ancestry.path(best).to_vec())
            }
        };
        let forgotten = self.steps.len().saturating_sub(known.len());
        std::iter::repeat_n(None, forgotten).chain(known.into_iter().map(Some)).collect()
    }

    /// How right the best map is; see [`score_path`].
    pub fn score(&self, truth: &TrueMap, nodes: &[Option<usize>]) -> MapScore {
        score_path(self.map(), &self.path(), truth, nodes)
    }
}

/// How right a map is. `path` says for each place which vertex it was taken for, `nodes` its true node; phantoms have none and
/// do not count. The truth is what was traversed of the true map: the nodes, and the edges between successive ones.
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
    let is_edge = |&(from, to): &(usize, usize)| {
        let ends = [visited[from], visited[to]];
        truth.edges.iter().any(|edge| edge.nodes == ends || edge.nodes == [ends[1], ends[0]])
    };
    let traversed = classes.iter().zip(classes.iter().skip(1)).map(|(&from, &to)| (from, to)).filter(is_edge);
    let truth = Graph::from_edges(visited.len(), traversed);
    score_map(&map, &path, &truth, &classes)
}

/// How right the best map of a robot is.
pub fn score_exploration(exploration: &Exploration<'_>) -> MapScore {
    let map = exploration.robot().mapper().map();
    score_path(map, &exploration.path(), exploration.rover().true_map(), exploration.nodes())
}

fn started<const SONARS: usize, F: Filter<VERTICES>>(
    geometry: RingGeometry<SONARS>,
    filter: F::Config,
) -> Result<Box<Mapper<SONARS, VERTICES, F>>, ConfigError> {
    let mut mapper = Box::new(Mapper::new());
    let (place, seed) = (reference::PLACE, reference::SEED);
    mapper.start(&MapperConfig::new(geometry, filter).with_place(place).with_seed(seed))?;
    Ok(mapper)
}
