//! Properties of merges, against a reference in f64 that computes everything again from the nodes.

use super::automaton::{Automaton, NODES, Node, PerNode};
use super::categories::{Categories, Category};
use crate::filter::Observation;
use crate::filter::RobustConfig;
use crate::filter::robust::history::ObservationHistory;
use crate::filter::robust::model::Model;
use crate::place::Fingerprint;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro128PlusPlus;
use std::collections::{BTreeMap, BTreeSet};

const KINDS: usize = 4;

/// A random tree that the tests keep beside the automaton.
struct Tree {
    automaton: Automaton,
    edges: Vec<(Node, Node)>,
    labels: Vec<Vec<i32>>,
    categories: Vec<Category>,
}

fn below(random: &mut Xoshiro128PlusPlus, bound: usize) -> usize {
    random.next_u32() as usize % bound
}

fn tree(random: &mut Xoshiro128PlusPlus, model: &Model) -> Tree {
    let mut tree = Tree { automaton: Automaton::new(), edges: vec![], labels: vec![], categories: vec![] };
    let kinds: Vec<Category> = Category::all().take(KINDS).collect();
    tree.automaton.clear();
    let most = 2 + below(random, NODES);
    let mut at = None;
    for _ in 0..2 * most {
        let category = kinds[below(random, KINDS)];
        let known = at.and_then(|from| tree.automaton.neighbour(from, category));
        let node = match known {
            Some(node) => node,
            None => {
                let Some(node) = tree.automaton.add(category) else { break };
                tree.labels.push(vec![]);
                tree.categories.push(category);
                if let Some(from) = at {
                    tree.automaton.connect(from, node);
                    tree.edges.push((from, node));
                }
                node
            }
        };
        let deviation = below(random, 41) as i32 - 20;
        tree.automaton.include(node, deviation);
        tree.labels[usize::from(node)].push(deviation);
        at = Some(node);
    }
    tree.automaton.score_all(model);
    tree
}

impl Tree {
    fn classes(&self) -> Vec<Node> {
        (0..self.automaton.len()).map(|node| self.automaton.find(node)).collect()
    }

    /// The neighbours of each class, by the edges of the tree.
    fn neighbours(&self) -> BTreeMap<Node, BTreeSet<Node>> {
        let mut neighbours = BTreeMap::<Node, BTreeSet<Node>>::new();
        let class = |node| self.automaton.find(node);
        for &(a, b) in &self.edges {
            neighbours.entry(class(a)).or_default().insert(class(b));
            neighbours.entry(class(b)).or_default().insert(class(a));
        }
        neighbours
    }

    /// The score of all classes in f64.
    fn score(&self, noise_steps: f64) -> f64 {
        let neighbours = self.neighbours();
        let classes: BTreeSet<Node> = self.classes().into_iter().collect();
        let score = |&class: &Node| {
            let members = (0..self.automaton.len()).filter(|&node| self.automaton.find(node) == class);
            let labels: Vec<f64> =
                members.flat_map(|node| &self.labels[usize::from(node)]).map(|&x| x.into()).collect();
            let degree = neighbours.get(&class).map_or(0, BTreeSet::len) as f64;
            let n = labels.len() as f64;
            let mean = labels.iter().sum::<f64>() / n;
            let scatter: f64 = labels.iter().map(|label| (label - mean).powi(2)).sum();
            let (shape, scale) = (2.0, 2.0 * noise_steps * noise_steps);
            let after = shape + (n - 1.0) / 2.0;
            let labels = -1000.0_f64.ln() - (n - 1.0) / 2.0 * (2.0 * std::f64::consts::PI).ln() - 0.5 * n.ln()
                + ln_gamma_of_halves(2.0 * after)
                - ln_gamma_of_halves(2.0 * shape)
                + shape * scale.ln()
                - after * (scale + scatter / 2.0).ln();
            labels - n * degree.max(1.0).ln() + 1.0 - 0.75 * degree
        };
        classes.iter().map(score).sum()
    }
}

/// ln Γ(x / 2) for a whole number x.
fn ln_gamma_of_halves(doubled: f64) -> f64 {
    let mut x = doubled / 2.0;
    let mut sum = 0.0;
    while x > 1.0 {
        x -= 1.0;
        sum += x.ln();
    }
    if x == 0.5 { sum + 0.5 * std::f64::consts::PI.ln() } else { sum }
}

fn model(noise_mm: u16) -> Model {
    let mut model = Model::new();
    model.configure(&RobustConfig::DEFAULT.with_noise_mm(noise_mm));
    model
}

