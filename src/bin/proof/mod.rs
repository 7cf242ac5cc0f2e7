//! Calls of every public function of the library, by module.

mod robot;
mod sonar;

use core::{
    fmt::{self, Write},
    hint::black_box,
};

use static_cell::ConstStaticCell;
use toposlam::{
    Config, ConfigError, Consistency, Direction, FaultCounters, FaultKind, Fingerprint, FingerprintError, History, Map,
    Ngram, NgramError, NgramLength, NgramTable, NgramsFull, Observation, PaperFilter, PerVertex, Prior, RobustConfig,
    RobustFilter, Turn, VertexId, VertexSet, VerticesFull,
    persist::Persist,
    persist::snapshot::{FILTER_SECTION, Resume, Snapshot, SnapshotError, SnapshotPolicy, Writer},
    place::{PlaceConfig, PlaceDetector},
    reference,
    ring::{Echo, RingFrame, RingGeometry},
    wire::{
        Decoder, EncodeError, Encoder, GoalState, Hello, HelloError, Inbox, MAX_FRAME_BYTES, MapReplica, Message,
        Outcome, Payload, Progress, QueueFull, Refusal, Reply, Reporter, Request, ResetCause, Setting, Settings,
        Staging, Version, crc32, map_digest,
    },
};

pub(crate) use robot::{drive, robot};
pub(crate) use sonar::sonar;

const PARTICLES: usize = 10;
const VERTICES: usize = 16;
const WORDS: usize = 8;

/// A value that the optimiser knows nothing about.
trait Opaque: Sized {
    fn opaque(self) -> Self {
        black_box(self)
    }
}

impl<T> Opaque for T {}

/// Takes text and forgets it.
struct Nowhere;

impl Write for Nowhere {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        black_box(text);
        if black_box(true) { Ok(()) } else { Err(fmt::Error) }
    }
}

/// Formats an error; whether that worked does not matter here.
fn show<ERROR: fmt::Display>(error: ERROR) {
    let _ = black_box(write!(Nowhere, "{error}"));
}

pub(crate) fn fault() {
    let mut counters = FaultCounters::new().opaque();
    let other = FaultCounters::default().opaque();
    for kind in FaultKind::ALL.opaque() {
        counters.record(kind);
        black_box(counters.count(kind));
    }
    counters.add(&other);
    black_box(counters);
}

pub(crate) fn ring() {
    black_box(Echo::Silence.opaque().range_mm());
    black_box(RingFrame { echoes: [Echo::Dead.opaque(); 16] }.dead_sensors().last());
}

fn any_fingerprint() -> Fingerprint {
    match Fingerprint::from_radius_mm(black_box(1200)) {
        Ok(fingerprint) => fingerprint,
        Err(error) => {
            show::<FingerprintError>(error);
            Fingerprint::MAX
        }
    }
}

fn any_length() -> NgramLength {
    match NgramLength::new(black_box(5)) {
        Ok(length) => length,
        Err(error) => {
            show::<NgramError>(error);
            NgramLength::MIN
        }
    }
}

