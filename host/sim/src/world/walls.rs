//! The walls of a floor plan as segments at any angle, with a grid that finds the segments near a point or along a ray.

use std::collections::BTreeMap;

use super::Point;
use super::grid::{Buckets, Grid};

/// Two walls that meet at a smaller angle are one smooth wall; at a larger angle they meet in a corner that scatters sound.
const CORNER_RAD: f64 = 30.0 * std::f64::consts::PI / 180.0;
/// The point of a bucket that decides between free space and wall, as shares of its side: no wall with integer coordinates runs through it.
const PROBE: (f64, f64) = (0.463_712_9, 0.531_173_7);

/// A corner of a wall, in whole millimetres.
pub(super) type Vertex = (i32, i32);

/// A straight piece of wall surface. Free space is on its left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Segment {
    pub(super) from: Vertex,
    pub(super) to: Vertex,
}

pub(super) fn point(vertex: Vertex) -> Point {
    Point::new(f64::from(vertex.0), f64::from(vertex.1))
}

impl Segment {
    /// The point of the segment that is nearest to another.
    pub(super) fn closest(&self, to: Point) -> Point {
        let (from, end) = (point(self.from), point(self.to));
        let (x_mm, y_mm) = (end.x_mm - from.x_mm, end.y_mm - from.y_mm);
        let length2 = x_mm * x_mm + y_mm * y_mm;
        let share = ((to.x_mm - from.x_mm) * x_mm + (to.y_mm - from.y_mm) * y_mm) / length2;
        if share <= 0.0 {
            from
        } else if share >= 1.0 {
            end
        } else {
            Point::new(from.x_mm + share * x_mm, from.y_mm + share * y_mm)
        }
    }

    /// The distance of a point to the segment, in millimetres.
    pub(super) fn distance_mm(&self, to: Point) -> f64 {
        self.closest(to).distance_mm(to)
    }

    /// The direction of the segment, in radians.
    fn direction(&self) -> f64 {
        point(self.from).direction_to(point(self.to))
    }
}

/// Where a ray meets a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// How far along the ray, in millimetres; infinite beyond the limit.
    pub(super) range_mm: f64,
    /// Cosine of the angle of incidence; 1 beyond the limit.
    pub(super) cosine_off_normal: f64,
}

impl Hit {
    const NONE: Self = Self { range_mm: f64::INFINITY, cosine_off_normal: 1.0 };
}

/// The walls of a plan. Memory: some 200 bytes a segment, and 13 bytes a bucket.
#[derive(Debug)]
pub(super) struct Walls {
    segments: Vec<Segment>,
    grid: Grid,
    segments_in: Buckets<Segment>,
    lines_in: Buckets<Line>,
    corners_in: Buckets<Point>,
    /// Whether the probe of each bucket is free.
    free: Vec<bool>,
}

impl Walls {
    /// The walls of a plan of this size. `row_free` says which points of a horizontal line are free: it gets the y of the line and the
    /// ascending x of the points, in millimetres.
    pub(super) fn new(
        segments: Vec<Segment>,
        (width_mm, height_mm): (f64, f64),
        mut row_free: impl FnMut(f64, &[f64]) -> Vec<bool>,
    ) -> Self {
        let grid = Grid::new(width_mm, height_mm, segments.len());
        let buckets = grid.columns as usize * grid.rows as usize;
        let along: Vec<_> = segments.iter().map(|segment| grid.along(point(segment.from), point(segment.to))).collect();
        let corners = corners(&segments);
        let beside: Vec<_> = corners.iter().map(|corner| grid.around(*corner, 0.0).collect()).collect();
        let probe = |index: i32, share: f64| (f64::from(index) + share) * grid.bucket_mm;
        let probes: Vec<f64> = (0..grid.columns).map(|column| probe(column, PROBE.0)).collect();
        let free = (0..grid.rows).flat_map(|row| row_free(probe(row, PROBE.1), &probes)).collect();
        let segments_in = Buckets::new(buckets, &segments, &along);
        let lines: Vec<Line> = segments.iter().copied().map(Line::from).collect();
        let lines_in = Buckets::new(buckets, &lines, &along);
        let corners_in = Buckets::new(buckets, &corners, &beside);
        Self { segments, grid, segments_in, lines_in, corners_in, free }
    }

