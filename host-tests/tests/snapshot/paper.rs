//! Snapshots of the paper's filter: a restored filter equals the saved one, and invalid snapshots are refused.

use super::common::environments::{floor, six_rooms};
use super::common::robot::{Hints, Robot};
use super::{contents, section, wrapped};
use toposlam::persist::Persist;
use toposlam::persist::snapshot::{SnapshotError, Writer};
use toposlam::{Direction, Filter, Observation, PaperConfig, PaperFilter, RobustFilter};

/// The number of places compared after a restore.
const WATCHED: usize = 10;
const PLACES: usize = 60;

pub(super) type Paper = PaperFilter<6, 12, 1>;

pub(super) const ROOM: usize = Paper::SNAPSHOT_BYTES;

pub(super) fn started() -> Box<Paper> {
    let config = PaperConfig::DEFAULT.with_direction(Direction::HistoryToMap).with_particles(6);
    let mut filter = Box::new(Paper::new());
    filter.start(config, 7).unwrap();
    filter
}

pub(super) fn saved(filter: &mut Paper, room: usize) -> Result<Vec<u8>, SnapshotError> {
    let mut buffer = vec![0; room];
    let mut writer = Writer::new(&mut buffer)?;
    writer.stage(filter)?;
    let length = writer.finish()?;
    buffer.truncate(length);
    Ok(buffer)
}

pub(super) fn walks() -> [Vec<Observation>; 2] {
    [(floor(), 1), (six_rooms(), 2)].map(|(environment, seed)| {
        let mut robot = Robot::new(&environment, Hints::default(), seed);
        (0..PLACES).map(|_| robot.step()).collect()
    })
}

#[test]
fn a_filter_restored_at_any_place_continues_bit_for_bit() {
    for walk in walks() {
        let mut filter = started();
        for cut in 0..=PLACES {
            let mut saved_filter = filter.clone();
            let snapshot = saved(&mut saved_filter, ROOM).unwrap();
            let mut restored = started();
            walk.iter().take(cut % 5).for_each(|&observation| {
                _ = restored.observe(observation);
            });
            restored.restore(section(&snapshot)).unwrap();
            assert_eq!(saved(&mut restored, ROOM).unwrap(), snapshot, "{cut}");
            for &observation in walk.iter().skip(cut).take(WATCHED) {
                let update = filter.clone().observe(observation);
                assert_eq!(restored.observe(observation), saved_filter.observe(observation), "{cut} {update:?}");
                assert_eq!(restored.map(), saved_filter.map());
            }
            if let Some(&observation) = walk.get(cut) {
                filter.observe(observation);
            }
        }
    }
}

#[test]
fn a_buffer_without_room_for_every_particle_is_refused() {
    let mut filter = started();
    walks()[0].iter().for_each(|&observation| {
        _ = filter.observe(observation);
    });
    let whole = saved(&mut filter, ROOM).unwrap().len();
    assert!((0..whole).all(|room| saved(&mut filter, room) == Err(SnapshotError::Full)));
}

#[test]
fn invalid_contents_and_other_filters_are_refused_and_change_nothing() {
    let mut filter = started();
    walks()[1].iter().for_each(|&observation| {
        _ = filter.observe(observation);
    });
    let snapshot = saved(&mut filter, ROOM).unwrap();
    let bytes = contents(&snapshot);
    let mut refused = 0;
    for at in 0..bytes.len() {
        for bit in [1, 16, 128] {
            let mut damaged = bytes.clone();
            damaged[at] ^= bit;
            let mut restored = started();
            let wrapped = wrapped(&damaged);
            match restored.restore(section(&wrapped)) {
                Ok(()) => {
                    walks()[0].iter().take(3).for_each(|&observation| {
                        _ = restored.observe(observation);
                    });
                }
                Err(_) => {
                    refused += 1;
                    assert_eq!(restored.observed(), 0);
                }
            }
        }
        let wrapped = wrapped(&bytes[..at]);
        assert!(started().restore(section(&wrapped)).is_err());
    }
    assert!(refused > bytes.len() / 4, "{refused}");
    let mut robust = Box::new(RobustFilter::<6, 12, 32>::new());
    assert_eq!(robust.restore(section(&snapshot)), Err(SnapshotError::Capacities));
}
