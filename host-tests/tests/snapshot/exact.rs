//! A restored filter continues exactly like the saved one, bit for bit.

use super::*;
use toposlam::reference::robust;

/// The number of places compared after a restore.
const WATCHED: usize = 14;

/// Saves and restores at every place of a drive; returns the number of snapshots and the largest one.
fn cut_everywhere<const N: usize, const V: usize, const T: usize>(drive: &Drive) -> (usize, usize) {
    let most = RobustFilter::<N, V, T>::SNAPSHOT_BYTES;
    let mut filter = drive.start::<N, V, T>();
    let mut largest = 0;
    let places = drive.observations.len();
    for cut in 0..=places {
        let mut saved_filter = filter.clone();
        let before = held(&saved_filter);
        let snapshot = saved(&mut saved_filter, most).unwrap();
        largest = largest.max(snapshot.len());
        let after = held(&saved_filter);
        assert_eq!(
            before.published, after.published,
            "saving does not change the published result: {} {cut}",
            drive.name
        );
        // Restore into a filter with another state.
        let mut restored = drive.start::<N, V, T>();
        (0..cut % 5).for_each(|index| drop(drive.step(&mut restored, index.min(places - 1))));
        restored.restore(section(&snapshot)).unwrap_or_else(|error| panic!("{} {cut}: {error}", drive.name));
        assert_eq!(held(&restored), after, "{} {cut}", drive.name);
        assert_eq!(saved(&mut restored, most).unwrap(), snapshot, "{} {cut}", drive.name);
        for index in cut..places.min(cut + WATCHED) {
            let (going_on, resumed) = (drive.step(&mut saved_filter, index), drive.step(&mut restored, index));
            assert_eq!(resumed, going_on, "{} cut at {cut}, place {index}", drive.name);
        }
        if cut < places {
            drive.step(&mut filter, cut);
        }
    }
    (places + 1, largest)
}

#[test]
fn a_filter_restored_at_any_place_continues_bit_for_bit() {
    let (mut cuts, mut largest) = (0, [0; 3]);
    for drive in drives(72) {
        for (size, (more, bytes)) in [
            cut_everywhere::<4, 12, 24>(&drive),
            cut_everywhere::<6, 20, 24>(&drive),
            cut_everywhere::<3, 5, 8>(&drive),
        ]
        .into_iter()
        .enumerate()
        {
            cuts += more;
            largest[size] = largest[size].max(bytes);
        }
    }
    let bounds = [
        RobustFilter::<4, 12, 24>::SNAPSHOT_BYTES,
        RobustFilter::<6, 20, 24>::SNAPSHOT_BYTES,
        RobustFilter::<3, 5, 8>::SNAPSHOT_BYTES,
    ];
    println!("{cuts} cuts; largest snapshots {largest:?} of {bounds:?} bytes");
    assert!(largest.iter().zip(bounds).all(|(&largest, bound)| largest <= bound));
    assert_eq!(largest[2], bounds[2], "the bound is tight");
}

#[test]
fn a_smaller_buffer_holds_fewer_hypotheses_and_the_same_map() {
    let drive = &drives(60)[1];
    let mut filter = drive.start::<6, 16, 40>();
    (0..60).for_each(|index| drop(drive.step(&mut filter, index)));
    let whole = saved(&mut filter, RobustFilter::<6, 16, 40>::SNAPSHOT_BYTES).unwrap();
    let published = held(&filter);
    let mut sizes = std::collections::BTreeSet::new();
    for room in 0..=whole.len() {
        match saved(&mut filter, room) {
            Ok(snapshot) => {
                let mut restored = drive.start::<6, 16, 40>();
                restored.restore(section(&snapshot)).unwrap();
                assert_eq!(held(&restored), published, "{room}");
                sizes.insert(snapshot.len());
            }
            Err(error) => {
                assert_eq!(error, SnapshotError::Full);
                assert!(sizes.is_empty(), "a larger buffer always suffices");
            }
        }
    }
    println!("snapshots of {sizes:?} bytes");
    assert_eq!(sizes.len(), 6, "one to six hypotheses");
    assert_eq!(sizes.last(), Some(&whole.len()));
}

#[test]
fn the_reference_robot_s_buffer_has_room_for_every_hypothesis() {
    let most = robust::Filter::SNAPSHOT_BYTES;
    println!("snapshot of the reference robot: at most {most} bytes");
    assert!(most <= robust::SNAPSHOT_BYTES);
    let drive = &drives(500)[1];
    let mut filter = drive.start::<10, 16, 400>();
    let mut sizes = Vec::new();
    for index in 0..500 {
        drive.step(&mut filter, index);
        if index % 100 == 99 {
            sizes.push(saved(&mut filter, most).unwrap().len());
        }
    }
    println!("after each hundred places: {sizes:?} bytes");
}
