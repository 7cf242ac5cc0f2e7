//! A long simulated run: a robot drives through a building for hours, with faults on its ring and its line and an
//! operator who sends commands all the time. The run is deterministic.
//!
//! The fault counts of the robot are compared with the injected faults, see [`Account`].
//!
//! ```
//! use toposlam_sim::injector::FaultRates;
//! use toposlam_eval::soak::Soak;
//! use toposlam_sim::world::{Plan, RobotModel};
//!
//! let plan = Plan::built_in("office").expect("a built-in plan");
//! let soak = Soak { model: RobotModel::default(), rates: FaultRates::scaled(0.01), seed: 1, turns: 1000 };
//! let life = soak.run(&plan)?;
//! assert_eq!(life.watchdog_fed, 1000);
//! assert_eq!(life.mistakes(), [""; 0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod operator;

use std::mem;

use toposlam::reference::{SNAPSHOT_BYTES, SONARS};
use toposlam::ring::{Echo, RingFrame};
use toposlam::wire::{Command, Decoder, Inbox, Message, Outcome, Payload, Progress, Request};
use toposlam::{FaultCounters, FaultKind};

use crate::faults::fault_lines;
use crate::mapping::score_exploration;
use crate::score::MapScore;
use operator::Operator;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::injector::{FaultRates, LineCounts, LineInjector, RingCounts, RingInjector};
use toposlam_sim::world::{Plan, RobotModel, VoronoiError};

pub use operator::OperatorCounts;

/// Turns of the robot's main loop in a simulated hour.
pub const TURNS_PER_HOUR: u64 = 36_000;

/// Robot, faults, seed and duration of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soak {
    /// Its sonars and their noise.
    pub model: RobotModel,
    /// The faults.
    pub rates: FaultRates,
    /// The seed of the world and of the faults.
    pub seed: u64,
    /// Turns of the robot's main loop, ten in a second.
    pub turns: u64,
}

/// The expected fault counts of the robot, derived from the injected faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Account {
    /// Lost answers.
    pub sonar_silent: u64,
    /// Sonars on a stuck bus.
    pub bus_error: u64,
    /// Ranges below what a sonar can measure, in frames that were mapped.
    pub sonar_out_of_range: u64,
    /// Mapped frames with too few live sonars.
    pub ring_blind: u64,
    /// Corrupt requests, as counted by a decoder of the same bytes.
    pub wire_corrupt: u64,
    /// Requests beyond one in a turn, and turns with too many bytes.
    pub command_flood: u64,
    /// Requests that the robot's replies reject.
    pub command_refused: u64,
    /// Places that found the history full. The filter counts its faults from the last restored snapshot on.
    pub history_full: u64,
}

impl Account {
    fn rows(&self) -> [(FaultKind, u64); 8] {
        [
            (FaultKind::SonarSilent, self.sonar_silent),
            (FaultKind::BusError, self.bus_error),
            (FaultKind::SonarOutOfRange, self.sonar_out_of_range),
            (FaultKind::RingBlind, self.ring_blind),
            (FaultKind::WireCorrupt, self.wire_corrupt),
            (FaultKind::CommandFlood, self.command_flood),
            (FaultKind::CommandRefused, self.command_refused),
            (FaultKind::HistoryFull, self.history_full),
        ]
    }
}

/// The results of a run.
#[derive(Clone, Debug)]
pub struct SoakReport {
    /// Turns of the robot's main loop.
    pub turns: u64,
    /// Number of times that the watchdog was fed.
    pub watchdog_fed: u64,
    /// Reported places.
    pub places: u64,
    /// Places that the filter has processed.
    pub observed: u64,
    /// Places whose number does not follow that of the previous place.
    pub out_of_order: u64,
    /// Snapshots stored in the flash.
    pub kept: u64,
    /// Faults injected into the ring.
    pub ring: RingCounts,
    /// Faults injected into the line, to the robot and from it.
    pub lines: [LineCounts; 2],
    /// Actions of the operator.
    pub operator: OperatorCounts,
    /// Fault counts of the robot.
    pub faults: FaultCounters,
    /// Expected fault counts of the robot.
    pub account: Account,
    /// Score of the final map.
    pub score: MapScore,
    /// Phantoms among the places.
    pub phantoms: u64,
    /// Number of frames in which a wall stopped the robot.
    pub bumps: u32,
}

