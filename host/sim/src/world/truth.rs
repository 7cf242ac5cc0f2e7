//! Computes the true map of a floor plan from its Voronoi diagram (docs/plans.md has the steps).

use super::branches::prune;
use super::graph::Graph;
use super::limits::Limits;
use super::obstacles::Obstacles;
use super::true_map::{Dropped, TrueMap, UnreachablePart};
use super::voronoi::{SAME_MM, Skeleton, VoronoiError};
use super::{Plan, Point};

/// Obstacles whose true ranges differ by no more than this are as near, in millimetres: three standard deviations of a range.
const AS_NEAR_MM: f64 = 45.0;
/// And by no more than this share of the nearest range.
const AS_NEAR_SHARE: f64 = 0.1;

/// Room that a robot needs beside its body, in millimetres: two standard deviations of a range.
const PLAY_MM: f64 = 30.0;

impl TrueMap {
    /// The true map of a plan; [`Plan::true_map`] computes it once.
    ///
    /// # Errors
    /// When the start does not reach any place.
    pub fn of(plan: &Plan, limits: &Limits) -> Result<Self, VoronoiError> {
        let walls = plan.walls();
        let mut skeleton = Skeleton::of(plan)?;
        let equidistant = skeleton.degrees().to_vec();
        let is_meet_point = |point: usize| equidistant[point] > 2;
        let radii_mm: Vec<f64> = skeleton.points.iter().map(|point| walls.clearance_mm(*point)).collect();
        let count = |skeleton: &Skeleton| {
            let degrees = skeleton.degrees().iter().enumerate();
            degrees.filter(|(point, degree)| **degree > 0 && is_meet_point(*point)).count()
        };
        let mut dropped = Dropped::default();

        let parts = skeleton.parts();
        let room = skeleton.nearest(plan.start(), walls).and_then(|start| parts[start]);
        let in_room = (0..radii_mm.len()).filter(|point| parts[*point] == room);
        let widest = in_room.max_by(|one, other| radii_mm[*one].total_cmp(&radii_mm[*other]));

        // Nobody drives into a corner.
        skeleton.retain(|piece| piece.ends.iter().all(|end| radii_mm[*end] >= SAME_MM));
        skeleton.trim(is_meet_point);
        let all = count(&skeleton);
        skeleton.retain(|piece| piece.clearance_mm >= limits.body_radius_mm + PLAY_MM);
        skeleton.trim(is_meet_point);
        let fitting = count(&skeleton);
        dropped.narrow = all - fitting;

        let parts = skeleton.parts();
        let start = skeleton.nearest(plan.start(), walls);
        let part = start.and_then(|start| parts[start]);
        let unreachable = unreachable(&skeleton, &parts, part, &radii_mm, is_meet_point);
        skeleton.retain(|piece| parts[piece.ends[0]] == part);
        let reachable = count(&skeleton);
        dropped.unreachable = fitting - reachable;

        let is_apart = |point: usize| {
            let radius_mm = radii_mm[point];
            let reach_mm = radius_mm + AS_NEAR_MM.min(AS_NEAR_SHARE * radius_mm);
            let around = || Obstacles::around(walls, skeleton.points[point], reach_mm, limits);
            is_meet_point(point) && around().spread_mm().is_some()
        };
        let apart: Vec<bool> =
            (0..radii_mm.len()).map(|point| skeleton.degrees()[point] > 0 && is_apart(point)).collect();
        skeleton.trim(|point| apart[point]);
        prune(&mut skeleton, &radii_mm, limits.width_mm());
        skeleton.trim(|point| apart[point]);
        let branching = count(&skeleton);
        dropped.branches = reachable - branching;

        let is_place = |point: usize| match skeleton.degrees()[point] {
            0 => false,
            2 => apart[point],
            _ => true,
        };
        let places: Vec<usize> = (0..radii_mm.len()).filter(|point| is_place(*point)).collect();
        dropped.smooth = branching.saturating_sub(places.len());
        let mut graph = Graph::of(&skeleton, &places, &radii_mm, &apart);
        dropped.halls = graph.join_halls(walls, limits);
        dropped.merged = graph.merge(walls, limits);
        if graph.nodes.is_empty() {
            // A room without a way out is one place.
            let fits = |point: &usize| radii_mm[*point] >= limits.body_radius_mm && skeleton.alive().next().is_none();
            let only = widest.filter(fits).ok_or(VoronoiError::NoPlace)?;
            graph.add_node(skeleton.points[only], radii_mm[only], true);
        }
        let (nodes, mut edges) = graph.finish(limits);
        for edge in &mut edges {
            edge.room_mm = edge.way.iter().map(|point| walls.clearance_mm(*point)).fold(0.0, f64::max);
        }
        Ok(Self { nodes, edges, dropped, unreachable })
    }
}

