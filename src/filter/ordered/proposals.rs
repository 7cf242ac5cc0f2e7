//! The ways to explain an observation, and what each of them gains.

use super::choice::{Choice, Closures, Gain, ReportedExit, Target, UNSEEN};
use super::hypothesis::{Hypothesis, LN_OFF_MAP};
use super::model::{LN_PART, Model};
use super::record::{Entry, Record};
use crate::map::{DartSet, NONE};

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    /// Proposes every way to explain observation `index`, with what it gains, but for those whose exit costs more than `worst`.
    pub(super) fn propose(
        &self,
        model: &Model,
        record: &Record<T>,
        index: usize,
        worst: f32,
        mut proposed: impl FnMut(Choice, Gain),
    ) {
        let entry = record.get(index);
        if !self.has_room_for_vertex() {
            proposed(Choice { exit: NONE, target: Target::OffMap }, Gain { labels: 0.0, rest: LN_OFF_MAP });
        }
        if !self.is_on_map() || entry.starts() {
            let mut propose = |target| {
                let choice = Choice { exit: NONE, target };
                proposed(choice, self.gain(model, &entry, ReportedExit::Unknown, choice));
            };
            propose(Target::New);
            if entry.starts() && self.map.vertices() > 0 {
                propose(Target::Spurious(false));
            }
            let near = |&dart: &u8| !self.is_far(model, entry.steps, self.map.vertex(dart));
            (0..self.map.darts()).filter(near).for_each(|dart| propose(Target::At(dart)));
            if let Some(edge) = self.edge_under(record, index) {
                self.propose_along(model, record, index, edge, proposed);
            }
            return;
        }
        let reported = self.reported_exit(record, index, self.at);
        let vertex = self.map.vertex(self.at);
        let ways = self.map.ways(vertex);
        let may_be_unseen = reported == ReportedExit::Unseen
            || self.label(vertex).looks == 0 && !matches!(reported, ReportedExit::Way(_));
        for &exit in ways.iter().chain(may_be_unseen.then_some(&UNSEEN)) {
            if reported.ln(model, exit, ways.len()) < worst {
                continue;
            }
            let is_known = self.map.partner(exit).is_some();
            let closures = if is_known { Closures::NONE } else { self.closures(exit) };
            let mut propose = |target| {
                let choice = Choice { exit, target };
                proposed(choice, self.gain_with(model, &entry, reported, choice, &closures));
            };
            let is_reported = reported == ReportedExit::Way(exit);
            if is_reported {
                propose(Target::Spurious(self.is_spurious_again(record, index, exit)));
            }
            if is_known {
                propose(Target::Known);
                if is_reported {
                    self.ways_beyond(exit).for_each(|way| propose(Target::Beyond(way)));
                }
                continue;
            }
            propose(Target::New);
            self.near_frontiers(model, &entry, exit).for_each(|frontier| propose(Target::At(frontier)));
            for vertex in 0..self.map.vertices() {
                if !self.is_far(model, entry.steps, vertex)
                    && let Some(bearing) = self.unseen_reference(&entry, vertex)
                {
                    propose(Target::Unseen(vertex, bearing));
                }
            }
        }
    }

    /// The other frontiers whose vertices the label is not too far off for.
    pub(super) fn near_frontiers(&self, model: &Model, entry: &Entry, exit: u8) -> impl Iterator<Item = u8> {
        let is_near =
            move |&frontier: &u8| frontier != exit && !self.is_far(model, entry.steps, self.map.vertex(frontier));
        self.map.frontiers().filter(is_near)
    }

    /// What a choice gains, given what the robot reported of its exit.
    pub(super) fn gain(&self, model: &Model, entry: &Entry, reported: ReportedExit, choice: Choice) -> Gain {
        let is_closure = matches!(choice.target, Target::At(_) | Target::Unseen(..)) && choice.exit != NONE;
        let closures = if is_closure { self.closures(choice.exit) } else { Closures::NONE };
        self.gain_with(model, entry, reported, choice, &closures)
    }

    /// As [`Hypothesis::gain`], with the closures of the exit.
    fn gain_with(
        &self,
        model: &Model,
        entry: &Entry,
        reported: ReportedExit,
        choice: Choice,
        closures: &Closures,
    ) -> Gain {
        let Choice { exit, target } = choice;
        let mut gain = match target {
            Target::New => self.new_arrival(model, entry),
            Target::At(dart) => self.arrival(model, entry, dart),
            Target::Unseen(vertex, bearing) => self.unseen_arrival(model, entry, vertex, bearing),
            Target::Known => self.arrival(model, entry, self.map.partner(exit).unwrap_or(NONE)),
            Target::Back => self.arrival(model, entry, exit),
            Target::Beyond(dart) => self.arrival_beyond(model, entry, exit, dart),
            Target::Spurious(again) => self.spurious(model, entry, again),
            Target::OffMap => return Gain { labels: 0.0, rest: LN_OFF_MAP },
        };
        if exit == NONE {
            gain.rest += match target {
                Target::New if self.map.vertices() > 0 => LN_PART,
                Target::New | Target::Spurious(_) => 0.0,
                _ => -model.ln_of(self.map.darts().into()),
            };
            return gain;
        }
        let vertex = self.map.vertex(self.at);
        let ways = self.map.ways(vertex).len();
        gain.rest += match exit {
            UNSEEN => reported.ln(model, exit, ways + 1) + model.way_unseen(self.label(vertex).looks),
            _ => reported.ln(model, exit, ways),
        };
        gain.rest += match target {
            Target::Known => self.travel_along(model, entry, reported, exit),
            Target::Back => self.travel_back(model, entry, reported),
            Target::Beyond(dart) => self.travel_beyond(model, entry, exit, dart),
            Target::New | Target::Spurious(_) | Target::OffMap => model.travel((0, 0), entry.ln_travel),
            Target::At(dart) => {
                model.travel((0, 0), entry.ln_travel) + {
                    let vertex = self.map.vertex(dart);
                    model.closure(closures.frontiers.into(), closures.keep_genus(exit, dart, vertex))
                        + closures.connect(vertex)
                }
            }
            Target::Unseen(vertex, bearing) => {
                // The way would lie between the one before it and this one.
                let next = self.way_after(vertex, bearing);
                model.travel((0, 0), entry.ln_travel)
                    + model.closure(usize::from(closures.frontiers) + 1, closures.keep_genus(exit, next, vertex))
                    + closures.connect(vertex)
            }
        };
        gain
    }

    /// What an edge from an exit to each frontier does to the map. Cost: O(D).
    fn closures(&self, exit: u8) -> Closures {
        let frontiers = self.map.frontiers().count() as u8;
        let is_unseen = exit == UNSEEN;
        let connected = self.map.component_of(self.map.vertex(if is_unseen { self.at } else { exit }));
        let face = if is_unseen { DartSet::EMPTY } else { self.map.face_of(exit) };
        Closures { face, connected, frontiers }
    }
}
