//! A robot whose map changes at random, and its messages.

use super::{frame, vertex};
use toposlam::wire::{Capacities, Encoder, Hello, Message, QueueFull, Reporter, ResetCause};
use toposlam::{
    ConfigError, DartMap, Darts, FaultCounters, FaultKind, Filter, FilterCapacities, Fingerprint, Map, Observation,
    RobustFactors, Update, VertexId, WeightFactors, WorstNgram,
};

pub(crate) const TICKS_PER_HELLO: u16 = 20;

pub(crate) use super::split_mix::Random;

impl Random {
    /// One of the first `count` vertices.
    pub(crate) fn vertex(&mut self, count: usize) -> VertexId {
        vertex(self.below(count))
    }

    pub(crate) fn happens(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    pub(crate) fn fingerprint(&mut self) -> Fingerprint {
        Fingerprint::from_steps(self.below(4000) as u16).expect("in range")
    }
}

/// A filter whose state the tests set.
#[derive(Clone)]
pub(crate) struct Believer<const V: usize> {
    pub(crate) map: Map<V>,
    /// The ways of the same vertices, of a filter that knows them.
    pub(crate) darts: Option<DartMap<V, 250>>,
    /// For each vertex id before the update, the id after it.
    pub(crate) names: Vec<Option<VertexId>>,
    pub(crate) location: VertexId,
    pub(crate) worst: WorstNgram,
    faults: FaultCounters,
}

impl<const V: usize> Filter<V> for Believer<V> {
    type Config = ();

    const UNSTARTED: Self = Self {
        map: Map::new(),
        darts: None,
        names: Vec::new(),
        location: VertexId::FIRST,
        worst: WorstNgram::NONE,
        faults: FaultCounters::new(),
    };

    fn capacities((): &()) -> FilterCapacities {
        FilterCapacities { hypotheses: 10, history: 256, ngram_length: 5 }
    }

    fn start(&mut self, (): (), _: u64) -> Result<(), ConfigError> {
        Ok(())
    }

    fn config(&self) -> &() {
        &()
    }

    fn set_config(&mut self, _: ()) -> Result<(), ConfigError> {
        Ok(())
    }

    fn observe(&mut self, _: impl Into<Observation>) -> Update {
        unreachable!("the tests change the map themselves")
    }

    fn map(&self) -> &Map<V> {
        &self.map
    }

    fn darts(&self) -> Option<Darts<'_>> {
        self.darts.as_ref().map(DartMap::view)
    }

    fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    fn recent(&self, ago: usize) -> Option<VertexId> {
        (ago == 0).then_some(self.location)
    }

    /// Two thirds for the location, the rest among the vertices beside it.
    fn vertex_probability_q16(&self, vertex: VertexId) -> u32 {
        match vertex.index().abs_diff(self.location.index()) {
            0 => 43_691,
            1 => 10_923,
            _ => 0,
        }
    }

    fn map_probability_q16(&self) -> u32 {
        1 << 15
    }

    fn remapped(&self, before: VertexId) -> Option<VertexId> {
        self.names.get(before.index()).copied().unwrap_or(Some(before))
    }

    fn worst(&self) -> WorstNgram {
        self.worst
    }
}

/// A robot whose map changes at random, and the frames it sends.
pub(crate) struct Robot<const V: usize> {
    pub(crate) filter: Believer<V>,
    pub(crate) faults: FaultCounters,
    pub(crate) reporter: Reporter<V>,
    pub(crate) encoder: Encoder,
    pub(crate) place_index: u32,
    /// The share of messages that the transmit queue refuses, in percent.
    pub(crate) refused_percent: usize,
}

impl<const V: usize> Robot<V> {
    /// The number of ticks in one round of the repeated map.
    pub(crate) fn round(&self) -> usize {
        let vertices = self.filter.map.vertices().len();
        5 + if self.filter.darts.is_some() { 2 * vertices } else { vertices }
    }

