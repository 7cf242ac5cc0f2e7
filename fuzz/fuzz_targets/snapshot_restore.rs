//! Arbitrary bytes as a snapshot, with a valid or invalid CRC, and mutated snapshots.
#![no_main]

use std::sync::LazyLock;

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use toposlam::Filter;
use toposlam::persist::Persist;
use toposlam::persist::snapshot::{SNAPSHOT_VERSION, SnapshotError};
use toposlam::wire::crc32;
use toposlam_fuzz::filters::{self, Seen, Small};

/// The most steps after a restore, before the last place.
const STEPS: usize = 30;

#[derive(Arbitrary, Debug)]
struct Input<'a> {
    source: Source<'a>,
    /// The steps after the restore.
    then: Vec<Then>,
}

#[derive(Arbitrary, Debug)]
enum Source<'a> {
    /// Mutated contents of a valid snapshot; the CRC is valid.
    Changed { which: u8, edits: Edits<'a> },
    /// Arbitrary contents of the filter's section.
    Contents(&'a [u8]),
    /// Arbitrary sections; header and CRC are valid.
    Sections(&'a [u8]),
    /// Arbitrary bytes.
    Whole(&'a [u8]),
    /// A mutated snapshot whose CRC is not updated.
    Damaged { which: u8, edits: Edits<'a> },
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Then {
    Place(Seen),
    Polish,
    LocaliseOnly(bool),
}

/// At least one change: an unchanged snapshot takes the longest and tests the least.
#[derive(Arbitrary, Debug)]
struct Edits<'a> {
    first: Edit<'a>,
    more: Vec<Edit<'a>>,
}

#[derive(Arbitrary, Debug)]
enum Edit<'a> {
    Set {
        at: u16,
        byte: u8,
    },
    Add {
        at: u16,
        what: i8,
    },
    /// Changes half a byte: a path has two places per byte.
    Xor {
        at: u16,
        half: bool,
        with: u8,
    },
    Insert {
        at: u16,
        bytes: &'a [u8],
    },
    Remove {
        at: u16,
        count: u8,
    },
    Cut {
        to: u16,
    },
}

/// Valid snapshots of filters: empty, with a short and with a full history, with a known map, and only localising.
static TRUE: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let mut localising = filters::after(30);
    localising.set_localise_only(true);
    let mut known = filters::with_map();
    let mut lost = filters::with_map();
    lost.set_localise_only(true);
    for index in 30..75 {
        localising.observe(filters::walk(index));
        lost.observe(filters::walk(index));
    }
    (0..9).for_each(|index| _ = known.observe(filters::walk(index)));
    [filters::after(0), filters::after(7), filters::after(33), filters::after(90), localising, known, lost]
        .map(|mut filter| filters::saved(&mut filter))
        .into()
});

/// A filter after it restored or refused a snapshot.
static BEFORE: LazyLock<Box<Small>> = LazyLock::new(|| filters::after(12));

fuzz_target!(|input: Input<'_>| {
    let snapshot = snapshot(&input.source);
    let mut filter = BEFORE.clone();
    let before = filters::saved(&mut filter);
    let mut twin = filter.clone();
    let restored = filters::contents(&snapshot).and_then(|contents| filter.restore(contents));
    if let Err(error) = restored {
        assert_ne!(error, SnapshotError::Full);
        assert_eq!(filters::saved(&mut filter), before, "a refused snapshot changes nothing");
        assert_eq!(filter.observe(filters::walk(12)), twin.observe(filters::walk(12)));
        assert_eq!(filters::saved(&mut filter), filters::saved(&mut twin), "a refused snapshot has no later effect");
        return;
    }
    exercise(&mut filter, &input.then);
});

/// The snapshot that is restored.
fn snapshot(source: &Source<'_>) -> Vec<u8> {
    match source {
        Source::Changed { which, edits } => {
            let snapshot = &TRUE[usize::from(*which) % TRUE.len()];
            let contents = &snapshot[15..snapshot.len() - 4];
            filters::of_contents(&edited(contents, edits))
        }
        Source::Contents(contents) => filters::of_contents(contents),
        Source::Sections(sections) => {
            let mut snapshot = b"TSLM".to_vec();
            snapshot.extend(SNAPSHOT_VERSION.to_le_bytes());
            snapshot.extend((sections.len() as u32 + 14).to_le_bytes());
            snapshot.extend(*sections);
            snapshot.extend(crc32(&snapshot).to_le_bytes());
            snapshot
        }
        Source::Whole(snapshot) => snapshot.to_vec(),
        Source::Damaged { which, edits } => edited(&TRUE[usize::from(*which) % TRUE.len()], edits),
    }
}

fn edited(bytes: &[u8], edits: &Edits<'_>) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for edit in std::iter::once(&edits.first).chain(&edits.more) {
        let length = bytes.len();
        let within = |at: u16| usize::from(at) % length.max(1);
        match *edit {
            Edit::Set { at, byte } => bytes.iter_mut().skip(within(at)).take(1).for_each(|slot| *slot = byte),
            Edit::Add { at, what } => {
                bytes.iter_mut().skip(within(at)).take(1).for_each(|slot| *slot = slot.wrapping_add_signed(what));
            }
            Edit::Xor { at, half, with } => {
                let with = (with & 15) << if half { 4 } else { 0 };
                bytes.iter_mut().skip(within(at)).take(1).for_each(|slot| *slot ^= with);
            }
            Edit::Insert { at, bytes: more } => _ = bytes.splice(within(at)..within(at), more.iter().copied()),
            Edit::Remove { at, count } => {
                bytes.drain(within(at)..length.min(within(at) + usize::from(count)));
            }
            Edit::Cut { to } => bytes.truncate(within(to)),
        }
    }
    bytes
}

/// Asserts that the filter is usable after any snapshot.
fn exercise(filter: &mut Small, then: &[Then]) {
    filters::check_map(filter);
    let mut twin = again(filter);
    // Up to 255 moves at a place are valid, but would take most of the fuzzing time.
    let steps = 4 * STEPS / (4 + usize::from(filters::moves(filter)));
    for then in then.iter().take(steps).chain([&Then::Place(Seen::PLAIN)]) {
        match *then {
            Then::Place(seen) => {
                let update = filter.observe(seen.observation());
                filters::check(filter, &update);
                assert_eq!(twin.observe(seen.observation()), update, "the restored filter equals the saved one");
            }
            Then::Polish => {
                filter.refine();
                twin.refine();
            }
            Then::LocaliseOnly(on) => {
                filter.set_localise_only(on);
                twin.set_localise_only(on);
            }
        }
    }
    assert_eq!(filters::saved(filter), filters::saved(&mut twin));
    again(filter);
}

/// Saves a filter and restores it into another one, whose snapshot is the same.
fn again(filter: &mut Small) -> Box<Small> {
    let snapshot = filters::saved(filter);
    let mut twin = BEFORE.clone();
    assert_eq!(filters::contents(&snapshot).and_then(|contents| twin.restore(contents)), Ok(()));
    assert_eq!(filters::saved(&mut twin), snapshot, "the restored filter has the same snapshot");
    twin
}
