//! CRC-32 of a frame and of a whole map.

use super::{List, Row, VertexWays, Way};
use crate::WAYS_MAX;
use crate::checksum::CRC;
use crate::map::{Darts, Map, VertexId};

/// CRC-32 ISO-HDLC of some bytes.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// The digest of a map: the CRC-32 ISO-HDLC of its canonical bytes. A listener compares it with that of its replica.
///
/// The canonical bytes are the number of vertices (`u8`) and, for each vertex in order, the radius in millimetres
/// (`u16`), the number of visits (`u32`) and the neighbours (`u64`, bit `w` for vertex `w`), all little endian. If `darts` has a
/// way, there follow for each vertex in order the number of its ways (`u8`) and, for each way, the bearing in milliradians
/// (`u16`), the vertex and the position of the other end (`u8` each; 255 and 255 for a frontier) and the travel time (`u16`, 0
/// if unknown). Two different maps have the same digest with probability 2⁻³². Cost: 15 bytes a vertex and 6 bytes a way.
pub fn map_digest<const V: usize>(map: &Map<V>, darts: Option<Darts<'_>>) -> u32 {
    let rows = map.vertices().map(|vertex| row_of(map, vertex));
    let ways = |vertex| darts.map_or(VertexWays::default(), |darts| VertexWays::of(darts, vertex)).ways;
    digest(map.vertices().len() as u8, rows, map.vertices().map(ways))
}

/// The digest of a map, from its rows and ways.
pub(super) fn digest(
    vertices: u8,
    rows: impl Iterator<Item = Row>,
    ways: impl Iterator<Item = List<Way, WAYS_MAX>> + Clone,
) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&[vertices]);
    for row in rows {
        digest.update(&row.radius_mm.to_le_bytes());
        digest.update(&row.visits.to_le_bytes());
        digest.update(&row.neighbours.to_le_bytes());
    }
    if ways.clone().any(|ways| !ways.as_slice().is_empty()) {
        for ways in ways {
            digest.update(&[ways.as_slice().len() as u8]);
            ways.as_slice().iter().for_each(|way| digest.update(&way.to_bytes()));
        }
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
    use crate::map::DartMap;
    use crate::place::Fingerprint;

    #[test]
    fn the_crc_is_the_one_of_zlib() {
        assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn the_digest_is_the_crc_of_the_canonical_bytes() {
        let mut map = Map::<4>::new();
        assert_eq!(map_digest(&map, None), CRC.checksum(&[0]));
        let [a, b] = [0x0204, 1000].map(|mm| map.add_vertex(Fingerprint::from_radius_mm(mm).unwrap()).unwrap());
        map.add_edge(a, b);
        let bytes = [2, 4, 2, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 232, 3, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(map_digest(&map, None), CRC.checksum(&bytes));
    }

    #[test]
    fn ways_follow_the_rows_and_a_map_without_ways_keeps_its_digest() {
        let mut map = Map::<4>::new();
        let mut darts = DartMap::<4, 8>::EMPTY;
        for _ in 0..2 {
            map.add_vertex(Fingerprint::ZERO).unwrap();
            darts.add_vertex().unwrap();
        }
        assert_eq!(map_digest(&map, Some(darts.view())), map_digest(&map, None));
        darts.add_way(0, 0).unwrap();
        darts.add_way(0, 1 << 15).unwrap();
        darts.add_way(1, 0).unwrap();
        darts.join(1, 2);
        darts.time(1, 4096);
        let row = [0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let ways = [2, 0, 0, 255, 255, 0, 0, 69, 12, 1, 0, 2, 0, 1, 0, 0, 0, 1, 2, 0];
        let bytes = [&[2][..], &row, &row, &ways].concat();
        assert_eq!(map_digest(&map, Some(darts.view())), CRC.checksum(&bytes));
    }
}