impl Soak {
    /// Runs the simulation.
    ///
    /// # Errors
    /// When the plan has no true map.
    pub fn run(&self, plan: &Plan) -> Result<SoakReport, VoronoiError> {
        let mut buffer = [0; SNAPSHOT_BYTES];
        let mut exploration = Exploration::start(plan, self.model, self.seed, &mut buffer)?;
        let mut ring = RingInjector::new(self.rates, self.seed);
        let mut lines = [0, 1].map(|line| LineInjector::new(self.rates, self.seed.wrapping_mul(2).wrapping_add(line)));
        let mut operator = Operator::new();
        let mut auditor = Auditor::default();
        let mut out_of_order = 0;
        let mut kept = 0;
        let mut replies: Decoder = Decoder::new();
        for turn in 0..self.turns {
            let frame = exploration.frame();
            let frame = ring.disturb(frame, exploration.ring_faults());
            let request = operator.turn(turn, exploration.robot().mapper().map().vertices().len() as u8);
            let mut arriving = lines[0].carry(&request);
            arriving.extend(lines[0].noise());
            auditor.arrive(&arriving);
            exploration.board().received.extend(arriving);
            let places = exploration.places() as u64;
            if let Some((_, update)) = exploration.map(&frame) {
                out_of_order += u64::from(u64::from(update.place_index) != places);
            }
            let sent = mem::take(&mut exploration.board().sent);
            auditor.depart(&sent, &operator, exploration.places() as u64);
            auditor.map(&frame);
            each(&mut replies, &lines[1].carry(&sent), |message| {
                if let Message::Reply(reply) = message {
                    operator.receive(&reply, turn);
                }
            });
            kept += u64::from(!mem::take(&mut exploration.board().kept).is_empty());
            let velocity = exploration.board().velocity;
            exploration.drive(velocity);
        }
        let places = exploration.places() as u64;
        let observed = u64::from(exploration.robot().mapper().filter().observed());
        let driver = *exploration.ring_faults();
        // The first place beyond the history drops its oldest quarter, and so does each that fills it again.
        let history = toposlam::reference::HISTORY as u64;
        let drops = |place: &u64| place.checked_sub(history).is_some_and(|beyond| beyond.is_multiple_of(history / 4));
        let account = Account {
            sonar_silent: driver.count(FaultKind::SonarSilent).into(),
            bus_error: driver.count(FaultKind::BusError).into(),
            history_full: (auditor.restored_at..places).filter(drops).count() as u64,
            ..auditor.account
        };
        Ok(SoakReport {
            turns: self.turns,
            watchdog_fed: exploration.board().fed,
            places,
            observed,
            out_of_order,
            kept,
            ring: ring.counts(),
            lines: lines.map(|line| line.counts()),
            operator: operator.counts(),
            faults: exploration.faults(),
            account,
            score: score_exploration(&exploration),
            phantoms: exploration.nodes().iter().filter(|node| node.is_none()).count() as u64,
            bumps: exploration.rover().bumps(),
        })
    }
}

/// Derives the expected fault counts, only from the robot's bytes and frames.
#[derive(Default)]
struct Auditor {
    account: Account,
    arriving: Decoder<Request>,
    departing: Decoder,
    /// The number of the last answered request.
    replied: Option<u16>,
    is_paused: bool,
    /// Number of places at the last restore of a snapshot.
    restored_at: u64,
}

impl Auditor {
    /// Processes bytes that the robot finds in its next turn.
    fn arrive(&mut self, bytes: &[u8]) {
        let looked_at = usize::from(Inbox::BYTES_PER_TURN);
        self.account.command_flood += u64::from(bytes.len() > looked_at);
        let mut rest = &bytes[..bytes.len().min(looked_at)];
        let mut waiting = None;
        loop {
            rest = match self.arriving.feed(rest) {
                Progress::NeedsMore => return,
                Progress::Error { rest, .. } => {
                    self.account.wire_corrupt += 1;
                    rest
                }
                Progress::Message { message, rest, .. } => {
                    let first = *waiting.get_or_insert(message);
                    self.account.command_flood += u64::from(first != message);
                    rest
                }
            };
        }
    }