    /// All pieces of wall surface.
    pub(super) fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The surfaces as closed rings of corners, free space on the left.
    pub(super) fn rings(&self) -> Vec<Vec<Point>> {
        let mut leaving: BTreeMap<Vertex, Vec<Vertex>> = BTreeMap::new();
        self.segments.iter().for_each(|segment| leaving.entry(segment.from).or_default().push(segment.to));
        let mut rings = Vec::new();
        while let Some((&start, _)) = leaving.first_key_value() {
            let mut ring = Vec::new();
            let mut at = start;
            while let Some(ends) = leaving.get_mut(&at) {
                ring.push(point(at));
                let next = ends.pop();
                if ends.is_empty() {
                    leaving.remove(&at);
                }
                match next {
                    Some(next) => at = next,
                    None => break,
                }
            }
            rings.push(ring);
        }
        rings
    }

    /// The corners within a distance of a point, and maybe some beyond it.
    pub(super) fn corners_near(&self, centre: Point, reach_mm: f64) -> impl Iterator<Item = Point> {
        let buckets = self.grid.around(centre, reach_mm);
        buckets.flat_map(|bucket| self.corners_in.items(bucket)).copied()
    }

    /// The segments within a distance of a point, and maybe some beyond it; some of them more than once.
    pub(super) fn segments_near(&self, centre: Point, reach_mm: f64) -> impl Iterator<Item = &Segment> {
        let buckets = self.grid.around(centre, reach_mm);
        buckets.flat_map(|bucket| self.segments_in.items(bucket))
    }

    /// The distance of a point to the nearest wall, in millimetres; infinite without walls.
    pub(super) fn clearance_mm(&self, at: Point) -> f64 {
        let extent_mm = f64::from(self.grid.columns.max(self.grid.rows)) * self.grid.bucket_mm;
        let mut reach_mm = self.grid.bucket_mm / 2.0;
        loop {
            let distances = self.segments_near(at, reach_mm).map(|segment| segment.distance_mm(at));
            let nearest_mm = distances.fold(f64::INFINITY, f64::min);
            if nearest_mm <= reach_mm || reach_mm > 2.0 * extent_mm {
                return nearest_mm;
            }
            // What was found bounds the search, unless it is far.
            reach_mm = if nearest_mm < 4.0 * reach_mm { nearest_mm } else { 2.0 * reach_mm };
        }
    }

    /// Whether a disc around a point is free of walls.
    pub(super) fn fits(&self, centre: Point, radius_mm: f64) -> bool {
        self.is_free(centre)
            && self.segments_near(centre, radius_mm).all(|segment| segment.distance_mm(centre) >= radius_mm)
    }

    /// Whether a point is free; everything outside the plan is wall.
    pub(super) fn is_free(&self, at: Point) -> bool {
        let (column, row) = (self.grid.column(at.x_mm), self.grid.column(at.y_mm));
        let Some(bucket) = self.grid.index(column, row) else { return false };
        let bucket_mm = self.grid.bucket_mm;
        let probe = Point::new((f64::from(column) + PROBE.0) * bucket_mm, (f64::from(row) + PROBE.1) * bucket_mm);
        let crossed = self.segments_in.items(bucket).iter().filter(|segment| {
            let (from, to) = (point(segment.from), point(segment.to));
            let sides = [is_left(at, probe, from), is_left(at, probe, to)];
            sides[0] != sides[1] && is_left(from, to, at) != is_left(from, to, probe)
        });
        self.free[bucket] ^ (crossed.count() % 2 == 1)
    }

    /// Whether nothing stands between two points of free space.
    pub(super) fn is_in_sight(&self, from: Point, to: Point) -> bool {
        let range_mm = from.distance_mm(to);
        if range_mm <= 1.0 {
            return true;
        }
        let direction = ((to.x_mm - from.x_mm) / range_mm, (to.y_mm - from.y_mm) / range_mm);
        self.cast_along(from, direction, range_mm).range_mm >= range_mm - 1.0
    }

