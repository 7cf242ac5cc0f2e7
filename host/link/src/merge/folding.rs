//! The map that two maps are together, when some of their vertices and ways are the same.

use toposlam::wire::{Way, WayId};

use super::alignment::Alignment;
use super::evidence::{TURN_MRAD, bearing_between};
use crate::topology::{TopologicalMap, Vertex};

/// A way of the merged map by where it comes from: a way of the first map, or one that only the second has.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    First(WayId),
    Second(WayId),
}

/// A way before the ways are numbered.
struct Draft {
    source: Source,
    bearing_mrad: f64,
    leads_to: Option<Source>,
    travel_frames: Option<u16>,
}

/// Merges two maps by an alignment. Where the maps contradict each other, the first one is right,
/// in names as well.
pub(super) fn fold(first: &TopologicalMap, second: &TopologicalMap, alignment: &Alignment) -> TopologicalMap {
    let source = |way: WayId| alignment.origin_of_way(way).map_or(Source::Second(way), Source::First);
    let mut vertices = first.vertices.clone();
    let mut names = first.names.clone();
    let mut drafts: Vec<Vec<Draft>> = Vec::new();
    for (vertex, ways) in (0..).zip(&first.ways) {
        let of_first = (0..).zip(ways).map(|(way, data)| Draft {
            source: Source::First(WayId { vertex, way }),
            bearing_mrad: data.bearing_mrad.into(),
            leads_to: data.leads_to.map(Source::First),
            travel_frames: data.travel_frames,
        });
        drafts.push(of_first.collect());
    }
    for (image, (ways, label)) in (0..).zip(second.ways.iter().zip(&second.vertices)) {
        let (target, turn_mrad) = match alignment.origin(image) {
            Some(vertex) => {
                let vertex = usize::from(vertex);
                vertices[vertex] = mean(vertices[vertex], *label);
                (vertex, alignment.turn_mrad(first, second, image))
            }
            None => {
                vertices.push(*label);
                drafts.push(Vec::new());
                (drafts.len() - 1, 0.0)
            }
        };
        if let Some(name) = second.names.get(&image)
            && !names.values().any(|known| known == name)
        {
            names.entry(target as u8).or_insert_with(|| name.clone());
        }
        for (way, data) in (0..).zip(ways) {
            let id = WayId { vertex: image, way };
            let leads_to = data.leads_to.map(source);
            let same = drafts[target].iter_mut().find(|draft| draft.source == source(id));
            match same {
                Some(draft) => {
                    draft.leads_to = draft.leads_to.or(leads_to);
                    draft.travel_frames = match (draft.travel_frames, data.travel_frames) {
                        (Some(a), Some(b)) => Some(a.midpoint(b)),
                        (a, b) => a.or(b),
                    };
                }
                None => drafts[target].push(Draft {
                    source: source(id),
                    bearing_mrad: f64::from(data.bearing_mrad) - turn_mrad,
                    leads_to,
                    travel_frames: data.travel_frames,
                }),
            }
        }
    }
    TopologicalMap { names, ..numbered(vertices, drafts) }
}

/// The mean of two labels, by their visits.
fn mean(a: Vertex, b: Vertex) -> Vertex {
    let (of_a, of_b) = (f64::from(a.visits.max(1)), f64::from(b.visits.max(1)));
    let radius_mm = (of_a * f64::from(a.radius_mm) + of_b * f64::from(b.radius_mm)) / (of_a + of_b);
    Vertex { radius_mm: radius_mm.round() as u16, visits: a.visits.saturating_add(b.visits) }
}

/// Numbers the ways of each vertex counter-clockwise. An edge whose ends do not name each other is dropped.
fn numbered(vertices: Vec<Vertex>, mut drafts: Vec<Vec<Draft>>) -> TopologicalMap {
    for ways in &mut drafts {
        for draft in ways.iter_mut() {
            draft.bearing_mrad = bearing_between(0.0, draft.bearing_mrad).rem_euclid(TURN_MRAD).min(TURN_MRAD - 1.0);
        }
        ways.sort_by(|a, b| a.bearing_mrad.total_cmp(&b.bearing_mrad));
    }
    let find = |source: Source| {
        (0..).zip(&drafts).find_map(|(vertex, ways)| {
            let way = ways.iter().position(|draft| draft.source == source)?;
            Some((WayId { vertex, way: way as u8 }, &ways[way]))
        })
    };
    let finished = |draft: &Draft| {
        let end = draft.leads_to.and_then(find).filter(|(_, end)| end.leads_to == Some(draft.source));
        Way {
            bearing_mrad: draft.bearing_mrad as u16,
            leads_to: end.map(|(id, _)| id),
            travel_frames: end.and(draft.travel_frames),
        }
    };
    let ways: Vec<Vec<Way>> = drafts.iter().map(|ways| ways.iter().map(finished).collect()).collect();
    let mut map = TopologicalMap { vertices, edges: Vec::new(), ways, ..Default::default() };
    let mut edges: Vec<(u8, u8)> = map.way_edges().map(|edge| (edge.ends[0].vertex, edge.ends[1].vertex)).collect();
    edges.sort_unstable();
    edges.dedup();
    map.edges = edges;
    map
}

/// The genus of a map after Euler, of all its connected parts together: 0 if it can be drawn in the plane.
pub(super) fn genus(map: &TopologicalMap) -> usize {
    let graph = map.to_petgraph();
    let parts = petgraph::algo::connected_components(&graph);
    let edges: Vec<_> = map.way_edges().collect();
    // The faces: from each dart to the next driven way, counter-clockwise, at the other end of its edge.
    let next = |end: WayId| {
        let ways = &map.ways[usize::from(end.vertex)];
        let count = ways.len();
        let after = (1..=count).map(|step| (usize::from(end.way) + step) % count);
        let way = after.into_iter().find(|&way| ways[way].leads_to.is_some()).unwrap_or(usize::from(end.way));
        WayId { vertex: end.vertex, way: way as u8 }
    };
    let mut open: std::collections::BTreeSet<WayId> = edges.iter().flat_map(|edge| edge.ends).collect();
    let mut faces = 0;
    while let Some(start) = open.pop_first() {
        faces += 1;
        let mut dart = start;
        while let Some(end) = map.way(dart).and_then(|way| way.leads_to) {
            dart = next(end);
            if !open.remove(&dart) {
                break;
            }
        }
    }
    let lonely = map.vertices.len() - with_edges(map);
    (2 * parts + edges.len()).saturating_sub(map.vertices.len() + faces + lonely) / 2
}

fn with_edges(map: &TopologicalMap) -> usize {
    map.ways.iter().filter(|ways| ways.iter().any(|way| way.leads_to.is_some())).count()
}
