//! The ring and the map as messages of ROS 2.

use std::f64::consts::TAU;

use toposlam::ring::Echo;
use toposlam::wire::Echoes;

use super::super::scene::{MAP_FRAME, METRES_PER_EDGE, ROBOT_FRAME, Scene};
use super::cdr::Cdr;
use crate::layout::Point;

const CYLINDER: i32 = 3;
const LINE_LIST: i32 = 5;
const TEXT: i32 = 9;
const ADD: i32 = 0;
const DELETE_ALL: i32 = 3;

const PLACE: [f32; 4] = [0.25, 0.5, 0.85, 0.8];
const HERE: [f32; 4] = [1.0, 0.55, 0.1, 0.9];
const EDGE: [f32; 4] = [0.6, 0.6, 0.6, 1.0];
/// Of a way that nobody has driven.
const FRONTIER: [f32; 4] = [0.3, 0.8, 0.4, 1.0];
const WHITE: [f32; 4] = [1.0; 4];
const LINE_M: f64 = 0.05;
const DISC_M: f64 = 0.02;
const TEXT_M: f64 = 0.4;
/// The limits of `sensor_msgs/LaserScan`: ranges outside are no obstacles.
const RANGE_MIN_M: f32 = 0.02;
const RANGE_MAX_M: f32 = 65.535;

/// `sensor_msgs/msg/LaserScan` of a ring of evenly spaced sensors, the first straight ahead. Silence is +∞ and a dead sensor NaN
/// (REP 117).
pub(super) fn scan(echoes: &Echoes, time_ns: u64) -> Vec<u8> {
    let ranges: Vec<f32> = echoes
        .iter()
        .map(|echo| match echo {
            Echo::Range { range_mm } => f32::from(range_mm) / 1000.0,
            Echo::Silence => f32::INFINITY,
            Echo::Dead => f32::NAN,
        })
        .collect();
    let step_rad = TAU / ranges.len().max(1) as f64;
    let mut cdr = Cdr::new();
    cdr.header(time_ns, ROBOT_FRAME).f32(0.0).f32((step_rad * ranges.len().saturating_sub(1) as f64) as f32);
    cdr.f32(step_rad as f32).f32(0.0).f32(0.0).f32(RANGE_MIN_M).f32(RANGE_MAX_M);
    cdr.sequence(&ranges, |cdr, range_m| {
        cdr.f32(*range_m);
    });
    cdr.length(0).finish()
}

/// `std_msgs/msg/String`.
pub(super) fn string(text: &str) -> Vec<u8> {
    Cdr::new().string(text).finish()
}

/// One `visualization_msgs/Marker`.
struct Marker {
    namespace: &'static str,
    id: usize,
    kind: i32,
    action: i32,
    at: [f64; 3],
    scale: [f64; 3],
    colour: [f32; 4],
    points: Vec<[f64; 3]>,
    text: String,
}

impl Marker {
    const fn new(namespace: &'static str, id: usize, kind: i32, scale: [f64; 3], colour: [f32; 4]) -> Self {
        Self { namespace, id, kind, action: ADD, at: [0.0; 3], scale, colour, points: Vec::new(), text: String::new() }
    }

    fn write(&self, cdr: &mut Cdr, time_ns: u64) {
        cdr.header(time_ns, MAP_FRAME).string(self.namespace).i32(self.id as i32).i32(self.kind).i32(self.action);
        // Position and an upright orientation.
        for number in self.at.into_iter().chain([0.0, 0.0, 0.0, 1.0]).chain(self.scale) {
            cdr.f64(number);
        }
        for part in self.colour {
            cdr.f32(part);
        }
        // No lifetime; not locked to the frame.
        cdr.i32(0).u32(0).u8(0);
        cdr.sequence(&self.points, |cdr, point| {
            for coordinate in point {
                cdr.f64(*coordinate);
            }
        });
        // No colours of points, no texture file; an empty texture with its header, format and data; no texture coordinates.
        cdr.length(0).string("").header(0, "").string("").length(0).length(0);
        // The text; no mesh: its resource, file name, data, and whether its materials are used.
        cdr.string(&self.text).string("").string("").length(0).u8(0);
    }
}

/// `visualization_msgs/msg/MarkerArray` of a map. It replaces all markers before.
pub(super) fn markers(scene: &Scene<'_>, time_ns: u64) -> Vec<u8> {
    let Scene { map, layout, robot } = *scene;
    let at = |point: &Point, z: f64| [METRES_PER_EDGE * point.x, METRES_PER_EDGE * point.y, z];
    let mut markers = vec![Marker { action: DELETE_ALL, ..Marker::new("", 0, 0, [0.0; 3], [0.0; 4]) }];
    for (vertex, (label, point)) in map.vertices.iter().zip(layout.points()).enumerate() {
        let width_m = 2.0 * f64::from(label.radius_mm.max(100)) / 1000.0;
        let colour = if robot.map(usize::from) == Some(vertex) { HERE } else { PLACE };
        let disc = Marker::new("places", vertex, CYLINDER, [width_m, width_m, DISC_M], colour);
        markers.push(Marker { at: at(point, 0.0), ..disc });
        let name = Marker::new("names", vertex, TEXT, [0.0, 0.0, TEXT_M], WHITE);
        markers.push(Marker { at: at(point, TEXT_M), text: format!("{vertex}: {} mm", label.radius_mm), ..name });
    }
    let edges = layout.edges();
    let lines = edges.iter().flat_map(|edge| edge.points.windows(2).flatten());
    let stubs = layout.stubs().iter().flat_map(|stub| [stub.from, stub.to]);
    let lists = [
        ("edges", EDGE, lines.map(|point| at(point, 0.0)).collect::<Vec<_>>()),
        ("frontiers", FRONTIER, stubs.map(|point| at(&point, 0.0)).collect()),
    ];
    for (namespace, colour, points) in lists {
        // Viewers complain of a list without points.
        if !points.is_empty() {
            markers.push(Marker { points, ..Marker::new(namespace, 0, LINE_LIST, [LINE_M, 0.0, 0.0], colour) });
        }
    }
    Cdr::new().sequence(&markers, |cdr, marker| marker.write(cdr, time_ns)).finish()
}
