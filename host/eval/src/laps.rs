//! Compares the laps of a recording: which places of the first lap the later laps repeat, and the shape of the map.
//!
//! A robot that drives the same round repeatedly should detect the same places in every lap, and a right map is then a
//! cycle. [`Laps`] compares the later laps with the first one, and [`Shape`] classifies the map.

use std::cmp::Reverse;
use std::fmt;
use std::num::NonZeroU32;

use crate::graph::Graph;

/// A detected place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visit {
    /// The frame, counted from 0 at the start of the recording.
    pub frame: u32,
    /// The radius of the place.
    pub radius_mm: u16,
    /// The vertex of the place in the final map; `None` for a place that has left the filter's history.
    pub vertex: Option<usize>,
}

/// Largest difference between two detections of one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tolerance {
    /// In position, in frames.
    pub frames: u32,
    /// In radius, in millimetres.
    pub radius_mm: u16,
}

impl Tolerance {
    /// A tenth of the lap, because no lap takes exactly as long as another, and 150 mm, the place detector's default for
    /// obstacles that are equally close.
    pub const fn of(lap_frames: NonZeroU32) -> Self {
        Self { frames: lap_frames.get() / 10, radius_mm: 150 }
    }

    /// Offset between two detections in frames; `None` when they are not of one place.
    fn apart(self, expected: &Expected, visit: &Visit) -> Option<u32> {
        let frames = expected.frame.abs_diff(visit.frame);
        let alike = expected.first.radius_mm.abs_diff(visit.radius_mm) <= self.radius_mm;
        (frames <= self.frames && alike).then_some(frames)
    }
}

/// A place of the first lap, as expected in a later lap.
struct Expected {
    lap: usize,
    frame: u32,
    first: Visit,
}

/// One lap compared with the first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lap {
    /// The places of this lap, in order.
    pub visits: Vec<Visit>,
    /// The repeated places of the first lap, each with its detection in this lap. Near the ends of a lap, the detection
    /// may be among the visits of a neighbouring lap.
    pub again: Vec<(Visit, Visit)>,
    /// The places of the first lap that are not repeated. Those beyond the end of the recording are not among them.
    pub missing: Vec<Visit>,
    /// The places of this lap that are not in the first lap.
    pub extra: Vec<Visit>,
}

/// The places of a recording, lap by lap.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Laps {
    lap_frames: NonZeroU32,
    tolerance: Tolerance,
    laps: Vec<Lap>,
}

impl Laps {
    /// Compares the laps of a recording of this many frames. `visits` are in the order of their frames.
    ///
    /// The places of the first lap, expected one, two and more laps later, and the later places are matched in order
    /// and one to one: as many as the tolerance allows, and of those matchings one with the least sum of deviations.
    /// Time and memory are quadratic in the number of places.
    pub fn compare(visits: &[Visit], lap_frames: NonZeroU32, frames: u32, tolerance: Tolerance) -> Self {
        let lap_of = |visit: &Visit| (visit.frame / lap_frames) as usize;
        let count = visits.iter().map(|visit| lap_of(visit) + 1).max().unwrap_or(0);
        let mut laps = vec![Lap::default(); count.max(frames.div_ceil(lap_frames.get()) as usize)];
        for visit in visits {
            laps[lap_of(visit)].visits.push(*visit);
        }
        let (first, later) = visits.split_at(visits.partition_point(|visit| visit.frame < lap_frames.get()));
        let expected: Vec<Expected> = (1..laps.len())
            .flat_map(|lap| {
                let start = (lap as u32).saturating_mul(lap_frames.get());
                first.iter().map(move |&first| Expected { lap, frame: start.saturating_add(first.frame), first })
            })
            .filter(|expected| expected.frame < frames)
            .collect();
        let matched = matched(&expected, later, tolerance);
        for (expected, found) in expected.iter().zip(&matched) {
            let lap = &mut laps[expected.lap];
            match found {
                Some(found) => lap.again.push((expected.first, later[*found])),
                None => lap.missing.push(expected.first),
            }
        }
        for (number, visit) in later.iter().enumerate() {
            if !matched.contains(&Some(number)) {
                laps[lap_of(visit)].extra.push(*visit);
            }
        }
        Self { lap_frames, tolerance, laps }
    }

