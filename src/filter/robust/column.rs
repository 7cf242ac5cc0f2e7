//! A column of the lattice: the vertices that explain one observation best, and their slots.

use crate::map::VertexId;
use crate::top_k::TopK;
use core::ops::{Index, IndexMut};

/// How many vertices a column has at most.
pub(super) const WIDTH: usize = 8;

/// The position of a vertex in a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot(u8);

impl Slot {
    pub(super) const FIRST: Self = Self(0);

    /// The slot of the low bits of a number.
    pub(super) const fn of_bits(bits: u16) -> Self {
        Self(bits as u8 & (WIDTH as u8 - 1))
    }

    /// The number of the slot.
    pub(super) const fn bits(self) -> u16 {
        self.0 as u16 & (WIDTH as u16 - 1)
    }

    /// The slots of a column of some length.
    pub(super) fn first(count: usize) -> impl ExactSizeIterator<Item = Self> + Clone {
        (0..count.min(WIDTH) as u8).map(Self)
    }
}

/// A value for each slot of a column.
#[derive(Clone, Copy, Debug)]
pub(super) struct PerSlot<T>(pub(super) [T; WIDTH]);

impl<T> Index<Slot> for PerSlot<T> {
    type Output = T;

    fn index(&self, slot: Slot) -> &T {
        &self.0[usize::from(slot.bits())]
    }
}

impl<T> IndexMut<Slot> for PerSlot<T> {
    fn index_mut(&mut self, slot: Slot) -> &mut T {
        &mut self.0[usize::from(slot.bits())]
    }
}

/// A vertex of a column, and the log likelihood of the observation there.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) vertex: VertexId,
    pub(super) ln_emission: f32,
}

/// The vertices that explain one observation best, the best first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column(TopK<State, WIDTH>);

impl Column {
    pub(super) const EMPTY: Self = Self(TopK::new(State { vertex: VertexId::FIRST, ln_emission: 0.0 }));

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.0.as_slice().len()
    }

    /// The states with their slots.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Slot, &State)> + Clone {
        Slot::first(WIDTH).zip(self.0.as_slice())
    }

    /// The states.
    pub(super) fn states_mut(&mut self) -> &mut [State] {
        self.0.as_mut_slice()
    }

    /// The vertex in a slot.
    pub(super) fn vertex(&self, slot: Slot) -> Option<VertexId> {
        self.0.as_slice().get(usize::from(slot.bits())).map(|state| state.vertex)
    }

    /// The largest log likelihood.
    pub(super) fn best(&self) -> f32 {
        self.0.as_slice().first().map_or(0.0, |state| state.ln_emission)
    }

    /// The slot of a vertex.
    pub(super) fn slot_of(&self, vertex: VertexId) -> Option<Slot> {
        self.iter().find(|(_, state)| state.vertex == vertex).map(|(slot, _)| slot)
    }

    pub(super) fn insert(&mut self, vertex: VertexId, ln_emission: f32) {
        self.0.insert(State { vertex, ln_emission }, |one, other| one.ln_emission >= other.ln_emission);
    }

    /// Inserts a vertex in any case, in place of the last if there is no room.
    pub(super) fn insert_always(&mut self, vertex: VertexId, ln_emission: f32) {
        self.0.truncate(WIDTH - 1);
        self.insert(vertex, ln_emission);
    }
}
