//! The map that the listener has: what was sent of each vertex.

use crate::wire::messages::bit;
use crate::wire::robot::sent_ways::SentWays;
use crate::wire::{Remapped, Row, VertexWays};

/// A radius and a number of visits. Without a `u32` it takes no padding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct SentLabel {
    radius_mm: u16,
    visits: [u16; 2],
}

impl SentLabel {
    const NONE: Self = Self { radius_mm: 0, visits: [0; 2] };

    const fn of(row: &Row) -> Self {
        Self { radius_mm: row.radius_mm, visits: [row.visits as u16, (row.visits >> 16) as u16] }
    }
}

/// The vertices, edges and ways that the transmit queue has accepted.
#[derive(Clone, Debug)]
pub(super) struct SentMap<const V: usize> {
    vertices: u8,
    labels: [SentLabel; V],
    neighbours: [u64; V],
    ways: [SentWays; V],
}

impl<const V: usize> SentMap<V> {
    /// Nothing was sent.
    pub(super) const fn new() -> Self {
        Self { vertices: 0, labels: [SentLabel::NONE; V], neighbours: [0; V], ways: [SentWays::NONE; V] }
    }

    /// Forgets everything that was sent.
    pub(super) fn clear(&mut self) {
        self.vertices = 0;
        self.neighbours = [0; V];
        self.ways = [SentWays::NONE; V];
    }

    /// The number of vertices of the listener's map.
    pub(super) const fn vertices(&self) -> u8 {
        self.vertices
    }

    pub(super) fn set_vertices(&mut self, vertices: u8) {
        self.vertices = vertices;
    }

    /// The edges from a vertex to itself or a later one that differ from what was sent.
    pub(super) fn flips(&self, row: &Row) -> u64 {
        let sent = self.neighbours.get(usize::from(row.vertex)).copied().unwrap_or(0);
        (row.neighbours ^ sent) & !bit(row.vertex).wrapping_sub(1)
    }

    /// Whether the label and the visits of the vertex were sent.
    pub(super) fn has_label(&self, row: &Row) -> bool {
        row.vertex < self.vertices && self.labels.get(usize::from(row.vertex)) == Some(&SentLabel::of(row))
    }

    /// Whether the ways of the vertex were sent.
    pub(super) fn has_ways(&self, ways: &VertexWays) -> bool {
        self.ways.get(usize::from(ways.vertex)) == Some(&SentWays::of(ways))
    }

    pub(super) fn set_label(&mut self, row: &Row) {
        if let Some(label) = self.labels.get_mut(usize::from(row.vertex)) {
            *label = SentLabel::of(row);
        }
    }

    pub(super) fn set_edge(&mut self, a: u8, b: u8, present: bool) {
        for (from, to) in [(a, b), (b, a)] {
            if let Some(row) = self.neighbours.get_mut(usize::from(from)) {
                *row = if present { *row | bit(to) } else { *row & !bit(to) };
            }
        }
    }

    /// The label and all edges of a vertex were sent.
    pub(super) fn set_row(&mut self, row: &Row) {
        self.set_label(row);
        for vertex in 0..V as u8 {
            self.set_edge(row.vertex, vertex, row.neighbours & bit(vertex) != 0);
        }
    }

    pub(super) fn set_ways(&mut self, ways: &VertexWays) {
        if let Some(sent) = self.ways.get_mut(usize::from(ways.vertex)) {
            *sent = SentWays::of(ways);
        }
    }

    /// Renumbers, merges and removes vertices as the listener does.
    pub(super) fn remap(&mut self, remapped: &Remapped) {
        let labelled = bit(self.vertices).wrapping_sub(1);
        remapped.apply(&mut self.labels, SentLabel::NONE, &mut self.neighbours, labelled);
        remapped.apply_to_ways(&mut self.ways, SentWays::NONE, |ways| ways.remap(remapped));
        self.vertices = remapped.count(self.vertices).min(V as u8);
    }

    /// Removes the vertices from `vertices` on with their edges, as the listener does.
    pub(super) fn truncate(&mut self, vertices: u8) {
        let kept = bit(vertices).wrapping_sub(1);
        for (row, vertex) in self.neighbours.iter_mut().zip(0u8..) {
            *row = if vertex < vertices { *row & kept } else { 0 };
        }
        for (ways, vertex) in self.ways.iter_mut().zip(0u8..) {
            if vertex < vertices { ways.forget_from(vertices) } else { *ways = SentWays::NONE }
        }
        self.vertices = vertices;
    }
}
