//! A replica of the robot's map, built from its messages.

use crate::fault::FaultKind;
use crate::map::VertexSet;

use crate::WAYS_MAX;
use crate::wire::decoder::{Arrival, Header};
use crate::wire::digest::digest;
use crate::wire::messages::bit;
use crate::wire::{
    Belief, Evidence, Exploration, GoalStatus, Health, Hello, List, Location, Message, Names, Remapped, Row,
    VertexWays, Way, WayId, Worst,
};

/// A replica of the robot's map and of the newest of its other messages.
///
/// Messages may be lost, repeated or late: late ones are ignored, and the robot repeats its map in turn. `V` must be at
/// least that of the robot; 64 always suffices. Memory: 104 bytes per vertex and about 280 bytes.
#[derive(Clone, Debug)]
pub struct MapReplica<const V: usize> {
    vertices: u8,
    labels: [(u16, u32); V],
    neighbours: [u64; V],
    /// The vertices with a known label.
    labelled: u64,
    ways: [List<Way, WAYS_MAX>; V],
    /// The digest of the robot's map, unless a message was lost since it was received.
    digest: Option<u32>,
    hello: Option<Hello>,
    location: Option<Location>,
    evidence: Option<Evidence>,
    health: Option<Health>,
    belief: Option<Belief>,
    worst: Option<Worst>,
    goal_status: Option<GoalStatus>,
    exploration: Option<Exploration>,
    names: Names<V>,
    faults: [u32; FaultKind::ALL.len()],
}

const NO_WAYS: List<Way, WAYS_MAX> = List::empty(Way::NONE);

impl<const V: usize> MapReplica<V> {
    /// An empty replica.
    pub const fn new() -> Self {
        const { assert!(V >= 1 && V <= 64, "a map holds 1 to 64 vertices") };
        Self {
            vertices: 0,
            labels: [(0, 0); V],
            neighbours: [0; V],
            labelled: 0,
            ways: [NO_WAYS; V],
            digest: None,
            hello: None,
            location: None,
            evidence: None,
            health: None,
            belief: None,
            worst: None,
            goal_status: None,
            exploration: None,
            names: Names::new(),
            faults: [0; FaultKind::ALL.len()],
        }
    }

    /// Applies one message. `Place`, `Ring`, `Velocity` and `Reply` change nothing; vertices from `V` on are dropped.
    pub fn apply(&mut self, header: Header, message: &Message) {
        match header.arrival {
            Arrival::Late => return,
            Arrival::AfterGap { .. } => self.digest = None,
            Arrival::Restart => *self = Self::new(),
            Arrival::First | Arrival::InOrder => {}
        }
        match *message {
            Message::Hello(hello) => self.hello = Some(hello),
            Message::Map { vertices, digest, .. } => {
                self.resize(vertices);
                self.digest = Some(digest);
            }
            Message::Vertex { vertex, radius_mm, visits } => self.set_label(vertex, radius_mm, visits),
            Message::Edge { a, b, present } => self.set_edge(a, b, present),
            Message::Row(Row { vertex, radius_mm, visits, neighbours }) => {
                self.set_label(vertex, radius_mm, visits);
                for other in 0..V as u8 {
                    self.set_edge(vertex, other, neighbours & bit(other) != 0);
                }
            }
            Message::Location(location) => self.location = Some(location),
            Message::Evidence(evidence) => self.evidence = Some(evidence),
            Message::Health(health) => self.health = Some(health),
            Message::Fault { kind, count } => {
                if let Some(slot) = self.faults.get_mut(usize::from(kind)) {
                    *slot = count;
                }
            }
            Message::Belief(belief) => self.belief = Some(belief),
            Message::Remapped(remapped) => self.remap(&remapped),
            Message::Worst(worst) => self.worst = Some(worst),
            Message::GoalStatus(goal_status) => self.goal_status = Some(goal_status),
            Message::Ways(ways) => self.set_ways(ways),
            Message::Exploration(exploration) => self.exploration = Some(exploration),
            Message::Name { vertex, name } => self.names.put(vertex, name),
            Message::Named { vertices } => self.names.keep(vertices),
            Message::Place { .. } | Message::Ring { .. } | Message::Velocity(_) | Message::Reply(_) => {}
        }
    }

