//! Judges the revisits of a recording with poses: whether a place is detected again, and as the same vertex.
//!
//! The poses come from another localisation, such as a laser scan matcher. The filter does not get them.

use std::fmt;

use toposlam_sim::world::{Point, Pose, length_mm};

use crate::laps::Visit;

/// A detection this near to a spot is a detection of it, and a pass comes this near.
pub const NEAR_MM: f64 = 500.0;
/// A pass ends when the robot is this far from the spot.
const LEFT_MM: f64 = 2.0 * NEAR_MM;
/// Two places this far apart are different places.
pub const FAR_MM: f64 = 3000.0;

/// Later passes of a spot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Passes {
    /// All passes.
    pub count: usize,
    /// Passes with a detection.
    pub detected: usize,
    /// Detections whose vertex is that of the first detection.
    pub same_vertex: usize,
}

/// The revisits of a recording.
///
/// A *spot* is the position of a detection that is not within [`NEAR_MM`] of an earlier spot. A *pass* of a spot starts when the
/// robot, which was at least twice as far away, is within [`NEAR_MM`] again.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Revisits {
    /// The length of the path.
    pub driven_mm: f64,
    /// Detections in frames with a pose.
    pub places: usize,
    /// Spots.
    pub spots: usize,
    /// Passes with the heading of the first detection, within a right angle.
    pub same_heading: Passes,
    /// All other passes.
    pub other_heading: Passes,
    /// Pairs of places that are more than [`FAR_MM`] apart.
    pub far_pairs: usize,
    /// Those that the map has as one vertex.
    pub far_pairs_in_one_vertex: usize,
    /// Pairs of places that the map has as one vertex, near and far. Places that have left the history have no vertex.
    pub pairs_in_one_vertex: usize,
    /// All pairs of places with a vertex.
    pub pairs: usize,
}

impl Revisits {
    /// Judges the visits, which are in the order of their frames. `poses` has the pose of each frame, `None` where it is unknown.
    ///
    /// Cost: frames times spots, and places squared.
    pub fn of(visits: &[Visit], poses: &[Option<Pose>]) -> Self {
        let placed: Vec<(Visit, Pose)> =
            visits.iter().filter_map(|visit| Some((*visit, *poses.get(visit.frame as usize)?.as_ref()?))).collect();
        let mut revisits = Self { places: placed.len(), driven_mm: driven_mm(poses), ..Self::default() };
        let mut spots: Vec<(Visit, Pose)> = Vec::new();
        for &(visit, pose) in &placed {
            if spots.iter().all(|(_, spot)| spot.position.distance_mm(pose.position) > NEAR_MM) {
                spots.push((visit, pose));
            }
        }
        revisits.spots = spots.len();
        for spot in &spots {
            revisits.count_passes(spot, &placed, poses);
        }
        revisits.count_pairs(&placed);
        revisits
    }

    fn count_passes(&mut self, spot: &(Visit, Pose), placed: &[(Visit, Pose)], poses: &[Option<Pose>]) {
        let (first, at) = spot;
        let mut has_left = false;
        // The frames of the present pass.
        let mut pass: Option<(usize, Pose)> = None;
        let mut finish = |(start, pose): (usize, Pose), end: usize| {
            let passes = if have_same_heading(&pose, at) { &mut self.same_heading } else { &mut self.other_heading };
            passes.count += 1;
            let detections = placed.iter().filter(|(visit, pose)| {
                (start..end).contains(&(visit.frame as usize)) && pose.position.distance_mm(at.position) <= NEAR_MM
            });
            let mut detections = detections.map(|(visit, _)| visit.vertex).peekable();
            if detections.peek().is_some() {
                passes.detected += 1;
                let is_same = |vertex: Option<usize>| vertex.is_some() && vertex == first.vertex;
                passes.same_vertex += usize::from(detections.any(is_same));
            }
        };
        for (frame, pose) in poses.iter().enumerate().skip(first.frame as usize + 1) {
            let Some(pose) = pose else { continue };
            let distance_mm = pose.position.distance_mm(at.position);
            if distance_mm > LEFT_MM {
                has_left = true;
                if let Some(start) = pass.take() {
                    finish(start, frame);
                }
            } else if distance_mm <= NEAR_MM && has_left && pass.is_none() {
                pass = Some((frame, *pose));
            }
        }
        if let Some(start) = pass {
            finish(start, poses.len());
        }
    }

    fn count_pairs(&mut self, placed: &[(Visit, Pose)]) {
        for (index, (one, at)) in placed.iter().enumerate() {
            for (other, there) in &placed[index + 1..] {
                let (Some(one), Some(other)) = (one.vertex, other.vertex) else { continue };
                let (is_far, is_one) = (at.position.distance_mm(there.position) > FAR_MM, one == other);
                self.pairs += 1;
                self.pairs_in_one_vertex += usize::from(is_one);
                self.far_pairs += usize::from(is_far);
                self.far_pairs_in_one_vertex += usize::from(is_far && is_one);
            }
        }
    }
}