    pub(crate) fn new(boot: u32) -> Self {
        let capacities = Capacities {
            vertices: V as u8,
            hypotheses: 10,
            history: 256,
            ngram_length: 5,
            fingerprint_step_mm: 2,
            sonars: 16,
        };
        let mut reporter = Reporter::new();
        reporter.start(Hello::new(boot, ResetCause::Unknown, 1, capacities), TICKS_PER_HELLO);
        Self {
            filter: Believer::UNSTARTED,
            faults: FaultCounters::new(),
            reporter,
            encoder: Encoder::new(0),
            place_index: 0,
            refused_percent: 0,
        }
    }

    /// The same robot with a filter that knows the ways.
    pub(crate) fn with_ways(mut self) -> Self {
        self.filter.darts = Some(DartMap::EMPTY);
        self
    }

    /// Adds up to three ways, edges between frontiers, loops included, and travel times.
    fn add_ways(&mut self, random: &mut Random) {
        let Some(darts) = &mut self.filter.darts else { return };
        while usize::from(darts.vertices()) < self.filter.map.vertices().len() {
            darts.add_vertex().expect("there is room");
        }
        for _ in 0..random.below(4) {
            // A vertex has room for seven ways.
            let _ = darts.add_way(random.vertex(darts.vertices().into()).into(), random.below(1 << 16) as u16);
        }
        for _ in 0..random.below(3) {
            let frontiers: Vec<u8> = darts.frontiers().collect();
            if !frontiers.is_empty() {
                darts.join(frontiers[random.below(frontiers.len())], frontiers[random.below(frontiers.len())]);
            }
            let edges: Vec<(u8, u8)> = darts.edges().collect();
            if !edges.is_empty() {
                darts.time(edges[random.below(edges.len())].0, random.below(1 << 16) as u16);
            }
        }
    }

    /// The ways of a map whose vertices were renumbered. Merged vertices keep the ways of all of them.
    fn rename_ways(&mut self, random: &mut Random) {
        let Some(darts) = &mut self.filter.darts else { return };
        let before = std::mem::replace(darts, DartMap::EMPTY);
        for _ in self.filter.map.vertices() {
            darts.add_vertex().expect("there is room");
        }
        let mut now = Vec::new();
        for dart in before.view().darts() {
            let vertex = before.view().vertex(dart).and_then(|vertex| self.filter.names[vertex.index()]);
            let way = vertex.and_then(|vertex| darts.add_way(vertex.into(), before.bearing(dart.into())));
            now.push(way.filter(|_| !random.happens(5)));
        }
        for (a, b) in before.edges() {
            if let (Some(a), Some(b)) = (now[usize::from(a)], now[usize::from(b)]) {
                darts.join(a, b);
                darts.time(a, 20_000);
            }
        }
    }

    /// Changes the map as one place does: a new or known vertex, one new edge, one more visit.
    pub(crate) fn drive(&mut self, random: &mut Random) {
        let Believer { map, location, names, .. } = &mut self.filter;
        names.clear();
        let from = *location;
        let known = map.vertices().len();
        *location = if known == 0 || random.happens(30) {
            map.add_vertex(random.fingerprint()).unwrap_or(from)
        } else {
            let vertex = random.vertex(known);
            map.observe(vertex, random.fingerprint());
            vertex
        };
        if known > 0 {
            map.add_edge(from, *location);
        }
        self.add_ways(random);
        self.set_random_worst(random);
    }

    /// Makes another hypothesis the best one: a map of another size with other labels and edges, whose vertices are
    /// unrelated to the previous ones.
    pub(crate) fn change_hypothesis(&mut self, random: &mut Random) {
        let Believer { map, location, names, .. } = &mut self.filter;
        names.clear();
        map.clear();
        for _ in 0..=random.below(V) {
            map.add_vertex(random.fingerprint()).expect("there is room");
        }
        let vertices = map.vertices().len();
        for _ in 0..random.below(2 * vertices) {
            map.add_edge(random.vertex(vertices), random.vertex(vertices));
        }
        *location = random.vertex(vertices);
        if let Some(darts) = &mut self.filter.darts {
            darts.clear();
        }
        (0..20).for_each(|_| self.add_ways(random));
        self.set_random_worst(random);
    }

