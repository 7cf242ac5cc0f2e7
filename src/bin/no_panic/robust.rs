//! Calls of the robust filter.

use core::hint::black_box;

use static_cell::ConstStaticCell;
use toposlam::{
    ConfigError, Filter, Observation, RobustConfig, RobustFilter,
    persist::Persist,
    persist::snapshot::{FILTER_SECTION, Snapshot, Writer},
};

use super::any::{Opaque, any_fingerprint, any_vertex, discard, show};
use super::ordered::{any_exit, any_ways};

pub(crate) fn robust_filter() {
    static LARGE: ConstStaticCell<RobustFilter<3, 32, 32>> = ConstStaticCell::new(RobustFilter::new());
    if let Some(filter) = LARGE.try_take() {
        robust(filter);
    }
}

pub(crate) fn robust<const N: usize, const V: usize, const HISTORY: usize>(filter: &mut RobustFilter<N, V, HISTORY>) {
    if let Err(error) = filter.start(RobustConfig::default().opaque(), black_box(1)) {
        show::<ConfigError>(error);
    }
    for _ in 0..black_box(3) {
        black_box(filter.observe(any_fingerprint()));
        let observation = Observation {
            fingerprint: any_fingerprint(),
            exit: any_exit(),
            ways: any_ways(),
            travel_frames: black_box(Some(100)),
            starts_sequence: false,
        };
        black_box(filter.observe(observation.opaque()));
        filter.refine();
        filter.set_localise_only(black_box(true));
        filter.refine();
        black_box(filter.refresh());
    }
    let map = *filter.map();
    let restarted = filter.start_with_map(RobustConfig::default().opaque(), black_box(1), black_box(&map));
    let _ = black_box((restarted, filter.evidence(), filter.noise_mm()));
    black_box((filter.map(), filter.observed(), filter.faults(), filter.remapped(any_vertex()), filter.worst()));
    black_box((filter.vertex_probability_q16(any_vertex()), filter.map_probability_q16()));
    for vertex in filter.path() {
        black_box(vertex);
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
