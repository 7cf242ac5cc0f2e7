//! Whether a map with ways is the part of a building that was driven.

use super::Building;
use std::collections::{BTreeMap, BTreeSet};
use toposlam::{Bearing, DartId, DartMap, Darts};

/// Whether a map has the vertices and edges that a walk has driven, one for each.
///
/// `walk` is the dart by which the robot came to each place, `path` that of the map. A vertex stands for the place, and an edge for
/// the corridor, at which most of its visits were. Loops and parallel corridors are told apart.
pub fn is_exact(building: &Building, walk: &[usize], map: Darts<'_>, path: &[Option<DartId>]) -> bool {
    let corridor = |dart: usize| dart.min(building.partner(dart));
    let edge = |dart: DartId| map.partner(dart).map(|partner| dart.min(partner));
    let steps = || walk.iter().zip(path).filter_map(|(&dart, &came_by)| Some((dart, came_by?)));
    let vertices = majority(steps().map(|(dart, came_by)| (map.vertex(came_by), building.place(dart))));
    let driven: BTreeSet<usize> = walk.iter().skip(1).map(|&dart| corridor(dart)).collect();
    let visited: BTreeSet<usize> = walk.iter().map(|&dart| building.place(dart)).collect();
    let passages = steps().skip(1).filter_map(|(dart, came_by)| Some((edge(came_by)?, corridor(dart))));
    let edges = majority(passages);
    let places: BTreeSet<usize> = vertices.values().copied().collect();
    let corridors: BTreeSet<usize> = edges.values().copied().collect();
    let ends_agree = |(&edge, &corridor): (&DartId, &usize)| {
        let place = |dart: DartId| vertices.get(&map.vertex(dart)).copied();
        let mut ends = [place(edge), map.partner(edge).and_then(place)];
        let mut expected = [corridor, building.partner(corridor)].map(|dart| Some(building.place(dart)));
        ends.sort_unstable();
        expected.sort_unstable();
        ends == expected
    };
    map.vertices().len() == visited.len()
        && places == visited
        && map.edges().count() == driven.len()
        && edges.len() == driven.len()
        && corridors == driven
        && edges.iter().all(ends_agree)
}

/// For each key the value that it has most often, the largest of several.
fn majority<K: Ord>(pairs: impl Iterator<Item = (K, usize)>) -> BTreeMap<K, usize> {
    let mut votes: BTreeMap<K, BTreeMap<usize, usize>> = BTreeMap::new();
    for (key, value) in pairs {
        *votes.entry(key).or_default().entry(value).or_default() += 1;
    }
    let winner = |counts: BTreeMap<usize, usize>| counts.into_iter().max_by_key(|&(_, count)| count);
    votes.into_iter().filter_map(|(key, counts)| Some((key, winner(counts)?.0))).collect()
}

/// A building as a map, and a walk as a path on it; `None` when the map has no room.
pub fn truth<const V: usize, const D: usize>(
    building: &Building,
    walk: &[usize],
) -> Option<(DartMap<V, D>, Vec<Option<DartId>>)> {
    let mut map = DartMap::EMPTY;
    let mut number = vec![0; building.darts()];
    for place in 0..building.environment().places().len() {
        let vertex = map.add_vertex()?;
        for &dart in building.ways(place) {
            let bearing = building.bearing_rad(dart) / std::f64::consts::TAU * 65536.0;
            number[dart] = map.add_way(vertex, bearing as i64 as Bearing)?;
        }
    }
    (0..building.darts()).for_each(|dart| map.join(number[dart], number[building.partner(dart)]));
    Some((map, walk.iter().map(|&dart| DartId::new(number[dart])).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        family::Family,
        ordered::{Bearings, WalkKind},
        walk::path_rng,
    };

    #[test]
    fn the_truth_is_exact_and_a_map_with_one_edge_elsewhere_is_not() {
        let family: Family = "2,1,10,10,2.6,5,0.03,general".parse().unwrap();
        let building = Building::of_family(&family, 0, Bearings::Spread(0.5), true).unwrap();
        let walk = building.draw_walk(400, WalkKind::Uniform, &mut path_rng(1, 0));
        let (mut map, path) = truth::<16, 80>(&building, &walk).unwrap();
        assert_eq!(map.genus(), 0);
        assert!(is_exact(&building, &walk, map.view(), &path));
        // A part of the walk has not driven everything.
        assert!(!is_exact(&building, &walk[..3], map.view(), &path[..3]));
        let ((a, b), (c, d)) = (map.edges().next().unwrap(), map.edges().last().unwrap());
        map.part(a);
        map.part(c);
        map.join(a, c);
        map.join(b, d);
        assert!(!is_exact(&building, &walk, map.view(), &path));
    }
}
