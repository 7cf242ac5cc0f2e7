//! The operator at the other end of a robot's line, who sends commands all the time and repeats unanswered requests.

use std::collections::VecDeque;

use toposlam::wire::{CHUNK_BYTES, Chunk, Command, Encoder, MAX_FRAME_BYTES, Outcome, Reply, Request, Setting, crc32};

/// Turns of the robot's loop after which an unanswered request is repeated.
const PATIENCE_TURNS: u32 = 3;
/// Interval between two tasks, in turns: five minutes.
const TURNS_BETWEEN_TASKS: u64 = 3000;
/// Shortest duration of a pause, in turns.
const PAUSE_TURNS: u64 = 50;
/// Requests of an operator have numbers below this.
const LAST_ID: u16 = 0x7FFF;

/// Counts of the operator's actions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperatorCounts {
    /// Answered requests.
    pub answered: u64,
    /// Rejected requests among them.
    pub refused: u64,
    /// Repetitions of a request.
    pub repeated: u64,
    /// Snapshots that were fetched and restored.
    pub restored: u64,
}

/// An operator with at most one pending request.
pub(super) struct Operator {
    encoder: Encoder,
    id: u16,
    todo: VecDeque<Command>,
    sent: Option<(Request, u32)>,
    snapshot: Vec<u8>,
    tasks: u64,
    /// Nothing is sent before this turn.
    quiet_until: u64,
    counts: OperatorCounts,
}

impl Operator {
    pub(super) fn new() -> Self {
        Self {
            encoder: Encoder::new(0),
            id: 0,
            todo: VecDeque::new(),
            sent: None,
            snapshot: Vec::new(),
            tasks: 0,
            quiet_until: 0,
            counts: OperatorCounts::default(),
        }
    }

    /// Returns the bytes to send; called once in each turn of the robot's loop. `vertices` is the size of the robot's
    /// map.
    pub(super) fn turn(&mut self, turn: u64, vertices: u8) -> Vec<u8> {
        if turn.is_multiple_of(TURNS_BETWEEN_TASKS) && self.todo.is_empty() && self.sent.is_none() {
            self.set_task(vertices);
        }
        match &mut self.sent {
            Some((_, waited)) if *waited < PATIENCE_TURNS => {
                *waited += 1;
                return Vec::new();
            }
            Some((_, waited)) => {
                *waited = 0;
                self.counts.repeated += 1;
            }
            None if turn < self.quiet_until => return Vec::new(),
            None => {
                let Some(command) = self.todo.pop_front() else { return Vec::new() };
                self.id = self.id.wrapping_add(1) & LAST_ID;
                self.sent = Some((Request { id: self.id, command }, 0));
            }
        }
        let Some((request, _)) = &self.sent else { return Vec::new() };
        let mut frame = [0; MAX_FRAME_BYTES];
        // A buffer of that size is always enough. The zero before it terminates a frame that noise has begun.
        let frame = self.encoder.encode(request, &mut frame).unwrap_or(&[]);
        [&[0], frame].concat()
    }

    /// Sets the next task; the tasks cover all commands of a robot.
    fn set_task(&mut self, vertices: u8) {
        self.tasks += 1;
        let round = self.tasks / 9;
        let some_vertex = (round % u64::from(vertices.max(1))) as u8;
        self.todo.extend(match self.tasks % 9 {
            0 => vec![Command::Info],
            1 => vec![Command::GetMap],
            2 => vec![Command::GoTo { vertex: some_vertex }],
            3 => vec![Command::Explore],
            4 => vec![Command::Pause { on: true }, Command::Pause { on: false }],
            5 => vec![Command::SetConfig(Setting::SpeedPermille(if round.is_multiple_of(2) { 800 } else { 1000 }))],
            6 => vec![Command::SetConfig(Setting::NoiseMm(0)), Command::GoTo { vertex: u8::MAX }],
            7 => vec![Command::SetConfig(Setting::SnapshotEveryPlaces(if round.is_multiple_of(2) { 10 } else { 25 }))],
            _ => vec![Command::Pause { on: true }, Command::GetSnapshot { offset: 0 }],
        });
    }

    /// The pending command with this number.
    pub(super) fn awaits(&self, id: u16) -> Option<Command> {
        self.sent.filter(|(request, _)| request.id == id).map(|(request, _)| request.command)
    }

    /// Processes a reply.
    pub(super) fn receive(&mut self, reply: &Reply, turn: u64) {
        let Some(command) = self.awaits(reply.request) else { return };
        self.sent = None;
        self.counts.answered += 1;
        self.counts.refused += u64::from(matches!(reply.outcome, Outcome::Refused(_)));
        match (command, reply.outcome) {
            (Command::Pause { on: true }, _) => self.quiet_until = turn + PAUSE_TURNS,
            (Command::GetSnapshot { offset }, Outcome::Snapshot { total, bytes, .. }) => {
                self.snapshot.truncate(offset.into());
                self.snapshot.extend(bytes.as_slice());
                let next = self.snapshot.len() as u16;
                if next < total { self.todo.push_back(Command::GetSnapshot { offset: next }) } else { self.send_back() }
            }
            // Another snapshot was taken in the meantime, or none could be taken.
            (Command::GetSnapshot { .. }, _) => self.todo.push_back(Command::Pause { on: false }),
            (Command::RestoreCommit, Outcome::Done) => self.counts.restored += 1,
            _ => {}
        }
    }

    /// Restores the fetched snapshot. The robot has paused since the fetch, so that it loses no place.
    fn send_back(&mut self) {
        let length = self.snapshot.len() as u16;
        self.todo.push_back(Command::RestoreBegin { length, crc: crc32(&self.snapshot) });
        for (offset, bytes) in (0..=length).step_by(CHUNK_BYTES).zip(self.snapshot.chunks(CHUNK_BYTES)) {
            self.todo.push_back(Command::RestoreChunk { offset, bytes: Chunk::new(bytes.iter().copied()) });
        }
        self.todo.extend([Command::RestoreCommit, Command::Pause { on: false }]);
    }

    pub(super) const fn counts(&self) -> OperatorCounts {
        self.counts
    }
}
