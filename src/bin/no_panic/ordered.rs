//! Calls of the ordered filter, of its map, and of the hints.

use core::hint::black_box;

use static_cell::ConstStaticCell;
use toposlam::{
    ConfigError, DartId, Darts, Exit, Filter, Observation, OrderedConfig, OrderedFilter, Passage, Ways, WaysError,
    persist::Persist,
    persist::snapshot::{FILTER_SECTION, Snapshot, Writer},
};

use super::any::{Opaque, any_fingerprint, any_vertex, discard, show};

pub(crate) fn ordered_filter() {
    static SMALL: ConstStaticCell<OrderedFilter<3, 12, 40, 32>> = ConstStaticCell::new(OrderedFilter::new());
    if let Some(filter) = SMALL.try_take() {
        ordered(filter);
    }
}

pub(crate) fn any_ways() -> Option<Ways> {
    if black_box(true) {
        return Ways::from_count(black_box(3)).ok();
    }
    match Ways::from_bearings_mrad(black_box(&[1571, 4712])) {
        Ok(ways) => Some(ways),
        Err(error) => {
            show::<WaysError>(error);
            None
        }
    }
}

pub(crate) fn any_exit() -> Option<Exit> {
    let exit = Exit::from_bearing_mrad(black_box(4712)).ok();
    [None, Some(Exit::Back), Some(Exit::On), exit].opaque().first().copied().flatten()
}

pub(crate) fn any_passage() -> Passage {
    Passage {
        exit: any_exit(),
        travel_frames: black_box(Some(3)),
        entry_mrad: black_box(Some(3)),
        returns: black_box(false),
    }
    .opaque()
}

pub(crate) fn ordered<const N: usize, const V: usize, const D: usize, const T: usize>(
    filter: &mut OrderedFilter<N, V, D, T>,
) {
    if let Err(error) = filter.start(OrderedConfig::DEFAULT.opaque(), black_box(1)) {
        show::<ConfigError>(error);
    }
    for _ in 0..black_box(3) {
        black_box(filter.observe(any_fingerprint()));
        let observation = Observation {
            fingerprint: any_fingerprint(),
            ways: any_ways(),
            exit: any_exit(),
            travel_frames: black_box(Some(100)),
            starts_sequence: black_box(false),
        };
        black_box(filter.observe(observation.opaque()));
        filter.refine();
        filter.set_localise_only(black_box(true));
    }
    if let Err(error) = filter.set_config(OrderedConfig::DEFAULT.opaque()) {
        show::<ConfigError>(error);
    }
    black_box((filter.map(), filter.observed(), filter.faults(), filter.remapped(any_vertex()), filter.worst()));
    black_box((filter.vertex_probability_q16(any_vertex()), filter.map_probability_q16(), filter.recent(black_box(2))));
    black_box((filter.arrival(), filter.is_in_doubt(), filter.is_localise_only(), filter.noise_mm(), filter.score()));
    for dart in filter.path() {
        black_box(dart);
    }
    if let Some(map) = filter.darts() {
        darts(map.opaque());
    }
    let mut buffer = black_box([0; 100]);
    if let Ok(mut writer) = Writer::new(&mut buffer) {
        discard(writer.stage(filter));
        discard(writer.finish());
    }
    if let Some(section) = Snapshot::open(&buffer).ok().and_then(|snapshot| snapshot.section(FILTER_SECTION)) {
        discard(filter.restore(section));
    }
}

fn darts(map: Darts<'_>) {
    for vertex in map.vertices() {
        for way in map.ways(vertex) {
            black_box((map.position(way), map.bearing(way), map.sightings(way), map.travel_frames(way)));
        }
    }
    for edge in map.edges() {
        black_box(edge);
    }
    for frontier in map.frontiers() {
        black_box(frontier);
    }
    if let Some(dart) = DartId::new(black_box(3)) {
        black_box((map.vertex(dart), map.partner(dart), map.darts().len()));
    }
}