/// The parts of a graph but one, by their meet points.
fn unreachable(
    skeleton: &Skeleton,
    parts: &[Option<usize>],
    reached: Option<usize>,
    radii_mm: &[f64],
    is_meet_point: impl Fn(usize) -> bool,
) -> Vec<UnreachablePart> {
    let mut found: Vec<UnreachablePart> = Vec::new();
    let mut index_of = vec![None; parts.len()];
    for (point, part) in parts.iter().enumerate() {
        let Some(part) = part.filter(|part| Some(*part) != reached && is_meet_point(point)) else { continue };
        let index = *index_of[part].get_or_insert_with(|| {
            found.push(UnreachablePart { position: Point::default(), radius_mm: 0.0, meet_points: 0 });
            found.len() - 1
        });
        let entry = &mut found[index];
        entry.meet_points += 1;
        if radii_mm[point] > entry.radius_mm {
            (entry.position, entry.radius_mm) = (skeleton.points[point], radii_mm[point]);
        }
    }
    found.sort_by_key(|part| std::cmp::Reverse(part.meet_points));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::TrueNode;

    fn plan(rows: &[&str]) -> Plan {
        Plan::parse(&format!("cell_mm 500\n{}", rows.join("\n"))).unwrap()
    }

    fn truth(plan: &Plan) -> TrueMap {
        TrueMap::of(plan, &Limits::default()).unwrap()
    }

    /// A plan of 20 by 20 m with light and dark shapes.
    fn drawing(shapes: &str) -> Plan {
        Plan::parse(&format!(
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 20000 20000' fill='white'>{shapes}</svg>"
        ))
        .unwrap()
    }

    fn degrees(map: &TrueMap) -> Vec<usize> {
        let mut degrees: Vec<usize> = map.nodes.iter().map(|node| node.degree).collect();
        degrees.sort_unstable();
        degrees
    }

    #[test]
    fn a_corridor_has_a_dead_end_at_each_end() {
        let map = truth(&plan(&["..............", ".S............", "..............", ".............."]));
        assert_eq!((map.nodes.len(), map.edges.len()), (2, 1));
        for node in &map.nodes {
            assert!((node.radius_mm - 1000.0).abs() < 1.0, "{node:?}");
            assert_eq!(node.degree, 1);
        }
    }

    #[test]
    fn a_junction_has_the_radius_of_the_disc_between_wall_and_corners() {
        let stem = "######....######";
        let bar = "................";
        let map = truth(&plan(&[bar, bar, bar, bar, stem, stem, stem, stem, stem, "######.S..######"]));
        assert_eq!((map.nodes.len(), map.edges.len()), (4, 3));
        let junction = map.nodes.iter().find(|node| node.degree == 3).unwrap();
        // A disc that touches a wall at distance w and two corners 2c apart: (w² + c²) / 2w.
        assert!((junction.radius_mm - 1250.0).abs() < 1.0, "{junction:?}");
        assert!((junction.position.x_mm - 4000.0).abs() < 1.0 && (junction.position.y_mm - 3750.0).abs() < 1.0);
    }

    #[test]
    fn every_point_of_an_edge_is_equidistant_from_two_obstacles() {
        for (name, _) in Plan::BUILT_IN {
            let plan = Plan::built_in(name).unwrap();
            let map = truth(&plan);
            for point in map.edges.iter().flat_map(|edge| &edge.way) {
                let segments = plan.walls().segments().iter();
                let mut distances: Vec<f64> = segments.map(|face| face.distance_mm(*point)).collect();
                distances.sort_by(f64::total_cmp);
                assert!(distances[1] - distances[0] < 1.0, "{name}: {point:?}");
            }
        }
    }

    #[test]
    fn a_rectangle_has_a_place_at_each_end_and_a_square_one_place() {
        assert_eq!(degrees(&truth(&drawing("<rect x='1000' y='1000' width='8000' height='3000'/>"))), [1, 1]);
        let square = truth(&drawing("<rect x='1000' y='1000' width='4000' height='4000'/>"));
        assert_eq!(degrees(&square), [0]);
        assert!((square.nodes[0].radius_mm - 2000.0).abs() < 1.0);
        // The two ends of a nearly square room are never left for each other.
        let nearly = truth(&drawing("<rect x='1000' y='1000' width='4300' height='4000'/>"));
        assert_eq!((degrees(&nearly), nearly.dropped.merged), (vec![0], 1));
    }

    #[test]
    fn corridors_meet_in_a_t_and_in_a_plus() {
        let bar = "<rect x='1000' y='9000' width='18000' height='2000'/>";
        let t = truth(&drawing(&format!("{bar}<rect x='9000' y='9000' width='2000' height='10000'/>")));
        assert_eq!((degrees(&t), t.edges.len()), (vec![1, 1, 1, 3], 3));
        let plus = truth(&drawing(&format!("{bar}<rect x='9000' y='1000' width='2000' height='18000'/>")));
        assert_eq!((degrees(&plus), plus.edges.len()), (vec![1, 1, 1, 1, 4], 4));
        // Two side corridors opposite each other, a little aside, are one junction.
        let sides =
            "<rect x='8850' y='1000' width='2000' height='9000'/><rect x='9150' y='10000' width='2000' height='9000'/>";
        let twins = truth(&drawing(&format!("{bar}{sides}")));
        assert_eq!((degrees(&twins), twins.dropped.merged), (vec![1, 1, 1, 1, 4], 1));
    }

    #[test]
    fn a_door_is_a_junction_and_its_room_a_dead_end() {
        let corridor = "<rect x='1000' y='9000' width='18000' height='2000'/>";
        let room = "<rect x='8000' y='4900' width='4000' height='4000'/>";
        for width_mm in [800, 900, 1200, 1600] {
            let door = format!("<rect x='10000' y='8800' width='{width_mm}' height='300'/>");
            let map = truth(&drawing(&format!("{corridor}{room}{door}")));
            let in_room = |node: &&TrueNode| node.position.y_mm > 11_000.0;
            assert_eq!(map.nodes.iter().filter(in_room).filter(|node| node.degree == 1).count(), 1, "{width_mm}");
            let junctions: Vec<&TrueNode> = map.nodes.iter().filter(|node| node.degree == 3).collect();
            assert!(matches!(junctions[..], [junction] if !in_room(&junction)), "{width_mm}: {junctions:?}");
        }
        // A robot 300 mm wide does not fit through a gap of 250 mm.
        let gap = truth(&drawing(&format!("{corridor}{room}<rect x='10000' y='8800' width='250' height='300'/>")));
        assert_eq!((degrees(&gap), gap.unreachable.len()), (vec![1, 1], 1));
    }

    #[test]
    fn a_slanted_corridor_has_two_ends_whether_its_walls_are_straight_or_stepped() {
        let straight = truth(&drawing("<polygon points='2000 3000 3000 1500 18000 12000 17000 13500'/>"));
        assert_eq!(degrees(&straight), [1, 1]);
        let (sine, cosine) = 35f64.to_radians().sin_cos();
        let cell = |x: i32, y: i32| {
            let (x, y) = (f64::from(x) - 75.0, f64::from(y) - 60.0);
            let is_free = (x * cosine + y * sine).abs() < 70.0 && (y * cosine - x * sine).abs() < 9.0;
            if is_free { '.' } else { '#' }
        };
        let stepped: Vec<String> = (0..120).map(|y| (0..150).map(|x| cell(x, y)).collect()).collect();
        let stepped = truth(&Plan::parse(&format!("cell_mm 100\n{}", stepped.join("\n"))).unwrap());
        assert_eq!(degrees(&stepped), [1, 1], "{:?}", stepped.nodes);
    }

    #[test]
    fn a_niche_that_is_no_deeper_than_the_robot_is_wide_is_no_place() {
        let with_niche = |depth_mm: u32| {
            let niche = format!("<rect x='9000' y='{}' width='800' height='{}'/>", 9000 - depth_mm, depth_mm + 10);
            degrees(&truth(&drawing(&format!("<rect x='1000' y='9000' width='18000' height='2000'/>{niche}"))))
        };
        assert_eq!(with_niche(150), [1, 1]);
        assert_eq!(with_niche(800), [1, 1, 1, 3]);
    }

    #[test]
    fn a_hall_wider_than_the_sonars_reach_is_crossed_or_one_place() {
        let hall = "<rect x='3000' y='3000' width='14000' height='14000'/><rect x='500' y='9000' width='19000' height='2000'/>";
        let crossed = truth(&drawing(hall));
        assert_eq!((degrees(&crossed), crossed.edges.len()), (vec![1, 1], 1));
        assert!(crossed.dropped.halls > 0);
        let forked = truth(&drawing(&format!("{hall}<rect x='9000' y='500' width='2000' height='9000'/>")));
        assert_eq!(degrees(&forked), [1, 1, 1, 3]);
        assert_eq!(forked.nodes.iter().filter(|node| node.is_hall).count(), 1);
    }
}
