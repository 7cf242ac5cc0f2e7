//! Closed rings of wall: where they cross, what they enclose, and the border of several that overlap.

use std::collections::{BTreeMap, BTreeSet};

use crate::world::walls::{Segment, Vertex, point};

/// Rounds after which segments that still cross are left so.
const ROUNDS: usize = 12;

/// What is free or wall beside a border is looked up this far from it, in millimetres; a wall twice as thick is the thinnest.
const BESIDE_MM: f64 = 2.0;

/// A shape: its rings, by the even-odd rule, and whether it is free space or wall.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) rings: Vec<Vec<Vertex>>,
    pub(super) is_free: bool,
}

impl Shape {
    fn segments(&self) -> impl Iterator<Item = Segment> {
        self.rings.iter().flat_map(|ring| {
            let next = ring.iter().cycle().skip(1);
            ring.iter().zip(next).map(|(from, to)| Segment { from: *from, to: *to })
        })
    }

    /// Where a horizontal line crosses the shape's border, in ascending order.
    fn crossings_at(&self, y: f64) -> Vec<f64> {
        let mut crossings: Vec<f64> = self
            .segments()
            .map(|segment| (point(segment.from), point(segment.to)))
            .filter(|(from, to)| (from.y_mm <= y) != (to.y_mm <= y))
            .map(|(from, to)| from.x_mm + (to.x_mm - from.x_mm) * (y - from.y_mm) / (to.y_mm - from.y_mm))
            .collect();
        crossings.sort_by(f64::total_cmp);
        crossings
    }
}

/// Which points of a horizontal line are free: the last shape that covers a point decides, and where there is none is wall.
pub(super) fn row_free(shapes: &[Shape], y: f64, xs: &[f64]) -> Vec<bool> {
    let mut free = vec![false; xs.len()];
    for shape in shapes {
        let crossings = shape.crossings_at(y);
        for (free, x) in free.iter_mut().zip(xs) {
            if crossings.partition_point(|crossing| crossing <= x) % 2 == 1 {
                *free = shape.is_free;
            }
        }
    }
    free
}

/// The segments of a shape's rings.
pub(super) fn outlines(shape: &Shape) -> Vec<Segment> {
    shape.segments().filter(|segment| segment.from != segment.to).collect()
}

/// The border between free space and wall, free space on the left, each piece as long as it is straight.
pub(super) fn border(shapes: &[Shape]) -> Vec<Segment> {
    let pieces = split(shapes.iter().flat_map(Shape::segments).collect());
    let mut border = Vec::new();
    for piece in pieces {
        let (from, to) = (point(piece.from), point(piece.to));
        let middle = from.towards(to, 0.5);
        let length_mm = from.distance_mm(to);
        // A point on each side, farther than a corner is moved to whole millimetres.
        let (x, y) = (BESIDE_MM * (from.y_mm - to.y_mm) / length_mm, BESIDE_MM * (to.x_mm - from.x_mm) / length_mm);
        let is_free = |side: f64| row_free(shapes, middle.y_mm + side * y, &[middle.x_mm + side * x])[0];
        match (is_free(1.0), is_free(-1.0)) {
            (true, false) => border.push(piece),
            (false, true) => border.push(Segment { from: piece.to, to: piece.from }),
            _ => {}
        }
    }
    joined(border)
}

/// The segments that cross another, overlap it, or have a corner of another between their ends; by index, in ascending order.
pub(super) fn crossings(segments: &[Segment]) -> Vec<usize> {
    let mut found = BTreeSet::new();
    for (one, other) in close_pairs(segments) {
        let (first, second) = (segments[one], segments[other]);
        if !cuts(first, second).is_empty() {
            found.insert(one);
        }
        if !cuts(second, first).is_empty() {
            found.insert(other);
        }
    }
    found.into_iter().collect()
}