    /// Whether the replica equals the robot's map: its digest is the one that the robot sent last, and no frame was lost
    /// since. Cost: the CRC of 15 bytes per vertex and 6 bytes per way.
    pub fn is_converged(&self) -> bool {
        let rows = (0..self.vertices).filter_map(|vertex| self.row(vertex));
        let ways = self.ways.iter().take(self.vertices.into()).copied();
        self.digest == Some(digest(self.vertices, rows, ways))
    }

    /// Whether the label of every known vertex was received. Edges may be missing.
    pub fn is_complete(&self) -> bool {
        self.labelled == bit(self.vertices).wrapping_sub(1)
    }

    /// The number of known vertices.
    pub const fn vertices(&self) -> u8 {
        self.vertices
    }

    /// The label and the neighbours of a vertex; `None` until its label was received.
    pub fn row(&self, vertex: u8) -> Option<Row> {
        let &(radius_mm, visits) = self.labels.get(usize::from(vertex))?;
        let neighbours = self.neighbours(vertex);
        (self.labelled & bit(vertex) != 0).then_some(Row { vertex, radius_mm, visits, neighbours })
    }

    /// The neighbours of a vertex as a set of bits; 0 for an unknown vertex.
    pub fn neighbours(&self, vertex: u8) -> u64 {
        self.neighbours.get(usize::from(vertex)).copied().unwrap_or(0)
    }

    /// The ways of a vertex in counter-clockwise order; none for an unknown vertex, and for a robot that knows edges only.
    ///
    /// Before the replica has converged, the other end of an edge may lead elsewhere or be unknown.
    pub fn ways(&self, vertex: u8) -> &[Way] {
        self.ways.get(usize::from(vertex)).map_or(&[], List::as_slice)
    }

    /// Whether the robot has sent ways.
    pub fn has_ways(&self) -> bool {
        self.ways.iter().any(|ways| !ways.as_slice().is_empty())
    }

