//! Calls of the paper's filter: n-grams, history, consistency, prior.

use core::hint::black_box;

use static_cell::ConstStaticCell;
use toposlam::{
    ConfigError, Consistency, Direction, Filter, Fingerprint, History, Map, Ngram, NgramError, NgramLength, NgramTable,
    NgramsFull, PaperConfig, PaperFilter, Prior,
    persist::Persist,
    persist::snapshot::{FILTER_SECTION, Snapshot, Writer},
};

use super::any::{Opaque, any_fingerprint, any_length, discard, show};

const PARTICLES: usize = 10;
const VERTICES: usize = 16;
const WORDS: usize = 8;

pub(crate) fn ngram() {
    black_box(Fingerprint::from_steps(black_box(9)));
    let (a, b) = (any_fingerprint(), any_fingerprint());
    black_box((a.steps(), a.radius_mm(), a.distance_steps(b)));
    let length = any_length();
    black_box((length.get(), length.bits_per_label(), length.label_step_mm()));
    let labels = [a; 9];
    if let Some(labels) = labels.get(..black_box(5)) {
        match Ngram::new(length, labels) {
            Ok(ngram) => {
                black_box(ngram.label(length, black_box(3)));
                table(length, ngram);
            }
            Err(error) => show::<NgramError>(error),
        }
    }
}

fn table(length: NgramLength, ngram: Ngram) {
    static TABLE: ConstStaticCell<NgramTable<WORDS>> = ConstStaticCell::new(NgramTable::new(NgramLength::MIN));
    static HISTORY: ConstStaticCell<History<WORDS>> = ConstStaticCell::new(History::new());
    let (Some(table), Some(history)) = (TABLE.try_take(), HISTORY.try_take()) else { return };
    *table = black_box(NgramTable::new(length));
    black_box((table.len(), table.is_empty(), table.length()));
    if let Err(error) = table.insert(ngram) {
        show::<NgramsFull>(error);
    }
    for _ in 0..black_box(3) {
        black_box(history.push(any_fingerprint()));
    }
    if let Err(error) = table.extend(history) {
        show::<NgramsFull>(error);
    }
    black_box(table.ngrams());
    static MAP: ConstStaticCell<Map<VERTICES>> = ConstStaticCell::new(Map::new());
    static CONSISTENCY: ConstStaticCell<Consistency<VERTICES, WORDS, 1>> = ConstStaticCell::new(Consistency::new());
    let (Some(map), Some(consistency)) = (MAP.try_take(), CONSISTENCY.try_take()) else { return };
    for direction in [Direction::TwoSided, Direction::MapToHistory, Direction::HistoryToMap].opaque() {
        black_box(consistency.distance_steps(map, &*history, length, direction));
        black_box(consistency.distance_steps(map, &*table, length, direction));
    }
    table.clear();
}

pub(crate) fn history() {
    static HISTORY: ConstStaticCell<History<WORDS>> = ConstStaticCell::new(History::new());
    let Some(history) = HISTORY.try_take() else { return };
    for _ in 0..black_box(3) {
        black_box(history.push(any_fingerprint()));
    }
    black_box((history.len(), history.is_empty(), history.newest(black_box(3))));
    for fingerprint in history.iter() {
        black_box(fingerprint);
    }
    history.clear();
}

pub(crate) fn filter() {
    static FILTER: ConstStaticCell<PaperFilter<PARTICLES, VERTICES, WORDS>> = ConstStaticCell::new(PaperFilter::new());
    static PRIOR: ConstStaticCell<Prior<VERTICES, WORDS>> = ConstStaticCell::new(Prior::new(NgramLength::MIN));
    let Some(filter) = FILTER.try_take() else { return };
    let Some(prior) = PRIOR.try_take() else { return };
    if let Err(error) = filter.start(PaperConfig::default().opaque(), black_box(1)) {
        show::<ConfigError>(error);
    }
    black_box(prior.ngrams());
    if let Ok(ngram) = Ngram::new(any_length(), &[any_fingerprint(); 5]) {
        black_box(prior.insert(ngram).is_ok());
    }
    for _ in 0..black_box(3) {
        let update = filter.observe(any_fingerprint());
        black_box(update.factors.ln_weight_q16());
        black_box(filter.observe_with_prior(any_fingerprint(), prior));
        black_box(prior.extend(filter.history()).is_ok());
    }
    let mut buffer = black_box([0; 100]);
    if let Ok(mut writer) = Writer::new(&mut buffer) {
        discard(writer.stage(filter));
        discard(writer.finish());
    }
    if let Some(section) = Snapshot::open(&buffer).ok().and_then(|snapshot| snapshot.section(FILTER_SECTION)) {
        discard(filter.restore(section));
    }
    black_box((filter.best(), filter.particles(), filter.observed(), filter.faults(), filter.config(), filter.map()));
}