/// Cuts segments where they cross, so that they share nothing but ends. Corners stay whole millimetres.
fn split(segments: Vec<Segment>) -> BTreeSet<Segment> {
    let undirected =
        |segment: Segment| Segment { from: segment.from.min(segment.to), to: segment.from.max(segment.to) };
    let mut pieces: BTreeSet<Segment> =
        segments.into_iter().filter(|segment| segment.from != segment.to).map(undirected).collect();
    for _ in 0..ROUNDS {
        let list: Vec<Segment> = pieces.iter().copied().collect();
        let mut cuts_of: BTreeMap<usize, BTreeSet<Vertex>> = BTreeMap::new();
        for (one, other) in close_pairs(&list) {
            for (index, by) in [(one, other), (other, one)] {
                for cut in cuts(list[index], list[by]) {
                    cuts_of.entry(index).or_default().insert(cut);
                }
            }
        }
        if cuts_of.is_empty() {
            break;
        }
        for (index, cuts) in cuts_of {
            let whole = list[index];
            pieces.remove(&whole);
            let mut corners: Vec<Vertex> = cuts.into_iter().chain([whole.from, whole.to]).collect();
            let along = |corner: &Vertex| dot(whole, *corner);
            corners.sort_by_key(|corner| (along(corner), *corner));
            let pairs = corners.windows(2).map(|ends| undirected(Segment { from: ends[0], to: ends[1] }));
            pieces.extend(pairs.filter(|piece| piece.from != piece.to));
        }
    }
    pieces
}

/// Pairs of segments whose boxes touch.
fn close_pairs(segments: &[Segment]) -> Vec<(usize, usize)> {
    let low_x = |index: usize| segments[index].from.0.min(segments[index].to.0);
    let high_x = |index: usize| segments[index].from.0.max(segments[index].to.0);
    let span_y = |index: usize| {
        let (one, other) = (segments[index].from.1, segments[index].to.1);
        (one.min(other), one.max(other))
    };
    let mut order: Vec<usize> = (0..segments.len()).collect();
    order.sort_by_key(|index| (low_x(*index), *index));
    let mut pairs = Vec::new();
    // The segments that still reach the sweep line.
    let mut open: Vec<usize> = Vec::new();
    for &index in &order {
        open.retain(|other| high_x(*other) + 1 >= low_x(index));
        let (low, high) = span_y(index);
        pairs.extend(open.iter().copied().filter_map(|other| {
            let (other_low, other_high) = span_y(other);
            (other_low <= high + 1 && low <= other_high + 1).then_some((other, index))
        }));
        open.push(index);
    }
    pairs
}

/// Where a segment is cut by another: at the other's ends that lie on it, or where the two cross, in whole units.
fn cuts(segment: Segment, by: Segment) -> Vec<Vertex> {
    let on_it = |end: Vertex| end != segment.from && end != segment.to && lies_on(segment, end);
    let mut cuts: Vec<Vertex> = [by.from, by.to].into_iter().filter(|end| on_it(*end)).collect();
    let sides = |line: Segment, ends: [Vertex; 2]| ends.map(|end| cross(line, end).signum());
    let of_by = sides(segment, [by.from, by.to]);
    let of_segment = sides(by, [segment.from, segment.to]);
    if cuts.is_empty() && of_by[0] * of_by[1] < 0 && of_segment[0] * of_segment[1] < 0 {
        let (from_side, to_side) = (cross(by, segment.from) as f64, cross(by, segment.to) as f64);
        let at = point(segment.from).towards(point(segment.to), from_side / (from_side - to_side));
        let cut = (at.x_mm.round() as i32, at.y_mm.round() as i32);
        if cut != segment.from && cut != segment.to {
            cuts.push(cut);
        }
    }
    cuts
}

/// Whether a corner lies between a segment's ends, to half a unit.
fn lies_on(segment: Segment, corner: Vertex) -> bool {
    let along = dot(segment, corner);
    let length2 = dot(segment, segment.to);
    along > 0 && along < length2 && 4 * i128::from(cross(segment, corner)).pow(2) <= i128::from(length2)
}

