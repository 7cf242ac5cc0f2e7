//! Branches that end in a dead end, and which of them are too short to count.

use super::voronoi::Skeleton;

/// Drops the branches that do not reach far enough beyond the disc of the junction that they leave, the shortest first.
pub(super) fn prune(skeleton: &mut Skeleton, radii_mm: &[f64], reach_mm: f64) {
    loop {
        let ends = (0..radii_mm.len()).filter(|point| skeleton.degrees()[*point] == 1);
        let mut branches: Vec<Branch> = ends.filter_map(|end| Branch::from_end(skeleton, end, radii_mm)).collect();
        branches.retain(|branch| branch.beyond_mm < reach_mm);
        branches.sort_by(|one, other| one.beyond_mm.total_cmp(&other.beyond_mm));
        let mut is_done = true;
        for branch in branches {
            // A junction that has lost a branch may be none any more.
            if skeleton.degrees()[branch.junction] > 2 {
                branch.pieces.iter().for_each(|piece| skeleton.drop(*piece));
                is_done = false;
            }
        }
        if is_done {
            return;
        }
    }
}

/// The way from a dead end to the first junction.
struct Branch {
    pieces: Vec<usize>,
    junction: usize,
    /// How far the discs along it reach beyond the junction's disc, in millimetres.
    beyond_mm: f64,
}

impl Branch {
    /// The branch that ends at a point of degree 1; `None` when it leads to another dead end.
    fn from_end(skeleton: &Skeleton, end: usize, radii_mm: &[f64]) -> Option<Self> {
        let mut points = vec![end];
        let mut pieces = Vec::new();
        let mut at = end;
        loop {
            let last = pieces.last().copied();
            let (piece, next) = skeleton.leaving(at).find(|(piece, _)| Some(*piece) != last)?;
            pieces.push(piece);
            at = next;
            match skeleton.degrees()[at] {
                2 => points.push(at),
                1 => return None,
                _ => break,
            }
        }
        let centre = skeleton.points[at];
        let reach_mm = points.iter().map(|point| centre.distance_mm(skeleton.points[*point]) + radii_mm[*point]);
        let beyond_mm = reach_mm.fold(0.0, f64::max) - radii_mm[at];
        Some(Self { pieces, junction: at, beyond_mm })
    }
}
