//! The map of a robot after a start.

use super::*;
use toposlam::drive::VelocityCommand;
use toposlam::persist::snapshot::SnapshotError;
use toposlam::persist::store::{BootOutcome, BootPolicy, BootReport, StoreError, resume};
use toposlam::reference::ReferenceRobot;
use toposlam::robot::{Board, SaveError};
use toposlam::wire::{Decoder, Message, Progress, QueueFull};
use toposlam::{FaultCounters, Filter};
use toposlam_sim::chip::{Cut, Tear};
use toposlam_sim::world::{Plan, RobotModel, Simulation};

type Robot16 = Box<reference::RobotMapper>;

/// A robot after `places` places, and its store with a snapshot every `every` places.
fn after(places: u32, every: u32) -> (Robot16, Store<Sectors>) {
    let mut store = Store::mount(Sectors::new(8), reference::STORE).unwrap();
    let (mut mapper, ..) = start(&mut store, BootPolicy::Fresh);
    let mut buffer = [0; reference::SNAPSHOT_BYTES];
    let simulation = Simulation::new(&Plan::built_in("office").unwrap(), RobotModel::default(), 3).unwrap();
    for (frame, truth) in simulation {
        if mapper.observe(&frame, truth.passage()).is_some() {
            let observed = mapper.filter().observed();
            if observed.is_multiple_of(every) {
                let length = mapper.snapshot(&mut buffer).unwrap();
                store.save(&buffer[..length]).unwrap();
            }
            if observed == places {
                break;
            }
        }
    }
    (mapper, store)
}

/// A started robot, its boot report, and the number of the start if it could be counted.
fn start(store: &mut Store<Sectors>, policy: BootPolicy) -> (Robot16, BootReport, Option<u32>) {
    let mut mapper = Robot16::new(reference::RobotMapper::new());
    let mut buffer = [0; reference::SNAPSHOT_BYTES];
    let number = store.count_start().ok();
    mapper.start(&reference::MAPPER).unwrap();
    let report = resume(store, &mut buffer, policy, |bytes, place| mapper.restore(bytes, place));
    (mapper, report, number)
}

#[test]
fn the_boot_policy_decides_whether_the_map_is_restored() {
    let (mapper, mut store) = after(30, 10);
    let (fresh, report, number) = start(&mut store, BootPolicy::Fresh);
    assert_eq!((fresh.map().vertices().len(), report.outcome, number), (0, BootOutcome::Fresh, Some(2)));
    for (policy, number) in [(BootPolicy::ContinueAtUnknownVertex, 3), (BootPolicy::ContinueInPlace, 4)] {
        let (restored, report, start) = start(&mut store, policy);
        assert!(matches!(report.outcome, BootOutcome::Continued(_)), "{report:?}");
        assert_eq!((start, report.rejected, report.store), (Some(number), 0, None));
        assert_eq!(map_digest(restored.map(), None), map_digest(mapper.map(), None));
        assert_eq!(restored.filter().observed(), 30);
    }
}

#[test]
fn the_hello_has_the_number_of_the_start() {
    let mut store = Store::mount(Sectors::new(8), reference::STORE).unwrap();
    for number in 1..5 {
        let boot = store.count_start().unwrap();
        let config = reference::ROBOT.with_boot(boot);
        let mut buffer = [0; reference::SNAPSHOT_BYTES];
        let mut robot = Box::new(ReferenceRobot::new());
        robot.boot(&config, &mut buffer, &mut store, BootPolicy::default()).unwrap();
        let frame = toposlam::ring::RingFrame { echoes: [toposlam::ring::Echo::Silence; 16] };
        let mut line = Line { decoder: Decoder::new(), boot: None };
        robot.turn(&frame, &FaultCounters::new(), &mut line);
        assert_eq!(line.boot, Some(number));
    }
}

/// A board that records the boot number in the robot's `Hello`.
struct Line {
    decoder: Decoder,
    boot: Option<u32>,
}

impl Board for Line {
    fn receive(&mut self) -> Option<u8> {
        None
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull> {
        if let Progress::Message { message: Message::Hello(hello), .. } = self.decoder.feed(frame) {
            self.boot = Some(hello.boot);
        }
        Ok(())
    }

    fn follow(&mut self, _: VelocityCommand) {}

    fn feed_watchdog(&mut self) {}

    fn now_ms(&mut self) -> u32 {
        0
    }

    fn stack_high_water_bytes(&mut self) -> u32 {
        0
    }

    fn save(&mut self, _: &[u8]) -> Result<(), SaveError> {
        Err(SaveError::NoStore)
    }
}

#[test]
fn an_invalid_snapshot_falls_back_to_the_previous_one() {
    let (mapper, mut store) = after(20, 20);
    let mut damaged = newest(&mut store).unwrap();
    damaged[100] ^= 1;
    store.save(&damaged).unwrap();
    let (restored, report, _) = start(&mut store, BootPolicy::ContinueAtUnknownVertex);
    assert_eq!((report.rejected, report.why), (1, Some(SnapshotError::Corrupt)));
    assert_eq!(map_digest(restored.map(), None), map_digest(mapper.map(), None));
    store.save(b"something else").unwrap();
    let (restored, report, _) = start(&mut store, BootPolicy::ContinueAtUnknownVertex);
    assert_eq!((report.rejected, report.why), (2, Some(SnapshotError::Corrupt)));
    assert_eq!(restored.filter().observed(), 20);
    // A snapshot of a filter with other capacities.
    let mut other = RobustOther::UNSTARTED;
    other.start(robust::FILTER, 1).unwrap();
    let mut buffer = [0; reference::SNAPSHOT_BYTES];
    let mut writer = Writer::new(&mut buffer).unwrap();
    writer.stage(&mut other).unwrap();
    let length = writer.finish().unwrap();
    store.save(&buffer[..length]).unwrap();
    let (_, report, _) = start(&mut store, BootPolicy::ContinueAtUnknownVertex);
    assert_eq!(report.rejected, 3);
}

type RobustOther = toposlam::RobustFilter<10, 16, 100>;

#[test]
fn without_a_snapshot_or_a_flash_the_map_is_empty() {
    let mut store = Store::mount(Sectors::new(8), reference::STORE).unwrap();
    let (mapper, report, _) = start(&mut store, BootPolicy::ContinueInPlace);
    assert_eq!((report.outcome, report.store, mapper.map().vertices().len()), (BootOutcome::Nothing, None, 0));
    let operation = store.flash_mut().operations();
    store.flash_mut().cut_power(Some(Cut { operation, tear: Tear::Done }));
    let (mapper, report, number) = start(&mut store, BootPolicy::ContinueInPlace);
    assert_eq!((report.outcome, number, mapper.map().vertices().len()), (BootOutcome::Nothing, None, 0));
    assert!(matches!(report.store, Some(StoreError::Flash(_))));
}