pub(crate) fn fingerprint_and_ngram() {
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

fn any_vertex() -> VertexId {
    VertexId::new(black_box(1)).unwrap_or(VertexId::FIRST)
}

pub(crate) fn map_and_history() {
    static MAP: ConstStaticCell<Map<VERTICES>> = ConstStaticCell::new(Map::new());
    let Some(map) = MAP.try_take() else { return };
    for _ in 0..black_box(3) {
        if let Err(error) = map.add_vertex(any_fingerprint()) {
            show::<VerticesFull>(error);
        }
    }
    map.observe(any_vertex(), any_fingerprint());
    map.add_edge(any_vertex(), any_vertex());
    black_box((map.vertices().len(), map.contains(any_vertex()), map.label(any_vertex()), map.visits(any_vertex())));
    let mut set = map.neighbours(any_vertex());
    set.insert(any_vertex());
    set.remove(any_vertex());
    black_box((set.contains(any_vertex()), set.len(), set.is_empty(), set.bits(), set.pop_first()));
    black_box(
        set | VertexSet::from(any_vertex()) & VertexSet::first(black_box(3)) - VertexSet::from_bits(black_box(7)),
    );
    for vertex in set.iter() {
        black_box(vertex);
    }
    let mut per_vertex = PerVertex::<u32, 10>::filled(0);
    per_vertex[any_vertex()] = black_box(1);
    black_box((per_vertex[any_vertex()], per_vertex.get(any_vertex())));
    black_box(map.labels());
    for edge in map.edges() {
        black_box(edge);
    }
    map.clear();
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
    if let Err(error) = filter.start(Config::default().opaque(), black_box(1)) {
        show::<ConfigError>(error);
    }
    black_box(prior.ngrams());
    if let Ok(ngram) = Ngram::new(any_length(), &[any_fingerprint(); 5]) {
        black_box(prior.insert(ngram).is_ok());
    }
    for _ in 0..black_box(3) {
        let update = filter.observe(any_fingerprint());
        black_box(update.factors.ln_weight_q16());
        black_box(filter.observe_with_draws(any_fingerprint(), || black_box(7)));
        black_box(filter.observe_with_prior(any_fingerprint(), prior));
        black_box(filter.observe_with_prior_and_draws(any_fingerprint(), prior, || black_box(7)));
        black_box(prior.extend(filter.history()).is_ok());
    }
    black_box((filter.best(), filter.particles(), filter.observed(), filter.faults(), filter.config(), filter.map()));
}

fn any_turn() -> Option<Turn> {
    [None, Some(Turn::Back), Some(Turn::On)].opaque().first().copied().flatten()
}

pub(crate) fn robust_filter() {
    static LARGE: ConstStaticCell<RobustFilter<3, 32, 32>> = ConstStaticCell::new(RobustFilter::new());
    if let Some(filter) = LARGE.try_take() {
        robust(filter);
    }
}

fn robust<const N: usize, const V: usize, const HISTORY: usize>(filter: &mut RobustFilter<N, V, HISTORY>) {
    if let Err(error) = filter.start(RobustConfig::default().opaque(), black_box(1)) {
        show::<ConfigError>(error);
    }
    for _ in 0..black_box(3) {
        black_box(filter.observe(any_fingerprint()));
        let observation =
            Observation { fingerprint: any_fingerprint(), turn: any_turn(), degree: black_box(Some(3)), begins: false };
        black_box(filter.observe(observation.opaque()));
        filter.polish();
        filter.set_localise_only(black_box(true));
        filter.polish();
        black_box(filter.refresh());
        black_box(filter.assume_path(&[any_vertex(); 3]));
    }
    let map = *filter.map();
    let restarted = filter.start_with_map(RobustConfig::default().opaque(), black_box(1), black_box(&map));
    let _ = black_box((restarted, filter.evidence(), filter.noise_mm()));
    black_box((filter.map(), filter.observed(), filter.faults(), filter.renamed(any_vertex()), filter.worst()));
    black_box((filter.place_probability_q16(any_vertex()), filter.map_probability_q16()));
    for vertex in filter.path() {
        black_box(vertex);
    }
    let mut buffer = black_box([0; 100]);
    if let Ok(mut writer) = Writer::new(&mut buffer) {
        forget(writer.stage(filter));
        forget(writer.finish());
    }
    if let Some(section) = Snapshot::open(&buffer).ok().and_then(|snapshot| snapshot.section(FILTER_SECTION)) {
        forget(filter.restore(section));
    }
}

fn any_frame() -> RingFrame<16> {
    RingFrame { echoes: black_box([Echo::Range { range_mm: 1000 }; 16]) }
}

pub(crate) fn place() {
    static DETECTOR: ConstStaticCell<PlaceDetector<16>> = ConstStaticCell::new(PlaceDetector::new());
    let Some(detector) = DETECTOR.try_take() else { return };
    if let Err(error) = detector.start(PlaceConfig::default().opaque(), RingGeometry::even().opaque()) {
        show::<ConfigError>(error);
    }
    for _ in 0..black_box(9) {
        black_box(detector.observe(&any_frame()));
    }
    black_box(detector.faults());
}

fn any_answer(message: &Message) -> Result<(), QueueFull> {
    black_box(message);
    if black_box(true) { Ok(()) } else { Err(QueueFull) }
}

pub(crate) fn mapper() {
    static MAPPER: ConstStaticCell<reference::RobotMapper> = ConstStaticCell::new(reference::RobotMapper::new());
    let Some(mapper) = MAPPER.try_take() else { return };
    if let Err(error) = mapper.start(&reference::MAPPER.opaque()) {
        show::<ConfigError>(error);
    }
    for _ in 0..black_box(9) {
        black_box(mapper.observe(&any_frame(), any_turn()));
    }
    robust(mapper.filter_mut());
    mapper.kidnapped();
    black_box((mapper.faults(), mapper.map(), mapper.filter(), mapper.detector()));
    snapshot(mapper);
    static REPORTER: ConstStaticCell<Reporter<VERTICES>> = ConstStaticCell::new(Reporter::new());
    let Some(reporter) = REPORTER.try_take() else { return };
    let seen = mapper.observe(&any_frame(), any_turn());
    reporter.report(mapper, seen.as_ref(), &FaultCounters::new().opaque(), any_answer);
    reporter.resync(any_answer);
    black_box((reporter.refused(), map_digest(mapper.map())));
}

/// Whether something worked, which does not matter here.
fn forget<T, ERROR>(outcome: Result<T, ERROR>) {
    black_box(outcome.is_ok());
}

fn snapshot(mapper: &mut reference::RobotMapper) {
    static BYTES: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);
    let Some(buffer) = BYTES.try_take().and_then(|bytes| bytes.get_mut(..black_box(500))) else { return };
    if let Err(error) = mapper.snapshot(buffer) {
        show::<SnapshotError>(error);
    }
    let resume = [Resume::InPlace, Resume::AtUnknownVertex].opaque().first().copied().unwrap_or(Resume::InPlace);
    if let Err(error) = mapper.restore(buffer, resume) {
        show::<SnapshotError>(error);
    }
    if let Ok(mut writer) = Writer::new(buffer) {
        forget(writer.section(black_box(9), |section| {
            section.u8(black_box(1))?;
            section.u16(black_box(2))?;
            section.u32(black_box(2))?;
            section.u64(black_box(3))?;
            section.f32(black_box(4.0))?;
            section.bytes(black_box(&[1, 2, 3]))
        }));
        forget(mapper.save(&mut writer));
        forget(writer.finish());
    }
    if let Ok(snapshot) = Snapshot::open(buffer) {
        black_box(snapshot.length());
        if let Some(mut section) = snapshot.section(black_box(9)) {
            forget(section.u8());
            forget(section.u16());
            forget(section.u32());
            forget(section.u64());
            forget(section.f32());
            forget(section.bytes(black_box(7)));
            forget(section.finish());
        }
    }
    black_box(SnapshotPolicy::default().opaque().is_due(black_box(7)));
}

