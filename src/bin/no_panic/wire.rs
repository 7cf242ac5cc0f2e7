//! Calls of the serial protocol.

use core::hint::black_box;

use static_cell::ConstStaticCell;
use toposlam::{
    FaultKind, RobustConfig,
    persist::snapshot::{Snapshot, Writer},
    place::PlaceConfig,
    wire::{
        Decoder, EncodeError, Encoder, GoalState, Hello, HelloError, Inbox, MAX_FRAME_BYTES, MapReplica, Message, Name,
        NameError, Names, Outcome, Payload, Progress, Refusal, Reply, Request, ResetCause, Setting, Settings, Staging,
        Version, crc32,
    },
};

use super::any::{Opaque, any_frame, discard, show};

pub(crate) fn wire() {
    static BYTES: ConstStaticCell<[u8; MAX_FRAME_BYTES]> = ConstStaticCell::new([0; MAX_FRAME_BYTES]);
    static DECODER: ConstStaticCell<Decoder> = ConstStaticCell::new(Decoder::new());
    static REPLICA: ConstStaticCell<MapReplica<64>> = ConstStaticCell::new(MapReplica::new());
    let (Some(bytes), Some(decoder), Some(replica)) = (BYTES.try_take(), DECODER.try_take(), REPLICA.try_take()) else {
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
                replica.apply(header, &message);
                rest
            }
        };
    }
    black_box(decoder.counters());
    black_box((replica.is_converged(), replica.is_complete(), replica.vertices(), replica.row(black_box(1))));
    for edge in replica.edges() {
        black_box(edge);
    }
    black_box((replica.hello(), replica.location(), replica.evidence(), replica.health()));
    black_box((replica.belief(), replica.worst(), replica.goal_status(), replica.exploration()));
    black_box((replica.ways(black_box(3)), replica.has_ways()));
    for frontier in replica.frontiers() {
        black_box(frontier);
    }
    black_box((replica.neighbours(black_box(3)), replica.fault(FaultKind::BusError.opaque())));
    if let Some(Err(error)) = replica.hello().map(|hello: Hello| hello.check()) {
        show::<HelloError>(error);
    }
    let echoes = toposlam::wire::Echoes::new(&any_frame().echoes);
    for echo in echoes.iter() {
        black_box(echo);
    }
}

pub(crate) fn names() {
    let mut names = Names::<16>::new();
    let text = black_box("hall");
    match Name::new(text) {
        Ok(name) => discard(names.set(black_box(3), name)),
        Err(error) => show::<NameError>(error),
    }
    show::<Name>(names.get(black_box(3)));
    names.remap(|vertex| black_box(Some(vertex)));
    names.truncate(black_box(7));
    black_box((names.find(text), names.vertices(), names.iter().count()));
    let mut bytes = [0; 100];
    if let Ok(mut writer) = Writer::new(&mut bytes) {
        discard(names.save(&mut writer));
        discard(writer.finish());
    }
    if let Ok(snapshot) = Snapshot::open(black_box(&bytes)) {
        discard(Names::<16>::check(&snapshot));
        discard(names.restore(&snapshot, black_box(7)));
    }
    names.clear();
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
        black_box(staging.outgoing_chunk(black_box(3)).unwrap_or_else(refuse));
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
    black_box((request.start(), request.clock(), inbox.faults(), crc32(black_box(&[1, 2, 3])), Version::LIBRARY));
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
