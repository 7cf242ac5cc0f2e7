//! Snapshots: a restored filter equals the saved one, and invalid snapshots are refused.

mod bad_bytes;
#[path = "../common/mod.rs"]
mod common;
mod exact;
mod mapper;
mod ordered;
mod paper;
mod specification;

use common::environments::{easy, floor, six_rooms};
use common::robot::{Hints, Robot};
use common::vertex;
use toposlam::persist::Persist;
use toposlam::persist::snapshot::{FILTER_SECTION, Reader, Snapshot, SnapshotError, Writer};
use toposlam::{Filter, Fingerprint, Map, Observation, RobustConfig, RobustFilter, Update, VertexId};

/// A drive: the settings of a filter and its observations.
#[derive(Clone)]
struct Drive {
    name: &'static str,
    config: RobustConfig,
    /// Whether the filter begins with a map.
    known: bool,
    /// The observations, each with the number of refinement steps after it.
    observations: Vec<(Observation, usize)>,
    /// The range of places in which the filter only localises.
    localise: Option<(usize, usize)>,
}

impl Drive {
    fn start<const N: usize, const V: usize, const T: usize>(&self) -> Box<RobustFilter<N, V, T>> {
        let mut filter = Box::new(RobustFilter::new());
        let config = self.config.with_hypotheses(N as u8);
        if self.known {
            let mut map = Map::new();
            for (number, radius_mm) in [900, 1300, 1700, 2100, 2500].into_iter().enumerate() {
                let label = Fingerprint::from_radius_mm(radius_mm).unwrap();
                let vertex = map.add_vertex(label).unwrap();
                (0..3 * number).for_each(|_| map.observe(vertex, label));
            }
            [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (0, 2)]
                .iter()
                .for_each(|&(a, b)| map.add_edge(vertex(a), vertex(b)));
            filter.start_with_map(config, 7, &map).unwrap();
        } else {
            filter.start(config, 7).unwrap();
        }
        filter
    }

    /// Makes one observation; returns the update and the state of the filter after it.
    fn step<const N: usize, const V: usize, const T: usize>(
        &self,
        filter: &mut RobustFilter<N, V, T>,
        index: usize,
    ) -> (Update, Held) {
        if let Some((from, until)) = self.localise {
            filter.set_localise_only((from..until).contains(&index));
        }
        let (observation, refine) = self.observations[index];
        let update = filter.observe(observation);
        (0..refine).for_each(|_| filter.refine());
        (update, held(filter))
    }
}

/// The observable state of a filter.
#[derive(Clone, PartialEq, Debug)]
struct Held {
    /// The last published result.
    published: String,
    /// The bits of the evidence of the best hypothesis and of the contribution of other paths.
    evidence: [u32; 2],
}

fn held<const N: usize, const V: usize, const T: usize>(filter: &RobustFilter<N, V, T>) -> Held {
    let map = filter.map();
    let vertices: Vec<_> = map
        .vertices()
        .map(|vertex| (map.label(vertex), map.visits(vertex).min(512), filter.vertex_probability_q16(vertex)))
        .collect();
    let edges: Vec<_> = map.edges().collect();
    let renamed: Vec<_> = VertexId::first(V).map(|before| filter.remapped(before)).collect();
    let path: Vec<_> = filter.path().collect();
    let (evidence, surplus) = filter.evidence();
    let published = format!(
        "{vertices:?} {edges:?} {renamed:?} {path:?} {} {} {} {:?}",
        filter.noise_mm(),
        filter.observed(),
        filter.map_probability_q16(),
        filter.worst()
    );
    Held { published, evidence: [evidence.to_bits(), surplus.to_bits()] }
}

/// Drives of all kinds; the histories of the filters are shorter.
fn drives(places: usize) -> Vec<Drive> {
    let walk = |environment: &toposlam_eval::environment::Environment, hints, seed, carried: &[usize]| {
        let mut robot = Robot::new(environment, hints, seed);
        (0..places)
            .map(|index| {
                if carried.contains(&index) {
                    robot.carry_off(true);
                }
                (robot.step(), index * 7 % 4)
            })
            .collect()
    };
    let all = Hints { turn: true, degree: true, missing_percent: 20, wrong_percent: 5 };
    let plain =
        |name, observations| Drive { name, config: RobustConfig::DEFAULT, known: false, observations, localise: None };
    let mut drives = vec![
        plain("floor", walk(&floor(), Hints::default(), 1, &[])),
        plain("floor with hints", walk(&floor(), all, 2, &[])),
        plain("six rooms, carried twice", walk(&six_rooms(), all, 3, &[places / 3, places / 2])),
        Drive { config: RobustConfig::DEFAULT.with_moves(3), ..plain("easy", walk(&easy(), all, 4, &[])) },
        Drive { known: true, ..plain("known map", walk(&easy(), all, 5, &[])) },
        Drive {
            known: true,
            localise: Some((0, places)),
            ..plain("known map, localising", walk(&easy(), all, 6, &[places / 2]))
        },
        Drive {
            localise: Some((places / 3, 2 * places / 3)),
            ..plain("localising in between", walk(&six_rooms(), all, 7, &[places / 2]))
        },
    ];
    // A filter whose vertices are full.
    drives.push(plain("floor again", walk(&floor(), all, 8, &[])));
    drives
}

/// The contents of the filter's section.
fn saved<const N: usize, const V: usize, const T: usize>(
    filter: &mut RobustFilter<N, V, T>,
    room: usize,
) -> Result<Vec<u8>, SnapshotError> {
    let mut buffer = vec![0; room];
    let mut writer = Writer::new(&mut buffer)?;
    writer.stage(filter)?;
    let length = writer.finish()?;
    buffer.truncate(length);
    Ok(buffer)
}

fn section(snapshot: &[u8]) -> Reader<'_> {
    Snapshot::open(snapshot).unwrap().section(FILTER_SECTION).unwrap()
}

/// The bytes of the filter's section alone.
fn contents(snapshot: &[u8]) -> Vec<u8> {
    // Magic, version, length; tag, length; CRC.
    snapshot[15..snapshot.len() - 4].to_vec()
}

fn wrapped(contents: &[u8]) -> Vec<u8> {
    let mut buffer = vec![0; contents.len() + 19];
    let mut writer = Writer::new(&mut buffer).unwrap();
    writer.section(FILTER_SECTION, |section| section.bytes(contents)).unwrap();
    assert_eq!(writer.finish().unwrap(), buffer.len());
    buffer
}
