//! What the reporter remembers of the ways that it sent.

use crate::WAYS_MAX;
use crate::wire::{Remapped, VertexWays};

/// The ways of one vertex as sent: the vertices they lead to, and a hash of everything else. So the record follows new vertex ids
/// as the listener's map does. If two hashes are equal by chance, the repeated map makes up for it. Memory: 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SentWays {
    hash: u32,
    /// The vertex plus one; 0 for a frontier and for no way.
    leads_to: [u8; WAYS_MAX],
}

impl SentWays {
    /// No way: all zero, so that a reporter that is not started is in `.bss`.
    pub(super) const NONE: Self = Self { hash: 0, leads_to: [Self::NOWHERE; WAYS_MAX] };
    const NOWHERE: u8 = 0;

    /// Cost: two multiplications a way.
    pub(super) fn of(ways: &VertexWays) -> Self {
        let mut sent = Self::NONE;
        for (slot, way) in sent.leads_to.iter_mut().zip(ways.ways.as_slice()) {
            let [a, b, vertex, position, c, d] = way.to_bytes();
            *slot = vertex.wrapping_add(1);
            for word in [[1, position, a, b], [0, 0, c, d]] {
                sent.hash = (sent.hash ^ u32::from_le_bytes(word)).wrapping_mul(0x9E37_79B1).rotate_left(15);
            }
        }
        sent
    }

    /// Applies new vertex ids. A way to a removed vertex keeps the old position in its hash, which no frontier has, so that it is
    /// sent again.
    pub(super) fn remap(&mut self, remapped: &Remapped) {
        for vertex in self.leads_to.iter_mut().filter(|vertex| **vertex != Self::NOWHERE) {
            *vertex = remapped.now(vertex.wrapping_sub(1)).map_or(Self::NOWHERE, |now| now.wrapping_add(1));
        }
    }

    /// Forgets the edges to the vertices from one on.
    pub(super) fn forget_from(&mut self, vertices: u8) {
        for vertex in self.leads_to.iter_mut().filter(|vertex| **vertex > vertices) {
            *vertex = Self::NOWHERE;
        }
    }
}
