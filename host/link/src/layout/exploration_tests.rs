//! The layout of an explored map, update by update.

use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::wire::Message;

use super::{Layout, conflicts, triangulation::Triangulation};
use crate::listener::{Event, Listener};
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

const RUNS: u64 = 6;
const PLACES: usize = 50;

/// Statistics over all runs.
#[derive(Debug, Default)]
struct Tally {
    updates: usize,
    /// Updates in which a vertex that already had a position moved.
    moved: usize,
    vertices_moved: usize,
    /// Updates to maps that are not planar.
    not_planar: usize,
    farthest: f64,
}

impl Tally {
    /// Arranges the current map and updates the statistics.
    fn arrange(&mut self, layout: &mut Layout, listener: &Listener) {
        let map = listener.map();
        let before = layout.points().to_vec();
        let graph_before = layout.network.graph.clone();
        layout.arrange(&map);
        let graph = layout.network.graph.clone();
        if graph == graph_before {
            assert_eq!(before, layout.points(), "nothing has changed");
            return;
        }
        self.updates += 1;
        if graph.vertices() < 3 || Triangulation::of(&graph).is_some() {
            assert_eq!(conflicts::conflicts(&graph, &layout.points), 0, "{map:?}");
        } else {
            self.not_planar += 1;
        }
        let moves = before.iter().zip(layout.points()).filter(|(before, now)| before.is_known() && before != now);
        let lengths: Vec<f64> = moves.map(|(before, now)| (*now - *before).length()).collect();
        self.moved += usize::from(!lengths.is_empty());
        self.vertices_moved += lengths.len();
        self.farthest = lengths.into_iter().fold(self.farthest, f64::max);
    }
}

#[test]
fn the_layout_of_an_exploration_rarely_changes() {
    let plan = Plan::built_in("office").unwrap();
    let mut tally = Tally::default();
    for seed in 1..=RUNS {
        let mut buffer = [0; SNAPSHOT_BYTES];
        let mut exploration = Exploration::start(&plan, RobotModel::default(), seed, &mut buffer).unwrap();
        let (mut listener, mut layout) = (Listener::new(), Layout::new());
        while exploration.places() < PLACES {
            exploration.advance();
            listener.feed(&exploration.board().sent, |listener, event| match event {
                Event::Message(header, message @ Message::Remapped(_)) => layout.apply(header, message),
                // At this message the update is complete.
                Event::Message(_, Message::Map { .. }) => tally.arrange(&mut layout, listener),
                Event::Message(..) | Event::Damaged(_) => {}
            });
        }
    }
    println!("{RUNS} explorations of the office, {PLACES} places each: {tally:?}");
    assert!(tally.updates > 60 && 5 * tally.moved < tally.updates, "{tally:?}");
}
