//! A grid of square buckets over a plan, which finds what lies near a point.

use super::Point;

/// Side of a bucket, in millimetres.
const BUCKET_MM: std::ops::RangeInclusive<f64> = 250.0..=2000.0;

/// Square buckets over the plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub(super) bucket_mm: f64,
    pub(super) columns: i32,
    pub(super) rows: i32,
}

/// What lies in each bucket, one bucket after the other.
#[derive(Debug)]
pub(super) struct Buckets<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl Grid {
    /// Buckets of about one segment each.
    pub(super) fn new(width_mm: f64, height_mm: f64, segments: usize) -> Self {
        let bucket_mm = (width_mm * height_mm / segments.max(1) as f64).sqrt();
        let bucket_mm = bucket_mm.clamp(*BUCKET_MM.start(), *BUCKET_MM.end()).ceil();
        let count = |length_mm: f64| (length_mm / bucket_mm).floor() as i32 + 1;
        Self { bucket_mm, columns: count(width_mm), rows: count(height_mm) }
    }

    /// The column of an x, or the row of a y.
    pub(super) fn column(&self, x_mm: f64) -> i32 {
        (x_mm / self.bucket_mm).floor() as i32
    }

    /// The number of a bucket, if it is one.
    pub(super) fn index(&self, column: i32, row: i32) -> Option<usize> {
        let inside = (0..self.columns).contains(&column) && (0..self.rows).contains(&row);
        inside.then(|| row as usize * self.columns as usize + column as usize)
    }

    /// The buckets that touch a square around a point.
    pub(super) fn around(self, centre: Point, reach_mm: f64) -> impl Iterator<Item = usize> {
        let span = |at_mm: f64, count: i32| {
            self.column(at_mm - reach_mm).clamp(0, count - 1)..=self.column(at_mm + reach_mm).clamp(0, count - 1)
        };
        let columns = span(centre.x_mm, self.columns);
        span(centre.y_mm, self.rows).flat_map(move |row| {
            columns.clone().map(move |column| row as usize * self.columns as usize + column as usize)
        })
    }

    /// The buckets that a segment touches, and maybe some beside it.
    pub(super) fn along(self, from: Point, to: Point) -> Vec<usize> {
        // One bucket row at a time, so that a long slanted wall does not fill a rectangle of buckets.
        let (low, high) = if from.y_mm <= to.y_mm { (from, to) } else { (to, from) };
        let rows = self.column(low.y_mm - 1.0).max(0)..=self.column(high.y_mm + 1.0).min(self.rows - 1);
        let mut found = Vec::new();
        for row in rows {
            let at = |y_mm: f64| match high.y_mm > low.y_mm {
                true => low.towards(high, ((y_mm - low.y_mm) / (high.y_mm - low.y_mm)).clamp(0.0, 1.0)).x_mm,
                false => low.x_mm,
            };
            let (bottom, top) = (f64::from(row) * self.bucket_mm, f64::from(row + 1) * self.bucket_mm);
            let (one, other) = match high.y_mm > low.y_mm {
                true => (at(bottom - 1.0), at(top + 1.0)),
                false => (low.x_mm, high.x_mm),
            };
            let columns =
                self.column(one.min(other) - 1.0).max(0)..=self.column(one.max(other) + 1.0).min(self.columns - 1);
            found.extend(columns.filter_map(|column| self.index(column, row)));
        }
        found
    }
}

impl<T: Copy> Buckets<T> {
    /// Sorts items into buckets. `buckets_of` has the numbers of the buckets of each item.
    pub(super) fn new(buckets: usize, items: &[T], buckets_of: &[Vec<usize>]) -> Self {
        let mut sorted: Vec<(usize, usize)> = Vec::new();
        for (item, buckets) in buckets_of.iter().enumerate() {
            sorted.extend(buckets.iter().map(|bucket| (*bucket, item)));
        }
        sorted.sort_unstable();
        let starts = (0..=buckets).map(|bucket| sorted.partition_point(|(of, _)| *of < bucket) as u32).collect();
        Self { starts, items: sorted.into_iter().map(|(_, item)| items[item]).collect() }
    }

    /// The items of a bucket.
    pub(super) fn items(&self, bucket: usize) -> &[T] {
        &self.items[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }
}
