//! What the reporter remembers of the ways that it sent.

use crate::WAYS_MAX;
use crate::checksum::CRC;
use crate::wire::{Remapped, VertexWays};

/// The ways of one vertex as sent: the vertices they lead to, and a checksum of everything else. So the record follows new
/// vertex ids as the listener's map does. Memory: 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SentWays {
    checksum: u32,
    leads_to: [u8; WAYS_MAX],
}

impl SentWays {
    /// What a reporter holds before it is started: all zero.
    pub(super) const UNSET: Self = Self { checksum: 0, leads_to: [0; WAYS_MAX] };
    /// No way.
    pub(super) const NONE: Self = Self { checksum: 0, leads_to: [Self::NOWHERE; WAYS_MAX] };
    const NOWHERE: u8 = u8::MAX;

    /// Cost: the CRC of 6 bytes a way.
    pub(super) fn of(ways: &VertexWays) -> Self {
        let mut sent = Self::NONE;
        let mut digest = CRC.digest();
        for (slot, way) in sent.leads_to.iter_mut().zip(ways.ways.as_slice()) {
            let [a, b, vertex, position, c, d] = way.to_bytes();
            *slot = vertex;
            digest.update(&[a, b, position, c, d]);
        }
        sent.checksum = digest.finalize();
        sent
    }

    /// Applies new vertex ids. A way to a removed vertex keeps the old position in its checksum, which no frontier has, so that it
    /// is sent again.
    pub(super) fn remap(&mut self, remapped: &Remapped) {
        for vertex in self.leads_to.iter_mut().filter(|vertex| **vertex != Self::NOWHERE) {
            *vertex = remapped.now(*vertex).unwrap_or(Self::NOWHERE);
        }
    }

    /// Forgets the edges to the vertices from one on.
    pub(super) fn forget_from(&mut self, vertices: u8) {
        for vertex in self.leads_to.iter_mut().filter(|vertex| **vertex >= vertices) {
            *vertex = Self::NOWHERE;
        }
    }
}