    /// Follows a ray to the first wall.
    pub(super) fn cast(&self, from: Point, direction_rad: f64, limit_mm: f64) -> Hit {
        let (sine, cosine) = direction_rad.sin_cos();
        self.cast_along(from, (cosine, sine), limit_mm)
    }

    /// The same with the cosine and the sine of the direction.
    fn cast_along(&self, from: Point, (cosine, sine): (f64, f64), limit_mm: f64) -> Hit {
        let bucket_mm = self.grid.bucket_mm;
        let (mut column, mut row) = (self.grid.column(from.x_mm), self.grid.column(from.y_mm));
        // For each axis: the step in buckets, the way between two grid lines, the way to the first one.
        let axis = |bucket: i32, start_mm: f64, slope: f64| {
            let line = if slope > 0.0 { bucket + 1 } else { bucket };
            let to_line = (f64::from(line) * bucket_mm - start_mm) / slope;
            (
                if slope > 0.0 { 1 } else { -1 },
                (bucket_mm / slope).abs(),
                if slope == 0.0 { f64::INFINITY } else { to_line },
            )
        };
        let (step_x, between_x, mut to_x) = axis(column, from.x_mm, cosine);
        let (step_y, between_y, mut to_y) = axis(row, from.y_mm, sine);
        let mut range_mm = limit_mm;
        let mut met = None;
        while let Some(bucket) = self.grid.index(column, row) {
            for line in self.lines_in.items(bucket) {
                if let Some(nearer_mm) = line.meet(from, (cosine, sine), range_mm) {
                    range_mm = nearer_mm;
                    met = Some(line);
                }
            }
            let way_mm = to_x.min(to_y);
            // A wall on the grid line itself may lie in the next bucket only.
            if range_mm < way_mm {
                break;
            }
            if to_x < to_y {
                column += step_x;
                to_x += between_x;
            } else {
                row += step_y;
                to_y += between_y;
            }
        }
        met.map_or(Hit::NONE, |line| {
            let cosine_off_normal = line.across((cosine, sine)).abs() / line.x_mm.hypot(line.y_mm);
            Hit { range_mm, cosine_off_normal: cosine_off_normal.min(1.0) }
        })
    }
}

/// A segment as rays need it: where it begins, and the way to its end.
#[derive(Clone, Copy, Debug)]
struct Line {
    from: Point,
    x_mm: f64,
    y_mm: f64,
}

impl From<Segment> for Line {
    fn from(segment: Segment) -> Self {
        let (from, to) = (point(segment.from), point(segment.to));
        Self { from, x_mm: to.x_mm - from.x_mm, y_mm: to.y_mm - from.y_mm }
    }
}

impl Line {
    /// Distance along a ray to the line, if it is at most the limit, in millimetres.
    fn meet(&self, start: Point, (cosine, sine): (f64, f64), limit_mm: f64) -> Option<f64> {
        let across = self.across((cosine, sine));
        let (aside_x, aside_y) = (self.from.x_mm - start.x_mm, self.from.y_mm - start.y_mm);
        // The fraction of the line at which the ray meets it, times `across`. Two walls that share a corner leave no gap there.
        let share = (aside_x * sine - aside_y * cosine) * across.signum();
        let (low, high) = (-1e-9 * across.abs(), (1.0 + 1e-9) * across.abs());
        if !(low <= share && share <= high) || across == 0.0 {
            return None;
        }
        let range_mm = (aside_x * self.y_mm - aside_y * self.x_mm) / across;
        (range_mm >= 0.0 && range_mm <= limit_mm).then_some(range_mm)
    }

    /// Length of the line across a direction, in millimetres.
    fn across(&self, (cosine, sine): (f64, f64)) -> f64 {
        cosine * self.y_mm - sine * self.x_mm
    }
}

