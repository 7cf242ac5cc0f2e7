//! One map per building, of the maps of many robots.

use super::{MergeError, merge};
use crate::topology::TopologicalMap;

/// The map of a building, or of a part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Building {
    /// The merged map.
    pub map: TopologicalMap,
    /// The robots whose maps are in it, by their indices in ascending order. The vertices of the first keep their numbers.
    pub robots: Vec<usize>,
    /// Why it was not merged with the other buildings: for each one, by its position, the error. Only for the pairs with something in
    /// common.
    pub refused: Vec<(usize, MergeError)>,
}

/// Merges the maps of robots that are in the same building. Which ones are is decided by [`merge`] alone: two maps are of one building
/// if they have a common part that is certain. A map that is not certain to be part of another one stays a building of its own.
///
/// `maps` are the maps by the index of the robot; those without ways are left out. The largest maps come first. The result does not
/// depend on the order of `maps`.
///
/// Cost: for N maps and B buildings O(N · B) merges, and O(B²) for each building that grows.
pub fn buildings(maps: &[(usize, TopologicalMap)]) -> Vec<Building> {
    let mut order: Vec<&(usize, TopologicalMap)> = maps.iter().filter(|(_, map)| !map.ways.is_empty()).collect();
    order.sort_by_key(|(robot, map)| (std::cmp::Reverse(map.vertices.len()), *robot));
    let mut buildings: Vec<Building> = Vec::new();
    for (robot, map) in order {
        let found = buildings.iter_mut().find_map(|building| Some((merge(&building.map, map).ok()?.map, building)));
        match found {
            Some((merged, building)) => {
                building.map = merged;
                building.robots.push(*robot);
            }
            None => buildings.push(Building { map: map.clone(), robots: vec![*robot], refused: Vec::new() }),
        }
    }
    // A building that has grown may have more in common with another one.
    while let Some((one, other, merged)) = mergeable(&buildings) {
        let absorbed = buildings.remove(other);
        buildings[one].map = merged;
        buildings[one].robots.extend(absorbed.robots);
    }
    for one in 0..buildings.len() {
        let errors = (0..buildings.len()).filter(|&other| other != one).filter_map(|other| {
            let error = merge(&buildings[one].map, &buildings[other].map).err()?;
            (error != MergeError::NothingInCommon).then_some((other, error))
        });
        buildings[one].refused = errors.collect();
        buildings[one].robots.sort_unstable();
    }
    buildings
}

/// The first two buildings that can be merged.
fn mergeable(buildings: &[Building]) -> Option<(usize, usize, TopologicalMap)> {
    let pairs = (0..buildings.len()).flat_map(|one| (one + 1..buildings.len()).map(move |other| (one, other)));
    pairs.into_iter().find_map(|(one, other)| {
        let merged = merge(&buildings[one].map, &buildings[other].map).ok()?;
        Some((one, other, merged.map))
    })
}
