//! Halves of a grid of corridors.

use std::collections::BTreeMap;

use toposlam::wire::{Way, WayId};

use super::*;
use crate::topology::Vertex;

const WIDTH: usize = 5;
const HEIGHT: usize = 3;
const QUARTER_MRAD: u16 = 1571;

/// What is measured at a place of the grid and along an edge.
#[derive(Clone, Copy)]
struct Building {
    radius_mm: fn(usize) -> u16,
    frames: fn(usize, usize) -> u16,
}

/// Every place and every edge differs from the others.
const VARIED: Building = Building {
    radius_mm: |place| 600 + 211 * (place * 7 % 15) as u16,
    frames: |a, b| 30 + 17 * ((a * b + 3 * (a + b)) % 13) as u16,
};
/// All look alike.
const UNIFORM: Building = Building { radius_mm: |_| 900, frames: |_, _| 60 };

/// The neighbours of a place to the east, north, west and south.
fn neighbours(place: usize) -> [Option<usize>; 4] {
    let (x, y) = (place % WIDTH, place / WIDTH);
    [
        (x + 1 < WIDTH).then_some(place + 1),
        (y + 1 < HEIGHT).then_some(place + WIDTH),
        x.checked_sub(1).map(|_| place - 1),
        y.checked_sub(1).map(|_| place - WIDTH),
    ]
}

/// The map of some places, in their order. Edges to other places are frontiers. Each vertex has its own frame.
fn part(building: Building, places: &[usize], noise_mm: u16) -> TopologicalMap {
    let number: BTreeMap<usize, u8> = places.iter().copied().zip(0..).collect();
    // The ways of a place in the order of their bearings in its frame, by direction.
    let directions = |place: usize| {
        let turn = (place * 5 + places.len()) % 4;
        let mut directions: Vec<usize> = (0..4).filter(|&direction| neighbours(place)[direction].is_some()).collect();
        directions.sort_by_key(|direction| (direction + turn) % 4);
        directions.into_iter().map(move |direction| (direction, (direction + turn) % 4)).collect::<Vec<_>>()
    };
    let way = |place: usize, (direction, quarter): (usize, usize)| {
        let end = neighbours(place)[direction].filter(|end| number.contains_key(end));
        let leads_to = end.map(|end| {
            let back = directions(end).iter().position(|(back, _)| *back == (direction + 2) % 4).unwrap();
            WayId { vertex: number[&end], way: back as u8 }
        });
        let travel_frames = end.map(|end| (building.frames)(place.min(end), place.max(end)));
        Way { bearing_mrad: quarter as u16 * QUARTER_MRAD + 40, leads_to, travel_frames }
    };
    let ways: Vec<Vec<Way>> =
        places.iter().map(|&place| directions(place).into_iter().map(|it| way(place, it)).collect()).collect();
    let vertex = |&place: &usize| Vertex { radius_mm: (building.radius_mm)(place) + noise_mm, visits: 4 };
    let mut map =
        TopologicalMap { vertices: places.iter().map(vertex).collect(), edges: Vec::new(), ways, ..Default::default() };
    map.edges = map.way_edges().map(|edge| (edge.ends[0].vertex, edge.ends[1].vertex)).collect();
    map.edges.iter_mut().for_each(|(a, b)| (*a, *b) = (*a.min(b), *a.max(b)));
    map.edges.sort_unstable();
    map
}

/// The places of some columns, from the last to the first or the other way.
fn columns(columns: std::ops::Range<usize>, is_reversed: bool) -> Vec<usize> {
    let mut places: Vec<usize> = (0..WIDTH * HEIGHT).filter(|place| columns.contains(&(place % WIDTH))).collect();
    if is_reversed {
        places.reverse();
    }
    places
}

#[test]
fn two_halves_of_a_building_are_its_map() {
    let (west, east) = (columns(0..3, false), columns(1..5, true));
    let merged = merge(&part(VARIED, &west, 0), &part(VARIED, &east, 16)).unwrap();
    let expected: Vec<(u8, u8)> = (0..)
        .zip(&west)
        .filter_map(|(vertex, place)| Some((vertex, east.iter().position(|other| other == place)? as u8)))
        .collect();
    assert_eq!(merged.common, expected);
    assert_eq!((merged.map.vertices.len(), merged.map.edges.len()), (15, 22));
    assert_eq!((merged.map.frontiers().count(), folding::genus(&merged.map)), (0, 0));
    assert_eq!(merged.map.all_ways().filter(|(_, way)| way.travel_frames.is_some()).count(), 44);
    // A common vertex has the mean label and the visits of both.
    assert_eq!(merged.map.vertices[2], Vertex { radius_mm: (VARIED.radius_mm)(west[2]) + 8, visits: 8 });
    assert_eq!(merged.parts.len(), 1);
}

#[test]
fn a_map_merged_with_itself_stays_as_it_is() {
    let whole = part(VARIED, &columns(0..5, false), 0);
    let merged = merge(&whole, &whole).unwrap();
    assert_eq!((&merged.map.edges, &merged.map.ways), (&whole.edges, &whole.ways));
    assert!(merged.parts[0].evidence.loops > 0.0);
}

#[test]
fn halves_that_look_alike_everywhere_are_refused() {
    let result = merge(&part(UNIFORM, &columns(0..3, false), 0), &part(UNIFORM, &columns(1..5, true), 0));
    assert!(matches!(result, Err(MergeError::Uncertain(..) | MergeError::NothingInCommon)), "{result:?}");
}

