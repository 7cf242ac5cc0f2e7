//! The small robot maps with the memory that it has.

use toposlam::reference::small::{self, Filter, VERTICES};
use toposlam_eval::mapping::score_path;
use toposlam_eval::score::MapScore;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

fn score<const SONARS: usize>(plan: &str, seed: u64, places: usize) -> MapScore {
    let plan = Plan::built_in(plan).unwrap();
    let (model, robot) = (RobotModel::for_ring(SONARS), small::robot::<SONARS>());
    let mut exploration =
        Exploration::<VERTICES, Filter, SONARS>::with_robot(&plan, model, seed, &robot, &mut []).unwrap();
    while exploration.places() < places {
        exploration.advance();
    }
    let map = exploration.robot().mapper().map();
    score_path(map, &exploration.path(), exploration.rover().true_map(), exploration.nodes())
}

#[test]
fn with_a_ring_of_sixteen_its_map_of_the_flat_is_exact() {
    assert!(score::<16>("flat", 1, 40).exact);
}

#[test]
fn with_its_ring_of_eight_it_is_located_at_nearly_every_place() {
    let located = [1, 2, 3].map(|seed| score::<{ small::SONARS }>("ring", seed, 40).location);
    assert!(located.iter().sum::<f64>() / 3.0 > 0.85, "{located:?}");
}
