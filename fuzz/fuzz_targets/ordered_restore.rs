//! Mutated snapshots of the ordered filter with a valid CRC.
#![no_main]

use std::sync::LazyLock;

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use toposlam::persist::Persist;
use toposlam::persist::snapshot::{SnapshotError, Writer};
use toposlam::{Exit, Filter, Fingerprint, Observation, OrderedConfig, OrderedFilter, Ways};
use toposlam_fuzz::filters::{self, Seen};

const VERTICES: usize = 8;
type Small = OrderedFilter<4, VERTICES, 34, 24>;

/// The most steps after a restore.
const STEPS: usize = 30;

#[derive(Arbitrary, Debug)]
struct Input {
    which: u8,
    /// Bytes of the contents and what is added to them.
    changes: Vec<(u16, u8)>,
    cut: Option<u16>,
    then: Vec<Then>,
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Then {
    Place(Seen),
    Refine,
    LocaliseOnly(bool),
}

/// A place of a walk along a corridor of five rooms.
fn walk(index: usize) -> Observation {
    let room = [0, 1, 2, 3, 4, 3, 2, 1][index % 8];
    let others: &[u16] = if room % 4 == 0 { &[] } else { &[3000 + 40 * room as u16] };
    Observation {
        ways: Ways::from_bearings_mrad(others).ok(),
        exit: Some(if room % 4 == 1 && index % 8 != 7 { Exit::Back } else { Exit::Bearing(125) }),
        travel_frames: Some(50 + 3 * room as u16),
        starts_sequence: index == 21,
        ..Observation::new(Fingerprint::from_steps(400 + 90 * room as u16).unwrap())
    }
}

fn after(places: usize) -> Box<Small> {
    let mut filter = Box::new(Small::new());
    filter.start(OrderedConfig::DEFAULT, 1).unwrap();
    for index in 0..places {
        filter.observe(walk(index));
        (0..index % 4).for_each(|_| filter.refine());
    }
    filter
}

fn saved(filter: &mut Small) -> Vec<u8> {
    let mut buffer = vec![0; Small::SNAPSHOT_BYTES];
    let mut writer = Writer::new(&mut buffer).unwrap();
    writer.stage(filter).expect("the buffer has room for the whole filter");
    let length = writer.finish().unwrap();
    buffer.truncate(length);
    buffer
}

static TRUE: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let mut localising = after(20);
    localising.set_localise_only(true);
    (20..40).for_each(|index| _ = localising.observe(walk(index)));
    [after(0), after(7), after(33), after(90), localising].map(|mut filter| saved(&mut filter)).into()
});

static BEFORE: LazyLock<Box<Small>> = LazyLock::new(|| after(12));

fuzz_target!(|input: Input| {
    let snapshot = &TRUE[usize::from(input.which) % TRUE.len()];
    let mut contents = snapshot[15..snapshot.len() - 4].to_vec();
    let length = contents.len();
    for (at, by) in input.changes {
        contents[usize::from(at) % length] = contents[usize::from(at) % length].wrapping_add(by);
    }
    contents.truncate(input.cut.map_or(length, |cut| usize::from(cut) % length));
    let snapshot = filters::of_contents(&contents);
    let mut filter = BEFORE.clone();
    let before = saved(&mut filter);
    if let Err(error) = filters::contents(&snapshot).and_then(|contents| filter.restore(contents)) {
        assert_ne!(error, SnapshotError::Full);
        assert_eq!(saved(&mut filter), before, "a refused snapshot changes nothing");
        return;
    }
    let mut twin = BEFORE.clone();
    let again = saved(&mut filter);
    assert_eq!(filters::contents(&again).and_then(|contents| twin.restore(contents)), Ok(()));
    assert_eq!(saved(&mut twin), again, "the restored filter has the same snapshot");
    for then in input.then.into_iter().take(STEPS).chain([Then::Place(Seen::PLAIN)]) {
        match then {
            Then::Place(seen) => {
                let update = filter.observe(seen.observation());
                assert_eq!(twin.observe(seen.observation()), update, "the restored filter equals the saved one");
                check(&filter);
            }
            Then::Refine => {
                filter.refine();
                twin.refine();
            }
            Then::LocaliseOnly(on) => {
                filter.set_localise_only(on);
                twin.set_localise_only(on);
            }
        }
    }
});

/// Checks that the published map is valid.
fn check(filter: &Small) {
    let (map, darts) = (filter.map(), filter.darts().expect("the filter knows ways"));
    assert!(map.vertices().len() <= VERTICES);
    assert_eq!(darts.vertices().len(), map.vertices().len());
    for dart in darts.darts() {
        assert!(darts.vertex(dart).is_some_and(|vertex| map.contains(vertex)));
        assert!(darts.partner(dart).is_none_or(|partner| darts.partner(partner) == Some(dart)));
    }
}
