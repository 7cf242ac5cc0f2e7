//! The map and the ring as Foxglove messages.

use std::f64::consts::TAU;

use foxglove::messages::{
    Color, CylinderPrimitive, FrameTransform, LaserScan, LinePrimitive, Point3, Pose, PosesInFrame, Quaternion,
    SceneEntity, SceneUpdate, TextPrimitive, Timestamp, Vector3, line_primitive,
};
use toposlam::ring::Echo;
use toposlam::wire::Echoes;

use crate::layout::{Layout, Point};
use crate::topology::{TopologicalMap, Vertex};

/// Frame of reference of the map's drawing.
pub const MAP_FRAME: &str = "map";
/// Frame of reference of the sonar ring.
pub const ROBOT_FRAME: &str = "robot";
/// Length of an edge in the scene. Adjacent discs with radii up to 1.5 m do not overlap.
pub const METRES_PER_EDGE: f64 = 3.0;

const EDGE_THICKNESS_M: f64 = 0.05;
const DISC_HEIGHT_M: f64 = 0.02;
/// Radius drawn for a vertex whose radius is not yet received.
const UNHEARD_RADIUS_M: f64 = 0.1;
const LOOP_RADIUS_M: f64 = 0.6;
const LOOP_CORNERS: u32 = 24;
const TEXT_PIXELS: f64 = 14.0;
const TEXT_HEIGHT_M: f64 = 0.2;

const PLACE_BLUE: Color = Color { r: 0.25, g: 0.5, b: 0.85, a: 0.8 };
const ROBOT_ORANGE: Color = Color { r: 1.0, g: 0.55, b: 0.1, a: 0.9 };
const EDGE_GREY: Color = Color { r: 0.6, g: 0.6, b: 0.6, a: 1.0 };
/// Of a way that nobody has driven.
const FRONTIER_GREEN: Color = Color { r: 0.3, g: 0.8, b: 0.4, a: 1.0 };
const TEXT_WHITE: Color = Color { r: 1.0, g: 1.0, b: 1.0, a: 1.0 };

/// A map with its drawing and the robot's vertex.
#[derive(Clone, Copy)]
pub(super) struct Scene<'map> {
    pub(super) map: &'map TopologicalMap,
    pub(super) layout: &'map Layout,
    pub(super) robot: Option<u8>,
}

pub(super) fn timestamp(time_ns: u64) -> Timestamp {
    let seconds = u32::try_from(time_ns / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (time_ns % 1_000_000_000) as u32)
}

/// A point of the drawing in the scene.
fn position(point: Point) -> Vector3 {
    Vector3 { x: METRES_PER_EDGE * point.x, y: METRES_PER_EDGE * point.y, z: 0.0 }
}

impl Scene<'_> {
    fn position(&self, vertex: usize, z: f64) -> Vector3 {
        let point = self.layout.points().get(vertex).copied().unwrap_or_default();
        Vector3 { z, ..position(point) }
    }

    fn pose(&self, vertex: usize, z: f64) -> Pose {
        Pose { position: Some(self.position(vertex, z)), orientation: Some(UPRIGHT) }
    }

    /// The whole map as one entity, which replaces the previous one.
    pub(super) fn update(&self, time_ns: u64) -> SceneUpdate {
        let vertices = || self.map.vertices.iter().enumerate();
        let entity = SceneEntity {
            timestamp: Some(timestamp(time_ns)),
            frame_id: MAP_FRAME.to_owned(),
            id: "map".to_owned(),
            frame_locked: true,
            cylinders: vertices().map(|(vertex, label)| self.disc(vertex, label)).collect(),
            lines: self.lines(),
            texts: vertices().map(|(vertex, label)| self.text(vertex, label)).collect(),
            ..Default::default()
        };
        SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
    }

    fn disc(&self, vertex: usize, label: &Vertex) -> CylinderPrimitive {
        let radius_m = if label.radius_mm == 0 { UNHEARD_RADIUS_M } else { metres(label.radius_mm) };
        let is_here = self.robot.map(usize::from) == Some(vertex);
        CylinderPrimitive {
            pose: Some(self.pose(vertex, 0.0)),
            size: Some(Vector3 { x: 2.0 * radius_m, y: 2.0 * radius_m, z: DISC_HEIGHT_M }),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: Some(if is_here { ROBOT_ORANGE } else { PLACE_BLUE }),
        }
    }

    fn text(&self, vertex: usize, label: &Vertex) -> TextPrimitive {
        TextPrimitive {
            pose: Some(self.pose(vertex, TEXT_HEIGHT_M)),
            billboard: true,
            font_size: TEXT_PIXELS,
            scale_invariant: true,
            color: Some(TEXT_WHITE),
            text: format!("{}: {} mm", self.map.vertex_text(vertex as u8), label.radius_mm),
        }
    }

    fn lines(&self) -> Vec<LinePrimitive> {
        // A self-loop of a map without ways has no line.
        let edges = self.layout.edges();
        let loops = edges.iter().filter(|edge| edge.points.len() == 1);
        let point = |point: Point| {
            let Vector3 { x, y, z } = position(point);
            Point3 { x, y, z }
        };
        let line = |kind: line_primitive::Type, points, color| LinePrimitive {
            r#type: kind.into(),
            pose: Some(Pose { position: Some(Vector3::default()), orientation: Some(UPRIGHT) }),
            thickness: EDGE_THICKNESS_M,
            points,
            color: Some(color),
            ..Default::default()
        };
        let segments = edges.iter().flat_map(|edge| edge.points.windows(2).flatten()).map(|&end| point(end)).collect();
        let stubs = self.layout.stubs().iter().flat_map(|stub| [point(stub.from), point(stub.to)]).collect();
        let round = |centre: Point| {
            let centre = point(centre);
            let corner = |corner| {
                let angle = TAU * f64::from(corner) / f64::from(LOOP_CORNERS);
                let (sine, cosine) = angle.sin_cos();
                Point3 { x: centre.x + LOOP_RADIUS_M * sine, y: centre.y + LOOP_RADIUS_M * (1.0 - cosine), ..centre }
            };
            (0..LOOP_CORNERS).map(corner).collect()
        };
        let lists = [(segments, EDGE_GREY), (stubs, FRONTIER_GREEN)];
        let lists = lists.map(|(points, color)| line(line_primitive::Type::LineList, points, color));
        let loops = loops.map(|edge| line(line_primitive::Type::LineLoop, round(edge.points[0]), EDGE_GREY));
        lists.into_iter().filter(|line| !line.points.is_empty()).chain(loops).collect()
    }

    /// Position of each vertex, in order of vertex numbers.
    pub(super) fn vertices(&self, time_ns: u64) -> PosesInFrame {
        PosesInFrame {
            timestamp: Some(timestamp(time_ns)),
            frame_id: MAP_FRAME.to_owned(),
            poses: (0..self.map.vertices.len()).map(|vertex| self.pose(vertex, 0.0)).collect(),
        }
    }

    /// The robot's frame at its vertex; at the origin of the drawing while the vertex is unknown.
    pub(super) fn transform(&self, time_ns: u64) -> FrameTransform {
        FrameTransform {
            timestamp: Some(timestamp(time_ns)),
            parent_frame_id: MAP_FRAME.to_owned(),
            child_frame_id: ROBOT_FRAME.to_owned(),
            translation: Some(self.robot.map_or(Vector3::default(), |vertex| self.position(vertex.into(), 0.0))),
            rotation: Some(UPRIGHT),
        }
    }
}