    /// The laps in order. The first is the reference for the others.
    pub fn laps(&self) -> &[Lap] {
        &self.laps
    }
}

/// The match of each expected place in the best matching in order.
fn matched(expected: &[Expected], visits: &[Visit], tolerance: Tolerance) -> Vec<Option<usize>> {
    // The best matching of each pair of suffixes of the two lists: most matches, then least deviation.
    let mut best = vec![vec![(0_usize, Reverse(0_u32)); visits.len() + 1]; expected.len() + 1];
    let with = |rest: (usize, Reverse<u32>), apart: u32| (rest.0 + 1, Reverse(rest.1.0 + apart));
    for (row, wanted) in expected.iter().enumerate().rev() {
        for (column, visit) in visits.iter().enumerate().rev() {
            let skipped = best[row + 1][column].max(best[row][column + 1]);
            let taken = tolerance.apart(wanted, visit).map(|apart| with(best[row + 1][column + 1], apart));
            best[row][column] = taken.map_or(skipped, |taken| taken.max(skipped));
        }
    }
    let mut matched = vec![None; expected.len()];
    let (mut row, mut column) = (0, 0);
    while row < expected.len() && column < visits.len() {
        let here = best[row][column];
        if here == best[row + 1][column] {
            row += 1;
        } else if here == best[row][column + 1] {
            column += 1;
        } else {
            matched[row] = Some(column);
            row += 1;
            column += 1;
        }
    }
    matched
}

impl fmt::Display for Laps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Tolerance { frames, radius_mm } = self.tolerance;
        writeln!(
            f,
            "laps of {} frames; a place comes again within {frames} frames of its position and {radius_mm} mm of its radius",
            self.lap_frames
        )?;
        let mut counts = [0; 3];
        for (number, lap) in self.laps.iter().enumerate() {
            let start = i64::from(self.lap_frames.get()) * number as i64;
            let position = |visit: &Visit| i64::from(visit.frame) - start;
            let visits = lap
                .visits
                .iter()
                .map(|visit| format!("{} ({} mm, vertex {})", position(visit), visit.radius_mm, Named(visit.vertex)));
            writeln!(f, "lap {}: {}", number + 1, listed(visits))?;
            if number == 0 {
                continue;
            }
            let (again, expected) = (lap.again.len(), lap.again.len() + lap.missing.len());
            let visits = lap.again.iter().map(|(first, visit)| {
                let vertex = if is_same(first, visit) {
                    format!("vertex {} again", Named(visit.vertex))
                } else {
                    format!("vertex {} instead of {}", Named(visit.vertex), Named(first.vertex))
                };
                format!("{} at {} ({vertex})", first.frame, position(visit))
            });
            let number = number + 1;
            writeln!(f, "  {again} of {expected} places of lap 1 come again in lap {number}: {}", listed(visits))?;
            let missing = lap.missing.iter().map(|visit| visit.frame.to_string());
            let extra = lap.extra.iter().map(|visit| position(visit).to_string());
            writeln!(f, "  missing: {}; extra: {}", listed(missing), listed(extra))?;
            let same = lap.again.iter().filter(|(first, visit)| is_same(first, visit)).count();
            for (count, more) in counts.iter_mut().zip([again, expected, same]) {
                *count += more;
            }
        }
        let [again, expected, same] = counts;
        write!(f, "in all, places of lap 1 come again {again} of {expected} times, {same} of them as the same vertex")
    }
}

/// Whether both have the same vertex in the map.
fn is_same(first: &Visit, again: &Visit) -> bool {
    first.vertex.is_some() && first.vertex == again.vertex
}