pub(crate) fn wire() {
    static BYTES: ConstStaticCell<[u8; MAX_FRAME_BYTES]> = ConstStaticCell::new([0; MAX_FRAME_BYTES]);
    static DECODER: ConstStaticCell<Decoder> = ConstStaticCell::new(Decoder::new());
    static PICTURE: ConstStaticCell<MapReplica<64>> = ConstStaticCell::new(MapReplica::new());
    let (Some(bytes), Some(decoder), Some(picture)) = (BYTES.try_take(), DECODER.try_take(), PICTURE.try_take()) else {
        return;
    };
    let mut encoder = Encoder::new(black_box(9));
    let message = Message::Edge { a: 1, b: 2, present: true }.opaque();
    if let Some(Err(error)) = bytes.get_mut(..black_box(40)).map(|out| encoder.encode(&message, out)) {
        show::<EncodeError>(error);
    }
    let mut rest = bytes.as_slice().opaque();
    loop {
        rest = match decoder.feed(rest) {
            Progress::NeedsMore => break,
            Progress::Error { error, rest } => {
                show(error);
                rest
            }
            Progress::Message { header, message, rest } => {
                picture.apply(header, &message);
                rest
            }
        };
    }
    black_box(decoder.counters());
    black_box((picture.is_converged(), picture.is_complete(), picture.vertices(), picture.row(black_box(1))));
    for edge in picture.edges() {
        black_box(edge);
    }
    black_box((picture.hello(), picture.location(), picture.evidence(), picture.health()));
    black_box((picture.belief(), picture.worst(), picture.goal_status()));
    black_box((picture.neighbours(black_box(3)), picture.fault(FaultKind::BusError.opaque())));
    if let Some(Err(error)) = picture.hello().map(|hello: Hello| hello.check()) {
        show::<HelloError>(error);
    }
    let echoes = toposlam::wire::Echoes::new(&any_frame().echoes);
    for echo in echoes.iter() {
        black_box(echo);
    }
}

