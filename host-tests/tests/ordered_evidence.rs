//! Faces and genus of edge-ordered maps, and the evidence of the ordered filter, against the reference in `f64`.

#[path = "ordered_behaviour/building.rs"]
#[allow(dead_code, reason = "another test uses the rest")]
mod building;
#[path = "common/split_mix.rs"]
mod split_mix;

use building::{Building, HOUSE, RING, Robot};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
use std::f64::consts::TAU;
use toposlam::{DartMap, Exit, Filter, Fingerprint, Observation, OrderedConfig, OrderedFilter, WeightFactors};
use toposlam_host_tests::ordered::{Model, Rotation, Visit, Walk};

const CONFIG: OrderedConfig = OrderedConfig::DEFAULT.with_noise_mm(15);

/// Tolerance in nats for each place: bearings of the core are rounded to 10⁻⁴ of a turn, logarithms of travel times to 2⁻¹².
const TOLERANCE: f64 = 0.02;

fn visit(observation: &Observation) -> Visit {
    let angle = |bearing: u8| f64::from(bearing) / 256.0 * TAU;
    let others = |ways: toposlam::Ways| Some(ways.others()?.iter().map(|&bearing| angle(bearing)).collect());
    Visit {
        label: f64::from(observation.fingerprint.steps()),
        others: observation.ways.and_then(others),
        exit: observation.exit.map(|exit| match exit {
            Exit::Back => 0.0,
            Exit::Bearing(bearing) => angle(bearing),
            Exit::On => unreachable!("the robot knows its bearing"),
        }),
        ln_travel: observation.travel_frames.map(|frames| f64::from(frames).ln()),
    }
}

/// Walks without refinement and compares the evidence of the best hypothesis with that of its path. Returns how many places were taken
/// for none, and how many for one beyond a place that was not detected, over all comparisons.
fn compare(building: &Building, seed: u64, places: usize) -> [usize; 2] {
    let mut filter = Box::new(OrderedFilter::<8, 16, 80, 64>::new());
    filter.start(CONFIG, seed).unwrap();
    let mut robot = Robot::new(building, seed);
    let mut random = split_mix::Random(seed);
    let mut visits = Vec::new();
    let mut outliers = [0; 2];
    let mut is_on_edge = false;
    for place in 1..=places {
        let mut observation = match random.below(12) {
            _ if std::mem::take(&mut is_on_edge) => robot.step_from_no_place(random.below(2) == 0),
            0 if place > places / 2 => {
                is_on_edge = true;
                robot.step_to_no_place(3000)
            }
            1 if place > places / 2 => robot.step_past(),
            _ => robot.step(),
        };
        match random.below(12) {
            0 => observation.exit = None,
            1 if place > 1 => observation.ways = None,
            2 => observation.travel_frames = None,
            _ => {}
        }
        visits.push(visit(&observation));
        let update = filter.observe(observation);
        let deviation = f64::from(filter.noise_mm()) / f64::from(Fingerprint::STEP_MM);
        let model = Model { deviation, wrong_exit: 0.04, missed_way: 0.05, false_way: 0.02, bearing: 0.1, travel: 0.1 };
        let darts = filter.darts().unwrap();
        let mut walk = Walk::default();
        for (index, (visit, arrival)) in visits.iter().zip(filter.path()).enumerate() {
            let Some(arrival) = arrival else {
                outliers[0] += 1;
                walk.drive_to_no_place(model, visit);
                continue;
            };
            let partner = darts.partner(arrival).map(toposlam::DartId::index);
            let arrival = arrival.index();
            match (walk.edge(), walk.at()) {
                (Some(edge), _) if arrival == edge || partner == Some(edge) && walk.is_driven(edge) => {
                    walk.drive_from_no_place(model, visit, arrival);
                }
                (None, Some(at))
                    if partner.is_some_and(|partner| partner < walk.darts() && !walk.are_ways_of_one(at, partner)) =>
                {
                    outliers[1] += 1;
                    let exit = walk.reported(visit, at).expect("a way of the map leads past a place");
                    walk.drive_past(model, visit, exit, arrival);
                }
                (edge, at) => {
                    // An exit that leads nowhere else is the edge on which the robot is.
                    let exit = partner.filter(|&partner| index > 0 && (at.is_some() || edge == Some(partner)));
                    walk.drive(model, visit, exit, arrival);
                }
            }
        }
        let WeightFactors::Ordered(factors) = update.factors else { panic!("the filter is the ordered one") };
        let [labels, rest] = [factors.ln_labels_q16, factors.ln_moves_q16].map(|q16| f64::from(q16) / 65536.0);
        let (expected, tolerance) = (walk.ln_labels(deviation), TOLERANCE * place as f64);
        assert!((labels - expected).abs() < 1e-3 * place as f64, "labels at {place}: {labels} {expected}");
        assert!((rest - walk.ln_rest).abs() < tolerance, "moves at {place}: {rest} {}", walk.ln_rest);
    }
    outliers
}

#[test]
fn the_evidence_is_that_of_the_reference() {
    let mut outliers = [0; 2];
    for seed in 0..12 {
        for found in [compare(&HOUSE, seed, 40), compare(&RING, seed, 60)] {
            outliers = [outliers[0] + found[0], outliers[1] + found[1]];
        }
    }
    assert!(outliers.iter().all(|&count| count > 20), "{outliers:?}");
}

proptest! {
    #![proptest_config(Config { cases: 400, rng_seed: RngSeed::Fixed(0x7090_51A0), failure_persistence: None, ..Config::default() })]

    #[test]
    fn faces_parts_and_genus_are_those_of_the_reference(
        ways in vec(0_usize..=7, 1..=9),
        joins in vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..24),
    ) {
        let mut map = DartMap::<9, 63>::EMPTY;
        let mut expected = Rotation::default();
        for &count in &ways {
            let vertex = map.add_vertex().unwrap();
            let around = (0..count).map(|way| usize::from(map.add_way(vertex, (way * 9000) as u16).unwrap())).collect();
            expected.ways.push(around);
        }
        expected.partner = vec![None; usize::from(map.darts())];
        for (a, b) in joins {
            let frontiers: Vec<u8> = map.frontiers().collect();
            if frontiers.len() < 2 {
                break;
            }
            let (a, b) = (*a.get(&frontiers), *b.get(&frontiers));
            if a != b {
                map.join(a, b);
                expected.partner[usize::from(a)] = Some(b.into());
                expected.partner[usize::from(b)] = Some(a.into());
            }
        }
        prop_assert_eq!(usize::from(map.faces()), expected.faces());
        prop_assert_eq!(usize::from(map.components()), expected.components());
        prop_assert_eq!(usize::from(map.genus()), expected.genus());
    }
}
