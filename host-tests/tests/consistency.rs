//! Eq. 2 and 3: what the core computes without enumerating walks equals what the reference enumerates, in every case.

mod common;

use common::random::{
    cases, dense_graph_and_its_history, graph, graph_and_history, graph_and_its_history, graph_and_what_is_missing,
    sequences,
};
use common::{
    HISTORY_WORDS, TABLE_WORDS, core_distances_mm, core_history, core_table_of_history, fingerprint, in_ngram_mm,
    length, ngrams_of, reference_distances_mm,
};
use proptest::prelude::*;
use toposlam::{Ngram, NgramTable};
use toposlam_host_tests::consistency::hausdorff;
use toposlam_host_tests::graph::Graph;
use toposlam_host_tests::ngram::{grams_of_graph, grams_of_history};

/// Words of a table that holds every n-gram of the densest graph here.
const EXPLORED_WORDS: usize = 512;

/// The reference's Eq. 2 of a graph and a history, labels as coarse as the n-grams of this length.
fn enumerated_mm(graph: &Graph, history_mm: &[f64], n: usize) -> [f64; 3] {
    let history: Vec<f64> = history_mm.iter().copied().map(in_ngram_mm(n)).collect();
    let of_graph = grams_of_graph(&graph.map_labels(in_ngram_mm(n)), n);
    reference_distances_mm(hausdorff(&of_graph, &grams_of_history(&history, n)))
}

/// The history itself and the table of its n-grams both give the enumerated distances.
fn agrees(graph: &Graph, history_mm: &[f64], n: usize) -> Result<(), TestCaseError> {
    let enumerated = enumerated_mm(graph, history_mm, n);
    let history = core_history::<HISTORY_WORDS>(history_mm);
    prop_assert_eq!(core_distances_mm::<_, 1>(graph, &history, n), enumerated, "history as evidence, n = {}", n);
    let table = core_table_of_history(history_mm, n);
    prop_assert_eq!(core_distances_mm::<_, 7>(graph, &table, n), enumerated, "table as evidence, n = {}", n);
    Ok(())
}

proptest! {
    #![proptest_config(cases(2000))]

    #[test]
    fn distances_equal_the_enumeration_for_n_2_to_4((graph, history) in graph_and_history(40), n in 2_usize..=4) {
        agrees(&graph, &history, n)?;
    }

    #[test]
    fn distances_equal_the_enumeration_for_n_5((graph, history) in graph_and_history(30)) {
        agrees(&graph, &history, 5)?;
    }
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn distances_equal_the_enumeration_where_ways_are_many(
        (graph, history) in dense_graph_and_its_history(80),
        n in 4_usize..=5,
    ) {
        agrees(&graph, &history, n)?;
    }

    #[test]
    fn distances_equal_the_enumeration_for_coarse_labels((graph, history) in graph_and_history(14), n in 6_usize..=7) {
        agrees(&graph, &history, n)?;
    }
}

proptest! {
    #![proptest_config(cases(1000))]

    #[test]
    fn histories_shorter_than_the_n_grams_agree((graph, history) in graph_and_history(5), n in 2_usize..=5) {
        agrees(&graph, &history, n)?;
    }

    #[test]
    fn a_wrapped_history_counts_with_its_newest_places((graph, history) in graph_and_its_history(110), n in 2_usize..=5) {
        let kept = &history[history.len().saturating_sub(32)..];
        let core = core_history::<1>(&history);
        prop_assert_eq!(core_distances_mm::<_, 1>(&graph, &core, n), enumerated_mm(&graph, kept, n));
    }

    #[test]
    fn a_prior_that_is_no_path_agrees(
        graph in graph(),
        (n, sequences) in (2_usize..=5).prop_flat_map(|n| (Just(n), sequences(n, 60))),
    ) {
        let mut table = NgramTable::<TABLE_WORDS>::new(length(n));
        for labels in sequences {
            let fingerprints: Vec<_> = labels.into_iter().map(fingerprint).collect();
            table.insert(Ngram::new(length(n), &fingerprints).unwrap()).unwrap();
        }
        let enumerated = hausdorff(&grams_of_graph(&graph, n), &ngrams_of(&table));
        prop_assert_eq!(core_distances_mm::<_, 7>(&graph, &table, n), reference_distances_mm(enumerated));
    }
}

proptest! {
    #![proptest_config(cases(200))]

    #[test]
    fn n_grams_missing_from_a_complete_exploration_are_found(
        (graph, missing) in graph_and_what_is_missing(),
        n in prop_oneof![1 => 3_usize..=4, 2 => Just(5)],
    ) {
        let of_graph = grams_of_graph(&graph, n);
        let mut explored: Vec<_> = of_graph.iter().cloned().collect();
        for index in missing {
            if !explored.is_empty() {
                explored.swap_remove(index.index(explored.len()));
            }
        }
        let mut table = Box::new(NgramTable::<EXPLORED_WORDS>::new(length(n)));
        for ngram in &explored {
            let fingerprints: Vec<_> = ngram.labels().iter().map(|&label_mm| fingerprint(label_mm)).collect();
            table.insert(Ngram::new(length(n), &fingerprints).unwrap()).unwrap();
        }
        let enumerated = hausdorff(&of_graph, &explored.into_iter().collect());
        prop_assert_eq!(core_distances_mm::<_, 7>(&graph, &*table, n), reference_distances_mm(enumerated));
    }
}