/// A ring of evenly spaced sonars, the first straight ahead. Silence is +∞ and a dead sonar NaN, as in REP 117.
pub(super) fn scan(echoes: &Echoes, time_ns: u64) -> LaserScan {
    let range_m = |echo| match echo {
        Echo::Range { range_mm } => metres(range_mm),
        Echo::Silence => f64::INFINITY,
        Echo::Dead => f64::NAN,
    };
    let ranges: Vec<f64> = echoes.iter().map(range_m).collect();
    let sonars = ranges.len().max(1) as f64;
    LaserScan {
        timestamp: Some(timestamp(time_ns)),
        frame_id: ROBOT_FRAME.to_owned(),
        pose: Some(Pose { position: Some(Vector3::default()), orientation: Some(UPRIGHT) }),
        start_angle: 0.0,
        end_angle: TAU * (sonars - 1.0) / sonars,
        ranges,
        intensities: Vec::new(),
    }
}

const UPRIGHT: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

fn metres(millimetres: u16) -> f64 {
    f64::from(millimetres) / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_vertex_is_a_disc_of_its_radius_and_the_robots_vertex_is_highlighted() {
        let vertices = [1200, 0].map(|radius_mm| Vertex { radius_mm, visits: 1 }).to_vec();
        let map = TopologicalMap { vertices, edges: vec![(0, 1), (1, 1)], ..Default::default() };
        let mut layout = Layout::new();
        layout.arrange(&map);
        let scene = Scene { map: &map, layout: &layout, robot: Some(1) };
        let entity = scene.update(5_000_000_001).entities.remove(0);
        assert_eq!(entity.timestamp, Some(Timestamp::new(5, 1)));
        let sizes: Vec<f64> = entity.cylinders.iter().map(|disc| disc.size.unwrap().x).collect();
        assert_eq!(sizes, [2.4, 2.0 * UNHEARD_RADIUS_M]);
        let colours: Vec<_> = entity.cylinders.iter().map(|disc| disc.color.unwrap()).collect();
        assert_eq!(colours, [PLACE_BLUE, ROBOT_ORANGE]);
        assert_eq!(entity.texts[0].text, "0: 1200 mm");
        let corners: Vec<usize> = entity.lines.iter().map(|line| line.points.len()).collect();
        assert_eq!(corners, [2, LOOP_CORNERS as usize]);
        let here = scene.transform(0).translation.unwrap();
        let point = layout.points()[1];
        assert_eq!((here.x, here.y), (METRES_PER_EDGE * point.x, METRES_PER_EDGE * point.y));
        assert_eq!(scene.vertices(0).poses[1].position, Some(here));
    }

    #[test]
    fn parallel_edges_and_loops_have_bends_and_frontiers_are_stubs() {
        let (map, layout) = crate::export::sample::with_ways();
        let lines = Scene { map: &map, layout: &layout, robot: None }.lines();
        // One segment of the straight edge, two of the parallel one and three of the loop; one of the frontier.
        let corners: Vec<usize> = lines.iter().map(|line| line.points.len()).collect();
        assert_eq!(corners, [12, 2]);
        assert_eq!(lines[1].color, Some(FRONTIER_GREEN));
    }

    #[test]
    fn silence_is_infinity_and_a_dead_sonar_is_nan() {
        let echoes = Echoes::new(&[Echo::Range { range_mm: 1500 }, Echo::Silence, Echo::Dead, Echo::Silence]);
        let scan = scan(&echoes, 0);
        assert_eq!((scan.ranges[0], scan.ranges[1], scan.ranges[2].is_nan()), (1.5, f64::INFINITY, true));
        assert!((scan.end_angle - 0.75 * TAU).abs() < 1e-12);
    }
}
