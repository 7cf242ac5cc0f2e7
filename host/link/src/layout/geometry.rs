//! Points and segments of the plane.

use std::ops::{Add, Mul, Sub};

use super::Point;

impl Point {
    /// The position of a vertex that has none. All comparisons with NaN are false, so it is near nothing and its edges
    /// cross nothing.
    pub(super) const UNKNOWN: Self = Self { x: f64::NAN, y: f64::NAN };

    pub(super) const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The unit vector of a direction, counter-clockwise from the right.
    pub(super) fn towards(angle: f64) -> Self {
        Self::new(angle.cos(), angle.sin())
    }

    pub(super) const fn is_known(self) -> bool {
        !self.x.is_nan()
    }

    pub(super) fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// Cross product; positive if `other` lies to the left.
    pub(super) fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    pub(super) fn squared(self) -> f64 {
        self.dot(self)
    }

    pub(super) fn length(self) -> f64 {
        self.squared().sqrt()
    }
}

impl Add for Point {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y)
    }
}

impl Sub for Point {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y)
    }
}

impl Mul<f64> for Point {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self::new(self.x * factor, self.y * factor)
    }
}

/// Mean of points; the origin if there are none.
pub(super) fn mean(points: impl Iterator<Item = Point>) -> Point {
    let (sum, count) = points.fold((Point::default(), 0), |(sum, count), point| (sum + point, count + 1));
    if count == 0 { sum } else { sum * (1.0 / f64::from(count)) }
}

/// Whether two segments without a common end cross.
pub(super) fn cross(first: (Point, Point), second: (Point, Point)) -> bool {
    // Rounding errors make the orientations of collinear segments unreliable; this check decides for them.
    let beside = |of: fn(Point) -> f64, one: (Point, Point), other: (Point, Point)| {
        of(one.0).max(of(one.1)) < of(other.0).min(of(other.1))
    };
    let apart = |of| beside(of, first, second) || beside(of, second, first);
    let parts = |(a, b): (Point, Point), (c, d): (Point, Point)| (b - a).cross(c - a) * (b - a).cross(d - a) < 0.0;
    !apart(|point| point.x) && !apart(|point| point.y) && parts(first, second) && parts(second, first)
}

/// Squared distance of a point from a segment.
pub(super) fn squared_distance(point: Point, (a, b): (Point, Point)) -> f64 {
    let along = b - a;
    let share = ((point - a).dot(along) / along.squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (a + along * share - point).squared()
}

/// Quick test whether a point may be within a distance of a segment; conservative at the corners.
pub(super) fn may_be_near(point: Point, (a, b): (Point, Point), distance: f64) -> bool {
    let spans = |one: f64, other: f64, at: f64| at > one.min(other) - distance && at < one.max(other) + distance;
    spans(a.x, b.x, point.x) && spans(a.y, b.y, point.y)
}

/// The smallest and the largest coordinates of the known points; `None` if there are none.
pub(super) fn bounds(points: &[Point]) -> Option<(Point, Point)> {
    let known = points.iter().copied().filter(|point| point.is_known());
    known.fold(None, |bounds, point| {
        let (low, high) = bounds.unwrap_or((point, point));
        let low = Point::new(low.x.min(point.x), low.y.min(point.y));
        Some((low, Point::new(high.x.max(point.x), high.y.max(point.y))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const O: Point = Point::new(0.0, 0.0);

    #[test]
    fn crossing_segments_are_distinguished_from_disjoint_ones() {
        let segment = |a: (f64, f64), b: (f64, f64)| (Point::new(a.0, a.1), Point::new(b.0, b.1));
        let diagonal = segment((0.0, 0.0), (2.0, 2.0));
        assert!(cross(diagonal, segment((0.0, 2.0), (2.0, 0.0))));
        assert!(!cross(diagonal, segment((0.0, 2.0), (0.9, 1.1))));
        assert!(!cross(diagonal, segment((3.0, 0.0), (3.0, 9.0))));
        assert!(!cross(segment((0.1, 0.3), (0.7, 2.1)), segment((1.1, 3.3), (1.9, 5.7))));
        assert!(!cross(diagonal, (O, Point::UNKNOWN)));
    }

    #[test]
    fn the_distance_to_a_segment_is_that_to_its_nearest_point() {
        let segment = (O, Point::new(2.0, 0.0));
        assert_eq!(squared_distance(Point::new(1.0, 3.0), segment), 9.0);
        assert_eq!(squared_distance(Point::new(4.0, 0.0), segment), 4.0);
        assert_eq!(squared_distance(Point::new(0.0, 1.0), (O, O)), 1.0);
    }

    #[test]
    fn a_vertex_without_a_position_does_not_affect_the_bounds() {
        assert_eq!(bounds(&[Point::UNKNOWN]), None);
        assert_eq!(bounds(&[Point::new(1.0, 2.0), Point::UNKNOWN]), Some((Point::new(1.0, 2.0), Point::new(1.0, 2.0))));
    }
}