fn listed(items: impl Iterator<Item = String>) -> String {
    let items: Vec<String> = items.collect();
    if items.is_empty() { "none".to_owned() } else { items.join(", ") }
}

/// A vertex, or a dash for a place that has left the filter's history.
pub struct Named(pub Option<usize>);

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(vertex) => write!(f, "{vertex}"),
            None => f.write_str("-"),
        }
    }
}

/// The shape of a map as a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Three or more vertices in a ring: connected, and every vertex with exactly two neighbours.
    Cycle,
    /// Connected and acyclic, and no vertex with more than two neighbours; a single vertex is a chain.
    Chain,
    /// Connected and acyclic, with a fork.
    Tree,
    /// Connected, with this many independent cycles, self-loops included, and not a ring.
    Circles(usize),
    /// Not connected.
    Apart,
    /// Without a vertex.
    Empty,
}

impl Shape {
    /// Classifies a graph.
    pub fn of(graph: &Graph) -> Self {
        let (vertices, edges) = (graph.vertex_count(), graph.edges().len());
        if vertices == 0 {
            return Self::Empty;
        }
        if !graph.is_connected() {
            return Self::Apart;
        }
        let loops = graph.edges().iter().any(|(a, b)| a == b);
        let neighbours = graph.neighbours();
        let at_most_two = neighbours.iter().all(|neighbours| neighbours.len() <= 2);
        // Connected, so there are at least as many edges as there are vertices but one.
        match (edges + 1).saturating_sub(vertices) {
            0 if at_most_two => Self::Chain,
            0 => Self::Tree,
            // One cycle and no vertex off it.
            1 if at_most_two && !loops => Self::Cycle,
            circles => Self::Circles(circles),
        }
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cycle => f.write_str("a cycle"),
            Self::Chain => f.write_str("no cycle: a chain"),
            Self::Tree => f.write_str("no cycle: a tree with a fork"),
            Self::Circles(circles) => write!(f, "no cycle: a connected graph with {circles} independent circles"),
            Self::Apart => f.write_str("no cycle: not connected"),
            Self::Empty => f.write_str("no cycle: empty"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn visit(frame: u32, radius_mm: u16, vertex: usize) -> Visit {
        Visit { frame, radius_mm, vertex: Some(vertex) }
    }

    fn compared(visits: &[Visit], frames: u32) -> Laps {
        let lap_frames = NonZeroU32::new(100).unwrap();
        Laps::compare(visits, lap_frames, frames, Tolerance::of(lap_frames))
    }

    #[test]
    fn a_place_is_repeated_when_position_and_radius_are_within_the_tolerance() {
        let first = visit(50, 1000, 0);
        for (other, again) in [
            (visit(160, 1150, 0), true),
            (visit(140, 850, 0), true),
            (visit(161, 1000, 0), false),
            (visit(139, 1000, 0), false),
            (visit(150, 1151, 0), false),
            (visit(150, 849, 0), false),
        ] {
            let laps = compared(&[first, other], 200);
            let [one, two] = laps.laps() else { panic!("{laps}") };
            assert_eq!(one, &Lap { visits: vec![first], ..Lap::default() });
            assert_eq!(two.again, if again { vec![(first, other)] } else { vec![] }, "{laps}");
            assert_eq!(two.missing, if again { vec![] } else { vec![first] });
            assert_eq!(two.extra, if again { vec![] } else { vec![other] });
        }
    }

    #[test]
    fn matching_is_one_to_one_and_prefers_more_matches_to_nearer_ones() {
        // The place at 152 is nearest to both; then the one at 159 is left for the second.
        let visits = [visit(50, 1000, 0), visit(55, 1000, 1), visit(152, 1000, 0), visit(159, 1000, 1)];
        let laps = compared(&visits, 200);
        assert_eq!(laps.laps()[1].again, [(visits[0], visits[2]), (visits[1], visits[3])]);
        // With one place left for two, the nearer takes it.
        let laps = compared(&[visits[0], visits[1], visit(154, 1000, 0)], 200);
        assert_eq!(laps.laps()[1].again, [(visits[1], visit(154, 1000, 0))]);
        assert_eq!(laps.laps()[1].missing, [visits[0]]);
    }

    #[test]
    fn a_place_at_the_end_of_a_lap_may_be_repeated_in_the_neighbouring_lap() {
        let visits = [visit(5, 1000, 0), visit(98, 2000, 1), visit(103, 1000, 0), visit(203, 2000, 1)];
        let laps = compared(&visits, 300);
        let [_, two, three] = laps.laps() else { panic!("{laps}") };
        assert_eq!(two.again, [(visits[0], visits[2]), (visits[1], visits[3])]);
        assert_eq!((&two.extra, &three.extra), (&vec![], &vec![]));
        assert_eq!((&three.visits, &three.missing), (&vec![visits[3]], &vec![visits[0], visits[1]]));
        assert!(laps.to_string().contains("98 at 103 (vertex 1 again)"), "{laps}");
    }

    #[test]
    fn places_beyond_the_end_of_the_recording_are_not_missing() {
        let visits = [visit(20, 1000, 0), visit(80, 2000, 1), visit(120, 1000, 0)];
        assert_eq!(compared(&visits, 181).laps()[1].missing, [visits[1]]);
        assert_eq!(compared(&visits, 180).laps()[1].missing, []);
        assert_eq!(compared(&visits, 90).laps().len(), 2, "a visit creates its lap");
        assert_eq!(compared(&[], 0).laps(), []);
    }

    #[test]
    fn the_text_lists_repeated_places_and_their_vertices() {
        let visits = [
            visit(20, 1000, 3),
            visit(80, 2000, 1),
            visit(121, 1000, 3),
            visit(150, 500, 2),
            visit(218, 1000, 4),
            Visit { frame: 281, radius_mm: 2000, vertex: None },
        ];
        let text = compared(&visits, 300).to_string();
        let expected = [
            "laps of 100 frames; a place comes again within 10 frames of its position and 150 mm of its radius",
            "lap 1: 20 (1000 mm, vertex 3), 80 (2000 mm, vertex 1)",
            "lap 2: 21 (1000 mm, vertex 3), 50 (500 mm, vertex 2)",
            "  1 of 2 places of lap 1 come again in lap 2: 20 at 21 (vertex 3 again)",
            "  missing: 80; extra: 50",
            "lap 3: 18 (1000 mm, vertex 4), 81 (2000 mm, vertex -)",
            "  2 of 2 places of lap 1 come again in lap 3: 20 at 18 (vertex 4 instead of 3), 80 at 81 (vertex - instead of 1)",
            "  missing: none; extra: none",
            "in all, places of lap 1 come again 3 of 4 times, 1 of them as the same vertex",
        ];
        assert_eq!(text.lines().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn only_a_ring_of_three_or_more_is_a_cycle() {
        let shape = |vertices, edges: &[(usize, usize)]| Shape::of(&Graph::from_edges(vertices, edges.iter().copied()));
        assert_eq!(shape(3, &[(0, 1), (1, 2), (2, 0)]), Shape::Cycle);
        assert_eq!(shape(4, &[(0, 2), (2, 1), (1, 3), (3, 0)]), Shape::Cycle);
        assert_eq!(shape(2, &[(0, 1)]), Shape::Chain);
        assert_eq!(shape(1, &[]), Shape::Chain);
        assert_eq!(shape(4, &[(0, 1), (0, 2), (0, 3)]), Shape::Tree);
        assert_eq!(shape(4, &[(0, 1), (1, 2), (2, 0), (2, 3)]), Shape::Circles(1));
        assert_eq!(shape(2, &[(0, 1), (1, 1)]), Shape::Circles(1));
        assert_eq!(shape(4, &[(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)]), Shape::Circles(2));
        assert_eq!(shape(6, &[(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3)]), Shape::Apart);
        assert_eq!(shape(0, &[]), Shape::Empty);
    }
}
