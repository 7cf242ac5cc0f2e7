//! Snapshots of the ordered filter: a restored filter equals the saved one, and invalid snapshots are refused.

use super::{contents, section, wrapped};
use toposlam::persist::Persist;
use toposlam::persist::snapshot::{SnapshotError, Writer};
use toposlam::{Exit, Filter, Fingerprint, Observation, OrderedConfig, OrderedFilter, RobustFilter, VertexId, Ways};

/// The number of places compared after a restore.
const WATCHED: usize = 10;

/// A random walk over a ladder with dead ends: each place with its ways, the exit and the travel time.
pub(super) fn walk(places: usize, seed: u32) -> Vec<Observation> {
    // Vertices with their ways in counter-clockwise order: the vertex behind each, and the position of the way back.
    const LADDER: [&[(usize, usize)]; 8] = [
        &[(1, 2), (4, 0)],
        &[(2, 1), (5, 1), (0, 0)],
        &[(3, 0), (1, 0)],
        &[(2, 0), (7, 0), (3, 3), (3, 2)],
        &[(0, 1), (5, 2)],
        &[(6, 0), (1, 1), (4, 1)],
        &[(5, 0)],
        &[(3, 1)],
    ];
    let mut state = seed;
    let mut below = |bound: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((state >> 16) as usize * bound) >> 16
    };
    let (mut vertex, mut came_by) = (0, 0);
    let mut observations = Vec::new();
    let mut exit = None;
    for index in 0..places {
        let ways = LADDER[vertex].len();
        let bearing = |way: usize| (way * 6283 / ways + way % 2 * 300) as u16;
        let relative = |way: usize| (bearing(way) + 6283 - bearing(came_by)) % 6283;
        let mut others: Vec<u16> =
            (0..ways).filter(|&way| way != came_by).map(|way| relative(way) + below(80) as u16).collect();
        others.sort_unstable();
        if below(20) == 0 {
            others.pop();
        }
        let fingerprint = Fingerprint::from_steps((500 + 40 * (vertex % 3) + below(12)) as u16).unwrap();
        observations.push(Observation {
            ways: Ways::from_bearings_mrad(&others).ok().filter(|_| index % 11 != 3),
            exit,
            travel_frames: Some((30 + 5 * vertex + below(5)) as u16).filter(|_| index % 7 != 1),
            starts_sequence: index == places / 2,
            ..Observation::new(fingerprint)
        });
        let way = below(ways);
        exit = match below(12) {
            0 => None,
            1 if way != came_by => Some(Exit::On),
            _ => Exit::from_bearing_mrad(relative(way)).ok(),
        };
        (vertex, came_by) = LADDER[vertex][way];
    }
    observations
}

pub(super) fn started<const N: usize, const V: usize, const D: usize, const T: usize>() -> Box<OrderedFilter<N, V, D, T>>
{
    let mut filter = Box::new(OrderedFilter::new());
    filter.start(OrderedConfig::DEFAULT.with_noise_mm(25), 7).unwrap();
    filter
}

/// Makes one observation; returns everything that can be seen of the filter after it. `index` decides
/// how often it refines.
fn step<const N: usize, const V: usize, const D: usize, const T: usize>(
    filter: &mut OrderedFilter<N, V, D, T>,
    observation: Observation,
    index: usize,
) -> String {
    // In between, the filter only localises.
    filter.set_localise_only((30..42).contains(&index));
    let update = filter.observe(observation);
    (0..index * 7 % 5).for_each(|_| filter.refine());
    held(filter) + &format!("{update:?}")
}

fn held<const N: usize, const V: usize, const D: usize, const T: usize>(filter: &OrderedFilter<N, V, D, T>) -> String {
    let ids = || VertexId::first(V);
    let probabilities: Vec<_> = ids().map(|vertex| filter.vertex_probability_q16(vertex)).collect();
    let remapped: Vec<_> = ids().map(|vertex| filter.remapped(vertex)).collect();
    let map = filter.map();
    let labels: Vec<_> = map.vertices().map(|vertex| (map.label(vertex), map.visits(vertex))).collect();
    let edges: Vec<_> = map.edges().collect();
    let path: Vec<_> = filter.path().collect();
    format!(
        "{labels:?} {edges:?} {:?} {path:?} {:?} {remapped:?} {probabilities:?} {} {:?} {} {}",
        filter.darts(),
        filter.arrival(),
        filter.map_probability_q16(),
        filter.worst(),
        filter.noise_mm().to_bits(),
        filter.observed()
    )
}

pub(super) fn saved<const N: usize, const V: usize, const D: usize, const T: usize>(
    filter: &mut OrderedFilter<N, V, D, T>,
    room: usize,
) -> Result<Vec<u8>, SnapshotError> {
    let mut buffer = vec![0; room];
    let mut writer = Writer::new(&mut buffer)?;
    writer.stage(filter)?;
    let length = writer.finish()?;
    buffer.truncate(length);
    Ok(buffer)
}

