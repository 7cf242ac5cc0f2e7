//! The ordered filter as a whole, on small buildings whose darts are known.

use super::*;
use crate::filter::{Ways, draws};
use crate::map::VertexSet;
use crate::place::Fingerprint;
use std::collections::{BTreeMap, BTreeSet};

const CONFIG: OrderedConfig = OrderedConfig::DEFAULT.with_noise_mm(20);

type Small = OrderedFilter<6, 12, 60, 64>;

/// A building: for each place a radius in steps and its ways counter-clockwise as (bearing in mrad, dart it leads to, ring
/// frames). Darts are numbered through all places.
struct Building {
    radius_steps: &'static [u16],
    ways: &'static [&'static [(u16, usize, u16)]],
}

/// A loop at place 0, two parallel corridors from 0 to 1, and a dead end 2 behind 1. No two places look alike but 0 and 2.
const HOUSE: Building = Building {
    radius_steps: &[500, 800, 504],
    ways: &[
        &[(0, 1, 40), (1100, 0, 40), (2500, 6, 20), (4300, 5, 90)],
        &[(300, 7, 30), (2000, 3, 90), (4100, 2, 20)],
        &[(1000, 4, 30)],
    ],
};

impl Building {
    fn place(&self, dart: usize) -> usize {
        let mut first = 0;
        let holds = |ways: &&[(u16, usize, u16)]| {
            first += ways.len();
            dart < first
        };
        self.ways.iter().position(holds).unwrap()
    }

    fn first(&self, place: usize) -> usize {
        self.ways[..place].iter().map(|ways| ways.len()).sum()
    }

    fn way(&self, dart: usize) -> (u16, usize, u16) {
        let place = self.place(dart);
        self.ways[place][dart - self.first(place)]
    }

    /// What the robot sees that came by a dart, and the dart it came by, for a walk of random exits.
    fn walk(&self, length: usize, seed: u64, wrong: impl Fn(usize) -> bool) -> Vec<(usize, Observation)> {
        let mut random = draws(seed, 7);
        let mut at = 0;
        let mut exit = None;
        let mut frames = None;
        (0..length)
            .map(|step| {
                let place = self.place(at);
                let (ways, first) = (self.ways[place], self.first(place));
                let relative = |slot: usize| {
                    let turn = (i32::from(ways[slot].0) - i32::from(ways[at - first].0)).rem_euclid(6283);
                    turn as u16
                };
                let mut others: Vec<(u16, usize)> = (0..ways.len())
                    .filter(|slot| first + slot != at)
                    .map(|slot| (relative(slot), first + slot))
                    .collect();
                others.sort_unstable();
                let bearings: Vec<u16> = others.iter().map(|&(bearing, _)| bearing).collect();
                let noise = (rand_core::Rng::next_u32(&mut random) % 9) as u16;
                let observation = Observation {
                    ways: Ways::from_bearings_mrad(&bearings).ok(),
                    exit,
                    travel_frames: frames,
                    starts_sequence: step == 0,
                    ..Observation::new(Fingerprint::from_steps(self.radius_steps[place] + noise).unwrap())
                };
                let came_by = at;
                let chosen = rand_core::Rng::next_u32(&mut random) as usize % ways.len();
                let reported = if wrong(step) { (chosen + 1) % ways.len() } else { chosen };
                exit = Some(
                    reported
                        .checked_sub(1)
                        .map_or(Exit::Back, |other| Exit::from_bearing_mrad(others[other].0).unwrap()),
                );
                let leaves = if chosen == 0 { at } else { others[chosen - 1].1 };
                frames = Some(self.way(leaves).2);
                at = self.way(leaves).1;
                (came_by, observation)
            })
            .collect()
    }

    /// Whether a map is the part of the building that a walk has driven: the same darts and edges.
    fn is_mapped<const N: usize, const V: usize, const D: usize, const T: usize>(
        &self,
        filter: &OrderedFilter<N, V, D, T>,
        walk: &[(usize, Observation)],
    ) -> bool {
        let map = filter.darts().unwrap();
        let mut image: BTreeMap<DartId, BTreeSet<usize>> = BTreeMap::new();
        let mut edges = BTreeSet::new();
        for (&(dart, _), came_by) in walk.iter().zip(filter.path()).skip(1) {
            let Some(came_by) = came_by else { return false };
            let left_by = self.way(dart).1;
            edges.insert(dart.min(left_by));
            image.entry(came_by).or_default().insert(dart);
            let Some(partner) = map.partner(came_by) else { return false };
            image.entry(partner).or_default().insert(left_by);
        }
        image.values().all(|darts| darts.len() == 1)
            && image.values().flatten().collect::<BTreeSet<_>>().len() == image.len()
            && map.edges().count() == edges.len()
    }
}