/// Whether both headings differ by less than a right angle.
fn have_same_heading(one: &Pose, other: &Pose) -> bool {
    (one.heading_rad - other.heading_rad).cos() > 0.0
}

/// The length of the path through the known poses.
fn driven_mm(poses: &[Option<Pose>]) -> f64 {
    let known: Vec<Point> = poses.iter().flatten().map(|pose| pose.position).collect();
    length_mm(&known)
}

impl fmt::Display for Revisits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share =
            |part: usize, of: usize| (100 * part).checked_div(of).map_or("-".to_owned(), |share| format!("{share} %"));
        writeln!(
            f,
            "revisits by the poses: {:.0} m driven, {} places at {} spots",
            self.driven_mm / 1000.0,
            self.places,
            self.spots
        )?;
        for (heading, passes) in [("the same", self.same_heading), ("another", self.other_heading)] {
            writeln!(
                f,
                "  later passes within {:.1} m with {heading} heading: {}; detected again: {}; as the same vertex: {}",
                NEAR_MM / 1000.0,
                passes.count,
                passes.detected,
                passes.same_vertex
            )?;
        }
        write!(
            f,
            "  pairs of places more than {:.0} m apart in one vertex: {} of {} ({}); pairs in one vertex at any distance: {}",
            FAR_MM / 1000.0,
            self.far_pairs_in_one_vertex,
            self.far_pairs,
            share(self.far_pairs_in_one_vertex, self.far_pairs),
            share(self.pairs_in_one_vertex, self.pairs)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Up and down a corridor of 10 m, at 0.25 m a frame.
    fn poses(legs: usize) -> Vec<Option<Pose>> {
        let leg = |leg: usize| {
            (0..40).map(move |step| {
                let x_mm = 250.0 * f64::from(if leg.is_multiple_of(2) { step } else { 40 - step });
                let heading_rad = if leg.is_multiple_of(2) { 0.0 } else { 3.0 };
                Some(Pose { position: Point::new(x_mm, 0.0), heading_rad })
            })
        };
        (0..legs).flat_map(leg).collect()
    }

    fn visit(frame: u32, vertex: usize) -> Visit {
        Visit { frame, radius_mm: 1000, vertex: Some(vertex) }
    }

    #[test]
    fn passes_are_counted_by_heading_and_judged_by_detection_and_vertex() {
        // The spot is at 5 m. It is passed back, forth and back; detected in the first two of these, once as another vertex.
        let visits = [visit(20, 3), visit(60, 3), visit(101, 4)];
        let revisits = Revisits::of(&visits, &poses(4));
        assert_eq!((revisits.places, revisits.spots), (3, 1));
        assert_eq!(revisits.other_heading, Passes { count: 2, detected: 1, same_vertex: 1 });
        assert_eq!(revisits.same_heading, Passes { count: 1, detected: 1, same_vertex: 0 });
    }

    #[test]
    fn a_robot_that_stays_near_a_spot_does_not_pass_it() {
        let pose = |x_mm| Some(Pose { position: Point::new(x_mm, 0.0), heading_rad: 0.0 });
        let there_and_back = [pose(0.0), pose(900.0), None, pose(0.0)];
        assert_eq!(Revisits::of(&[visit(0, 0)], &there_and_back).same_heading.count, 0);
        let farther = [pose(0.0), pose(1100.0), None, pose(0.0)];
        assert_eq!(Revisits::of(&[visit(0, 0)], &farther).same_heading, Passes { count: 1, ..Passes::default() });
    }

    #[test]
    fn pairs_that_are_far_apart_in_one_vertex_are_counted() {
        // At 0, 5 and 9.75 m, the last in the vertex of the first; then one that has left the history.
        let visits = [visit(0, 0), visit(20, 1), visit(39, 0), Visit { frame: 41, radius_mm: 0, vertex: None }];
        let revisits = Revisits::of(&visits, &poses(2));
        assert_eq!((revisits.far_pairs, revisits.far_pairs_in_one_vertex), (3, 1));
        assert_eq!((revisits.pairs, revisits.pairs_in_one_vertex), (3, 1));
        assert!(revisits.to_string().contains("more than 3 m apart in one vertex: 1 of 3 (33 %)"), "{revisits}");
    }

    #[test]
    fn frames_without_a_pose_are_ignored() {
        assert_eq!(Revisits::of(&[visit(0, 0), visit(9, 0)], &[None, None]), Revisits::default());
    }
}