pub(crate) fn commands() {
    static INBOX: ConstStaticCell<Inbox> = ConstStaticCell::new(Inbox::new());
    static BUFFER: ConstStaticCell<[u8; 300]> = ConstStaticCell::new([0; 300]);
    static FRAME: ConstStaticCell<[u8; MAX_FRAME_BYTES]> = ConstStaticCell::new([0; MAX_FRAME_BYTES]);
    let (Some(inbox), Some(buffer), Some(frame)) = (INBOX.try_take(), BUFFER.try_take(), FRAME.try_take()) else {
        return;
    };
    let mut staging = Staging::new(buffer);
    for _ in 0..black_box(300) {
        inbox.take(black_box(7));
    }
    let reply = inbox.turn(|command| {
        black_box(*command);
        let refuse = |refusal: Refusal| {
            show::<Refusal>(refusal);
            Outcome::from(refusal)
        };
        let taken = staging.take(|bytes| {
            black_box(&bytes);
            black_box(Some(200))
        });
        black_box(Outcome::from(taken));
        black_box(staging.piece(black_box(3)).unwrap_or_else(refuse));
        black_box(staging.begin(black_box(3), black_box(4)).is_ok());
        let bytes = black_box([1; 64]);
        black_box(staging.chunk(black_box(1), bytes.get(..black_box(3)).unwrap_or(&[])).is_ok());
        match staging.commit() {
            Ok(bytes) => {
                black_box(bytes);
                Outcome::Done
            }
            Err(refusal) => refuse(refusal),
        }
    });
    if let Some(reply) = reply.map(Reply::opaque) {
        let message = Message::Reply(reply).opaque();
        black_box(Encoder::new(black_box(9)).encode(&message, frame).is_ok());
    }
    let request = Request { id: black_box(1), command: toposlam::wire::Command::Info.opaque() };
    black_box(Encoder::new(black_box(9)).encode(&request, frame).is_ok());
    black_box((request.boot(), inbox.faults(), crc32(black_box(&[1, 2, 3])), Version::LIBRARY));
    let settings = Settings {
        filter: RobustConfig::default().opaque(),
        place: PlaceConfig::default().opaque(),
        speed_permille: black_box(1000),
        snapshot_every_places: black_box(10),
    };
    black_box(settings.with(Setting::Hypotheses(7).opaque(), black_box(10), black_box(16)).is_ok());
    show(ResetCause::from(black_box(3)));
    show(GoalState::from(black_box(3)));
}
