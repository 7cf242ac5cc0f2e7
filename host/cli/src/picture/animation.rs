//! Animated SVG of a growing map over its floor plan, which repeats.
//!
//! Each vertex, edge and text is drawn once, and visible during the steps whose map contains it.

use std::collections::BTreeMap;

use svg::Document;
use svg::node::element::{Animate, Circle, Group, Polyline, Rectangle, Title};

use super::{Drawing, MARGIN_MM, walls};
use toposlam_link::export::marks::{DOT_MM, MAP_COLOUR, ROBOT_COLOUR, words};
use toposlam_sim::world::{Plan, Point};

/// Durations of the animated drive and of its last map, in seconds.
const DRIVE_S: f64 = 24.0;
const PAUSE_S: f64 = 4.0;
/// Maximum number of points of the robot's path.
const WAY_POINTS: usize = 600;

/// The map after one place.
#[derive(Clone, Debug)]
pub struct Step {
    /// The map, with the position of each drawn vertex.
    pub drawing: Drawing,
    /// Number of points of the path driven so far.
    pub driven: usize,
}

/// An element of the drawing. Elements with the same appearance are the same in two steps.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Element {
    Edge([i64; 4]),
    Disc([i64; 3]),
    Vertex([i64; 2], String),
    Caption(String),
}

/// Draws the steps of a map over its floor plan, with the robot and its path. `way` has the robot's position in each
/// ring frame.
///
/// One unit of the document is 1 mm of the building; the animation repeats every 28 seconds.
pub fn animate(plan: &Plan, way: &[Point], steps: &[Step]) -> String {
    let (width_mm, height_mm) = (plan.width_mm(), plan.height_mm());
    let at = |point: Point| (point.x_mm, height_mm - point.y_mm);
    let timeline = Timeline { way: way.len().max(1) };
    let title = steps.last().map_or("", |step| &*step.drawing.caption);
    let mut document = Document::new()
        .set("viewBox", (0, 0, width_mm, height_mm + 2.0 * MARGIN_MM))
        .set("width", width_mm / 25.0)
        .set("font-family", "sans-serif")
        .add(Title::new(title))
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "white"))
        .add(walls(plan));
    let (trail, robot) = robot(way, at, &timeline);
    document = document.add(trail);
    for (element, intervals) in intervals(steps, at) {
        let shown = timeline.shown(&intervals, steps);
        document = document.add(draw(&element, height_mm).add(shown));
    }
    document.add(robot).to_string()
}

/// Times of events, as fractions of the whole duration.
struct Timeline {
    way: usize,
}

impl Timeline {
    fn share(&self, driven: usize) -> f64 {
        driven as f64 / self.way as f64 * DRIVE_S / (DRIVE_S + PAUSE_S)
    }

    /// Shows an element during the given steps, each from its place to the next one.
    fn shown(&self, intervals: &[(usize, usize)], steps: &[Step]) -> Animate {
        let (mut values, mut times) = (vec!["0"], vec![0.0]);
        for &(first, end) in intervals {
            for (value, step) in [("1", first), ("0", end)] {
                let Some(step) = steps.get(step) else { continue };
                values.push(value);
                times.push(self.share(step.driven));
            }
        }
        let times: Vec<String> = times.iter().map(|time| format!("{time:.4}")).collect();
        repeating("opacity")
            .set("calcMode", "discrete")
            .set("values", values.join(";"))
            .set("keyTimes", times.join(";"))
    }
}

fn repeating(attribute: &str) -> Animate {
    Animate::new()
        .set("attributeName", attribute)
        .set("dur", format!("{}s", DRIVE_S + PAUSE_S))
        .set("repeatCount", "indefinite")
}

/// The robot and the path behind it.
fn robot(way: &[Point], at: impl Fn(Point) -> (f64, f64), timeline: &Timeline) -> (Polyline, Circle) {
    let stride = way.len().div_ceil(WAY_POINTS).max(1);
    let points: Vec<(f64, f64)> = way.iter().step_by(stride).map(|point| at(*point)).collect();
    let mut lengths = vec![0.0];
    for pair in points.windows(2) {
        let length = (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1);
        lengths.push(lengths[lengths.len() - 1] + length);
    }
    let whole = lengths.last().copied().unwrap_or(0.0).max(1.0);
    let times: Vec<String> = (0..points.len())
        .map(|index| format!("{:.4}", timeline.share(index * stride)))
        .chain(["1".to_owned()])
        .collect();
    let along = |attribute: &str, values: Vec<String>| {
        let last = values.last().cloned();
        let values: Vec<String> = values.into_iter().chain(last).collect();
        repeating(attribute).set("values", values.join(";")).set("keyTimes", times.join(";"))
    };
    let coordinates = |pick: fn(&(f64, f64)) -> f64| points.iter().map(|point| format!("{:.0}", pick(point))).collect();
    let hidden = lengths.iter().map(|length| format!("{:.0}", whole - length)).collect();
    let trail = Polyline::new()
        .set("points", points.iter().map(|(x, y)| format!("{x:.0},{y:.0}")).collect::<Vec<_>>().join(" "))
        .set("fill", "none")
        .set("stroke", ROBOT_COLOUR)
        .set("stroke-opacity", 0.25)
        .set("stroke-width", 60)
        .set("stroke-dasharray", format!("{whole:.0}"))
        .add(along("stroke-dashoffset", hidden));
    let robot = Circle::new()
        .set("r", 0.8 * DOT_MM)
        .set("fill", ROBOT_COLOUR)
        .set("fill-opacity", 0.8)
        .add(along("cx", coordinates(|point| point.0)))
        .add(along("cy", coordinates(|point| point.1)));
    (trail, robot)
}