/// Twice the area of the triangle of a segment and a corner; positive on the segment's left.
fn cross(segment: Segment, corner: Vertex) -> i64 {
    let [x, y, to_x, to_y] = spans(segment, corner);
    to_x * y - to_y * x
}

/// How far along a segment a corner lies, in units of the segment's length.
fn dot(segment: Segment, corner: Vertex) -> i64 {
    let [x, y, to_x, to_y] = spans(segment, corner);
    to_x * x + to_y * y
}

fn spans(segment: Segment, corner: Vertex) -> [i64; 4] {
    let Segment { from, to } = segment;
    [corner.0 - from.0, corner.1 - from.1, to.0 - from.0, to.1 - from.1].map(i64::from)
}

/// Joins segments that lead straight on and meet no other.
fn joined(border: Vec<Segment>) -> Vec<Segment> {
    let mut arriving: BTreeMap<Vertex, Vec<usize>> = BTreeMap::new();
    let mut leaving: BTreeMap<Vertex, Vec<usize>> = BTreeMap::new();
    for (index, segment) in border.iter().enumerate() {
        arriving.entry(segment.to).or_default().push(index);
        leaving.entry(segment.from).or_default().push(index);
    }
    let mut joined: Vec<Option<Segment>> = border.iter().copied().map(Some).collect();
    // Which joined segment a piece is part of now.
    let mut part_of: Vec<usize> = (0..border.len()).collect();
    for (corner, before) in &arriving {
        let ([before], Some([after])) = (&before[..], leaving.get(corner).map(|after| &after[..])) else { continue };
        let (first, second) = (root(&part_of, *before), root(&part_of, *after));
        let (Some(one), Some(other)) = (joined[first], joined[second]) else { continue };
        let whole = Segment { from: one.from, to: other.to };
        let is_straight = cross(border[*before], border[*after].to) == 0 && dot(border[*before], border[*after].to) > 0;
        if first != second && is_straight && whole.from != whole.to {
            joined[first] = Some(whole);
            joined[second] = None;
            part_of[second] = first;
        }
    }
    joined.into_iter().flatten().collect()
}

fn root(part_of: &[usize], mut index: usize) -> usize {
    while part_of[index] != index {
        index = part_of[index];
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(x: i32, y: i32, width: i32, height: i32, is_free: bool) -> Shape {
        Shape { rings: vec![vec![(x, y), (x + width, y), (x + width, y + height), (x, y + height)]], is_free }
    }

    #[test]
    fn two_rooms_that_overlap_are_one() {
        let shapes = [rectangle(0, 0, 4000, 2000, true), rectangle(3000, 500, 4000, 1000, true)];
        let border = border(&shapes);
        assert_eq!(border.len(), 8, "{border:?}");
        assert!(crossings(&border).is_empty());
    }

    #[test]
    fn a_wall_over_a_room_divides_it_and_a_door_over_the_wall_opens_it() {
        let mut shapes = vec![rectangle(0, 0, 4000, 2000, true), rectangle(1900, -100, 100, 2200, false)];
        assert_eq!(border(&shapes).len(), 8);
        shapes.push(rectangle(1800, 500, 300, 900, true));
        assert_eq!(border(&shapes).len(), 12);
    }

    #[test]
    fn a_slanted_wall_is_cut_where_it_crosses() {
        let slanted =
            Shape { rings: vec![vec![(-100, 900), (5000, 1800), (5000, 1900), (-100, 1000)]], is_free: false };
        let border = border(&[rectangle(0, 0, 4000, 3000, true), slanted]);
        assert_eq!(border.len(), 8, "{border:?}");
        for segment in &border {
            let middle = point(segment.from).towards(point(segment.to), 0.5);
            assert!((0.0..=4000.0).contains(&middle.x_mm) && (0.0..=3000.0).contains(&middle.y_mm));
        }
    }

    #[test]
    fn a_wall_that_leads_straight_on_is_one_piece() {
        let shapes = [rectangle(0, 0, 2000, 1000, true), rectangle(2000, 0, 2000, 1000, true)];
        assert_eq!(border(&shapes).len(), 4);
    }
}
