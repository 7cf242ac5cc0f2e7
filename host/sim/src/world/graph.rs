//! Places and the ways between them, joined where a robot cannot distinguish them.

use super::obstacles::Obstacles;
use super::voronoi::Skeleton;
use super::walls::Walls;
use super::{Limits, Point, TrueEdge, TrueNode, length_mm};

/// Two meet points of one place are at most this far apart, in millimetres.
const PLACE_MM: f64 = 1000.0;
/// A way is looked at in steps of this length, in millimetres.
const STEP_MM: f64 = 50.0;

/// A place.
pub(super) struct Node {
    position: Point,
    radius_mm: f64,
    meet_points: Vec<Point>,
    /// Whether three obstacles are apart in bearing there.
    is_apart: bool,
}

/// Places and ways.
pub(super) struct Graph {
    pub(super) nodes: Vec<Node>,
    edges: Vec<TrueEdge>,
}

impl Graph {
    /// The places of a skeleton, by their points, and the chains of pieces between them.
    pub(super) fn of(skeleton: &Skeleton, places: &[usize], radii_mm: &[f64], apart: &[bool]) -> Self {
        let mut graph = Self { nodes: Vec::new(), edges: Vec::new() };
        let mut node_of = vec![None; skeleton.points.len()];
        for place in places {
            node_of[*place] = Some(graph.nodes.len());
            graph.add_node(skeleton.points[*place], radii_mm[*place], apart[*place]);
        }
        let mut used = vec![false; skeleton.pieces.len()];
        let mut leave = |from: usize| {
            let (piece, next) = skeleton.leaving(from).find(|(piece, _)| !used[*piece])?;
            used[piece] = true;
            Some((skeleton.way_from(from, piece), next))
        };
        for first in places {
            while let Some((mut way, mut at)) = leave(*first) {
                while node_of[at].is_none()
                    && let Some((more, next)) = leave(at)
                {
                    way.extend_from_slice(&more[1..]);
                    at = next;
                }
                if let (Some(from), Some(to)) = (node_of[*first], node_of[at]) {
                    graph.edges.push(TrueEdge { nodes: [from, to], way, room_mm: 0.0 });
                }
            }
        }
        graph
    }

    /// Adds a place.
    pub(super) fn add_node(&mut self, position: Point, radius_mm: f64, is_apart: bool) {
        self.nodes.push(Node { position, radius_mm, meet_points: vec![position], is_apart });
    }

    /// Joins the places in the middle of a hall, where the sonars measure nothing, to one; none is left where the way does not fork.
    /// Returns how many meet points are gone.
    pub(super) fn join_halls(&mut self, walls: &Walls, limits: &Limits) -> usize {
        let before = self.nodes.len();
        let is_hall = |node: &Node| node.radius_mm > limits.range_max_mm;
        let is_inner = |edge: &TrueEdge| {
            edge.nodes.iter().all(|node| is_hall(&self.nodes[*node]))
                && narrowest_mm(walls, &steps(&edge.way)) > limits.range_max_mm
        };
        let inner: Vec<bool> = self.edges.iter().map(is_inner).collect();
        self.contract(&inner, f64::INFINITY);
        self.pass_through(is_hall);
        before - self.nodes.len()
    }

    /// Joins the places that a robot takes for one. Returns how many places are gone.
    pub(super) fn merge(&mut self, walls: &Walls, limits: &Limits) -> usize {
        let before = self.nodes.len();
        let is_one = |edge: &TrueEdge| {
            let length_mm = length_mm(&edge.way);
            length_mm <= limits.width_mm() || length_mm <= PLACE_MM && is_never_left(walls, &edge.way, limits)
        };
        let inner: Vec<bool> = self.edges.iter().map(is_one).collect();
        self.contract(&inner, PLACE_MM);
        self.pass_through(|node| node.meet_points.len() > 1 && !node.is_apart);
        before - self.nodes.len()
    }

