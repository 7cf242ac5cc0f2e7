//! Planar drawing with each inner vertex at a weighted mean of its neighbours, after Tutte and Floater.

use super::{Point, triangulation::Triangulation};

/// Number of weight updates that equalise the edge lengths.
const ROUNDS: usize = 12;

/// Positions of all vertices: the outer face is a regular polygon, and the other edges have similar lengths.
///
/// Any positive weights give a drawing without crossings, up to rounding errors: vertices may come very close to each
/// other. Cost: O(vertices³).
pub(super) fn draw(triangulation: &Triangulation) -> Vec<Point> {
    let graph = &triangulation.graph;
    let rim = &triangulation.rim;
    let mut points = vec![Point::UNKNOWN; graph.vertices()];
    for (index, &vertex) in rim.iter().enumerate() {
        points[vertex] = Point::towards(std::f64::consts::TAU * index as f64 / rim.len() as f64);
    }
    let inner: Vec<usize> = (0..points.len()).filter(|&vertex| !points[vertex].is_known()).collect();
    let mut weights = vec![1.0; graph.edges().len()];
    for round in 0..ROUNDS {
        solve(triangulation, &inner, &weights, &mut points);
        if round + 1 < ROUNDS {
            // Longer edges get larger weights.
            for (weight, &(a, b)) in weights.iter_mut().zip(graph.edges()) {
                *weight *= (points[a] - points[b]).length().max(1e-6);
            }
            let mean = weights.iter().sum::<f64>() / weights.len() as f64;
            weights.iter_mut().for_each(|weight| *weight = (*weight / mean).clamp(1e-3, 1e3));
        }
    }
    points
}

/// Moves the inner vertices to the weighted means of their neighbours, by Gaussian elimination.
fn solve(triangulation: &Triangulation, inner: &[usize], weights: &[f64], points: &mut [Point]) {
    let count = inner.len();
    let mut row_of = vec![usize::MAX; points.len()];
    inner.iter().enumerate().for_each(|(row, &vertex)| row_of[vertex] = row);
    let mut matrix = vec![vec![0.0; count]; count];
    let mut right = vec![Point::default(); count];
    for (&(a, b), &weight) in triangulation.graph.edges().iter().zip(weights) {
        for (vertex, other) in [(a, b), (b, a)] {
            let (row, column) = (row_of[vertex], row_of[other]);
            if row == usize::MAX {
                continue;
            }
            matrix[row][row] += weight;
            if column == usize::MAX {
                right[row] = right[row] + points[other] * weight;
            } else {
                matrix[row][column] -= weight;
            }
        }
    }
    // The matrix is diagonally dominant: no pivoting is needed.
    for pivot in 0..count {
        let (above, below) = matrix.split_at_mut(pivot + 1);
        let pivot_row = &above[pivot];
        for (row, values) in below.iter_mut().enumerate() {
            let factor = values[pivot] / pivot_row[pivot];
            if factor != 0.0 {
                for (value, pivot_value) in values[pivot..].iter_mut().zip(&pivot_row[pivot..]) {
                    *value -= factor * pivot_value;
                }
                right[pivot + 1 + row] = right[pivot + 1 + row] - right[pivot] * factor;
            }
        }
    }
    for row in (0..count).rev() {
        let known =
            (row + 1..count).fold(Point::default(), |sum, column| sum + points[inner[column]] * matrix[row][column]);
        points[inner[row]] = (right[row] - known) * (1.0 / matrix[row][row]);
    }
}
