//! The drawing of the map in a recording: it follows the map, a few times a second.

use super::scene::Scene;
use crate::layout::Layout;
use crate::listener::Listener;
use crate::topology::TopologicalMap;

/// Minimum interval between two drawings.
const PERIOD_NS: u64 = 100_000_000;

/// The drawing of a robot's map.
#[derive(Default)]
pub(super) struct Drawing {
    pub(super) layout: Layout,
    drawn: Option<Drawn>,
}

/// The map in its last scene.
struct Drawn {
    map: TopologicalMap,
    robot: Option<u8>,
    time_ns: u64,
}

impl Drawing {
    /// Whether the last scene is older than the minimum interval.
    pub(super) fn is_due(&self, time_ns: u64) -> bool {
        self.drawn.as_ref().is_none_or(|drawn| time_ns.saturating_sub(drawn.time_ns) >= PERIOD_NS)
    }

    /// The scene, if the map or the robot's vertex has changed since the last one.
    pub(super) fn scene(&mut self, listener: &Listener, time_ns: u64) -> Option<Scene<'_>> {
        let map = listener.map();
        let robot = listener.replica().location().map(|location| location.vertex);
        if self.drawn.as_ref().is_some_and(|drawn| drawn.map == map && drawn.robot == robot) {
            return None;
        }
        self.layout.arrange(&map);
        let Drawn { map, .. } = self.drawn.insert(Drawn { map, robot, time_ns });
        Some(Scene { map, layout: &self.layout, robot })
    }
}