/// Every element with the steps that show it, as half-open intervals; edges are below discs, discs below vertices.
fn intervals(steps: &[Step], at: impl Fn(Point) -> (f64, f64)) -> BTreeMap<Element, Vec<(usize, usize)>> {
    let mut elements: BTreeMap<Element, Vec<(usize, usize)>> = BTreeMap::new();
    for (index, step) in steps.iter().enumerate() {
        for element in elements_of(&step.drawing, &at) {
            let intervals = elements.entry(element).or_default();
            match intervals.last_mut() {
                Some((_, end)) if *end == index => *end = index + 1,
                Some((_, end)) if *end > index => {}
                _ => intervals.push((index, index + 1)),
            }
        }
    }
    elements
}

fn elements_of(drawing: &Drawing, at: impl Fn(Point) -> (f64, f64)) -> Vec<Element> {
    let rounded = |point: Point| {
        let (x, y) = at(point);
        [x.round() as i64, y.round() as i64]
    };
    let mut elements = vec![Element::Caption(drawing.caption.clone())];
    for vertex in &drawing.vertices {
        let [x, y] = rounded(vertex.position);
        // Rounded to 50 mm, so that a disc does not become a new element with each visit.
        elements.push(Element::Disc([x, y, 50 * (vertex.radius_mm / 50.0).round() as i64]));
        elements.push(Element::Vertex([x, y], vertex.name.clone()));
    }
    for &(a, b) in &drawing.edges {
        if let (Some(a), Some(b)) = (drawing.vertices.get(a), drawing.vertices.get(b)) {
            let ([x1, y1], [x2, y2]) = (rounded(a.position), rounded(b.position));
            elements.push(Element::Edge([x1, y1, x2, y2]));
        }
    }
    elements
}

fn draw(element: &Element, height_mm: f64) -> Group {
    let group = Group::new().set("opacity", 0);
    match element {
        Element::Edge([x1, y1, x2, y2]) => group.add(
            Polyline::new()
                .set("points", format!("{x1},{y1} {x2},{y2}"))
                .set("stroke", MAP_COLOUR)
                .set("stroke-width", 110),
        ),
        Element::Disc([x, y, radius]) => group.add(
            Circle::new()
                .set("cx", *x)
                .set("cy", *y)
                .set("r", *radius)
                .set("fill", MAP_COLOUR)
                .set("fill-opacity", 0.1),
        ),
        Element::Vertex([x, y], name) => group
            .add(Circle::new().set("cx", *x).set("cy", *y).set("r", DOT_MM).set("fill", MAP_COLOUR))
            .add(words(name, *x as f64, *y as f64 + 130.0, 380.0).set("fill", "white").set("text-anchor", "middle")),
        Element::Caption(caption) => group.add(words(caption, 300.0, height_mm + 1.3 * MARGIN_MM, 520.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Vertex;
    use super::*;

    fn step(vertices: &[(f64, &str)], driven: usize) -> Step {
        let vertex = |&(x_mm, name): &(f64, &str)| Vertex {
            position: Point::new(x_mm, 1000.0),
            radius_mm: 800.0,
            name: name.to_owned(),
        };
        let edges = if vertices.len() > 1 { vec![(0, 1)] } else { Vec::new() };
        let vertices = vertices.iter().map(vertex).collect();
        Step { drawing: Drawing { vertices, edges, caption: format!("{driven} frames") }, driven }
    }

    #[test]
    fn an_element_is_drawn_once_and_shown_while_the_map_contains_it() {
        let plan = Plan::built_in("ring").unwrap();
        let way: Vec<Point> = (0..100).map(|frame| Point::new(10.0 * f64::from(frame), 1000.0)).collect();
        let steps = [
            step(&[(2000.0, "0")], 10),
            step(&[(2000.0, "0"), (5000.0, "1")], 40),
            step(&[(5000.0, "1")], 70),
            step(&[(2000.0, "0"), (5000.0, "1")], 90),
        ];
        let shown = intervals(&steps, |point| (point.x_mm, point.y_mm));
        let vertex = |x, name: &str| shown[&Element::Vertex([x, 1000], name.to_owned())].clone();
        assert_eq!(vertex(2000, "0"), [(0, 2), (3, 4)]);
        assert_eq!(vertex(5000, "1"), [(1, 4)]);
        assert_eq!(shown[&Element::Edge([2000, 1000, 5000, 1000])], [(1, 2), (3, 4)]);
        let picture = animate(&plan, &way, &steps);
        assert_eq!(picture.matches("1.0 frames").count(), 0);
        for driven in [10, 40, 70, 90] {
            assert!(picture.contains(&format!("{driven} frames")));
        }
        assert_eq!(picture.matches("attributeName=\"opacity\"").count(), shown.len());
    }
}
