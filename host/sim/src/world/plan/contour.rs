//! The contours of a bitmap, simplified: a slanted or round wall of cells becomes a wall of few straight pieces.

use std::collections::BTreeMap;

use super::bitmap::Bitmap;
use super::rings;
use crate::world::walls::{Segment, Vertex};

/// A contour that is no longer and no wider than this is not simplified: it is a table leg.
const FEW_CELLS: i32 = 2;

/// A closed contour along the cells, free space on the left.
type Contour = Vec<Vertex>;

/// Corners are counted in half cells, so that the middle of a side has a whole number.
pub(super) const PER_CELL: i32 = 2;

/// Traces the border between free cells and wall by crack following, evens out the steps of slanted walls, and simplifies the rest
/// (Douglas and Peucker, 1973): no corner or middle of a step is as far from the simplified border as `tolerance`, in cells. No two
/// borders cross. The corners are in half cells.
///
/// Time O(n log n) for n corners on the border where little is curved.
pub(super) fn trace(bitmap: &Bitmap, tolerance: f64) -> Vec<Contour> {
    let tolerance = tolerance * f64::from(PER_CELL);
    let contours: Vec<Contour> = follow(bitmap.faces()).iter().map(|contour| even_out(contour)).collect();
    let mut kept: Vec<Vec<usize>> = contours.iter().map(|contour| simplify(contour, tolerance)).collect();
    // Two borders of a thin wall may cross when each is moved; they get their corners back where they do.
    for _ in 0..32 {
        let pieces: Vec<(usize, usize, Segment)> = kept
            .iter()
            .enumerate()
            .flat_map(|(ring, kept)| {
                let next = kept.iter().cycle().skip(1);
                let piece = move |(&from, &to): (&usize, &usize)| (ring, from, to);
                kept.iter().zip(next).map(piece).collect::<Vec<_>>()
            })
            .map(|(ring, from, to)| (ring, from, Segment { from: contours[ring][from], to: contours[ring][to] }))
            .collect();
        let segments: Vec<Segment> = pieces.iter().map(|(_, _, segment)| *segment).collect();
        let crossing = rings::crossings(&segments);
        let mut added = false;
        for index in crossing {
            let (ring, from, segment) = pieces[index];
            let contour = &contours[ring];
            if let Some(corner) = farthest(contour, from, segment, 0.0)
                && let Err(position) = kept[ring].binary_search(&corner)
            {
                kept[ring].insert(position, corner);
                added = true;
            }
        }
        if !added {
            break;
        }
    }
    let kept = contours.iter().zip(kept);
    kept.map(|(contour, kept)| kept.into_iter().map(|index| contour[index]).collect()).collect()
}

/// Joins faces to closed contours of corners. Two walls that touch at a corner are one wall.
fn follow(faces: Vec<Segment>) -> Vec<Contour> {
    let mut leaving: BTreeMap<Vertex, Vec<Segment>> = BTreeMap::new();
    faces.into_iter().for_each(|face| leaving.entry(face.from).or_default().push(face));
    let mut contours = Vec::new();
    while let Some((&start, _)) = leaving.first_key_value() {
        let mut contour = Vec::new();
        let (mut at, mut direction) = (start, (0, 0));
        while let Some(faces) = leaving.get_mut(&at) {
            contour.push(at);
            // The left turn first: along the same free cell.
            let is_left = |face: &Segment| {
                let (x, y) = (face.to.0 - at.0, face.to.1 - at.1);
                direction.0 * y - direction.1 * x > 0
            };
            let next = faces.iter().position(is_left).unwrap_or(0);
            let face = faces.swap_remove(next);
            if faces.is_empty() {
                leaving.remove(&at);
            }
            (direction, at) = ((face.to.0 - at.0, face.to.1 - at.1), face.to);
            if at == start {
                break;
            }
        }
        contours.push(contour);
    }
    contours
}

/// Replaces each step of a staircase by its middle: a side of one cell between two turns the opposite way, before or after another
/// that leads the same way. The corners become half cells.
fn even_out(contour: &[Vertex]) -> Contour {
    let count = contour.len();
    let at = |index: usize| contour[index % count];
    let side = |index: usize| (at(index + 1).0 - at(index).0, at(index + 1).1 - at(index).1);
    let is_step = |index: usize| {
        let (x, y) = side(index);
        let goes_on = |other: usize| side(other).0 == x && side(other).1 == y;
        // The sides before and after lead the same way: no niche and no pilaster.
        let along = |index: usize| (side(index).0.signum(), side(index).1.signum());
        x.abs() + y.abs() == 1
            && along(index + count - 1) == along(index + 1)
            && (goes_on(index + 2) || goes_on(index + count - 2))
    };
    let steps: Vec<bool> = (0..count).map(is_step).collect();
    let mut even = Vec::new();
    for index in 0..count {
        let (corner, next) = (at(index), at(index + 1));
        if !steps[index] && !steps[(index + count - 1) % count] {
            even.push((PER_CELL * corner.0, PER_CELL * corner.1));
        }
        if steps[index] {
            even.push((corner.0 + next.0, corner.1 + next.1));
        }
    }
    even
}

