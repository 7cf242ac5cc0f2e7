//! A map made on this computer by the very stages that run on the robot, with the log that a person wants of it.

use toposlam::place::Place;
use toposlam::reference::{HISTORY_WORDS, PARTICLES, VERTICES};
use toposlam::ring::RingFrame;
use toposlam::{FaultCounters, Map, Mapper, MapperConfig, MapperError, Update};

use crate::evaluation::ancestry::Ancestry;
use crate::evaluation::graph::Graph;
use crate::evaluation::score::{MapScore, score_map};
use crate::world::TrueMap;

/// What one place brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The place as the detector saw it.
    pub place: Place,
    /// What the filter made of it.
    pub update: Update,
    /// How many vertices the best map has now.
    pub vertices: u8,
    /// How many edges the best map has now.
    pub edges: usize,
}

impl std::fmt::Display for Step {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { place, update, vertices, edges } = self;
        write!(
            f,
            "place {:4}  frame {:6}  radius {:4} mm  vertex {:2}{}  map of {vertices:2} vertices, {edges:2} edges, {} mm",
            update.place_index,
            place.frame_index,
            place.fingerprint.radius_mm(),
            update.vertex,
            if update.is_new { " new" } else { "    " },
            update.consistency_mm,
        )
    }
}

/// The robot's stages for a ring of `SONARS`, with the capacities of the reference robot, and their log.
pub struct Mapping<const SONARS: usize> {
    mapper: Box<Mapper<SONARS, PARTICLES, VERTICES, HISTORY_WORDS>>,
    ancestry: Ancestry,
    steps: Vec<Step>,
}

impl<const SONARS: usize> Mapping<SONARS> {
    /// Starts a mapping.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn start(config: &MapperConfig<SONARS>) -> Result<Self, MapperError> {
        let mut mapper = Box::new(Mapper::new());
        mapper.start(config)?;
        Ok(Self { mapper, ancestry: Ancestry::new(), steps: Vec::new() })
    }

    /// Takes one frame; gives a step when the robot has just been at a place.
    pub fn observe(&mut self, frame: &RingFrame<SONARS>) -> Option<Step> {
        let (place, update) = self.mapper.observe(frame, &FaultCounters::new(), |_| Ok(()))?;
        let particles = self.mapper.filter().particles().iter();
        self.ancestry.advance(particles.map(|particle| (particle.parent.into(), particle.place.into())));
        let map = self.mapper.map();
        let step = Step { place, update, vertices: map.vertices(), edges: map.edges().count() };
        self.steps.push(step);
        Some(step)
    }

    /// One step for every place so far.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The best map.
    pub fn map(&self) -> &Map<VERTICES> {
        self.mapper.map()
    }

    /// What went wrong: in the detector and in the filter.
    pub fn faults(&self) -> FaultCounters {
        let mut faults = *self.mapper.detector().faults();
        faults.add(self.mapper.filter().faults());
        faults
    }

    /// The vertex of the best map that each place so far was taken for, by the best hypothesis of now.
    pub fn path(&self) -> &[usize] {
        let filter = self.mapper.filter();
        let best = filter.particles().iter().position(|particle| std::ptr::eq(particle, filter.best()));
        best.map_or(&[], |best| self.ancestry.path(best))
    }

    /// How right the best map is. `nodes` is the true node of each place so far; phantoms have none and do not count.
    /// The truth is what was traversed of the true map: the nodes, and the edges between successive ones.
    pub fn score(&self, truth: &TrueMap, nodes: &[Option<usize>]) -> MapScore {
        let map = Graph::from_edges(
            self.map().vertices().into(),
            self.map().edges().map(|(a, b)| (usize::from(a), usize::from(b))),
        );
        let mut visited: Vec<usize> = nodes.iter().copied().flatten().collect();
        visited.sort_unstable();
        visited.dedup();
        let class = |node: usize| visited.binary_search(&node).ok();
        let real = self.path().iter().zip(nodes).filter_map(|(&vertex, &node)| Some((vertex, class(node?)?)));
        let (path, classes): (Vec<usize>, Vec<usize>) = real.unzip();
        let is_edge = |&(from, to): &(usize, usize)| {
            let ends = [visited[from], visited[to]];
            truth.edges.iter().any(|edge| edge.nodes == ends || edge.nodes == [ends[1], ends[0]])
        };
        let traversed = classes.iter().zip(classes.iter().skip(1)).map(|(&from, &to)| (from, to)).filter(is_edge);
        let truth = Graph::from_edges(visited.len(), traversed);
        score_map(&map, &path, &truth, &classes)
    }
}