    /// Repairs the map: vertices are reordered, merged, removed and added, and an edge is added or removed.
    pub(crate) fn repair(&mut self, random: &mut Random) {
        let Believer { map, location, names, .. } = &mut self.filter;
        let before = *map;
        let old = before.vertices();
        // The origin of each vertex of the new map, in random order.
        let mut origins: Vec<Option<VertexId>> = old.clone().filter(|_| !random.happens(15)).map(Some).collect();
        if origins.len() < V && random.happens(50) || origins.is_empty() {
            origins.push(None);
        }
        for last in (1..origins.len()).rev() {
            origins.swap(last, random.below(last + 1));
        }
        *names = old
            .map(|before| match origins.iter().position(|&origin| origin == Some(before)) {
                Some(now) => Some(vertex(now)),
                None if random.happens(50) => Some(random.vertex(origins.len())),
                None => None,
            })
            .collect();
        map.clear();
        for &origin in &origins {
            let label = origin.and_then(|vertex| before.label(vertex)).unwrap_or(random.fingerprint());
            map.add_vertex(label).expect("there is room");
        }
        for (a, b) in before.edges().filter(|_| !random.happens(5)) {
            if let (Some(a), Some(b)) = (names[a.index()], names[b.index()])
                && a != b
            {
                map.add_edge(a, b);
            }
        }
        let vertices = map.vertices().len();
        map.add_edge(random.vertex(vertices), random.vertex(vertices));
        *location = names.get(location.index()).copied().flatten().unwrap_or(VertexId::FIRST);
        self.rename_ways(random);
        self.add_ways(random);
        self.set_random_worst(random);
    }

    /// Applies one of the three kinds of map change.
    pub(crate) fn change(&mut self, random: &mut Random) {
        match random.below(10) {
            0 | 1 => self.change_hypothesis(random),
            2 | 3 => self.repair(random),
            _ => self.drive(random),
        }
    }

    fn set_random_worst(&mut self, random: &mut Random) {
        let vertices = self.filter.map.vertices().len();
        let walk = std::array::from_fn(|_| random.vertex(vertices));
        let length = random.below(8) as u8;
        self.filter.worst = WorstNgram { distance_mm: 200, length, newest_age: 9, vertices: walk };
    }

    pub(crate) fn update(&self) -> Update {
        Update {
            place_index: self.place_index,
            vertex: self.filter.location,
            is_new: false,
            consistency_mm: 40,
            factors: WeightFactors::Robust(RobustFactors { ln_labels_q16: -1, ln_moves_q16: -2, ln_size_q16: -3 }),
            lead_q16: 4,
            distinct: 5,
        }
    }

    /// The frames after a place.
    pub(crate) fn place(&mut self, random: &mut Random) -> Vec<Vec<u8>> {
        let update = self.update();
        self.place_index += 1;
        let mut frames = Vec::new();
        let Self { filter, reporter, encoder, refused_percent, .. } = self;
        reporter
            .update(filter, &update, |message| queue(encoder, message, random.happens(*refused_percent), &mut frames));
        assert!(frames.len() <= 3 * V + 6, "{} frames in one update", frames.len());
        frames
    }

    /// The frames of a tick.
    pub(crate) fn tick(&mut self, random: &mut Random) -> Vec<Vec<u8>> {
        let mut frames = Vec::new();
        let Self { filter, faults, reporter, encoder, refused_percent, .. } = self;
        reporter.tick(filter, faults, |message| queue(encoder, message, random.happens(*refused_percent), &mut frames));
        assert!(frames.len() <= FaultKind::ALL.len() + 6);
        frames
    }
}

fn queue(encoder: &mut Encoder, message: &Message, full: bool, frames: &mut Vec<Vec<u8>>) -> Result<(), QueueFull> {
    let frame = frame(encoder, message);
    if full {
        return Err(QueueFull);
    }
    frames.push(frame);
    Ok(())
}
