//! A picture from scratch: without crossings where the graph allows that, and as much like the picture before as it can be.

use super::{
    Point, barycentres,
    conflicts::{conflicts, conflicts_of, growth},
    drawing, geometry,
    graph::Graph,
    placement::place,
    reduction::Reduction,
    smoothing::smooth,
    triangulation::Triangulation,
    untangling::untangle,
};

/// Sweeps of smoothing of a drawing, and again when it is laid over the picture before.
const SWEEPS: u32 = 16;

/// A picture that has to grow by more than this, so that nothing hides anything, is drawn in another way.
const TOO_SMALL: f64 = 2.0;

/// A picture with crossings grows by this at most.
const MOST_GROWTH: f64 = 4.0;

/// Draws the whole graph; `before` are the positions to be kept where possible.
///
/// A planar graph is drawn without any conflict, any other without those edges that make it so, which then cross some.
pub(super) fn redraw(graph: &Graph, before: &[Point]) -> Vec<Point> {
    let all: Vec<usize> = (0..graph.vertices()).collect();
    let nowhere = vec![Point::UNKNOWN; all.len()];
    let is_planar = Triangulation::of(graph).is_some();
    let mut points = if is_planar {
        draw(graph)
    } else {
        let mut points = draw(&planar_part(graph));
        untangle(graph, &mut points);
        smooth(graph, &mut points, &all, &nowhere, SWEEPS);
        let growth = growth(graph, &points).min(MOST_GROWTH);
        scale(&mut points, growth);
        points
    };
    if before.iter().any(|point| point.is_known()) {
        lay_over(&mut points, before);
        smooth(graph, &mut points, &all, before, SWEEPS);
        put_back(graph, &mut points, before);
    }
    points
}

/// As many edges as fit without crossings.
fn planar_part(graph: &Graph) -> Graph {
    let mut part = Graph::new(graph.vertices());
    for &(a, b) in graph.edges() {
        part.connect(a, b);
        if Triangulation::of(&part).is_none() {
            part.disconnect_last();
        }
    }
    part
}

/// A way to the positions of a triangulation's vertices.
type Method = fn(&Triangulation) -> Vec<Point>;

/// A picture of a planar graph without conflicts.
///
/// What is drawn without trees and bends looks best, but may leave no room for them; the last way always works.
fn draw(graph: &Graph) -> Vec<Point> {
    let ways: [(bool, Method); 3] = [(true, barycentres::draw), (false, barycentres::draw), (false, drawing::draw)];
    let mut best: Option<(f64, Vec<Point>)> = None;
    for (is_reduced, method) in ways {
        let reduction = if is_reduced { Reduction::of(graph) } else { Reduction::none(graph) };
        if let Some((growth, points)) = draw_in_one_way(graph, &reduction, method)
            && best.as_ref().is_none_or(|(least, _)| growth < *least)
        {
            best = Some((growth, points));
            if growth < TOO_SMALL {
                break;
            }
        }
    }
    best.map_or_else(Vec::new, |(_, points)| points)
}

/// A picture without conflicts, and by how much it had to grow for that; `None` when there is no room, or it is no planar graph.
fn draw_in_one_way(graph: &Graph, reduction: &Reduction, method: Method) -> Option<(f64, Vec<Point>)> {
    let mut points = vec![Point::UNKNOWN; graph.vertices()];
    if !reduction.kept.is_empty() {
        let kept = method(&Triangulation::of(&reduction.graph)?);
        reduction.kept.iter().zip(kept).for_each(|(&vertex, at)| points[vertex] = at);
    }
    for &(bend, (one, other)) in reduction.bends.iter().rev() {
        points[bend] = (points[one] + points[other]) * 0.5;
    }
    // Its edges are about as long as they should be, and what is too close then comes apart; the rest of it by growth.
    let length = mean_length(graph, &points);
    scale(&mut points, 1.0 / length);
    let drawn: Vec<usize> = (0..points.len()).filter(|&vertex| points[vertex].is_known()).collect();
    let nowhere = vec![Point::UNKNOWN; points.len()];
    smooth(graph, &mut points, &drawn, &nowhere, SWEEPS);
    let growth = growth(graph, &points);
    scale(&mut points, growth);
    for &leaf in reduction.leaves.iter().rev() {
        points[leaf] = place(graph, &points, leaf);
    }
    (growth.is_finite() && conflicts(graph, &points) == 0).then_some((growth, points))
}

fn scale(points: &mut [Point], factor: f64) {
    points.iter_mut().for_each(|point| *point = *point * factor);
}

/// The mean length of the edges; 1 when there are none.
fn mean_length(graph: &Graph, points: &[Point]) -> f64 {
    let lengths = graph.edges().iter().map(|&(a, b)| (points[a] - points[b]).length());
    let (sum, count) = lengths
        .filter(|length| length.is_finite())
        .fold((0.0, 0.0), |(sum, count), length| (sum + length, count + 1.0));
    if count == 0.0 { 1.0 } else { sum / count }
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
            if !then.is_known() || now == then {
                continue;
            }
            let conflicts = conflicts_of(graph, points, vertex, now, u32::MAX);
            if conflicts_of(graph, points, vertex, then, conflicts) <= conflicts {
                points[vertex] = then;
                moved = true;
            }
        }
        if !moved {
            return;
        }
    }
}