    /// Contracts edges, the shortest first, as long as no place becomes larger than the limit.
    fn contract(&mut self, inner: &[bool], place_mm: f64) {
        let mut order: Vec<usize> = (0..self.edges.len()).filter(|edge| inner[*edge]).collect();
        order.sort_by(|one, other| {
            length_mm(&self.edges[*one].way).total_cmp(&length_mm(&self.edges[*other].way)).then(one.cmp(other))
        });
        // The members of each cluster; a node that was joined to another has none.
        let mut members: Vec<Vec<usize>> = (0..self.nodes.len()).map(|node| vec![node]).collect();
        let mut cluster_of: Vec<usize> = (0..self.nodes.len()).collect();
        let mut tree = vec![false; self.edges.len()];
        let mut gone = vec![false; self.edges.len()];
        for edge in order {
            let [one, other] = self.edges[edge].nodes.map(|node| cluster_of[node]);
            if one == other {
                gone[edge] = self.edges[edge].nodes[0] != self.edges[edge].nodes[1];
                continue;
            }
            let spots = |cluster: usize| members[cluster].iter().flat_map(|node| &self.nodes[*node].meet_points);
            let is_small = spots(one).all(|one| spots(other).all(|other| one.distance_mm(*other) <= place_mm));
            if is_small {
                let (kept, joined) = (one.min(other), one.max(other));
                let moved = std::mem::take(&mut members[joined]);
                moved.iter().for_each(|node| cluster_of[*node] = kept);
                members[kept].extend(moved);
                (tree[edge], gone[edge]) = (true, true);
            }
        }
        if !tree.contains(&true) {
            return;
        }
        let centres: Vec<Option<usize>> = members.iter().map(|members| self.centre(members)).collect();
        let inner: Vec<Vec<Point>> =
            (0..self.nodes.len()).map(|node| self.way_to(node, centres[cluster_of[node]], &tree)).collect();
        for (edge, _) in self.edges.iter_mut().zip(&gone).filter(|(_, gone)| !**gone) {
            let before = inner[edge.nodes[0]].iter().rev().copied();
            let after = inner[edge.nodes[1]].iter().copied();
            edge.way = before.chain(edge.way.iter().copied()).chain(after).collect();
            edge.nodes = edge.nodes.map(|node| cluster_of[node]);
        }
        for (cluster, members) in members.iter().enumerate() {
            let Some(centre) = centres[cluster].filter(|_| members.len() > 1) else { continue };
            let meet_points = members.iter().flat_map(|node| self.nodes[*node].meet_points.clone()).collect();
            let is_apart = members.iter().any(|node| self.nodes[*node].is_apart);
            let Node { position, radius_mm, .. } = self.nodes[centre];
            self.nodes[cluster] = Node { position, radius_mm, meet_points, is_apart };
        }
        let mut gone = gone.into_iter();
        self.edges.retain(|_| !gone.next().unwrap_or(false));
        self.remove(|cluster| members[cluster].is_empty());
    }

    /// The member of a cluster that is nearest to its middle.
    fn centre(&self, members: &[usize]) -> Option<usize> {
        let count = members.len() as f64;
        let positions = members.iter().map(|node| self.nodes[*node].position);
        let (x_mm, y_mm) = positions.fold((0.0, 0.0), |(x, y), at| (x + at.x_mm / count, y + at.y_mm / count));
        let off_mm = |node: &usize| self.nodes[*node].position.distance_mm(Point::new(x_mm, y_mm));
        members.iter().copied().min_by(|one, other| off_mm(one).total_cmp(&off_mm(other)).then(one.cmp(other)))
    }

    /// The way from a node to the centre of its cluster along contracted edges, without the node's own position.
    fn way_to(&self, node: usize, centre: Option<usize>, tree: &[bool]) -> Vec<Point> {
        let Some(centre) = centre.filter(|centre| *centre != node) else { return Vec::new() };
        let mut open = vec![(node, Vec::new(), None)];
        while let Some((at, way, came_by)) = open.pop() {
            if at == centre {
                return way;
            }
            for (index, edge) in
                self.edges.iter().enumerate().filter(|(index, _)| tree[*index] && came_by != Some(*index))
            {
                let forwards = edge.nodes[0] == at;
                if forwards || edge.nodes[1] == at {
                    let more: Vec<Point> =
                        if forwards { edge.way.clone() } else { edge.way.iter().rev().copied().collect() };
                    let way: Vec<Point> = way.iter().copied().chain(more.into_iter().skip(1)).collect();
                    open.push((edge.nodes[usize::from(forwards)], way, Some(index)));
                }
            }
        }
        Vec::new()
    }

