//! The store: in any state of the flash, it returns the newest complete snapshot and stores the next one.

mod boot;
#[path = "../common/mod.rs"]
mod common;
mod cuts;
mod wear;

use common::environments::floor;
use common::robot::{Hints, Robot};
use toposlam::persist::snapshot::{Snapshot, Writer};
use toposlam::persist::store::Store;
use toposlam::reference::{self, robust};
use toposlam::wire::map_digest;
use toposlam::{Filter, RobustConfig};
use toposlam_sim::chip::FlashModel;

/// The two last sectors of the reference robot's flash, and the pages of an nRF52840.
type Sectors = FlashModel<1, { 128 * 1024 }>;
type Pages = FlashModel<4, 4096>;

/// `count` valid snapshots of a drive, one per `every` places after the first `places`.
fn snapshots(places: usize, count: usize, every: usize) -> Vec<Vec<u8>> {
    let environment = floor();
    let hints = Hints { turn: true, degree: true, missing_percent: 10, wrong_percent: 2 };
    let mut robot = Robot::new(&environment, hints, 11);
    let mut filter = Box::new(robust::Filter::new());
    filter.start(RobustConfig::DEFAULT, 1).unwrap();
    let mut restored = Box::new(robust::Filter::new());
    let mut all = Vec::new();
    for _ in 0..places {
        filter.observe(robot.step());
    }
    for _ in 0..count {
        for _ in 0..every {
            filter.observe(robot.step());
            filter.refine();
        }
        let mut buffer = vec![0; robust::SNAPSHOT_BYTES];
        let mut writer = Writer::new(&mut buffer).unwrap();
        writer.stage(filter.as_mut()).unwrap();
        let length = writer.finish().unwrap();
        buffer.truncate(length);
        Snapshot::open(&buffer).unwrap().restore(restored.as_mut()).unwrap();
        assert_eq!(map_digest(restored.map(), None), map_digest(filter.map(), None));
        all.push(buffer);
    }
    all
}

/// The newest snapshot of a store.
fn newest<FLASH: embedded_storage::nor_flash::NorFlash>(store: &mut Store<FLASH>) -> Option<Vec<u8>> {
    let mut buffer = vec![0; robust::SNAPSHOT_BYTES];
    let kept = store.newest(&mut buffer).unwrap()?;
    buffer.truncate(kept.length);
    Some(buffer)
}