fn cut_everywhere<const N: usize, const V: usize, const D: usize, const T: usize>(observations: &[Observation]) {
    let room = OrderedFilter::<N, V, D, T>::SNAPSHOT_BYTES;
    let mut filter = started::<N, V, D, T>();
    let mut largest = 0;
    for cut in 0..=observations.len() {
        let mut saved_filter = filter.clone();
        let before = held(&saved_filter);
        let snapshot = saved(&mut saved_filter, room).unwrap();
        largest = largest.max(snapshot.len());
        assert_eq!(held(&saved_filter), before, "saving does not change what is published: {cut}");
        let mut restored = started::<N, V, D, T>();
        observations.iter().take(cut % 5).for_each(|&observation| {
            step(&mut restored, observation, 2);
        });
        restored.restore(section(&snapshot)).unwrap_or_else(|error| panic!("{cut}: {error}"));
        assert_eq!(held(&restored), before, "{cut}");
        assert_eq!(saved(&mut restored, room).unwrap(), snapshot, "{cut}");
        for (index, &observation) in observations.iter().enumerate().skip(cut).take(WATCHED) {
            let continued = step(&mut saved_filter, observation, index);
            assert_eq!(step(&mut restored, observation, index), continued, "cut at {cut}, place {index}");
        }
        if let Some(&observation) = observations.get(cut) {
            step(&mut filter, observation, cut);
        }
    }
    println!("largest snapshot {largest} of {room} bytes");
}

#[test]
fn a_filter_restored_at_any_place_continues_bit_for_bit() {
    for seed in [1, 2] {
        let observations = walk(70, seed);
        cut_everywhere::<4, 12, 40, 32>(&observations);
        cut_everywhere::<6, 16, 60, 100>(&observations);
        cut_everywhere::<3, 5, 16, 12>(&observations);
    }
}

#[test]
fn a_smaller_buffer_holds_fewer_hypotheses_and_the_same_map() {
    let mut filter = started::<6, 16, 60, 100>();
    walk(60, 3).into_iter().for_each(|observation| {
        step(&mut filter, observation, 1);
    });
    let whole = saved(&mut filter, OrderedFilter::<6, 16, 60, 100>::SNAPSHOT_BYTES).unwrap();
    let published = held(&filter);
    let mut sizes = std::collections::BTreeSet::new();
    for room in 0..=whole.len() {
        match saved(&mut filter, room) {
            Ok(snapshot) => {
                let mut restored = started::<6, 16, 60, 100>();
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
    assert!(sizes.len() > 1);
    assert_eq!(sizes.last(), Some(&whole.len()));
}

type Small = OrderedFilter<3, 8, 30, 16>;

#[test]
fn invalid_contents_are_refused_and_change_nothing_or_are_usable() {
    let mut filter = started::<3, 8, 30, 16>();
    let observations = walk(40, 4);
    observations.iter().for_each(|&observation| {
        step(&mut filter, observation, 2);
    });
    let snapshot = saved(&mut filter, Small::SNAPSHOT_BYTES).unwrap();
    let bytes = contents(&snapshot);
    let mut start = started::<3, 8, 30, 16>();
    observations.iter().take(4).for_each(|&observation| {
        step(&mut start, observation, 0);
    });
    let before = saved(&mut start, Small::SNAPSHOT_BYTES).unwrap();
    let (mut refused, mut usable) = (0, 0);
    for at in 0..bytes.len() {
        for change in [1, 16, 128, 255] {
            let mut damaged = bytes.clone();
            damaged[at] ^= change;
            let mut restored = start.clone();
            match restored.restore(section(&wrapped(&damaged))) {
                Ok(()) => {
                    usable += 1;
                    for &observation in observations.iter().take(30) {
                        let update = restored.observe(observation);
                        assert!(restored.map().vertices().len() <= 8 && update.vertex.index() < 8);
                        (0..3).for_each(|_| restored.refine());
                    }
                }
                Err(error) => {
                    refused += 1;
                    assert!(!matches!(error, SnapshotError::Full), "{error}");
                    assert_eq!(saved(&mut restored, Small::SNAPSHOT_BYTES).unwrap(), before);
                }
            }
        }
        assert!(start.clone().restore(section(&wrapped(&bytes[..at]))).is_err(), "{at}");
    }
    println!("{refused} refused, {usable} usable");
    assert!(refused > 100 && usable > 100);
    let mut robust = Box::new(RobustFilter::<6, 8, 16>::new());
    assert_eq!(robust.restore(section(&snapshot)), Err(SnapshotError::Capacities));
    let mut other = started::<3, 8, 28, 16>();
    assert_eq!(other.restore(section(&snapshot)), Err(SnapshotError::Capacities));
}
