//! Draws a graph from scratch: without crossings if it is planar, and as close to the previous drawing as possible.

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

/// Sweeps of smoothing after drawing, and again after alignment with the previous drawing.
const SWEEPS: u32 = 16;

/// Maximum growth to remove overlaps; beyond it the next drawing method is tried.
const TOO_SMALL: f64 = 2.0;

/// Maximum growth of a drawing with crossings.
const MOST_GROWTH: f64 = 4.0;

/// Draws the whole graph. `before` holds the positions to keep where possible.
///
/// A planar graph is drawn without conflicts. For any other graph a planar subgraph is drawn, and the remaining edges
/// cross.
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
        lay_over(&mut points, before, graph.is_ordered());
        smooth(graph, &mut points, &all, before, SWEEPS);
        put_back(graph, &mut points, before);
    }
    points
}

/// A maximal planar subgraph.
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

/// A method that gives the positions of a triangulation's vertices.
type Method = fn(&Triangulation) -> Vec<Point>;

/// A drawing of a planar graph without conflicts.
///
/// Drawing without trees and bends looks best, but may leave no room for them; the last method always succeeds.
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

/// A drawing without conflicts and its growth factor; `None` if there is no room or the graph is not planar.
fn draw_in_one_way(graph: &Graph, reduction: &Reduction, method: Method) -> Option<(f64, Vec<Point>)> {
    let mut points = vec![Point::UNKNOWN; graph.vertices()];
    if !reduction.kept.is_empty() {
        let kept = method(&Triangulation::of(&reduction.graph)?);
        reduction.kept.iter().zip(kept).for_each(|(&vertex, at)| points[vertex] = at);
    }
    for &(bend, (one, other)) in reduction.bends.iter().rev() {
        points[bend] = (points[one] + points[other]) * 0.5;
    }
    // At first the mean edge length is 1 and vertices too close to each other move apart; growth removes the remaining
    // overlaps.
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

/// Mean edge length; 1 for a graph without edges.
fn mean_length(graph: &Graph, points: &[Point]) -> f64 {
    let lengths = graph.edges().iter().map(|&(a, b)| (points[a] - points[b]).length());
    let (sum, count) = lengths
        .filter(|length| length.is_finite())
        .fold((0.0, 0.0), |(sum, count), length| (sum + length, count + 1.0));
    if count == 0.0 { 1.0 } else { sum / count }
}

/// Rotates and translates a drawing to the best fit with the previous one; mirrors it too if it has no order.
pub(super) fn lay_over(points: &mut [Point], before: &[Point], is_ordered: bool) {
    let pairs = || points.iter().zip(before).filter(|(_, before)| before.is_known());
    let (from, to) = (geometry::mean(pairs().map(|pair| *pair.0)), geometry::mean(pairs().map(|pair| *pair.1)));
    let mirror = |point: Point, sign: f64| Point::new(point.x, sign * point.y);
    // The angle of the sum of products is the best rotation; its magnitude measures the fit.
    let turn = |sign: f64| {
        let products = pairs().map(|(point, before)| (mirror(*point - from, sign), *before - to));
        let (cosine, sine) = products.fold((0.0, 0.0), |(cosine, sine), (point, before)| {
            (cosine + point.dot(before), sine + point.cross(before))
        });
        (sign, Point::new(cosine, sine))
    };
    let (straight, mirrored) = (turn(1.0), turn(-1.0));
    let (sign, turn) = if !is_ordered && mirrored.1.squared() > straight.1.squared() { mirrored } else { straight };
    let length = turn.length();
    let turn = if length > 0.0 { turn * (1.0 / length) } else { Point::new(1.0, 0.0) };
    for point in points {
        let centred = mirror(*point - from, sign);
        *point = to + Point::new(turn.x * centred.x - turn.y * centred.y, turn.y * centred.x + turn.x * centred.y);
    }
}

/// Moves vertices back to their exact previous positions where that causes no conflict.
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
