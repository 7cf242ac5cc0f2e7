//! Bytes that are no snapshot, or one that no filter wrote.

use super::common::random::cases;
use super::*;
use proptest::collection::vec;
use proptest::prelude::*;
use std::sync::LazyLock;
use toposlam::Filter;
use toposlam::Turn;

type Small = RobustFilter<3, 6, 12>;

/// Where the contents have the number of moves at a place.
const MOVES_AT: usize = 9;

const ROOM: usize = Small::SNAPSHOT_BYTES;

/// Contents of snapshots of filters in all states.
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

/// Lets a filter go on with anything, in every way there is.
fn goes_on(filter: &mut Small) {
    for index in 0..40_u16 {
        let steps = 400 + 90 * (index * 5 % 7) + index % 3;
        let turn = [None, Some(Turn::Back), Some(Turn::On)][usize::from(index % 3)];
        let observation = Observation {
            fingerprint: Fingerprint::from_steps(steps).unwrap(),
            turn,
            degree: (index % 2 == 0).then_some(3),
            starts_sequence: index % 11 == 10,
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

/// Restores some contents; a filter that refuses them must not have changed. Tells whether it took them.
fn bears(bytes: &[u8]) -> bool {
    let mut filter = Box::new(Small::new());
    filter.start(RobustConfig::DEFAULT.with_hypotheses(3), 1).unwrap();
    for steps in [500, 800, 500, 1100] {
        filter.observe(Fingerprint::from_steps(steps).unwrap());
    }
    let before = saved(&mut filter, ROOM).unwrap();
    let snapshot = wrapped(bytes);
    match filter.restore(section(&snapshot)) {
        Ok(()) => {
            goes_on(&mut filter);
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
    fn changed_contents_with_a_right_crc_are_refused_or_borne(
        which in any::<prop::sample::Index>(),
        changes in vec((any::<prop::sample::Index>(), prop_oneof![any::<u8>(), Just(0), Just(255), 0_u8..8]), 1..4),
    ) {
        let mut bytes = CONTENTS[which.index(CONTENTS.len())].clone();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = if at == MOVES_AT { byte & 3 } else { byte };
        }
        bears(&bytes);
    }
}

#[test]
fn every_byte_at_its_bounds_is_refused_or_borne() {
    let mut taken = 0;
    let mut tried = 0;
    for bytes in CONTENTS.iter().step_by(29) {
        // 255 moves at every place would take minutes.
        for at in (0..bytes.len()).filter(|&at| at != MOVES_AT) {
            for byte in [0, bytes[at] ^ 1, bytes[at].wrapping_add(1), 127, 255] {
                let mut changed = bytes.clone();
                changed[at] = byte;
                taken += usize::from(bears(&changed));
                tried += 1;
            }
        }
    }
    println!("{tried} changed snapshots, {taken} taken");
    assert!(taken > 500 && tried - taken > 500);
}

#[test]
fn contents_that_are_cut_or_too_long_are_refused() {
    for bytes in CONTENTS.iter().step_by(9) {
        assert!(bears(bytes));
        assert!((0..bytes.len()).all(|kept| !bears(&bytes[..kept])));
        assert!(!bears(&[bytes, &[0][..]].concat()));
    }
}

#[test]
fn a_snapshot_without_any_hypothesis_is_refused_because_no_filter_could_go_on_with_it() {
    let mut filter = Box::new(Small::new());
    filter.start(RobustConfig::DEFAULT.with_hypotheses(3), 1).unwrap();
    let bytes = contents(&saved(&mut filter, ROOM).unwrap());
    assert!(bears(&bytes));
    // Vertices, the place before, whether counts left the history, surplus and faded: all there is of a hypothesis of nothing.
    let (rest, _hypothesis) = bytes.split_at(bytes.len() - 11);
    let (count, before) = rest.split_last().unwrap();
    assert_eq!(*count, 1);
    assert!(!bears(&[before, &[0]].concat()));
}

#[test]
fn a_filter_with_other_capacities_refuses_by_that_name() {
    let drive = &drives(8)[0];
    let mut filter = drive.start::<3, 6, 12>();
    (0..8).for_each(|index| drop(drive.step(&mut filter, index)));
    let snapshot = saved(&mut filter, ROOM).unwrap();
    let other = |refused: Result<(), SnapshotError>| assert_eq!(refused, Err(SnapshotError::Capacities));
    other(RobustFilter::<3, 7, 12>::new().restore(section(&snapshot)));
    other(RobustFilter::<3, 6, 13>::new().restore(section(&snapshot)));
    other(RobustFilter::<2, 6, 12>::new().restore(section(&snapshot)));
    // More room for hypotheses than the snapshot has is no obstacle.
    let mut larger = Box::new(RobustFilter::<9, 6, 12>::new());
    assert_eq!(larger.restore(section(&snapshot)), Ok(()));
    assert_eq!(held(&*larger), held(&*filter));
}
