//! Calls of the mapper and of the snapshots.

use core::hint::black_box;

use static_cell::ConstStaticCell;
use toposlam::{
    ConfigError, FaultCounters, Filter, Mapper, OrderedFilter,
    persist::snapshot::{Resume, Snapshot, SnapshotError, SnapshotPolicy, Writer},
    reference,
    wire::{Reporter, map_digest},
};

use super::any::{Opaque, any_answer, any_frame, discard, show};
use super::ordered::{any_passage, ordered};

/// Two mappers of the reference robot do not fit.
type SmallMapper = Mapper<16, VERTICES, OrderedFilter<4, VERTICES, 40, 32>>;
const VERTICES: usize = 12;

pub(crate) fn mapper() {
    static MAPPER: ConstStaticCell<SmallMapper> = ConstStaticCell::new(SmallMapper::new());
    let Some(mapper) = MAPPER.try_take() else { return };
    if let Err(error) = mapper.start(&reference::MAPPER.opaque()) {
        show::<ConfigError>(error);
    }
    for _ in 0..black_box(9) {
        black_box(mapper.observe(&any_frame(), any_passage()));
    }
    ordered(mapper.filter_mut());
    mapper.kidnapped();
    black_box((mapper.faults(), mapper.map(), mapper.filter(), mapper.detector()));
    snapshot(mapper);
    static REPORTER: ConstStaticCell<Reporter<VERTICES>> = ConstStaticCell::new(Reporter::new());
    let Some(reporter) = REPORTER.try_take() else { return };
    let seen = mapper.observe(&any_frame(), any_passage());
    reporter.report(mapper, seen.as_ref(), &FaultCounters::new().opaque(), any_answer);
    reporter.resync(any_answer);
    black_box((reporter.refused(), map_digest(mapper.map(), mapper.filter().darts())));
}

fn snapshot(mapper: &mut SmallMapper) {
    static BYTES: ConstStaticCell<[u8; 128]> = ConstStaticCell::new([0; 128]);
    let Some(buffer) = BYTES.try_take().and_then(|bytes| bytes.get_mut(..black_box(100))) else { return };
    if let Err(error) = mapper.snapshot(buffer) {
        show::<SnapshotError>(error);
    }
    let resume = [Resume::InPlace, Resume::AtUnknownVertex].opaque().first().copied().unwrap_or(Resume::InPlace);
    if let Err(error) = mapper.restore(buffer, resume) {
        show::<SnapshotError>(error);
    }
    if let Ok(mut writer) = Writer::new(buffer) {
        discard(writer.section(black_box(9), |section| {
            section.u8(black_box(1))?;
            section.u16(black_box(2))?;
            section.u32(black_box(2))?;
            section.u64(black_box(3))?;
            section.f32(black_box(4.0))?;
            section.bytes(black_box(&[1, 2, 3]))
        }));
        discard(mapper.save(&mut writer));
        discard(writer.finish());
    }
    if let Ok(snapshot) = Snapshot::open(buffer) {
        black_box(snapshot.length());
        if let Some(mut section) = snapshot.section(black_box(9)) {
            discard(section.u8());
            discard(section.u16());
            discard(section.u32());
            discard(section.u64());
            discard(section.f32());
            discard(section.bytes(black_box(7)));
            discard(section.finish());
        }
    }
    black_box(SnapshotPolicy::default().opaque().is_due(black_box(7)));
}
