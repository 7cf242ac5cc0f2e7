//! Where a robot starts in a plan that does not say it.

use crate::world::Point;
use crate::world::walls::Walls;

/// Distance of the points that are looked at, in millimetres, in a plan of up to a million of them.
const STEP_MM: f64 = 100.0;
const POINTS: f64 = 1e6;
/// Points with this much room around them are connected when they are neighbours, in millimetres.
const ROOM_MM: f64 = 150.0;

/// The most open place of the largest connected part of a plan: the point farthest from the walls. Time: some microseconds for each
/// of the points that are looked at.
pub(super) fn most_open(walls: &Walls, width_mm: f64, height_mm: f64) -> Option<Point> {
    let step_mm = STEP_MM.max((width_mm * height_mm / POINTS).sqrt());
    let (columns, rows) = ((width_mm / step_mm) as usize, (height_mm / step_mm) as usize);
    let at = |index: usize| {
        let (column, row) = (index % columns, index / columns);
        Point::new((column as f64 + 0.5) * step_mm, (row as f64 + 0.5) * step_mm)
    };
    let room_mm: Vec<f64> = (0..columns * rows)
        .map(at)
        .map(|point| if walls.is_free(point) { walls.clearance_mm(point) } else { 0.0 })
        .collect();
    let mut seen = vec![false; room_mm.len()];
    let mut largest: (usize, Option<usize>) = (0, None);
    for first in 0..room_mm.len() {
        let (mut size, mut best) = (0, first);
        let mut open = vec![first];
        while let Some(index) = open.pop() {
            if room_mm[index] < ROOM_MM || std::mem::replace(&mut seen[index], true) {
                continue;
            }
            size += 1;
            if (room_mm[index], best) > (room_mm[best], index) {
                best = index;
            }
            let column = index % columns;
            open.extend(index.checked_sub(columns));
            open.extend(Some(index + columns).filter(|above| *above < room_mm.len()));
            open.extend((column > 0).then(|| index - 1));
            open.extend((column + 1 < columns).then_some(index + 1));
        }
        if size > largest.0 {
            largest = (size, Some(best));
        }
    }
    // A plan in which nothing has room starts where it is least narrow.
    let widest =
        || (0..room_mm.len()).filter(|index| room_mm[*index] > 0.0).max_by(|a, b| room_mm[*a].total_cmp(&room_mm[*b]));
    largest.1.or_else(widest).map(at)
}
