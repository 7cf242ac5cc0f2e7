//! A listener that the tests let miss frames, and the comparison of its map with the robot's.

use super::robot::{Believer, Robot};
use toposlam::wire::{Decoder, MapReplica, Progress, Way};
use toposlam::{DartId, DartMap, Fingerprint};

/// The state of a listener.
pub(crate) struct Listener<const V: usize> {
    decoder: Decoder,
    pub(crate) replica: MapReplica<V>,
}

impl<const V: usize> Listener<V> {
    pub(crate) fn new() -> Self {
        Self { decoder: Decoder::new(), replica: MapReplica::new() }
    }

    pub(crate) fn decode(&mut self, mut bytes: &[u8]) {
        loop {
            bytes = match self.decoder.feed(bytes) {
                Progress::NeedsMore => return,
                Progress::Error { rest, .. } => rest,
                Progress::Message { header, message, rest } => {
                    self.replica.apply(header, &message);
                    rest
                }
            };
        }
    }
}

/// A robot whose filter knows the ways or only the edges.
pub(crate) fn robot(has_ways: bool) -> Robot<16> {
    let robot = Robot::new(1);
    if has_ways { robot.with_ways() } else { robot }
}

/// Whether the replica equals the map, compared by vertices, edges and ways and not by the digest.
pub(crate) fn same<const V: usize, const W: usize>(replica: &MapReplica<W>, filter: &Believer<V>) -> bool {
    let map = &filter.map;
    filter.darts.as_ref().is_none_or(|darts| same_ways(replica, darts))
        && usize::from(replica.vertices()) == map.vertices().len()
        && replica.is_complete()
        && replica.edges().eq(map.edges().map(|(a, b)| (a.into(), b.into())))
        && map.vertices().all(|vertex| {
            replica.row(vertex.into()).is_some_and(|row| {
                Some(row.radius_mm) == map.label(vertex).map(Fingerprint::radius_mm)
                    && row.visits == map.visits(vertex)
                    && row.neighbours == map.neighbours(vertex).bits()
            })
        })
}

/// Whether every way of a map is in the replica, at its place and with its edge, and no other.
fn same_ways<const V: usize, const W: usize>(replica: &MapReplica<W>, darts: &DartMap<V, 250>) -> bool {
    let position = |way| {
        let ways = darts.ways(darts.vertex(way));
        ways.iter().position(|&other| other == way).map(|way| way as u8)
    };
    (0..darts.vertices()).all(|vertex| {
        let (of_map, received) = (darts.ways(vertex), replica.ways(vertex));
        let is_same = |(&dart, way): (&u8, &Way)| {
            let partner = darts.partner(dart);
            (f64::from(darts.bearing(dart)) / 65_536.0 * 6283.0 - f64::from(way.bearing_mrad)).abs() <= 1.0
                && way.leads_to.map(|end| end.vertex) == partner.map(|partner| darts.vertex(partner))
                && way.leads_to.map(|end| end.way) == partner.and_then(position)
                && way.travel_frames == DartId::new(dart).and_then(|dart| darts.view().travel_frames(dart))
        };
        of_map.len() == received.len() && of_map.iter().zip(received).all(is_same)
    }) && replica.frontiers().count() == darts.frontiers().count()
}