/// The corners that stay, by index, in ascending order. At least three, and all of a contour of few cells.
fn simplify(contour: &[Vertex], tolerance: f64) -> Vec<usize> {
    let extent =
        |of: fn(&Vertex) -> i32| contour.iter().map(of).max().unwrap_or(0) - contour.iter().map(of).min().unwrap_or(0);
    if extent(|corner| corner.0).max(extent(|corner| corner.1)) <= FEW_CELLS * PER_CELL {
        return (0..contour.len()).collect();
    }
    let far_from = |corner: usize| {
        let distance2 = |other: Vertex| {
            let (x, y) = (i64::from(other.0 - contour[corner].0), i64::from(other.1 - contour[corner].1));
            x * x + y * y
        };
        (0..contour.len()).max_by_key(|index| (distance2(contour[*index]), usize::MAX - index)).unwrap_or(0)
    };
    // The recursion starts from two corners that are far apart.
    let one = far_from(0);
    let other = far_from(one);
    let mut kept = vec![one.min(other), one.max(other)];
    let mut open = vec![(kept[0], kept[1]), (kept[1], kept[0])];
    while let Some((from, to)) = open.pop() {
        let segment = Segment { from: contour[from], to: contour[to] };
        if let Some(corner) = farthest(contour, from, segment, tolerance) {
            kept.push(corner);
            open.extend([(from, corner), (corner, to)]);
        }
    }
    kept.sort_unstable();
    kept.dedup();
    if kept.len() < 3 {
        // A contour is never flat: the corner farthest from the line through the two stays.
        let segment = Segment { from: contour[kept[0]], to: contour[kept[1]] };
        kept.extend(farthest(contour, kept[0], segment, 0.0).or(farthest(
            contour,
            kept[1],
            Segment { from: segment.to, to: segment.from },
            0.0,
        )));
        kept.sort_unstable();
    }
    kept
}

/// The corner of a stretch that is farthest from the segment between its ends, if it is at least that far, in cells. The stretch
/// begins at the corner `from` and ends at the segment's end.
fn farthest(contour: &[Vertex], from: usize, segment: Segment, tolerance: f64) -> Option<usize> {
    let mut best = None;
    let mut best_distance = tolerance.max(f64::MIN_POSITIVE);
    for step in 1..contour.len() {
        let index = (from + step) % contour.len();
        if contour[index] == segment.to {
            break;
        }
        let distance = segment.distance_mm(crate::world::walls::point(contour[index]));
        // The first of equals, so that a stretch is split where it begins to bend.
        if distance > best_distance || best.is_none() && distance >= best_distance {
            best_distance = distance;
            best = Some(index);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bitmap(columns: usize, rows: usize, is_free: impl Fn(f64, f64) -> bool) -> Bitmap {
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (column as f64 + 0.5, row as f64 + 0.6)));
        Bitmap::new(columns, cells.map(|(x, y)| is_free(x, y)).collect())
    }

    #[test]
    fn a_room_keeps_its_four_corners() {
        let room = bitmap(12, 9, |x, y| (1.0..11.0).contains(&x) && (1.0..8.0).contains(&y));
        let contours = trace(&room, 0.6);
        assert_eq!(contours.len(), 1);
        let mut corners = contours[0].clone();
        corners.sort_unstable();
        assert_eq!(corners, [(2, 2), (2, 16), (22, 2), (22, 16)]);
    }

    #[test]
    fn a_slanted_room_has_few_corners_at_any_angle() {
        for degrees in (0..90).step_by(5) {
            let (sine, cosine) = f64::from(degrees).to_radians().sin_cos();
            let slanted = bitmap(220, 220, |x, y| {
                let (x, y) = (x - 110.0, y - 110.0);
                (x * cosine + y * sine).abs() < 80.0 && (y * cosine - x * sine).abs() < 40.0
            });
            let contours = trace(&slanted, 0.6);
            assert_eq!(contours.len(), 1);
            assert!((4..=12).contains(&contours[0].len()), "{degrees} degrees: {:?}", contours[0]);
        }
    }

    #[test]
    fn a_pillar_is_a_contour_of_its_own_and_a_niche_of_one_cell_stays() {
        let hall = bitmap(40, 40, |x, y| {
            let in_hall = (5.0..35.0).contains(&x) && (5.0..35.0).contains(&y);
            let in_niche = (35.0..36.0).contains(&x) && (15.0..20.0).contains(&y);
            (in_hall || in_niche) && !((18.0..22.0).contains(&x) && (18.0..22.0).contains(&y))
        });
        let mut contours = trace(&hall, 0.6);
        contours.sort_by_key(Vec::len);
        assert_eq!(contours.iter().map(Vec::len).collect::<Vec<_>>(), [4, 8]);
    }

    #[test]
    fn the_borders_of_a_thin_slanted_wall_do_not_cross() {
        let thin = bitmap(120, 120, |x, y| {
            let off = (y - 10.0 - 0.37 * x).floor();
            (2.0..118.0).contains(&x) && (2.0..118.0).contains(&y) && off != 0.0
        });
        let contours = trace(&thin, 0.6);
        let segments: Vec<Segment> = contours
            .iter()
            .flat_map(|contour| {
                let next = contour.iter().cycle().skip(1);
                contour.iter().zip(next).map(|(from, to)| Segment { from: *from, to: *to }).collect::<Vec<_>>()
            })
            .collect();
        assert!(rings::crossings(&segments).is_empty());
    }
}
