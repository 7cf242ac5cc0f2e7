//! Proposals that split a vertex: some of its visits become a vertex of their own.

use super::history::ObservationHistory;
use super::hypothesis::Hypothesis;
use super::proposals::Proposals;
use crate::map::VertexId;
use rand_core::Rng;

/// How many neighbours of a vertex are grouped; the others stay in the first group.
const GROUPED: usize = 8;

/// How often the robot passed between each two neighbours of a vertex, in either direction.
#[derive(Default)]
struct Passages([[u16; GROUPED]; GROUPED]);

impl Passages {
    fn record(&mut self, a: usize, b: usize) {
        for (a, b) in [(a, b), (b, a)] {
            if let Some(count) = self.0.get_mut(a).and_then(|row| row.get_mut(b)) {
                *count += 1;
            }
        }
    }

    fn count(&self, a: usize, b: usize) -> f32 {
        self.0.get(a).and_then(|row| row.get(b)).copied().unwrap_or(0).into()
    }
}

impl<const V: usize, const T: usize> Proposals<'_, V, T> {
    /// Parts the neighbours of a vertex into two groups between which the robot seldom passed, and gives the visits from and to
    /// the second group a vertex of their own.
    ///
    /// With `p(a, b)` passages between two neighbours and `t(a) = 1 + Σ p(a, b)`, the second group starts with the neighbour b
    /// of least `p(a, b) / t(b)` for a random neighbour a. Each other neighbour c then joins, twice in turn, the group of larger
    /// `Σ p(c, b) / t(b)` over its members b.
    pub(super) fn split_by_neighbours(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertex = self.vertex(hypothesis);
        let neighbours = hypothesis.neighbours[vertex];
        let degree = neighbours.len();
        if degree < 2 {
            return false;
        }
        let number = |neighbour: VertexId| neighbours.rank(neighbour);
        let mut passages = Passages::default();
        for visit in visits(self.history, hypothesis, vertex) {
            if let (Some(before), Some(after)) = (visit.before, visit.after) {
                passages.record(number(before), number(after));
            }
        }
        let grouped = degree.min(GROUPED);
        let first = self.below(grouped);
        let offset = self.below(grouped);
        let total = |a: usize| (0..grouped).map(|b| passages.count(a, b)).sum::<f32>() + 1.0;
        let mut second = (f32::INFINITY, first);
        for number in (0..grouped).map(|number| (number + offset) % grouped).filter(|&number| number != first) {
            let share = passages.count(first, number) / total(number);
            if share < second.0 {
                second = (share, number);
            }
        }
        let second = second.1;
        let mut group = 1_u32 << second;
        for _ in 0..2 {
            for number in (0..grouped).filter(|&number| number != first && number != second) {
                let (mut to_first, mut to_second) = (0.0, 0.0);
                for other in (0..grouped).filter(|&other| other != number) {
                    let to_group = if group >> other & 1 == 1 { &mut to_second } else { &mut to_first };
                    *to_group += passages.count(number, other) / total(other);
                }
                if to_second > to_first || to_second == to_first && self.random.next_u32() >> 31 == 1 {
                    group |= 1 << number;
                } else {
                    group &= !(1 << number);
                }
            }
        }
        let coin = self.random.next_u32();
        self.split(hypothesis, vertex, |visit| {
            let is_second = |neighbour: VertexId| group >> (number(neighbour) & 31) & 1 == 1;
            match (visit.before.map(is_second), visit.after.map(is_second)) {
                (Some(before), Some(after)) if before != after => {
                    coin.rotate_left(visit.index as u32).wrapping_mul(0x9E37_79B9) >> 31 == 1
                }
                (before, after) => after.or(before).unwrap_or(false),
            }
        })
    }

    /// Gives the visits of a vertex with labels above its mean a vertex of their own.
    pub(super) fn split_by_label(&mut self, hypothesis: &mut Hypothesis<V, T>) -> bool {
        let vertex = self.vertex(hypothesis);
        let mean = hypothesis.statistics[vertex].mean;
        self.split(hypothesis, vertex, |visit| f32::from(visit.steps) > mean)
    }

    /// Gives some visits of a vertex a vertex of their own; returns whether there were any.
    fn split(&mut self, hypothesis: &mut Hypothesis<V, T>, vertex: VertexId, leaves: impl Fn(&Visit) -> bool) -> bool {
        let Some(new) = hypothesis.next_vertex() else { return false };
        let mut leaving = [false; T];
        for visit in visits(self.history, hypothesis, vertex).filter(leaves) {
            if let Some(leaving) = leaving.get_mut(visit.index) {
                *leaving = true;
            }
        }
        let mut any = false;
        for (vertex, _) in hypothesis.path.iter_mut().zip(leaving).filter(|(_, leaving)| *leaving) {
            *vertex = new;
            any = true;
        }
        hypothesis.vertices += u8::from(any);
        any
    }
}

/// A visit of a vertex.
struct Visit {
    index: usize,
    steps: u16,
    /// The vertex that the robot came from; `None` where a sequence starts.
    before: Option<VertexId>,
    /// The vertex that the robot went to; `None` where a sequence ends.
    after: Option<VertexId>,
}

/// The visits of a vertex in the history, the oldest first.
fn visits<const V: usize, const T: usize>(
    history: &ObservationHistory<T>,
    hypothesis: &Hypothesis<V, T>,
    vertex: VertexId,
) -> impl Iterator<Item = Visit> {
    let visited = history.iter().enumerate().filter(move |&(index, _)| hypothesis.vertex_of(index) == Some(vertex));
    visited.map(move |(index, observation)| {
        let before = match index.checked_sub(1) {
            _ if observation.starts_sequence() => None,
            None => hypothesis.before,
            Some(before) => hypothesis.vertex_of(before),
        };
        let continues = history.get(index + 1).is_some_and(|next| !next.starts_sequence());
        let after = if continues { hypothesis.vertex_of(index + 1) } else { None };
        Visit { index, steps: observation.steps, before, after }
    })
}