    /// Removes nodes where two edges meet and that are no places, and joins the edges.
    fn pass_through(&mut self, is_none: impl Fn(&Node) -> bool) {
        let mut removed = vec![false; self.nodes.len()];
        for (node, is_removed) in removed.iter_mut().enumerate() {
            if !is_none(&self.nodes[node]) {
                continue;
            }
            let ends: Vec<usize> = self
                .edges
                .iter()
                .enumerate()
                .flat_map(|(index, edge)| edge.nodes.iter().filter(|end| **end == node).map(move |_| index))
                .collect();
            let [first, second] = ends[..] else { continue };
            if first == second {
                continue;
            }
            let joined = self.edges.remove(second);
            let edge = &mut self.edges[first];
            if edge.nodes[0] == node {
                edge.nodes.reverse();
                edge.way.reverse();
            }
            let (to, way) = match joined.nodes[0] == node {
                true => (joined.nodes[1], joined.way),
                false => (joined.nodes[0], joined.way.into_iter().rev().collect()),
            };
            edge.nodes[1] = to;
            edge.way.extend(way.into_iter().skip(1));
            *is_removed = true;
        }
        self.remove(|node| removed[node]);
    }

    /// Removes nodes that no edge ends at.
    fn remove(&mut self, is_removed: impl Fn(usize) -> bool) {
        let mut next = 0;
        let numbers: Vec<usize> = (0..self.nodes.len())
            .map(|node| {
                let number = next;
                next += usize::from(!is_removed(node));
                number
            })
            .collect();
        self.edges.iter_mut().for_each(|edge| edge.nodes = edge.nodes.map(|node| numbers[node]));
        let mut node = 0;
        self.nodes.retain(|_| {
            node += 1;
            !is_removed(node - 1)
        });
    }

    /// The nodes and edges.
    pub(super) fn finish(self, limits: &Limits) -> (Vec<TrueNode>, Vec<TrueEdge>) {
        let mut degrees = vec![0; self.nodes.len()];
        self.edges.iter().flat_map(|edge| edge.nodes).for_each(|node| degrees[node] += 1);
        let nodes = self.nodes.into_iter().zip(degrees).map(|(node, degree)| TrueNode {
            position: node.position,
            radius_mm: node.radius_mm,
            degree,
            meet_points: node.meet_points,
            is_hall: node.radius_mm > limits.range_max_mm,
        });
        (nodes.collect(), self.edges)
    }
}

/// The distance to walls at the narrowest point of a way, in millimetres.
fn narrowest_mm(walls: &Walls, way: &[Point]) -> f64 {
    way.iter().map(|point| walls.clearance_mm(*point)).fold(f64::INFINITY, f64::min)
}

/// Points along a way, close to each other, its ends included.
fn steps(way: &[Point]) -> Vec<Point> {
    let legs = way.windows(2).flat_map(|ends| {
        let count = (ends[0].distance_mm(ends[1]) / STEP_MM).ceil().max(1.0);
        (0..count as u32).map(move |step| ends[0].towards(ends[1], f64::from(step) / count))
    });
    legs.chain(way.last().copied()).collect()
}

/// Whether the third obstacle is nowhere along a way so much farther than the nearest that a detector has left the place.
fn is_never_left(walls: &Walls, way: &[Point], limits: &Limits) -> bool {
    steps(way).into_iter().all(|at| {
        let reach_mm = walls.clearance_mm(at) + limits.leave_mm;
        Obstacles::around(walls, at, reach_mm, limits).spread_mm().is_some()
    })
}
