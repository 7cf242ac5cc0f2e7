//! Invalid snapshots: damaged bytes, and contents that no filter writes.

use super::common::random::cases;
use super::*;
use proptest::collection::vec;
use proptest::prelude::*;
use std::sync::LazyLock;
use toposlam::Filter;
use toposlam::{Exit, Ways};

type Small = RobustFilter<3, 6, 12>;

/// The offset of the setting `moves` in the section.
const MOVES_AT: usize = 9;

const ROOM: usize = Small::SNAPSHOT_BYTES;

/// Section contents of filters in all states.
static CONTENTS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let mut all = Vec::new();
    for drive in drives(48) {
        let mut filter = drive.start::<3, 6, 12>();
        for index in 0..48 {
            if index % 6 == 0 {
                all.push(contents(&saved(&mut filter, ROOM).unwrap()));
            }
            drive.step(&mut filter, index);
        }
    }
    all
});

/// Runs a filter through every operation with arbitrary observations.
fn exercise(filter: &mut Small) {
    for index in 0..40_u16 {
        let steps = 400 + 90 * (index * 5 % 7) + index % 3;
        let turn = [None, Some(Exit::Back), Some(Exit::On)][usize::from(index % 3)];
        let observation = Observation {
            exit: turn,
            ways: Ways::from_count(3).ok().filter(|_| index % 2 == 0),
            starts_sequence: index % 11 == 10,
            ..Observation::new(Fingerprint::from_steps(steps).unwrap())
        };
        let update = filter.observe(observation);
        assert!(filter.map().vertices().len() <= 6 && update.vertex.index() < 6);
        assert!(filter.path().all(|vertex| vertex.index() < 6));
        (0..3).for_each(|_| filter.refine());
        if index % 13 == 12 {
            filter.set_localise_only(index % 2 == 0);
        }
        if index == 20 {
            let snapshot = saved(filter, ROOM).unwrap();
            filter.restore(section(&snapshot)).unwrap();
        }
    }
}

/// Restores section contents and returns whether the filter accepted them. A filter that refuses them must not change.
fn accepts(bytes: &[u8]) -> bool {
    let mut filter = Box::new(Small::new());
    filter.start(RobustConfig::DEFAULT.with_hypotheses(3), 1).unwrap();
    for steps in [500, 800, 500, 1100] {
        filter.observe(Fingerprint::from_steps(steps).unwrap());
    }
    let before = saved(&mut filter, ROOM).unwrap();
    let snapshot = wrapped(bytes);
    match filter.restore(section(&snapshot)) {
        Ok(()) => {
            exercise(&mut filter);
            true
        }
        Err(error) => {
            let is_typed =
                matches!(error, SnapshotError::Contents | SnapshotError::Capacities | SnapshotError::TooShort);
            assert!(is_typed, "{error}");
            assert_eq!(saved(&mut filter, ROOM).unwrap(), before, "a refused snapshot changes nothing");
            false
        }
    }
}

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn mutated_contents_with_a_valid_crc_are_refused_or_usable(
        which in any::<prop::sample::Index>(),
        changes in vec((any::<prop::sample::Index>(), prop_oneof![any::<u8>(), Just(0), Just(255), 0_u8..8]), 1..4),
    ) {
        let mut bytes = CONTENTS[which.index(CONTENTS.len())].clone();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = if at == MOVES_AT { byte & 3 } else { byte };
        }
        accepts(&bytes);
    }
}

#[test]
fn every_byte_at_its_bounds_is_refused_or_usable() {
    let mut taken = 0;
    let mut tried = 0;
    for bytes in CONTENTS.iter().step_by(29) {
        // 255 moves at every place take minutes.
        for at in (0..bytes.len()).filter(|&at| at != MOVES_AT) {
            for byte in [0, bytes[at] ^ 1, bytes[at].wrapping_add(1), 127, 255] {
                let mut changed = bytes.clone();
                changed[at] = byte;
                taken += usize::from(accepts(&changed));
                tried += 1;
            }
        }
    }
    println!("{tried} changed snapshots, {taken} taken");
    assert!(taken > 500 && tried - taken > 500);
}

#[test]
fn truncated_and_overlong_contents_are_refused() {
    for bytes in CONTENTS.iter().step_by(9) {
        assert!(accepts(bytes));
        assert!((0..bytes.len()).all(|kept| !accepts(&bytes[..kept])));
        assert!(!accepts(&[bytes, &[0][..]].concat()));
    }
}

#[test]
fn a_snapshot_without_hypotheses_is_refused() {
    let mut filter = Box::new(Small::new());
    filter.start(RobustConfig::DEFAULT.with_hypotheses(3), 1).unwrap();
    let bytes = contents(&saved(&mut filter, ROOM).unwrap());
    assert!(accepts(&bytes));
    // An empty hypothesis: vertices, the vertex before the history, whether anything was marginalised, and two floats.
    let (rest, _hypothesis) = bytes.split_at(bytes.len() - 11);
    let (count, before) = rest.split_last().unwrap();
    assert_eq!(*count, 1);
    assert!(!accepts(&[before, &[0]].concat()));
}

#[test]
fn a_snapshot_of_other_capacities_is_refused() {
    let drive = &drives(8)[0];
    let mut filter = drive.start::<3, 6, 12>();
    (0..8).for_each(|index| drop(drive.step(&mut filter, index)));
    let snapshot = saved(&mut filter, ROOM).unwrap();
    let other = |refused: Result<(), SnapshotError>| assert_eq!(refused, Err(SnapshotError::Capacities));
    other(RobustFilter::<3, 7, 12>::new().restore(section(&snapshot)));
    other(RobustFilter::<3, 6, 13>::new().restore(section(&snapshot)));
    other(RobustFilter::<2, 6, 12>::new().restore(section(&snapshot)));
    // A filter with room for more hypotheses accepts the snapshot.
    let mut larger = Box::new(RobustFilter::<9, 6, 12>::new());
    assert_eq!(larger.restore(section(&snapshot)), Ok(()));
    assert_eq!(held(&*larger), held(&*filter));
}
