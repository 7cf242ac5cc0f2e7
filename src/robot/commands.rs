//! The commands of the serial line, and the status of the goal.

use super::{Board, FRAMES_PER_HELLO, Line, RECEIVED_PER_TURN, Robot, restore, snapshot};
use crate::drive::{self, Goal};
use crate::fault::FaultKind;
use crate::filter::Filter;
use crate::map::VertexId;
use crate::persist::Persist;
use crate::persist::snapshot::Resume;
use crate::wire::{
    Command, FilterSettings, GoalState, GoalStatus, Info, Message, Outcome, Refusal, Setting, Settings, Version,
};

/// No goal status was sent.
pub(super) const NO_GOAL: (Goal, drive::GoalStatus) = (Goal::Explore, drive::GoalStatus::Inactive);

impl<const SONARS: usize, const V: usize, F> Robot<'_, SONARS, V, F>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    /// Reads the received bytes and executes at most one command.
    #[inline(never)]
    pub(super) fn poll_commands(&mut self, board: &mut impl Board) {
        for _ in 0..RECEIVED_PER_TURN {
            let Some(byte) = board.receive() else { break };
            self.inbox.take(byte);
        }
        // The command needs the robot, and the robot holds the inbox.
        let mut inbox = core::mem::take(&mut self.inbox);
        let reply = inbox.turn(|command| self.execute(command, board).unwrap_or_else(Outcome::Refused));
        self.inbox = inbox;
        if let Some(reply) = reply {
            // A client that misses the reply repeats its request.
            let _ = self.send(&Message::Reply(reply), board);
        }
    }

    fn execute(&mut self, command: &Command, board: &mut impl Board) -> Result<Outcome, Refusal> {
        match *command {
            Command::Info => return Ok(Outcome::Info(self.info(board))),
            Command::GetMap => self.reporter.send_full(),
            Command::GetSnapshot { offset } => {
                if offset == 0 {
                    let Self { mapper, reporter, staging, .. } = self;
                    staging.take(|buffer| snapshot(mapper, reporter, buffer).ok())?;
                }
                return self.staging.outgoing_chunk(offset);
            }
            Command::RestoreBegin { length, crc } => self.staging.begin(length, crc)?,
            Command::RestoreChunk { offset, bytes } => self.staging.chunk(offset, bytes.as_slice())?,
            Command::RestoreCommit => self.restore_staged(board)?,
            Command::Reset => self.reset(board)?,
            Command::SetConfig(setting) => self.set(setting)?,
            Command::LocaliseOnly { on } => {
                self.mapper.filter_mut().set_localise_only(on);
                self.localise_only = self.mapper.filter().is_localise_only();
                if self.localise_only != on {
                    return Err(Refusal::Unsupported);
                }
            }
            Command::GoTo { vertex } => self.go_to(vertex, board)?,
            Command::Explore => self.set_goal(Goal::Explore, board),
            Command::Pause { on } => self.paused = on,
            Command::Name { vertex, name } => {
                let vertex = self.known(vertex)?;
                self.reporter.set_name(vertex.into(), name)?;
            }
            Command::GetSettings => return Ok(Outcome::Settings { settings: self.settings().list() }),
        }
        Ok(Outcome::Done)
    }

    fn info(&self, board: &mut impl Board) -> Info {
        let goal = match (self.drive.goal(), self.drive.goal_status()) {
            (Goal::Vertex(vertex), drive::GoalStatus::Active) => Some(vertex.into()),
            _ => None,
        };
        Info {
            version: Version::LIBRARY,
            boot: self.config.boot,
            reset_cause: self.config.reset_cause,
            uptime_ms: board.now_ms(),
            paused: self.paused,
            localise_only: self.localise_only,
            goal,
            stored_bytes: self.stored_bytes,
            stored_places_ago: if self.stored_bytes == 0 { 0 } else { self.places_since },
        }
    }

    /// Restores the snapshot received over the line. The robot may be at any vertex.
    fn restore_staged(&mut self, board: &mut impl Board) -> Result<(), Refusal> {
        let Self { mapper, reporter, drive, staging, encoder, faults, .. } = self;
        let bytes = staging.commit()?;
        if restore(mapper, reporter, drive, bytes, Resume::AtUnknownVertex).is_err() {
            faults.record(FaultKind::SnapshotRejected);
            return Err(Refusal::BadSnapshot);
        }
        let mut line = Line { encoder, faults, board };
        self.reporter.resync(|message| line.send(message));
        self.localise_only = self.mapper.filter().is_localise_only();
        Ok(())
    }

    fn reset(&mut self, board: &mut impl Board) -> Result<(), Refusal> {
        let Self { mapper, reporter, drive, config, encoder, faults, .. } = self;
        let mut line = Line { encoder, faults, board };
        reporter.forget(|message| line.send(message));
        // A restored snapshot may have brought other settings.
        config.mapper.filter = *mapper.filter().config();
        mapper.start(&config.mapper).map_err(|_| Refusal::OutOfRange)?;
        reporter.start(config.hello::<V, F>(), FRAMES_PER_HELLO);
        drive.start(config.drive, config.mapper.seed).map_err(|_| Refusal::OutOfRange)?;
        self.localise_only = false;
        self.times_lost = 0;
        self.sent_goal = NO_GOAL;
        Ok(())
    }

    /// The settings in use.
    fn settings(&self) -> Settings<F::Config> {
        Settings {
            filter: *self.mapper.filter().config(),
            place: self.config.mapper.place,
            speed_permille: self.config.drive.speed_permille,
            snapshot_every_places: self.config.snapshot.every_places,
        }
    }

    fn set(&mut self, setting: Setting) -> Result<(), Refusal> {
        let settings = self.settings();
        // The filter itself refuses more hypotheses than it has room for.
        let settings = settings.with(setting, usize::from(u8::MAX), SONARS)?;
        self.mapper.set_config(settings.place, settings.filter).map_err(|_| Refusal::OutOfRange)?;
        self.drive.set_speed(settings.speed_permille).map_err(|_| Refusal::OutOfRange)?;
        self.config.mapper.filter = settings.filter;
        self.config.mapper.place = settings.place;
        self.config.drive.speed_permille = settings.speed_permille;
        self.config.snapshot.every_places = settings.snapshot_every_places;
        Ok(())
    }

    /// A vertex of the map.
    fn known(&self, vertex: u8) -> Result<VertexId, Refusal> {
        let known = VertexId::new(vertex).filter(|&vertex| self.mapper.map().contains(vertex));
        known.ok_or(Refusal::UnknownVertex)
    }

    fn go_to(&mut self, vertex: u8, board: &mut impl Board) -> Result<(), Refusal> {
        let vertex = self.known(vertex)?;
        if !self.drive.leads_to(self.mapper.filter(), vertex) {
            return Err(Refusal::NoRoute);
        }
        self.set_goal(Goal::Vertex(vertex), board);
        Ok(())
    }

    fn set_goal(&mut self, goal: Goal, board: &mut impl Board) {
        if let (Goal::Vertex(vertex), drive::GoalStatus::Active) = self.sent_goal {
            let _ = self
                .send(&Message::GoalStatus(GoalStatus { vertex: vertex.into(), state: GoalState::Replaced }), board);
        }
        self.sent_goal = NO_GOAL;
        self.drive.set_goal(goal);
    }

    /// Sends the status of the goal whenever it has changed.
    pub(super) fn send_goal_status(&mut self, board: &mut impl Board) {
        let now = (self.drive.goal(), self.drive.goal_status());
        let (Goal::Vertex(vertex), goal_status) = now else { return };
        let state = match goal_status {
            drive::GoalStatus::Inactive => return,
            drive::GoalStatus::Active => GoalState::Active,
            drive::GoalStatus::Reached => GoalState::Reached,
            drive::GoalStatus::VertexRemoved => GoalState::VertexRemoved,
            drive::GoalStatus::TimedOut => GoalState::TimedOut,
        };
        let message = Message::GoalStatus(GoalStatus { vertex: vertex.into(), state });
        if self.sent_goal != now && self.send(&message, board).is_ok() {
            self.sent_goal = now;
        }
    }
}