/// Whether a point is on the left of a line, or on it.
fn is_left(from: Point, to: Point, at: Point) -> bool {
    (to.x_mm - from.x_mm) * (at.y_mm - from.y_mm) - (to.y_mm - from.y_mm) * (at.x_mm - from.x_mm) >= 0.0
}

/// The corners of walls: where a wall turns by more than [`CORNER_RAD`], or where not just two segments meet.
fn corners(segments: &[Segment]) -> Vec<Point> {
    let mut at: BTreeMap<Vertex, (Vec<f64>, Vec<f64>)> = BTreeMap::new();
    for segment in segments {
        at.entry(segment.from).or_default().1.push(segment.direction());
        at.entry(segment.to).or_default().0.push(segment.direction());
    }
    let turns = |before: &[f64], after: &[f64]| match (before, after) {
        ([before], [after]) => super::ray_casting::wrapped(after - before).abs() > CORNER_RAD,
        _ => true,
    };
    at.into_iter().filter(|(_, (before, after))| turns(before, after)).map(|(vertex, _)| point(vertex)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(vertices: &[Vertex]) -> Vec<Segment> {
        let next = vertices.iter().cycle().skip(1);
        vertices.iter().zip(next).map(|(from, to)| Segment { from: *from, to: *to }).collect()
    }

    /// A square of 4 m, standing on a corner.
    fn diamond() -> Walls {
        let inside = |x: f64, y: f64| (x - 4000.0).abs() + (y - 4000.0).abs() < 3000.0;
        let segments = ring(&[(4000, 1000), (7000, 4000), (4000, 7000), (1000, 4000)]);
        Walls::new(segments, (8000.0, 8000.0), |y, xs| xs.iter().map(|x| inside(*x, y)).collect())
    }

    #[test]
    fn a_ray_meets_a_slanted_wall_where_it_stands() {
        let hit = diamond().cast(Point::new(4000.0, 4000.0), 0.0, 6000.0);
        assert!((hit.range_mm - 3000.0).abs() < 1e-9, "{hit:?}");
        let hit = diamond().cast(Point::new(4500.0, 4000.0), 90f64.to_radians(), 6000.0);
        assert!((hit.range_mm - 2500.0).abs() < 1e-9, "{hit:?}");
        assert!((hit.cosine_off_normal - 45f64.to_radians().cos()).abs() < 1e-9, "{hit:?}");
        assert_eq!(diamond().cast(Point::new(4000.0, 4000.0), 0.0, 2000.0).range_mm, f64::INFINITY);
    }

    #[test]
    fn free_space_ends_at_the_walls() {
        let walls = diamond();
        for (x, y) in [(1500, 3000), (3999, 1003), (6500, 3700), (6000, 6000), (100, 100), (4000, 4000)] {
            let expected = i32::abs(x - 4000) + i32::abs(y - 4000) < 3000;
            assert_eq!(walls.is_free(point((x, y))), expected, "{x}, {y}");
        }
        assert!(!walls.is_free(Point::new(-10.0, 4000.0)));
    }

    #[test]
    fn a_body_fits_where_no_wall_is_nearer_than_its_radius() {
        let walls = diamond();
        assert!((walls.clearance_mm(point((4000, 4000))) - 3000.0 / 2f64.sqrt()).abs() < 1e-9);
        assert!(walls.fits(point((4000, 4000)), 2100.0));
        assert!(!walls.fits(point((4000, 4000)), 2150.0));
        assert!(!walls.fits(point((500, 500)), 100.0));
    }

    #[test]
    fn a_smooth_wall_has_no_corners() {
        let corner = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            ((4000.0 + 3000.0 * cosine).round() as i32, (4000.0 + 3000.0 * sine).round() as i32)
        };
        let round: Vec<Vertex> = (0..24).map(|step| corner(15.0 * f64::from(step))).collect();
        assert!(corners(&ring(&round)).is_empty());
        let hexagon: Vec<Vertex> = (0..6).map(|step| corner(60.0 * f64::from(step))).collect();
        assert_eq!(corners(&ring(&hexagon)).len(), 6);
    }
}
