//! Travel times over the ways of a map.

use crate::map::{DartId, Darts, PerVertex, VertexId};

/// Time to stop at a place and turn to an exit, in ring frames.
const STOP_FRAMES: u32 = 30;
/// Travel time of an edge whose time is unknown, in ring frames.
const UNKNOWN_FRAMES: u16 = 150;

/// Travel time of the edge of a dart with the stop at its end, in ring frames.
pub(super) fn edge_frames(darts: Darts<'_>, dart: DartId) -> u32 {
    u32::from(darts.travel_frames(dart).unwrap_or(UNKNOWN_FRAMES)) + STOP_FRAMES
}

/// The shortest travel time from each vertex to one that `is_target` accepts, in ring frames; `None` where no path leads to one.
///
/// Dijkstra's algorithm. Time O(V² + D).
#[inline(never)]
pub(super) fn frames_to<const V: usize>(
    darts: Darts<'_>,
    is_target: impl Fn(VertexId) -> bool,
) -> PerVertex<Option<u32>, V> {
    let mut frames = PerVertex::<Option<u32>, V>::filled(None);
    for vertex in darts.vertices().take(V) {
        frames[vertex] = is_target(vertex).then_some(0);
    }
    let mut is_final = PerVertex::<bool, V>::filled(false);
    for _ in 0..V {
        let open = darts.vertices().take(V).filter(|&vertex| !is_final[vertex]);
        let nearest = open.filter_map(|vertex| Some((frames[vertex]?, vertex))).min();
        let Some((so_far, vertex)): Option<(u32, VertexId)> = nearest else { break };
        is_final[vertex] = true;
        for dart in darts.ways(vertex) {
            let Some(neighbour) = darts.partner(dart).and_then(|partner| darts.vertex(partner)) else { continue };
            let through = so_far.saturating_add(edge_frames(darts, dart));
            if frames[neighbour].is_none_or(|known| through < known) {
                frames[neighbour] = Some(through);
            }
        }
    }
    frames
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::DartMap;

    #[test]
    fn the_shorter_of_two_paths_counts() {
        // A triangle of vertices 0, 1 and 2, and vertex 3 without an edge. The direct edge from 0 to 2 takes 500 frames.
        let mut map = DartMap::<4, 8>::EMPTY;
        for _ in 0..4 {
            let vertex = map.add_vertex().unwrap();
            map.add_way(vertex, 0).unwrap();
            map.add_way(vertex, 32_768).unwrap();
        }
        for (a, b, frames) in [(0, 2, 50.0_f32), (3, 4, 60.0), (1, 5, 500.0)] {
            map.join(a, b);
            map.time(a, (frames.ln() * 4096.0) as u16);
        }
        let id = |number| VertexId::new(number).unwrap();
        let frames = frames_to::<4>(map.view(), |vertex| vertex == id(0));
        assert_eq!(frames[id(0)], Some(0));
        assert!(frames[id(1)].unwrap().abs_diff(50 + STOP_FRAMES) <= 1);
        assert!(frames[id(2)].unwrap().abs_diff(110 + 2 * STOP_FRAMES) <= 2);
        assert_eq!(frames[id(3)], None);
    }
}
