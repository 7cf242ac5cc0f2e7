//! An alignment of two maps: which vertices and ways are the same, along the edges that both maps have.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use toposlam::wire::WayId;

use super::evidence::{Background, Evidence, bearing_between, like_bearings};
use crate::topology::TopologicalMap;

/// An alignment with less evidence is not followed further: it will not be the best one.
const LN_HOPELESS: f64 = -10.0;

/// Which vertices and ways of two maps are the same, and the evidence for it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Alignment {
    /// For vertices of the first map, those of the second.
    vertices: BTreeMap<u8, u8>,
    /// For ways of the second map, those of the first.
    ways: BTreeMap<WayId, WayId>,
    pub(super) evidence: Evidence,
}

impl Alignment {
    /// The alignment that follows when a way of the first map is one of the second.
    pub(super) fn from_pair(
        first: &TopologicalMap,
        second: &TopologicalMap,
        background: &Background,
        way: WayId,
        other: WayId,
    ) -> Self {
        let mut alignment = Self::default();
        let mut taken: BTreeMap<u8, u8> = BTreeMap::new();
        // Ways of the second map: those of the edges by which the vertices were reached, and those whose travel time counts.
        let (mut tree, mut timed) = (BTreeSet::new(), BTreeSet::new());
        let mut open = VecDeque::from([(way, other, None)]);
        // Each edge is followed from both ends.
        while let Some((way, other, from)) = open.pop_front() {
            if alignment.evidence.total() < LN_HOPELESS {
                break;
            }
            let (vertex, image) = (way.vertex, other.vertex);
            match (alignment.vertices.get(&vertex), taken.get(&image)) {
                (Some(&known), _) if known == image && alignment.ways.get(&other) == Some(&way) => {
                    if from.is_some_and(|from| !tree.contains(&from)) {
                        alignment.evidence.loops += 0.5 * background.loop_nats();
                    }
                    continue;
                }
                (None, None) => {}
                _ => {
                    alignment.evidence.contradictions += 1;
                    continue;
                }
            }
            alignment.vertices.insert(vertex, image);
            taken.insert(image, vertex);
            tree.extend(from.into_iter().chain([other]));
            let [label, other_label] = [&first.vertices[usize::from(vertex)], &second.vertices[usize::from(image)]];
            alignment.evidence.add_label(label.radius_mm, other_label.radius_mm, image, background);
            let [ways, others] = [&first.ways[usize::from(vertex)], &second.ways[usize::from(image)]];
            let [origin_mrad, other_mrad] =
                [ways[usize::from(way.way)].bearing_mrad, others[usize::from(other.way)].bearing_mrad];
            let matched = like_bearings(ways, origin_mrad, others, other_mrad);
            let missing = ways.len() + others.len() - 2 * matched.len();
            alignment.evidence.ways += background.shape_nats(other, missing);
            for (here, there) in matched {
                let [here_id, there_id] =
                    [(vertex, here), (image, there)].map(|(vertex, way)| WayId { vertex, way: way as u8 });
                alignment.ways.insert(there_id, here_id);
                let (here, there) = (&ways[here], &others[there]);
                let (Some(far), Some(other_far)) = (here.leads_to, there.leads_to) else { continue };
                if let (Some(frames), Some(other_frames)) = (here.travel_frames, there.travel_frames)
                    && !timed.contains(&other_far)
                {
                    timed.insert(there_id);
                    alignment.evidence.add_travel(frames, other_frames, background);
                }
                open.push_back((far, other_far, Some(there_id)));
            }
        }
        alignment
    }

    /// This alignment and another one.
    pub(super) fn with(&self, other: &Self) -> Self {
        let mut both = self.clone();
        both.vertices.extend(&other.vertices);
        both.ways.extend(&other.ways);
        both
    }

    /// The vertices that are the same, in the order of the first map.
    pub(super) fn vertex_pairs(&self) -> Vec<(u8, u8)> {
        self.vertices.iter().map(|(&vertex, &image)| (vertex, image)).collect()
    }

    /// The vertex of the second map that is this one of the first.
    pub(super) fn image(&self, vertex: u8) -> Option<u8> {
        self.vertices.get(&vertex).copied()
    }

    /// The vertex of the first map that is this one of the second.
    pub(super) fn origin(&self, image: u8) -> Option<u8> {
        self.vertices.iter().find_map(|(&vertex, &of)| (of == image).then_some(vertex))
    }

    /// The way of the first map that is this one of the second.
    pub(super) fn origin_of_way(&self, way: WayId) -> Option<WayId> {
        self.ways.get(&way).copied()
    }

    /// How far the frame of a common vertex in the second map is turned against that in the first, in milliradians.
    pub(super) fn turn_mrad(&self, first: &TopologicalMap, second: &TopologicalMap, image: u8) -> f64 {
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (&other, &way) in self.ways.iter().filter(|(other, _)| other.vertex == image) {
            let (Some(there), Some(here)) = (second.way(other), first.way(way)) else { continue };
            let turn_rad = bearing_between(here.bearing_mrad.into(), there.bearing_mrad.into()) / 1000.0;
            sine += turn_rad.sin();
            cosine += turn_rad.cos();
        }
        1000.0 * sine.atan2(cosine)
    }

    /// Whether the alignments name no vertex in common.
    pub(super) fn is_disjoint_from(&self, other: &Self) -> bool {
        self.vertices.iter().all(|(&vertex, &image)| other.image(vertex).is_none() && other.origin(image).is_none())
    }

    /// Whether both cannot be true: a vertex of one map would be two of the other.
    pub(super) fn contradicts(&self, other: &Self) -> bool {
        self.vertices.iter().any(|(&vertex, &image)| {
            other.image(vertex).is_some_and(|it| it != image) || other.origin(image).is_some_and(|it| it != vertex)
        })
    }
}