/// Tries merges of random trees and keeps some of them; calls `check` after each, with the gain.
fn merge_at_random(mut check: impl FnMut(&Tree, f64, Option<f32>)) {
    let model = model(20);
    for seed in 0..40 {
        let mut random = Xoshiro128PlusPlus::seed_from_u64(seed);
        let mut tree = tree(&mut random, &model);
        for _ in 0..60 {
            let [a, b] = [0; 2].map(|_| tree.automaton.find(below(&mut random, tree.labels.len()) as Node));
            if a == b || tree.categories[usize::from(a)] != tree.categories[usize::from(b)] {
                continue;
            }
            let before = tree.score(10.0);
            let (gain, _) = tree.automaton.merge(&model, a, b);
            check(&tree, before, gain);
            if random.next_u32() >> 30 == 0 {
                tree.automaton.commit(&model);
            } else {
                tree.automaton.undo();
                assert!((tree.score(10.0) - before).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn the_gain_of_a_merge_is_the_difference_of_the_scores_in_f64() {
    let mut compared = 0;
    merge_at_random(|tree, before, gain| {
        let Some(gain) = gain else { return };
        let difference = tree.score(10.0) - before;
        assert!((f64::from(gain) - difference).abs() < 2e-3 * (1.0 + difference.abs()), "{gain} {difference}");
        compared += 1;
    });
    assert!(compared > 200, "{compared}");
}

#[test]
fn after_a_merge_no_class_has_two_neighbours_of_a_category_or_is_its_own_neighbour() {
    merge_at_random(|tree, _, gain| {
        if gain.is_none() {
            return;
        }
        for (class, neighbours) in tree.neighbours() {
            assert!(!neighbours.contains(&class));
            let kinds: Vec<usize> = neighbours.iter().map(|&node| tree.automaton.category(node).index()).collect();
            assert_eq!(kinds.iter().collect::<BTreeSet<_>>().len(), kinds.len(), "{class}: {neighbours:?}");
            for neighbour in neighbours {
                let known = tree.automaton.neighbour(class, tree.automaton.category(neighbour));
                assert_eq!(known.map(|known| tree.automaton.find(known)), Some(neighbour));
            }
        }
    });
}

#[test]
fn a_merge_that_is_undone_or_refused_leaves_no_trace() {
    let model = model(20);
    for seed in 0..20 {
        let mut random = Xoshiro128PlusPlus::seed_from_u64(seed);
        let mut tree = tree(&mut random, &model);
        let before = format!("{:?}", (tree.classes(), tree.neighbours(), tree.automaton.classes()));
        let mut gains = [vec![], vec![]];
        for gains in &mut gains {
            for a in 0..tree.automaton.len() {
                for b in (a + 1..tree.automaton.len())
                    .filter(|&b| tree.categories[usize::from(a)] == tree.categories[usize::from(b)])
                {
                    gains.push(tree.automaton.merge(&model, a, b).0.map(f32::to_bits));
                    tree.automaton.undo();
                }
            }
        }
        assert_eq!(gains[0], gains[1], "bit for bit");
        assert_eq!(format!("{:?}", (tree.classes(), tree.neighbours(), tree.automaton.classes())), before);
    }
}

#[test]
fn compaction_keeps_classes_and_edges() {
    let model = model(20);
    for seed in 0..20 {
        let mut random = Xoshiro128PlusPlus::seed_from_u64(seed);
        let mut tree = tree(&mut random, &model);
        for _ in 0..30 {
            let [a, b] = [0; 2].map(|_| tree.automaton.find(below(&mut random, tree.labels.len()) as Node));
            if a != b && tree.categories[usize::from(a)] == tree.categories[usize::from(b)] {
                tree.automaton.merge(&model, a, b);
                tree.automaton.commit(&model);
            }
        }
        let (classes, neighbours) = (tree.classes(), tree.neighbours());
        let mut renamed = PerNode::filled(0);
        tree.automaton.compact(&mut renamed);
        assert_eq!(usize::from(tree.automaton.len()), classes.iter().collect::<BTreeSet<_>>().len());
        assert_eq!(tree.automaton.len(), tree.automaton.classes());
        for (node, class) in classes.iter().enumerate() {
            assert_eq!(renamed[node as Node], renamed[*class]);
            assert_eq!(tree.automaton.category(renamed[node as Node]).index(), tree.categories[node].index());
        }
        for (class, neighbours) in neighbours {
            for neighbour in neighbours {
                let category = tree.categories[usize::from(neighbour)];
                assert_eq!(tree.automaton.neighbour(renamed[class], category), Some(renamed[neighbour]));
            }
        }
    }
}

#[test]
fn labels_alone_are_partitioned_into_groups_that_noise_explains() {
    let mut model = Model::new();
    model.configure(&RobustConfig::DEFAULT.with_noise_mm(10));
    let mut history = ObservationHistory::<64>::new();
    for visit in 0..60 {
        let radius_mm = [1000, 1100, 1260, 1500][visit % 4] + (visit * 7 % 25) as u16;
        history.push(&Observation::from(Fingerprint::from_radius_mm(radius_mm).unwrap()));
    }
    let mut categories = Categories::new();
    categories.find_in(&model, &history, 2.0);
    let means: Vec<f32> = Category::all().map(|category| categories.mean(category) * 2.0).take(4).collect();
    assert_eq!(categories.ln_densities(500).count(), 4);
    for (mean, radius_mm) in means.iter().zip([1012.0, 1112.0, 1272.0, 1512.0]) {
        assert!((mean - radius_mm).abs() < 6.0, "{means:?}");
    }
}
