//! Snapshots of a mapper: other sections, and the start of a sequence after a restore.

use toposlam::persist::snapshot::{Resume, Snapshot, SnapshotError, Writer};
use toposlam::reference::{
    self, SONARS,
    ordered::{self, VERTICES},
};
use toposlam::wire::map_digest;
use toposlam::{Filter, Mapper, MapperConfig};
use toposlam_sim::world::{Plan, RobotModel, Simulation};

use super::common::notes::Notes;

fn started<F: Filter<VERTICES>>(filter: F::Config) -> Box<Mapper<SONARS, VERTICES, F>> {
    let mut mapper = Box::new(Mapper::new());
    let config = MapperConfig::new(reference::RING, filter).with_place(reference::PLACE).with_seed(1);
    mapper.start(&config).unwrap();
    mapper
}

/// Drives until the mapper has observed `places` places.
fn drive<F: Filter<VERTICES>>(mapper: &mut Mapper<SONARS, VERTICES, F>, simulation: &mut Simulation, places: usize) {
    let mut seen = 0;
    while seen < places {
        let (frame, truth) = simulation.next().unwrap();
        let place = mapper.observe(&frame, truth.passage());
        seen += usize::from(place.is_some());
    }
}

fn simulation() -> Simulation {
    Simulation::new(&Plan::built_in("office").unwrap(), RobotModel::default(), 3).unwrap()
}

/// For each place, whether it starts a sequence.
fn starts_of(mapper: &Mapper<SONARS, VERTICES, Notes>) -> Vec<bool> {
    mapper.filter().observations.iter().map(|observation| observation.starts_sequence).collect()
}

#[test]
fn a_restore_at_an_unknown_vertex_starts_a_sequence() {
    let mut buffer = [0; 64];
    let length = started::<Notes>(5).snapshot(&mut buffer).unwrap();
    for (resume, starts_sequence) in [(Resume::AtUnknownVertex, true), (Resume::InPlace, false)] {
        let mut mapper = started::<Notes>(9);
        mapper.restore(&buffer[..length], resume).unwrap();
        assert_eq!(mapper.filter().history, 5);
        drive(&mut mapper, &mut simulation(), 3);
        assert_eq!(starts_of(&mapper), [starts_sequence, false, false]);
    }
    // Refused bytes have no effect, and a start resets the state.
    let mut mapper = started::<Notes>(9);
    assert_eq!(mapper.restore(&buffer[..length - 1], Resume::AtUnknownVertex), Err(SnapshotError::TooShort));
    mapper.restore(&buffer[..length], Resume::AtUnknownVertex).unwrap();
    let config = MapperConfig::new(reference::RING, 9).with_place(reference::PLACE).with_seed(1);
    mapper.start(&config).unwrap();
    drive(&mut mapper, &mut simulation(), 1);
    assert_eq!((starts_of(&mapper), mapper.filter().history), (vec![false], 9));
}

#[test]
fn sections_of_other_stages_are_preserved_and_skipped() {
    let mut buffer = [0; 128];
    let mut writer = Writer::new(&mut buffer).unwrap();
    writer.section(77, |section| section.u32(4711)).unwrap();
    started::<Notes>(5).save(&mut writer).unwrap();
    let length = writer.finish().unwrap();
    let mut mapper = started::<Notes>(9);
    mapper.restore(&buffer[..length], Resume::InPlace).unwrap();
    assert_eq!(mapper.filter().history, 5);
    assert_eq!(Snapshot::open(&buffer[..length]).unwrap().section(77).unwrap().u32(), Ok(4711));
    let mut without = [0; 64];
    let length = Writer::new(&mut without).unwrap().finish().unwrap();
    assert_eq!(mapper.restore(&without[..length], Resume::InPlace), Err(SnapshotError::Contents));
}

#[test]
fn a_robot_restored_during_a_drive_ends_with_the_same_map() {
    let mut buffer = [0; ordered::SNAPSHOT_BYTES];
    let mut simulation = simulation();
    let mut mapper = started::<ordered::Filter>(ordered::FILTER);
    drive(&mut mapper, &mut simulation, 40);
    let length = mapper.snapshot(&mut buffer).unwrap();
    // The detector of the restored mapper is empty, so the restore is between two places.
    let mut restored = mapper.clone();
    restored.start(&ordered::MAPPER).unwrap();
    restored.restore(&buffer[..length], Resume::InPlace).unwrap();
    assert_eq!(
        map_digest(restored.map(), restored.filter().darts()),
        map_digest(mapper.map(), mapper.filter().darts())
    );
    for (frame, truth) in simulation.take(4000) {
        for mapper in [&mut mapper, &mut restored] {
            mapper.observe(&frame, truth.passage());
        }
    }
    assert_eq!(
        map_digest(restored.map(), restored.filter().darts()),
        map_digest(mapper.map(), mapper.filter().darts())
    );
    assert_eq!(restored.filter().observed(), mapper.filter().observed());
    assert!(restored.filter().observed() > 50);
}
