//! A picture from scratch: without crossings where the graph allows that, and as much like the picture before as it can be.

use super::{
    Point, conflicts, drawing, geometry, graph::Graph, smoothing::smooth, triangulation::Triangulation,
    untangling::untangle,
};

/// Sweeps of smoothing, before and after the picture is laid over the one before.
const SWEEPS: usize = 30;

/// Draws the whole graph; `before` are the positions to be kept where possible.
///
/// A planar graph is drawn without any conflict, any other without those edges that make it so, which then cross some.
pub(super) fn redraw(graph: &Graph, before: &[Point]) -> Vec<Point> {
    let vertices = graph.vertices();
    if vertices < 3 {
        return (0..vertices).map(|vertex| Point::new(vertex as f64, 0.0)).collect();
    }
    let mut points = planar_part(graph);
    let growth = conflicts::growth(graph, &points).min(vertices as f64 * 4.0);
    points.iter_mut().for_each(|point| *point = *point * growth);
    let all: Vec<usize> = (0..vertices).collect();
    let nowhere = vec![Point::UNKNOWN; vertices];
    smooth(graph, &mut points, &all, &nowhere, SWEEPS);
    if before.iter().any(|point| point.is_known()) {
        lay_over(&mut points, before);
        smooth(graph, &mut points, &all, before, SWEEPS);
        put_back(graph, &mut points, before);
    }
    untangle(graph, &mut points);
    points
}

/// The drawing of a planar part of the graph that no edge can be added to.
fn planar_part(graph: &Graph) -> Vec<Point> {
    if let Some(triangulation) = Triangulation::of(graph) {
        return drawing::draw(&triangulation);
    }
    let mut part = Graph::new(graph.vertices());
    for &(a, b) in graph.edges() {
        part.connect(a, b);
        if Triangulation::of(&part).is_none() {
            part.disconnect_last();
        }
    }
    Triangulation::of(&part).map_or_else(Vec::new, |triangulation| drawing::draw(&triangulation))
}

/// Turns, mirrors and shifts a picture so that it lies as well as possible over the one before.
fn lay_over(points: &mut [Point], before: &[Point]) {
    let pairs = || points.iter().zip(before).filter(|(_, before)| before.is_known());
    let (from, to) = (geometry::mean(pairs().map(|pair| *pair.0)), geometry::mean(pairs().map(|pair| *pair.1)));
    let mirror = |point: Point, sign: f64| Point::new(point.x, sign * point.y);
    // The turn by the angle of the sum of products brings the directions together best, and its length says how well.
    let turn = |sign: f64| {
        let products = pairs().map(|(point, before)| (mirror(*point - from, sign), *before - to));
        let (cosine, sine) = products.fold((0.0, 0.0), |(cosine, sine), (point, before)| {
            (cosine + point.dot(before), sine + point.cross(before))
        });
        (sign, Point::new(cosine, sine))
    };
    let (straight, mirrored) = (turn(1.0), turn(-1.0));
    let (sign, turn) = if mirrored.1.squared() > straight.1.squared() { mirrored } else { straight };
    let length = turn.length();
    let turn = if length > 0.0 { turn * (1.0 / length) } else { Point::new(1.0, 0.0) };
    for point in points {
        let centred = mirror(*point - from, sign);
        *point = to + Point::new(turn.x * centred.x - turn.y * centred.y, turn.y * centred.x + turn.x * centred.y);
    }
}

/// Puts vertices exactly where they were, as long as that makes no conflict.
fn put_back(graph: &Graph, points: &mut [Point], before: &[Point]) {
    loop {
        let mut moved = false;
        for vertex in 0..points.len() {
            let (now, then) = (points[vertex], before[vertex]);
            if then.is_known()
                && now != then
                && conflicts::conflicts_of(graph, points, vertex, then)
                    <= conflicts::conflicts_of(graph, points, vertex, now)
            {
                points[vertex] = then;
                moved = true;
            }
        }
        if !moved {
            return;
        }
    }
}