    /// Every frontier, a way that nobody has driven, in the order of the vertices.
    pub fn frontiers(&self) -> impl Iterator<Item = WayId> + '_ {
        let ends = |vertex| (0..).zip(self.ways(vertex)).map(move |(way, of)| (WayId { vertex, way }, of));
        (0..self.vertices).flat_map(ends).filter(|(_, way)| way.leads_to.is_none()).map(|(id, _)| id)
    }

    /// Every edge once, as pairs of vertices with the smaller id first. Parallel edges count as one;
    /// [`MapReplica::ways`] distinguishes them.
    pub fn edges(&self) -> impl Iterator<Item = (u8, u8)> + '_ {
        let later = |a, &b: &u8| a <= b;
        let neighbours = |a| VertexSet::from_bits(self.neighbours(a)).iter().map(u8::from);
        (0..self.vertices).flat_map(move |a| neighbours(a).filter(move |b| later(a, b)).map(move |b| (a, b)))
    }

    /// The last `Hello`.
    pub const fn hello(&self) -> Option<Hello> {
        self.hello
    }

    /// The last location of the robot.
    pub const fn location(&self) -> Option<Location> {
        self.location
    }

    /// The last evidence.
    pub const fn evidence(&self) -> Option<Evidence> {
        self.evidence
    }

    /// The last state of the firmware.
    pub const fn health(&self) -> Option<Health> {
        self.health
    }

    /// The last belief.
    pub const fn belief(&self) -> Option<Belief> {
        self.belief
    }

    /// The last worst n-gram.
    pub const fn worst(&self) -> Option<Worst> {
        self.worst
    }

    /// The last status of a goal.
    pub const fn goal_status(&self) -> Option<GoalStatus> {
        self.goal_status
    }

    /// How far the map is explored; `None` for a robot that knows edges only.
    pub const fn exploration(&self) -> Option<Exploration> {
        self.exploration
    }

    /// The names of the vertices.
    pub const fn names(&self) -> &Names<V> {
        &self.names
    }

    /// The last count of a kind of fault.
    pub fn fault(&self, kind: FaultKind) -> u32 {
        self.faults.get(kind as usize).copied().unwrap_or(0)
    }

    /// Applies new vertex ids to every stored vertex id. The digest is unknown until the size of the new map follows.
    fn remap(&mut self, remapped: &Remapped) {
        self.digest = None;
        self.vertices = remapped.count(self.vertices).min(V as u8);
        self.labelled = remapped.apply(&mut self.labels, (0, 0), &mut self.neighbours, self.labelled);
        remapped.apply_to_ways(&mut self.ways, NO_WAYS, |ways| {
            ways.as_mut_slice().iter_mut().for_each(|way| *way = way.remapped(remapped));
        });
        self.names.remap(|vertex| remapped.now(vertex));
        self.location = self.location.and_then(|location| location.remapped(remapped));
        if let Some(belief) = &mut self.belief {
            belief.remap(remapped);
        }
        self.worst = self.worst.and_then(|worst| worst.remapped(remapped));
        self.goal_status = self.goal_status.and_then(|goal_status| goal_status.remapped(remapped));
    }

    fn set_label(&mut self, vertex: u8, radius_mm: u16, visits: u32) {
        if let Some(label) = self.labels.get_mut(usize::from(vertex)) {
            *label = (radius_mm, visits);
            self.labelled |= bit(vertex);
            self.vertices = self.vertices.max(vertex.saturating_add(1));
        }
    }

    fn set_edge(&mut self, a: u8, b: u8, present: bool) {
        if usize::from(a.max(b)) >= V {
            return;
        }
        for (from, to) in [(a, b), (b, a)] {
            if let Some(row) = self.neighbours.get_mut(usize::from(from)) {
                *row = if present { *row | bit(to) } else { *row & !bit(to) };
            }
        }
        if present {
            self.vertices = self.vertices.max(a.max(b).saturating_add(1));
        }
    }

    fn set_ways(&mut self, VertexWays { vertex, ways }: VertexWays) {
        if let Some(slot) = self.ways.get_mut(usize::from(vertex)) {
            *slot = ways;
            self.vertices = self.vertices.max(vertex.saturating_add(1));
        }
    }

    /// Removes the vertices from `vertices` on and their edges.
    fn resize(&mut self, vertices: u8) {
        let kept = bit(vertices).wrapping_sub(1);
        for (row, vertex) in self.neighbours.iter_mut().zip(0u8..) {
            *row = if vertex < vertices { *row & kept } else { 0 };
        }
        for (ways, vertex) in self.ways.iter_mut().zip(0u8..) {
            if vertex >= vertices {
                *ways = NO_WAYS;
            } else {
                let beyond = |way: &Way| way.leads_to.is_some_and(|end| end.vertex >= vertices);
                ways.as_mut_slice().iter_mut().filter(|way| beyond(way)).for_each(|way| *way = way.frontier());
            }
        }
        self.names.keep(kept);
        self.labelled &= kept;
        self.vertices = vertices.min(V as u8);
    }
}

impl<const V: usize> Default for MapReplica<V> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::List;

    #[test]
    fn an_edge_to_a_vertex_that_is_remapped_beyond_the_capacity_is_dropped() {
        let header = Header { sequence: 0, arrival: Arrival::InOrder };
        let mut replica = MapReplica::<3>::new();
        replica.apply(header, &Message::Edge { a: 0, b: 1, present: true });
        replica.apply(header, &Message::Edge { a: 1, b: 1, present: true });
        replica.apply(header, &Message::Remapped(Remapped { place_index: 0, vertices: List::new([5, 0]) }));
        assert_eq!(replica.neighbours(0), 0b1);
        assert!(replica.edges().eq([(0, 0)]));
    }
}