fn run(filter: &mut Small, walk: &[(usize, Observation)]) {
    for (_, observation) in walk {
        filter.observe(*observation);
        (0..4).for_each(|_| filter.refine());
    }
}

#[test]
fn loops_and_parallel_corridors_are_mapped() {
    let mut filter = Box::new(Small::new());
    for seed in 0..10 {
        filter.start(CONFIG, seed).unwrap();
        let walk = HOUSE.walk(60, seed, |_| false);
        run(&mut filter, &walk);
        assert!(
            HOUSE.is_mapped(&filter, &walk),
            "seed {seed}: {:?}",
            filter.darts().unwrap().edges().collect::<Vec<_>>()
        );
        assert_eq!((filter.darts.vertices(), filter.darts.genus()), (3, 0));
    }
}

#[test]
fn a_wrong_exit_costs_no_map() {
    let mut filter = Box::new(Small::new());
    let mut right = 0;
    for seed in 0..10 {
        filter.start(CONFIG, seed).unwrap();
        let walk = HOUSE.walk(60, seed, |step| step % 20 == 13);
        run(&mut filter, &walk);
        right += u32::from(HOUSE.is_mapped(&filter, &walk));
    }
    assert!(right >= 9, "{right} of 10");
}

#[test]
fn contradictory_hints_at_every_place_leave_a_hypothesis_and_the_next_walk_is_mapped() {
    let mut filter = Box::new(Small::new());
    filter.start(CONFIG, 3).unwrap();
    for step in 0..150_u16 {
        let observation = Observation {
            ways: Ways::from_bearings_mrad(&[100 + step * 37 % 900, 3000, 3001 + step * 91 % 3000]).ok(),
            exit: Some(Exit::Bearing((step * 51 % 256) as u8)),
            travel_frames: Some(1 + step * 57 % 900),
            ..Observation::new(Fingerprint::from_steps((u32::from(step) * 773 % 4000) as u16).unwrap())
        };
        filter.observe(observation);
        filter.refine();
        assert!(filter.map().vertices().len() > 0 && filter.score().is_finite());
    }
    assert!(filter.faults().count(FaultKind::VerticesFull) > 0, "more places than vertices");
    assert!(filter.faults().count(FaultKind::InvalidHint) > 0, "exits where no way was seen");
    filter.start(CONFIG, 3).unwrap();
    let walk = HOUSE.walk(60, 3, |_| false);
    run(&mut filter, &walk);
    assert!(HOUSE.is_mapped(&filter, &walk));
}

#[test]
fn a_long_run_keeps_its_map_when_old_places_leave_the_record() {
    let mut filter = Box::new(Small::new());
    filter.start(CONFIG, 5).unwrap();
    run(&mut filter, &HOUSE.walk(2000, 5, |step| step % 50 == 7));
    let map = &filter.darts;
    assert_eq!((map.vertices(), map.edges().count(), map.genus()), (3, 4, 0));
    assert!(filter.score().abs() < 1e4);
}

#[test]
fn a_robot_that_is_set_down_elsewhere_finds_its_place_on_the_map() {
    let mut filter = Box::new(Small::new());
    filter.start(CONFIG, 8).unwrap();
    run(&mut filter, &HOUSE.walk(40, 8, |_| false));
    // The second walk starts as the first one did, not where that ended.
    run(&mut filter, &HOUSE.walk(12, 9, |_| false));
    assert_eq!((filter.darts.vertices(), filter.darts.edges().count()), (3, 4));
}

#[test]
fn the_same_input_gives_the_same_result() {
    let map = |seed| {
        let mut filter = Box::new(Small::new());
        filter.start(CONFIG, seed).unwrap();
        run(&mut filter, &HOUSE.walk(50, 2, |step| step % 9 == 4));
        (filter.darts.clone(), filter.path().collect::<Vec<_>>(), filter.score().to_bits())
    };
    assert_eq!(map(1), map(1));
}

#[test]
fn a_hypothesis_built_again_along_its_own_path_is_the_same() {
    let mut filter = Box::new(Small::new());
    for seed in 0..5 {
        filter.start(CONFIG, seed).unwrap();
        let walk = HOUSE.walk(9, seed, |step| step % 7 == 4);
        walk.iter().for_each(|(_, observation)| {
            filter.observe(*observation);
        });
        for rank in 0..filter.beam.len() {
            filter.source.clone_from(filter.beam.get(rank).unwrap());
            let score = filter.source.score();
            assert_eq!(filter.rebuild(0, walk.len()), Some(()));
            assert!((filter.draft.score() - score).abs() < 1e-2, "{} {score}", filter.draft.score());
            assert_eq!(filter.draft.key(), filter.source.key());
            assert_eq!(filter.draft.map.edges().count(), filter.source.map.edges().count());
        }
    }
}

