//! All stages in one: what reaches the filter, and what the listener makes of what is sent.

mod common;

use common::notes::Notes;
use toposlam::reference::{self, SONARS, VERTICES, ordered, paper, robust};
use toposlam::wire::{
    Arrival, Belief, Capacities, Header, Hello, Location, MapReplica, Message, Reporter, ResetCause, Worst,
};
use toposlam::{Exit, FaultCounters, Filter, Mapper, MapperConfig, Observation};
use toposlam_sim::world::{Plan, RobotModel, Simulation};

fn config<C: Copy>(filter: C) -> MapperConfig<SONARS, C> {
    let (geometry, place) = (reference::RING, reference::PLACE);
    MapperConfig::new(geometry, filter).with_place(place).with_seed(1)
}

fn simulation() -> Simulation {
    Simulation::new(&Plan::built_in("office").unwrap(), RobotModel::default(), 3).unwrap()
}

#[test]
fn the_filter_observes_radius_ways_and_exit() {
    let mut mapper = Mapper::<SONARS, VERTICES, Notes>::new();
    assert!(mapper.start(&config(0)).is_err());
    mapper.start(&config(99)).unwrap();
    let mut expected = Vec::new();
    for (frame, truth) in simulation() {
        if let Some((place, _)) = mapper.observe(&frame, truth.passage()) {
            expected.push(Observation {
                exit: truth.turn,
                ways: truth.passage().ways(&place, 0),
                ..Observation::new(place.fingerprint)
            });
        }
        if expected.len() == 12 {
            break;
        }
    }
    assert_eq!(mapper.filter().observations, expected);
    assert!(expected.iter().any(|observation| observation.exit == Some(Exit::Back)));
    assert!(expected.iter().any(|observation| observation.ways.is_some_and(|ways| ways.count() == 3)));
    let capacities = Capacities::of_mapper::<SONARS, VERTICES, Notes>(&config(99));
    assert_eq!((capacities.hypotheses, capacities.history, capacities.ngram_length), (7, 99, 3));
}

/// A listener to the whole run has what the filter believes, after every place.
fn a_listener_has_what_the_filter_believes<const V: usize, F: Filter<V>>(settings: F::Config) {
    let mut mapper = Box::new(Mapper::<SONARS, V, F>::new());
    mapper.start(&config(settings)).unwrap();
    let mut reporter = Reporter::new();
    let capacities = Capacities::of_mapper::<SONARS, V, F>(&config(settings));
    reporter.start(Hello::new(0, ResetCause::Unknown, 1, capacities), 100);
    let mut replica = MapReplica::<V>::new();
    let mut sequence = 0;
    let mut places = 0;
    for (frame, truth) in simulation() {
        let seen = mapper.observe(&frame, truth.passage());
        reporter.report(&mapper, seen.as_ref(), &FaultCounters::new(), |message: &Message| {
            replica.apply(Header { sequence, arrival: Arrival::InOrder }, message);
            sequence = sequence.wrapping_add(1);
            Ok(())
        });
        let Some((_, update)) = seen else { continue };
        let filter = mapper.filter();
        assert!(replica.is_converged(), "place {places}");
        assert!(replica.edges().eq(filter.map().edges().map(|(a, b)| (a.into(), b.into()))), "place {places}");
        assert_eq!(replica.location(), Some(Location::from(&update)));
        assert_eq!(replica.belief(), Some(Belief::of(filter, places)));
        assert_eq!(replica.worst(), Some(Worst::of(filter, places)));
        let belief = replica.belief().unwrap();
        assert!((1..=1000).contains(&belief.map_permille), "{belief:?}");
        let certain: u16 = belief.vertices.as_slice().iter().map(|place| place.permille).sum();
        assert!((1..=1004).contains(&certain), "{belief:?}");
        places += 1;
        if places == 40 {
            break;
        }
    }
}

#[test]
fn a_listener_has_what_the_ordered_filter_believes() {
    a_listener_has_what_the_filter_believes::<{ ordered::VERTICES }, ordered::Filter>(ordered::FILTER);
}

#[test]
fn a_listener_has_what_the_robust_filter_believes() {
    a_listener_has_what_the_filter_believes::<{ robust::VERTICES }, robust::Filter>(robust::FILTER);
}

#[test]
fn a_listener_has_what_the_paper_s_filter_believes() {
    a_listener_has_what_the_filter_believes::<{ paper::VERTICES }, paper::Filter>(paper::FILTER);
}
