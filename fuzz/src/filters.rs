//! A small robust filter, arbitrary observations, and the invariants of every filter.

use arbitrary::Arbitrary;
use toposlam::persist::snapshot::{FILTER_SECTION, Reader, Snapshot, SnapshotError, Writer};
use toposlam::{Exit, Filter, Fingerprint, Map, Observation, RobustConfig, RobustFilter, Update, VertexId, Ways};

/// The most hypotheses of a [`Small`] filter.
pub const HYPOTHESES: usize = 4;
/// The most vertices of its maps.
pub const VERTICES: usize = 8;
/// A filter that is quick to run.
pub type Small = RobustFilter<HYPOTHESES, VERTICES, 40>;

/// The settings of a small filter.
pub const CONFIG: RobustConfig = RobustConfig::DEFAULT.with_hypotheses(HYPOTHESES as u8);

/// The offset of the setting `moves` in the filter's section.
const MOVES_AT: usize = 9;

/// An arbitrary observation of a place.
#[derive(Arbitrary, Clone, Copy, Debug)]
pub struct Seen {
    steps: u16,
    hints: u8,
}

impl Seen {
    /// A place without hints.
    pub const PLAIN: Self = Self { steps: 600, hints: 3 };

    /// The same as an observation.
    pub fn observation(self) -> Observation {
        Observation {
            fingerprint: Fingerprint::from_steps(self.steps % (Fingerprint::MAX.steps() + 1)).unwrap(),
            exit: match self.hints & 3 {
                0 => Some(Exit::Back),
                1 => Some(Exit::On),
                2 => Some(Exit::Bearing(self.hints)),
                _ => None,
            },
            ways: Ways::from_count(self.hints >> 4).ok().filter(|_| self.hints & 4 != 0),
            travel_frames: Some(self.steps >> 8).filter(|_| self.hints & 8 != 0),
            starts_sequence: self.hints & 0xF8 == 0xF8,
        }
    }
}

/// A place of a walk through seven rooms, some of them similar; equal arguments give the same walk.
pub fn walk(index: usize) -> Observation {
    let room = index * index % 11 % 7;
    let steps = [400, 580, 400, 760, 1000, 1010, 1400][room] + (index * 5 % 13) as u16;
    Observation {
        exit: [None, Some(Exit::On), Some(Exit::Back)][index % 3],
        ways: Ways::from_count(1 + room as u8 / 2).ok().filter(|_| index.is_multiple_of(4)),
        starts_sequence: index == 17,
        ..Observation::new(Fingerprint::from_steps(steps).unwrap())
    }
}

/// A small filter after a number of places of the walk.
pub fn after(places: usize) -> Box<Small> {
    let mut filter = Box::new(Small::new());
    filter.start(CONFIG, 1).unwrap();
    for index in 0..places {
        filter.observe(walk(index));
        (0..index % 4).for_each(|_| filter.refine());
    }
    filter
}

/// A small filter started with a map.
pub fn with_map() -> Box<Small> {
    let mut map = Map::new();
    let vertices = [900, 1300, 1700, 2100, 2500]
        .map(|radius_mm| map.add_vertex(Fingerprint::from_radius_mm(radius_mm).unwrap()).unwrap());
    for (a, b) in [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (0, 2)] {
        map.add_edge(vertices[a], vertices[b]);
    }
    let mut filter = Box::new(Small::new());
    filter.start_with_map(CONFIG, 2, &map).unwrap();
    filter
}

/// The whole snapshot of a filter.
pub fn saved(filter: &mut Small) -> Vec<u8> {
    let mut buffer = [0; Small::SNAPSHOT_BYTES];
    let mut writer = Writer::new(&mut buffer).unwrap();
    writer.stage(filter).expect("the buffer has room for the whole filter");
    let length = writer.finish().unwrap();
    buffer[..length].to_vec()
}

/// A snapshot with these contents of the filter's section and a valid CRC.
pub fn of_contents(contents: &[u8]) -> Vec<u8> {
    let mut snapshot = vec![0; contents.len() + 19];
    let mut writer = Writer::new(&mut snapshot).unwrap();
    writer.section(FILTER_SECTION, |section| section.bytes(contents)).unwrap();
    assert_eq!(writer.finish(), Ok(snapshot.len()));
    snapshot
}

/// The contents of the filter's section.
pub fn contents(snapshot: &[u8]) -> Result<Reader<'_>, SnapshotError> {
    Snapshot::open(snapshot)?.section(FILTER_SECTION).ok_or(SnapshotError::Contents)
}

/// The setting `moves` of a filter.
pub fn moves(filter: &mut Small) -> u8 {
    let snapshot = saved(filter);
    *contents(&snapshot).unwrap().bytes(MOVES_AT + 1).unwrap().last().unwrap()
}

/// Checks that the map is valid and that the path is a walk of it.
pub fn check_map(filter: &Small) {
    let map = filter.map();
    let vertices = map.vertices().len();
    assert!(vertices <= VERTICES);
    for from in VertexId::first(VertexId::LIMIT) {
        for to in map.neighbours(from).iter() {
            assert!(map.contains(from) && map.contains(to), "an edge from {from} to {to} of {vertices}");
            assert!(map.neighbours(to).contains(from), "the edge from {from} to {to} does not lead back");
        }
        assert_eq!(map.label(from).is_some(), map.contains(from));
    }
    assert!(filter.path().all(|vertex| map.contains(vertex)));
}

/// Checks the invariants of a filter after an update.
pub fn check(filter: &Small, update: &Update) {
    check_map(filter);
    let is_vertex = |vertex: VertexId| filter.map().contains(vertex);
    if filter.map().vertices().len() == 0 {
        // The filter only localises and has an empty map.
        return;
    }
    for vertex in VertexId::first(VertexId::LIMIT) {
        assert!(filter.remapped(vertex).is_none_or(is_vertex));
        assert!(filter.vertex_probability_q16(vertex) <= 65_600);
    }
    assert_eq!(filter.path().last(), Some(update.vertex));
    assert!(filter.worst().walk().iter().copied().all(is_vertex));
    assert!((1..=1 << 16).contains(&filter.map_probability_q16()));
    assert!((1..=HYPOTHESES).contains(&usize::from(update.distinct)));
    let (evidence, surplus) = filter.evidence();
    assert!(evidence.is_finite() && surplus.is_finite() && filter.noise_mm().is_finite());
}
