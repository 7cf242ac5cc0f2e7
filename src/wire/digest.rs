//! CRC-32 of a frame and of a whole map.

use super::Row;
use crate::checksum::CRC;
use crate::map::{Map, VertexId};

/// CRC-32 ISO-HDLC of some bytes.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// The digest of a map: the CRC-32 ISO-HDLC of its canonical bytes. A listener compares it with that of its replica.
///
/// The canonical bytes are the number of vertices (`u8`) and, for each vertex in order, the radius in millimetres
/// (`u16`), the number of visits (`u32`) and the neighbours (`u64`, bit `w` for vertex `w`), all little endian. Two
/// different maps have the same digest with probability 2⁻³². Cost: 14 bytes a vertex.
pub fn map_digest<const V: usize>(map: &Map<V>) -> u32 {
    rows_digest(map.vertices().len() as u8, map.vertices().map(|vertex| row_of(map, vertex)))
}

/// The digest of a map, from its rows.
pub(super) fn rows_digest(vertices: u8, rows: impl Iterator<Item = Row>) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&[vertices]);
    for row in rows {
        digest.update(&row.radius_mm.to_le_bytes());
        digest.update(&row.visits.to_le_bytes());
        digest.update(&row.neighbours.to_le_bytes());
    }
    digest.finalize()
}

/// The canonical bytes of one vertex.
pub(super) fn row_of<const V: usize>(map: &Map<V>, vertex: VertexId) -> Row {
    Row {
        vertex: vertex.into(),
        radius_mm: map.label(vertex).map_or(0, |label| label.radius_mm()),
        visits: map.visits(vertex),
        neighbours: map.neighbours(vertex).bits(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::Fingerprint;

    #[test]
    fn the_crc_is_the_one_of_zlib() {
        assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn the_digest_is_the_crc_of_the_canonical_bytes() {
        let mut map = Map::<4>::new();
        assert_eq!(map_digest(&map), CRC.checksum(&[0]));
        let [a, b] = [0x0204, 1000].map(|mm| map.add_vertex(Fingerprint::from_radius_mm(mm).unwrap()).unwrap());
        map.add_edge(a, b);
        let bytes = [2, 4, 2, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 232, 3, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(map_digest(&map), CRC.checksum(&bytes));
    }
}
