//! Grams_H: the core's table, which grows with the history, holds what the reference extracts from the whole of it.

mod common;

use common::random::{cases, graph_and_its_history, history};
use common::{core_table_of_history, fingerprint, in_ngram_mm, length, ngrams_of};
use proptest::prelude::*;
use std::collections::BTreeSet;
use toposlam::{History, Ngram, NgramTable, NgramsFull};
use toposlam_host_tests::ngram::{NgramSet, grams_of_history};

/// `Grams_H` with labels as coarse as the n-grams of this length.
fn extracted(history_mm: &[f64], n: usize) -> NgramSet {
    grams_of_history(&history_mm.iter().copied().map(in_ngram_mm(n)).collect::<Vec<_>>(), n)
}

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn the_table_of_an_arbitrary_history_is_grams_h(history in history(25), n in 2_usize..=7) {
        let table = core_table_of_history(&history, n);
        let extracted = extracted(&history, n);
        prop_assert_eq!(table.len(), extracted.len(), "no n-gram is in the table twice");
        prop_assert_eq!(ngrams_of(&table), extracted);
    }
}

proptest! {
    #![proptest_config(cases(500))]

    #[test]
    fn the_table_remembers_what_the_ring_of_the_history_dropped(
        (_, labels) in graph_and_its_history(110),
        n in 2_usize..=5,
    ) {
        let mut history = History::<1>::new();
        let mut table = NgramTable::<128>::new(length(n));
        for &label_mm in &labels {
            history.push(fingerprint(label_mm));
            prop_assert_eq!(table.extend(&history), Ok(()));
        }
        prop_assert_eq!(ngrams_of(&table), extracted(&labels, n));
    }

    #[test]
    fn a_full_table_says_so_and_loses_nothing(labels in history(25), n in 2_usize..=7) {
        let mut history = History::<1>::new();
        let mut table = NgramTable::<2>::new(length(n));
        let mut complete = true;
        for (newest, &label_mm) in labels.iter().enumerate() {
            let before = ngrams_of(&table);
            history.push(fingerprint(label_mm));
            let result = table.extend(&history);
            let after = ngrams_of(&table);
            let all = extracted(&labels[..=newest], n);
            prop_assert!(before.is_subset(&after) && after.is_subset(&all));
            if result == Err(NgramsFull) {
                complete = false;
                prop_assert_eq!(after.len(), NgramTable::<2>::CAPACITY);
            }
            prop_assert_eq!(complete, after == all, "missing n-grams are reported, and nothing else is");
        }
    }
}

#[test]
fn a_full_table_keeps_its_n_grams() {
    let ngram = |label: u16| Ngram::new(length(2), &[fingerprint(2.0 * f64::from(label)); 2]).unwrap();
    let mut table = NgramTable::<2>::new(length(2));
    for label in 0..32 {
        assert_eq!(table.insert(ngram(label)), Ok(true));
    }
    let held: BTreeSet<_> = table.ngrams().iter().copied().collect();
    assert_eq!(table.insert(ngram(32)), Err(NgramsFull));
    assert_eq!(table.insert(ngram(31)), Ok(false));
    assert_eq!(table.ngrams().iter().copied().collect::<BTreeSet<_>>(), held);
}
