//! A robot localises on a map that came from a file.

use std::collections::BTreeMap;

use toposlam::persist::snapshot::Resume;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_link::export;
use toposlam_link::import;
use toposlam_link::layout::Layout;
use toposlam_link::topology::TopologicalMap;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

/// Places of the exploration that makes the map, and of the robot that localises.
const MAPPED: usize = 150;
const LOCALISED: usize = 40;
/// After this many places the robot knows where it is.
const LOST: usize = 12;

#[test]
fn a_robot_localises_on_the_exported_map_of_another_one_and_does_not_change_it() {
    let plan = Plan::built_in("office").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut first = Exploration::start(&plan, RobotModel::default(), 3, &mut buffer).unwrap();
    while first.places() < MAPPED {
        first.advance();
    }
    let map = TopologicalMap::of(first.robot().mapper().filter());
    let mut node_of: BTreeMap<usize, usize> = BTreeMap::new();
    for (vertex, node) in first.path().into_iter().zip(first.nodes()) {
        node_of.extend(vertex.zip(*node));
    }
    let mut layout = Layout::new();
    layout.arrange(&map);
    let imported = import::json(&export::json(&map, &layout, None)).unwrap();
    let snapshot = import::known_map(&imported).unwrap();

    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut second = Exploration::start(&plan, RobotModel::default(), 4, &mut buffer).unwrap();
    second.robot_mut().restore(&snapshot, Resume::AtUnknownVertex).unwrap();
    while second.places() < LOCALISED {
        second.advance();
    }
    let filter = second.robot().mapper().filter();
    assert_eq!(TopologicalMap::of(filter).ways, import::snapshot(&snapshot).unwrap().ways);
    let located = second.steps().iter().zip(second.nodes()).skip(LOST);
    let right = located.filter(|(step, node)| node_of.get(&step.update.vertex.index()) == node.as_ref()).count();
    assert!(right >= (LOCALISED - LOST) * 9 / 10, "{right} of {}", LOCALISED - LOST);
}
