//! A link to a simulated robot over TCP.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;

use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::wire::{Command, Outcome, Refusal, Setting};

use super::*;
use crate::broadcast::Broadcast;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

const OPTIONS: Options = Options {
    retry: Duration::from_millis(20),
    silence: Duration::from_secs(60),
    reply: Duration::from_secs(60),
    attempts: 1,
};

/// A robot that runs until it is dropped.
struct Robot {
    address: SocketAddr,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Robot {
    fn at(address: &str) -> Self {
        let mut broadcast = Broadcast::bind(address).unwrap();
        let address = broadcast.address().unwrap();
        let ends = Arc::new(AtomicBool::new(false));
        let told_to_end = Arc::clone(&ends);
        let live = move || {
            let plan = Plan::built_in("ring").unwrap();
            let mut buffer = [0; SNAPSHOT_BYTES];
            let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
            while !told_to_end.load(Ordering::Relaxed) {
                exploration.advance();
                let board = exploration.board();
                let received = broadcast.exchange(&board.sent);
                board.received.extend(received);
                thread::sleep(Duration::from_millis(1));
            }
        };
        Self { address, ends, thread: Some(thread::spawn(live)) }
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
    }
}

fn link_to(address: SocketAddr, options: Options) -> (Link, Receiver<LinkEvent>) {
    let (sender, news) = mpsc::channel();
    let source = Source::named(&format!("tcp:{address}"), 115_200);
    (Link::start(source, options, move |news| sender.send(news).is_ok()), news)
}

fn wait_for<T>(news: &Receiver<LinkEvent>, what: impl FnMut(LinkEvent) -> Option<T>) -> T {
    news.iter().find_map(what).expect("the link is running")
}

fn disconnected(news: LinkEvent) -> Option<String> {
    if let LinkEvent::Disconnected(reason) = news { Some(reason) } else { None }
}

fn connected(news: LinkEvent) -> Option<()> {
    matches!(news, LinkEvent::Connected).then_some(())
}

#[test]
fn a_cut_line_is_reopened_and_the_state_is_kept() {
    let robot = Robot::at("127.0.0.1:0");
    let address = robot.address;
    let (_link, news) = link_to(address, OPTIONS);
    wait_for(&news, connected);
    let edges = |at_least: usize| {
        move |news| {
            let LinkEvent::Received(_, listener) = news else { return None };
            (listener.map().edges.len() >= at_least).then(|| listener.counters().messages)
        }
    };
    let messages = wait_for(&news, edges(2));
    drop(robot);
    wait_for(&news, disconnected);
    let robot = Robot::at(&address.to_string());
    wait_for(&news, connected);
    let after = wait_for(&news, |news| if let LinkEvent::Received(_, listener) = news { Some(listener) } else { None });
    assert!(after.counters().messages > messages, "the count continues");
    wait_for(&news, edges(2));
    drop(robot);
}

#[test]
fn a_missing_robot_is_reported_once_and_retried_and_tasks_fail() {
    let robot = Robot::at("127.0.0.1:0");
    let address = robot.address;
    drop(robot);
    let (link, news) = link_to(address, OPTIONS);
    let reason = wait_for(&news, disconnected);
    assert!(reason.contains(&address.to_string()), "{reason}");
    for _ in 0..3 {
        link.start_task(Task::Command(Command::Explore));
        match news.recv().unwrap() {
            LinkEvent::TaskDone(Task::Command(Command::Explore), Err(TaskError::NotConnected)) => {}
            other => panic!("{other:?}"),
        }
        thread::sleep(2 * OPTIONS.retry);
    }
    let _robot = Robot::at(&address.to_string());
    assert!(matches!(news.recv().unwrap(), LinkEvent::Connected), "the reason is not repeated");
}

#[test]
fn tasks_are_executed_and_refusals_are_returned() {
    let robot = Robot::at("127.0.0.1:0");
    let (link, news) = link_to(robot.address, OPTIONS);
    wait_for(&news, connected);
    let perform = |task: Task| {
        link.start_task(task);
        wait_for(&news, |news| if let LinkEvent::TaskDone(task, answer) = news { Some((task, answer)) } else { None })
    };
    let set = Task::Command(Command::SetConfig(Setting::NoiseMm(0)));
    let (task, answer) = perform(set.clone());
    assert_eq!(task, set);
    assert_eq!(answer.unwrap(), Answer::Outcome(Outcome::Refused(Refusal::OutOfRange)));
    let (_, answer) = perform(Task::Command(Command::Pause { on: true }));
    assert_eq!(answer.unwrap(), Answer::Outcome(Outcome::Done));

    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.snapshot");
    let (_, answer) = perform(Task::Snapshot { file: file.clone(), force: false });
    let bytes = std::fs::metadata(&file).unwrap().len() as usize;
    assert_eq!(answer.unwrap(), Answer::Written(bytes));
    assert!(bytes > 0);
    let (_, answer) = perform(Task::Snapshot { file: file.clone(), force: false });
    assert!(matches!(answer, Err(TaskError::File(_))), "an existing file is not replaced: {answer:?}");
    let (_, answer) = perform(Task::Restore(file));
    assert_eq!(answer.unwrap(), Answer::Restored { bytes, changes: Some(Vec::new()) });
    let (_, answer) = perform(Task::Restore(directory.path().join("none")));
    assert!(matches!(answer, Err(TaskError::File(_))), "{answer:?}");
}

#[test]
fn a_silent_connection_is_reopened() {
    let mut silent = Broadcast::bind("127.0.0.1:0").unwrap();
    let options = Options { silence: Duration::from_millis(50), ..OPTIONS };
    let (_link, news) = link_to(silent.address().unwrap(), options);
    wait_for(&news, connected);
    let reason = wait_for(&news, disconnected);
    assert!(reason.contains("no data for"), "{reason}");
    wait_for(&news, connected);
    silent.exchange(&[]);
}

#[test]
fn dropping_a_link_closes_its_line() {
    let mut robot = Broadcast::bind("127.0.0.1:0").unwrap();
    let (link, news) = link_to(robot.address().unwrap(), OPTIONS);
    wait_for(&news, connected);
    while robot.listeners() == 0 {
        robot.exchange(&[]);
    }
    drop(link);
    while robot.listeners() > 0 {
        robot.exchange(b"anyone?");
    }
    assert!(news.iter().all(|news| matches!(news, LinkEvent::Received(Err(_), _))), "no other news after the drop");
}