#[test]
fn a_symmetric_building_is_refused_as_such() {
    // Turned by half a turn it is the same.
    const SYMMETRIC: Building = Building {
        radius_mm: |place| 700 + 90 * (if place < 7 { place } else { 14 - place }) as u16,
        frames: |_, _| 60,
    };
    let whole = part(SYMMETRIC, &columns(0..5, false), 0);
    let error = merge(&whole, &part(SYMMETRIC, &columns(0..5, true), 4)).unwrap_err();
    assert!(matches!(error, MergeError::Uncertain(Doubt::Repetition, _)), "{error}");
    assert!(error.to_string().contains("symmetric"), "{error}");
}

#[test]
fn the_merged_map_has_the_names_of_both_and_the_first_one_is_right() {
    let (west, east) = (columns(0..3, false), columns(1..5, true));
    let (mut first, mut second) = (part(VARIED, &west, 0), part(VARIED, &east, 16));
    let at = |places: &[usize], place: usize| places.iter().position(|&other| other == place).unwrap() as u8;
    let (common, far) = (1, WIDTH - 1);
    first.names = [(at(&west, common), "hall".to_owned()), (at(&west, 0), "door".to_owned())].into();
    second.names = [(at(&east, common), "lobby".to_owned()), (at(&east, far), "roof".to_owned())].into();
    let merged = merge(&first, &second).unwrap().map;
    let names: Vec<&str> = merged.names.values().map(String::as_str).collect();
    assert_eq!((names.len(), merged.names.get(&at(&west, common)).map(String::as_str)), (3, Some("hall")));
    assert!(names.contains(&"roof") && names.contains(&"door"));
    // A name of the first map is not given twice.
    second.names = [(at(&east, far), "door".to_owned())].into();
    assert_eq!(merge(&first, &second).unwrap().map.names, first.names);
}

#[test]
fn maps_of_different_buildings_are_refused() {
    let other = Building {
        radius_mm: |place| 700 + 211 * (place * 4 % 15) as u16,
        frames: |a, b| 41 + 29 * ((a + 2 * b) % 7) as u16,
    };
    let result = merge(&part(VARIED, &columns(0..3, false), 0), &part(other, &columns(1..5, true), 0));
    assert!(matches!(result, Err(MergeError::Uncertain(..) | MergeError::NothingInCommon)), "{result:?}");
}

#[test]
fn an_edge_that_leads_elsewhere_is_a_contradiction() {
    let good = part(VARIED, &columns(0..4, false), 0);
    let mut wrong = part(VARIED, &columns(0..4, false), 0);
    // Exchanges the far ends of two edges.
    let ends: Vec<[WayId; 2]> = wrong.way_edges().map(|edge| edge.ends).collect();
    let ([a, b], [c, d]) = (ends[0], ends[7]);
    for (from, to) in [(a, d), (d, a), (c, b), (b, c)] {
        wrong.ways[usize::from(from.vertex)][usize::from(from.way)].leads_to = Some(to);
    }
    let Err(MergeError::Uncertain(Doubt::Contradiction, part)) = merge(&good, &wrong) else { panic!("merged") };
    assert!(part.evidence.contradictions > 0, "{part}");
}

#[test]
fn maps_without_ways_are_refused_in_words() {
    let map = TopologicalMap { ways: Vec::new(), ..part(VARIED, &columns(0..2, false), 0) };
    let error = merge(&map, &map).unwrap_err();
    assert_eq!(error.to_string(), "a map has no ways; only the maps of the ordered filter can be merged");
}

#[test]
fn the_maps_of_many_robots_are_one_map_per_building() {
    let other = Building {
        radius_mm: |place| 700 + 211 * (place * 4 % 15) as u16,
        frames: |a, b| 41 + 29 * ((a + 2 * b) % 7) as u16,
    };
    let mut maps: Vec<(usize, TopologicalMap)> = [
        part(VARIED, &columns(0..3, false), 0),
        part(other, &columns(0..4, false), 0),
        part(VARIED, &columns(1..5, true), 16),
        part(other, &columns(1..5, true), 8),
        TopologicalMap { ways: Vec::new(), ..part(VARIED, &columns(0..2, false), 0) },
        part(VARIED, &columns(0..4, true), 4),
    ]
    .into_iter()
    .enumerate()
    .collect();
    let merged = buildings(&maps);
    let of = |buildings: &[super::Building]| {
        buildings.iter().map(|building| (building.robots.clone(), building.map.vertices.len())).collect::<Vec<_>>()
    };
    assert_eq!(of(&merged), [(vec![1, 3], 15), (vec![0, 2, 5], 15)]);
    // Whatever the order in which the maps come.
    maps.reverse();
    assert_eq!(buildings(&maps), merged);
}

#[test]
fn the_map_of_a_robot_that_is_not_certain_to_be_in_a_building_stays_apart_with_the_reason() {
    let maps = [part(UNIFORM, &columns(0..3, false), 0), part(UNIFORM, &columns(1..5, true), 0)];
    let merged = buildings(&maps.into_iter().enumerate().collect::<Vec<_>>());
    assert_eq!(merged.len(), 2);
    assert!(matches!(merged[0].refused[..], [(1, MergeError::Uncertain(..))]), "{:?}", merged[0].refused);
}