    /// Processes the bytes that the robot sent in its turn, after `places` places.
    fn depart(&mut self, bytes: &[u8], operator: &Operator, places: u64) {
        let Self { account, departing, replied, is_paused, restored_at, .. } = self;
        each(departing, bytes, |message| {
            let Message::Reply(reply) = message else { return };
            // A repeated request is answered again, but not executed.
            let is_executed = replied.replace(reply.request) != Some(reply.request);
            account.command_refused += u64::from(is_executed && matches!(reply.outcome, Outcome::Refused(_)));
            match operator.awaits(reply.request) {
                Some(Command::Pause { on }) => *is_paused = on,
                Some(Command::RestoreCommit) => *restored_at = places,
                _ => {}
            }
        });
    }

    /// Processes the frame of the turn. A command is executed before the frame is mapped.
    fn map(&mut self, frame: &RingFrame<SONARS>) {
        if self.is_paused {
            return;
        }
        let place = toposlam::reference::PLACE;
        let is_out_of_range = |echo: &&Echo| matches!(echo, Echo::Range { range_mm } if *range_mm < place.range_min_mm);
        let out_of_range = frame.echoes.iter().filter(is_out_of_range).count();
        let live = SONARS - out_of_range - frame.dead_sensors().count();
        self.account.sonar_out_of_range += out_of_range as u64;
        self.account.ring_blind += u64::from(live < usize::from(place.live_sensors_min));
    }
}

/// Passes every message among the bytes of a line to `take`.
fn each<M: Payload>(decoder: &mut Decoder<M>, bytes: &[u8], mut take: impl FnMut(M)) {
    let mut rest = bytes;
    loop {
        rest = match decoder.feed(rest) {
            Progress::NeedsMore => return,
            Progress::Error { rest, .. } => rest,
            Progress::Message { message, rest, .. } => {
                take(message);
                rest
            }
        };
    }
}

impl SoakReport {
    /// The violated expectations in words; empty when there are none.
    pub fn mistakes(&self) -> Vec<String> {
        let mut mistakes = Vec::new();
        let mut hold = |holds: bool, mistake: String| {
            if !holds {
                mistakes.push(mistake);
            }
        };
        let Self { turns, watchdog_fed, places, observed, out_of_order, .. } = self;
        hold(watchdog_fed == turns, format!("the watchdog was fed {watchdog_fed} times in {turns} turns"));
        hold(observed == places, format!("the filter has {observed} places, reported were {places}"));
        hold(*out_of_order == 0, format!("{out_of_order} places had a number out of order"));
        for (kind, expected) in self.account.rows() {
            let counted = u64::from(self.faults.count(kind));
            hold(counted == expected, format!("{kind:?} was counted {counted} times, not {expected}"));
        }
        for kind in [FaultKind::LoopLate, FaultKind::StoreFailed, FaultKind::SnapshotRejected, FaultKind::WireFull] {
            hold(self.faults.count(kind) == 0, format!("{kind:?} was counted {} times", self.faults.count(kind)));
        }
        mistakes
    }

    /// A summary, one line for each subject.
    pub fn lines(&self) -> Vec<String> {
        let [to_robot, from_robot] = self.lines;
        let OperatorCounts { answered, refused, repeated, restored } = self.operator;
        let hours = self.turns as f64 / TURNS_PER_HOUR as f64;
        let mut lines = vec![
            format!("turns: {} ({hours:.1} simulated hours), watchdog fed {} times", self.turns, self.watchdog_fed),
            format!("places: {} reported, {} in the filter, {} phantoms", self.places, self.observed, self.phantoms),
            format!("ring: {}", self.ring),
            format!("line to the robot: {to_robot}"),
            format!("line from the robot: {from_robot}"),
            format!(
                "operator: {answered} requests answered, {refused} of them refused, {repeated} repetitions, \
                 {restored} snapshots fetched and restored"
            ),
            format!("flash: {} snapshots kept", self.kept),
            format!("stopped by a wall in {} turns", self.bumps),
        ];
        lines.extend(fault_lines(&self.faults).into_iter().map(|line| format!("fault {line}")));
        lines.push(format!("fault LoopLate: {}", self.faults.count(FaultKind::LoopLate)));
        lines.push(format!(
            "against the true map: exact {}, edge F1 {:.2}, located in {:.0} % of the places that are remembered",
            if self.score.exact { "yes" } else { "no" },
            self.score.edge_f1,
            100.0 * self.score.location
        ));
        lines
    }
}
