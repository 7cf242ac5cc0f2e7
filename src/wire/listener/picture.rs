//! The listener's side: the map as heard.

use crate::{FaultKind, VertexSet};

use crate::wire::decoder::{Arrival, Header};
use crate::wire::digest::rows_digest;
use crate::wire::robot::bit;
use crate::wire::{Belief, Evidence, Health, Hello, Journey, Location, Message, Renamed, Row, Worst};

/// The map as heard so far, and whether it is the robot's.
///
/// Any message may be missing, doubled or late: late ones are ignored, and what is missing comes round with the
/// rolling picture. `V` has to be at least the robot's; 64 always is. Memory: 16 bytes for each vertex and about 280 bytes.
#[derive(Clone, Debug)]
pub struct Picture<const V: usize> {
    vertices: u8,
    labels: [(u16, u32); V],
    neighbours: [u64; V],
    /// The vertices whose label was heard.
    labelled: u64,
    /// The digest of the robot's map, unless a message was missed since it was heard.
    digest: Option<u32>,
    hello: Option<Hello>,
    location: Option<Location>,
    evidence: Option<Evidence>,
    health: Option<Health>,
    belief: Option<Belief>,
    worst: Option<Worst>,
    journey: Option<Journey>,
    faults: [u32; FaultKind::ALL.len()],
}

impl<const V: usize> Picture<V> {
    /// The picture of a listener who has heard nothing.
    pub const fn new() -> Self {
        const { assert!(V >= 1 && V <= 64, "a map holds 1 to 64 vertices") };
        Self {
            vertices: 0,
            labels: [(0, 0); V],
            neighbours: [0; V],
            labelled: 0,
            digest: None,
            hello: None,
            location: None,
            evidence: None,
            health: None,
            belief: None,
            worst: None,
            journey: None,
            faults: [0; FaultKind::ALL.len()],
        }
    }

    /// Takes in one message. `Place`, `Ring`, `Drive` and `Reply` leave no trace here; a vertex beyond `V` is left out.
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
            Message::Renamed(renamed) => self.rename(&renamed),
            Message::Worst(worst) => self.worst = Some(worst),
            Message::Journey(journey) => self.journey = Some(journey),
            Message::Place { .. } | Message::Ring { .. } | Message::Drive(_) | Message::Reply(_) => {}
        }
    }

    /// Whether the map heard so far is the robot's, as far as anyone can know: its digest is the one that the robot
    /// sent last, and no frame was missed since. Cost: the CRC of 14 bytes a vertex.
    pub fn is_converged(&self) -> bool {
        self.digest == Some(rows_digest(self.vertices, (0..self.vertices).filter_map(|vertex| self.row(vertex))))
    }

    /// Whether the label of every vertex known to exist was heard. Edges may still be missing.
    pub fn is_complete(&self) -> bool {
        self.labelled == bit(self.vertices).wrapping_sub(1)
    }

    /// How many vertices the map has, as far as heard.
    pub const fn vertices(&self) -> u8 {
        self.vertices
    }

    /// All that was heard of a vertex; `None` while its label was not.
    pub fn row(&self, vertex: u8) -> Option<Row> {
        let &(radius_mm, visits) = self.labels.get(usize::from(vertex))?;
        let neighbours = self.neighbours(vertex);
        (self.labelled & bit(vertex) != 0).then_some(Row { vertex, radius_mm, visits, neighbours })
    }

    /// The neighbours of a vertex as a bit row; 0 for a vertex that the map does not have.
    pub fn neighbours(&self, vertex: u8) -> u64 {
        self.neighbours.get(usize::from(vertex)).copied().unwrap_or(0)
    }

    /// Every edge once, as pairs of vertices with the smaller number first.
    pub fn edges(&self) -> impl Iterator<Item = (u8, u8)> + '_ {
        let later = |a, &b: &u8| a <= b;
        let neighbours = |a| VertexSet::from_bits(self.neighbours(a)).iter().map(u8::from);
        (0..self.vertices).flat_map(move |a| neighbours(a).filter(move |b| later(a, b)).map(move |b| (a, b)))
    }

    /// The last introduction of the robot.
    pub const fn hello(&self) -> Option<Hello> {
        self.hello
    }

    /// Where the robot was last.
    pub const fn location(&self) -> Option<Location> {
        self.location
    }

    /// The last evidence.
    pub const fn evidence(&self) -> Option<Evidence> {
        self.evidence
    }

    /// How the firmware was last.
    pub const fn health(&self) -> Option<Health> {
        self.health
    }

    /// Where the robot may be and how far the map is to be trusted, as last heard.
    pub const fn belief(&self) -> Option<Belief> {
        self.belief
    }

    /// What the map explains worst, as last heard.
    pub const fn worst(&self) -> Option<Worst> {
        self.worst
    }

    /// How the way to a vertex goes, as last heard.
    pub const fn journey(&self) -> Option<Journey> {
        self.journey
    }

    /// How often a kind of fault was seen, as far as heard.
    pub fn fault(&self, kind: FaultKind) -> u32 {
        self.faults.get(kind as usize).copied().unwrap_or(0)
    }

    /// Gives the vertices their new numbers, wherever they were heard of. The map is that of the update once its size
    /// follows; until then the digest of the map before means nothing.
    fn rename(&mut self, renamed: &Renamed) {
        self.digest = None;
        self.vertices = renamed.vertices(self.vertices).min(V as u8);
        self.labelled = renamed.apply(&mut self.labels, &mut self.neighbours, self.labelled);
        self.location = self.location.and_then(|location| location.renamed(renamed));
        if let Some(belief) = &mut self.belief {
            belief.rename(renamed);
        }
        self.worst = self.worst.and_then(|worst| worst.renamed(renamed));
        self.journey = self.journey.and_then(|journey| journey.renamed(renamed));
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

    /// Vertices that do not exist any more go with their edges.
    fn resize(&mut self, vertices: u8) {
        let kept = bit(vertices).wrapping_sub(1);
        for (row, vertex) in self.neighbours.iter_mut().zip(0u8..) {
            *row = if vertex < vertices { *row & kept } else { 0 };
        }
        self.labelled &= kept;
        self.vertices = vertices.min(V as u8);
    }
}

impl<const V: usize> Default for Picture<V> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::List;

    #[test]
    fn an_edge_to_a_vertex_that_is_renamed_beyond_the_capacity_is_left_out() {
        let header = Header { sequence: 0, arrival: Arrival::InOrder };
        let mut picture = Picture::<3>::new();
        picture.apply(header, &Message::Edge { a: 0, b: 1, present: true });
        picture.apply(header, &Message::Edge { a: 1, b: 1, present: true });
        picture.apply(header, &Message::Renamed(Renamed { place_index: 0, names: List::new([5, 0]) }));
        assert_eq!(picture.neighbours(0), 0b1);
        assert!(picture.edges().eq([(0, 0)]));
    }
}