#[test]
fn a_hypothesis_built_again_scores_the_same_after_old_places_have_left_the_record() {
    let mut filter = Box::new(Small::new());
    for seed in 0..5 {
        filter.start(CONFIG, seed).unwrap();
        let walk = HOUSE.walk(100, seed, |step| step % 9 == 4);
        run(&mut filter, &walk[..60]);
        walk[60..].iter().for_each(|(_, observation)| {
            filter.observe(*observation);
        });
        assert!(filter.record.len() < walk.len());
        filter.source.clone_from(filter.beam.get(0).unwrap());
        assert_eq!(filter.rebuild(0, filter.record.len()), Some(()));
        let (built, held) = (filter.draft.score(), filter.source.score());
        assert!((built - held).abs() < 0.1, "seed {seed}: {built} {held}");
    }
}

#[test]
fn a_decoded_path_is_the_best_one_along_known_ways() {
    let mut filter = Box::new(Small::new());
    for seed in 0..20 {
        filter.start(CONFIG, seed).unwrap();
        let walk = HOUSE.walk(40, seed, |step| step % 7 == 3);
        run(&mut filter, &walk);
        filter.source.clone_from(filter.beam.get(0).unwrap());
        let (first, last) = (8 + seed as usize, 14 + seed as usize);
        filter.source.path[first..=last].fill(NONE);
        filter.decoder.start(VertexSet::EMPTY, (NONE, NONE));
        let mut next = 0;
        while next < walk.len() {
            next = filter.decoder.run(&filter.model, &filter.record, &mut filter.source, next, 50).0;
        }
        let (source, model, record) = (&filter.source, &filter.model, &filter.record);
        let gain = |index: usize, before: u8, now: u8| {
            let exit = source.map.partner(now).filter(|&exit| source.map.vertex(exit) == source.map.vertex(before))?;
            let ways = source.map.ways(source.map.vertex(before)).len();
            let entry = record.get(index);
            let exit = source.reported_exit(record, index, before).ln(model, exit, ways);
            let travel = model.travel(source.map.travel(now), entry.ln_travel);
            Some(f64::from(exit) + f64::from(travel) + f64::from(source.arrival(model, &entry, now).total()))
        };
        // The best path to each dart, from the place before the gap.
        let mut best = BTreeMap::from([(source.came_by(first - 1), 0.0)]);
        let mut decoded = 0.0;
        for index in first..=last {
            let to = |now| {
                let from = best.iter().filter_map(|(&before, score)| Some(score + gain(index, before, now)?));
                Some((now, from.max_by(f64::total_cmp)?))
            };
            best = (0..source.map.darts()).filter_map(to).collect();
            decoded += gain(index, source.came_by(index - 1), source.came_by(index)).expect("a known way");
        }
        let score = best[&source.came_by(last)];
        assert!((decoded - score).abs() < 1e-2, "seed {seed}: {decoded} {score}");
    }
}

#[test]
fn a_building_that_is_on_the_map_twice_becomes_one_again() {
    let mut filter = Box::new(Small::new());
    for seed in 0..10 {
        filter.start(CONFIG, seed).unwrap();
        let mut walk = HOUSE.walk(60, seed, |_| false);
        walk[30].1.starts_sequence = true;
        run(&mut filter, &walk);
        let score = filter.score();
        // The only hypothesis left takes the second half for a building of its own.
        filter.source.clear();
        for place in (0..2).flat_map(|_| 0..HOUSE.ways.len()) {
            let vertex = filter.source.map.add_vertex().unwrap();
            for &(bearing_mrad, ..) in HOUSE.ways[place] {
                filter.source.map.add_way(vertex, (u32::from(bearing_mrad) * 65536 / 6283) as u16).unwrap();
            }
        }
        let darts = filter.source.map.darts() / 2;
        for dart in 0..2 * darts {
            let copy = dart / darts * darts;
            filter.source.map.join(dart, HOUSE.way(usize::from(dart - copy)).1 as u8 + copy);
        }
        for (index, &(dart, _)) in walk.iter().enumerate() {
            filter.source.path[index] = dart as u8 + if index < 30 { 0 } else { darts };
        }
        filter.repair_nothing();
        assert!(filter.rebuild(0, walk.len()).is_some());
        assert!(filter.draft.map.vertices() == 6 && filter.draft.score() < score - 5.0);
        filter.beam.start_with(&filter.draft);
        for _ in 0..200 {
            filter.refine();
        }
        filter.refresh();
        assert!(filter.darts.vertices() == 3 && filter.score() > score - 0.5, "seed {seed}");
    }
}
