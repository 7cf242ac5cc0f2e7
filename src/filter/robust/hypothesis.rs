//! One hypothesis: which vertex each observation belongs to, and the map and counts that follow from that.

use super::prices::{EDGE, Prices, VERTEX};
use super::record::Record;
use super::tally::Tally;
use crate::Map;
use crate::map::bits;

/// No vertex: before the first place, or where the robot's way is not known.
pub(crate) const NOWHERE: u8 = u8::MAX;

/// The price of a path that stays at one vertex for two places: such a path is never kept.
const STANDSTILL: f32 = 1e6;

/// A partition of the newest `T` observations, and of all that came before them, into at most `V` vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hypothesis<const V: usize, const T: usize> {
    pub(crate) vertices: u8,
    /// The vertex of the newest observation.
    pub(crate) place: u8,
    /// The vertex of the place before the oldest observation of the record; [`NOWHERE`] when there is none.
    pub(crate) before: u8,
    /// How many sequences begin in the record.
    pub(crate) starts: u16,
    /// ln P of all turn hints.
    pub(crate) hints: f32,
    /// The collapsed evidence of map and path.
    pub(crate) evidence: f32,
    /// By how much the evidence of the map, all its paths together, exceeds that of this one path, as last computed.
    pub(crate) surplus: f32,
    /// Evidence of counts that have faded.
    pub(crate) faded: f32,
    /// Identifies the map; vertices are numbered in the order of their first visit.
    pub(crate) map_key: u32,
    pub(crate) path: [u8; T],
    pub(crate) tallies: [Tally; V],
    /// What left the record.
    pub(crate) settled: [Tally; V],
    pub(crate) neighbours: [u32; V],
    /// Edges that were driven before the record begins.
    pub(crate) settled_neighbours: [u32; V],
}

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    pub(crate) const NONE: Self = Self {
        vertices: 0,
        place: 0,
        before: 0,
        starts: 0,
        hints: 0.0,
        evidence: 0.0,
        surplus: 0.0,
        faded: 0.0,
        map_key: 0,
        path: [0; T],
        tallies: [Tally::NONE; V],
        settled: [Tally::NONE; V],
        neighbours: [0; V],
        settled_neighbours: [0; V],
    };

    pub(crate) fn clear(&mut self) {
        self.vertices = 0;
        self.place = NOWHERE;
        self.before = NOWHERE;
        self.starts = 0;
        self.hints = 0.0;
        self.evidence = 0.0;
        self.surplus = 0.0;
        self.faded = 0.0;
        self.map_key = 0;
        self.tallies.fill(Tally::NONE);
        self.settled.fill(Tally::NONE);
        self.neighbours.fill(0);
        self.settled_neighbours.fill(0);
    }

    /// What hypotheses are ranked by.
    pub(crate) fn score(&self) -> f32 {
        self.evidence + self.surplus
    }

    pub(crate) fn key(&self) -> u32 {
        keyed(self.map_key, self.vertices, self.place)
    }

    pub(crate) fn tally(&self, vertex: u8) -> Tally {
        self.tallies.get(usize::from(vertex)).copied().unwrap_or(Tally::NONE)
    }

    pub(crate) fn row(&self, vertex: u8) -> u32 {
        self.neighbours.get(usize::from(vertex)).copied().unwrap_or(0)
    }

    pub(crate) fn degree(&self, vertex: u8) -> u32 {
        self.row(vertex).count_ones()
    }

    pub(crate) fn at(&self, index: usize) -> u8 {
        self.path.get(index).copied().unwrap_or(NOWHERE)
    }

    pub(crate) fn edges(&self) -> u32 {
        let rows = self.neighbours.iter().take(usize::from(self.vertices));
        rows.map(|row| row.count_ones()).sum::<u32>() / 2
    }

    pub(crate) fn is_edge(&self, a: u8, b: u8) -> bool {
        self.row(a) >> (b & 31) & 1 == 1
    }

    /// Identifies the map, wherever the robot is.
    pub(crate) fn map_alone_key(&self) -> u32 {
        keyed(self.map_key, self.vertices, 0)
    }

    /// A hypothesis that knows a map and has seen nothing yet.
    pub(crate) fn know(&mut self, map: &Map<V>, deviation_steps: f32) {
        self.clear();
        self.vertices = map.vertices().len() as u8;
        for vertex in map.vertices() {
            let slot = vertex.index();
            if let (Some(settled), Some(row), Some(label)) =
                (self.settled.get_mut(slot), self.settled_neighbours.get_mut(slot), map.label(vertex))
            {
                *settled = Tally::known(label, map.visits(vertex).min(u32::from(u16::MAX)) as u16, deviation_steps);
                // A loop says that the place is its own neighbour, which no path of this filter uses.
                *row = map.neighbours(vertex).bits() as u32 & !(1 << (u8::from(vertex) & 31));
            }
        }
    }

    /// Takes leave of the oldest observation: its counts stay. Tells whether counts have faded, so that the hypothesis has to
    /// be [rebased](Hypothesis::rebase) when the record has dropped the observation.
    pub(crate) fn settle_oldest(&mut self, record: &Record<T>) -> bool {
        let (Some(oldest), Some(next)) = (record.get(0), record.get(1)) else { return false };
        let mut has_faded = false;
        let vertex = self.at(0);
        if !oldest.begins() && self.before != NOWHERE {
            join(&mut self.settled_neighbours, self.before, vertex);
        }
        if let Some(settled) = self.settled.get_mut(usize::from(vertex)) {
            settled.include(oldest);
            if !next.begins() {
                settled.exits = settled.exits.saturating_add(1);
            }
            has_faded = settled.fade();
        }
        self.before = if next.begins() { NOWHERE } else { vertex };
        self.path.copy_within(1.., 0);
        has_faded
    }

    /// Counts anew what the settled counts say now, with the evidence as it was.
    pub(crate) fn rebase(&mut self, prices: &Prices, record: &Record<T>) {
        let before = self.evidence;
        self.recount(prices, record);
        self.faded += before - self.evidence;
        self.evidence = before;
    }

    /// Takes a common amount of faded evidence from a hypothesis, so that sums stay small in long runs.
    pub(crate) fn forget(&mut self, faded: f32) {
        self.faded -= faded;
        self.evidence -= faded;
    }

    pub(crate) fn faded(&self) -> f32 {
        self.faded
    }

    /// Counts everything anew from a path that was changed: numbers the vertices by first visit, drops those without
    /// visits, and computes the evidence. Cost: O(T + V).
    pub(crate) fn rebuild(&mut self, prices: &Prices, record: &Record<T>) {
        self.renumber(record.len());
        self.recount(prices, record);
    }

    /// As [`Hypothesis::rebuild`], with the numbers as they are.
    pub(crate) fn recount(&mut self, prices: &Prices, record: &Record<T>) {
        self.tallies = self.settled;
        self.neighbours = self.settled_neighbours;
        self.starts = 0;
        self.hints = 0.0;
        let mut from = self.before;
        for (index, entry) in record.iter().enumerate() {
            let vertex = self.at(index);
            if let Some(tally) = self.tallies.get_mut(usize::from(vertex)) {
                tally.include(entry);
            }
            if entry.begins() || from == NOWHERE {
                self.starts = self.starts.saturating_add(1);
            } else {
                // The exit of the place before the record was counted when it left.
                if index > 0
                    && let Some(left) = self.tallies.get_mut(usize::from(from))
                {
                    left.exits = left.exits.saturating_add(1);
                }
                join(&mut self.neighbours, from, vertex);
                self.hints += self.hint(prices, record, index, entry, vertex);
            }
            from = vertex;
        }
        self.place = from;
        self.map_key = self.key_of_edges();
        self.evidence = self.total(prices);
    }

    /// The key of a map with these edges.
    pub(crate) fn key_of_edges(&self) -> u32 {
        let mut key = 0;
        for vertex in 0..self.vertices {
            for neighbour in bits(u64::from(self.row(vertex))).filter(|&neighbour| neighbour > vertex) {
                key ^= edge_key(vertex, neighbour);
            }
        }
        key
    }

    /// The evidence from the counts.
    pub(crate) fn total(&self, prices: &Prices) -> f32 {
        self.faded + self.factors(prices).iter().sum::<f32>()
    }

    /// The factors of the evidence, but for what has faded: of the labels, of the moves between places, and of the size of
    /// the map.
    pub(crate) fn factors(&self, prices: &Prices) -> [f32; 3] {
        let mut labels = 0.0;
        let mut moves = self.hints - f32::from(self.starts) * ln(self.vertices.max(1));
        for (vertex, tally) in (0..self.vertices).zip(&self.tallies) {
            labels += prices.label_evidence(tally);
            moves += prices.exit_evidence(tally, self.degree(vertex));
            if self.is_edge(vertex, vertex) {
                moves -= STANDSTILL;
            }
        }
        [labels, moves, -(f32::from(self.vertices) * VERTEX + self.edges() as f32 * EDGE)]
    }

    fn renumber(&mut self, len: usize) {
        let mut name = [NOWHERE; 32];
        let mut named = 0;
        let visits = self.path.iter().take(len).chain(core::iter::once(&self.before)).copied();
        let unvisited = (0..self.vertices)
            .filter(|&vertex| self.settled.get(usize::from(vertex)).is_some_and(|tally| tally.visits > 0));
        for vertex in visits.chain(unvisited) {
            if let Some(name) = name.get_mut(usize::from(vertex)).filter(|name| **name == NOWHERE) {
                *name = named;
                named += 1;
            }
        }
        let name = |vertex: u8| name.get(usize::from(vertex)).copied().unwrap_or(NOWHERE);
        self.path.iter_mut().take(len).for_each(|vertex| *vertex = name(*vertex));
        self.before = name(self.before);
        if self.settled_neighbours.iter().any(|&row| row != 0) || self.before != NOWHERE {
            let (settled, rows) = (self.settled, self.settled_neighbours);
            self.settled.fill(Tally::NONE);
            self.settled_neighbours.fill(0);
            for (vertex, (tally, row)) in (0..).zip(settled.into_iter().zip(rows)) {
                let slot = usize::from(name(vertex));
                if let (Some(to), Some(to_row)) = (self.settled.get_mut(slot), self.settled_neighbours.get_mut(slot)) {
                    *to = tally;
                    *to_row = bits(u64::from(row)).fold(0, |renamed, old| renamed | 1 << (name(old) & 31));
                }
            }
        }
        self.vertices = named;
    }

    /// Whether a vertex was only visited in the record, so that it can go without a trace.
    pub(crate) fn is_recent(&self, vertex: u8) -> bool {
        self.settled.get(usize::from(vertex)).is_some_and(|tally| tally.visits == 0) && self.before != vertex
    }

    pub(crate) fn settled_row(&self, vertex: u8) -> u32 {
        self.settled_neighbours.get(usize::from(vertex)).copied().unwrap_or(0)
    }
}

pub(crate) fn join(rows: &mut [u32], a: u8, b: u8) {
    for (from, to) in [(a, b), (b, a)] {
        if let Some(row) = rows.get_mut(usize::from(from)) {
            *row |= 1 << (to & 31);
        }
    }
}

pub(crate) fn ln(count: u8) -> f32 {
    libm::logf(f32::from(count))
}

fn mix(value: u32) -> u32 {
    let value = (value ^ value >> 16).wrapping_mul(0x7FEB_352D);
    let value = (value ^ value >> 15).wrapping_mul(0x846C_A68B);
    value ^ value >> 16
}

pub(crate) fn edge_key(a: u8, b: u8) -> u32 {
    mix(0x1_0000 | u32::from(a.min(b)) << 8 | u32::from(a.max(b)))
}

pub(crate) fn keyed(map_key: u32, vertices: u8, place: u8) -> u32 {
    map_key ^ mix(0x2_0000 | u32::from(vertices) << 8 | u32::from(place))
}
