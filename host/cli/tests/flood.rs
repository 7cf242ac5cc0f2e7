//! Floods, and readers that never read: every server and client keeps its memory, and commands are answered meanwhile.

#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use toposlam::wire::{self, Encoder, MAX_FRAME_BYTES, Message, Request, Row};

/// The most memory of a process under a flood. The buffers of a robot for 64 clients are 4.6 MB.
const MEMORY_BYTES: u64 = 48 << 20;
const FLOOD: Duration = Duration::from_secs(3);

/// A process that ends with the test.
struct Process(Child);

impl Process {
    fn start(arguments: &[&str], stdout: Stdio) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_toposlam"));
        Self(command.args(arguments).stdin(Stdio::null()).stdout(stdout).stderr(Stdio::null()).spawn().unwrap())
    }

    /// A simulated robot, and its address.
    fn robot() -> (Self, String) {
        let mut robot = Self::start(&["robot", "--listen", "127.0.0.1:0", "--speed", "10"], Stdio::piped());
        let mut line = String::new();
        BufReader::new(robot.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
        (robot, line.trim_end().split_once("tcp:").unwrap().1.to_owned())
    }

    /// The largest resident memory so far.
    fn memory_bytes(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.0.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("the process is alive");
        line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
    }

    fn assert_bounded(&mut self, what: &str) {
        assert!(self.0.try_wait().unwrap().is_none(), "{what} has ended");
        let bytes = self.memory_bytes();
        println!("{what}: {bytes} bytes");
        assert!(bytes < MEMORY_BYTES, "{what} takes {bytes} bytes");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Threads that send until they are dropped.
#[derive(Default)]
struct Floods {
    ends: Arc<AtomicBool>,
}

impl Floods {
    fn send(&self, mut to: TcpStream, bytes: Vec<u8>) {
        let ends = Arc::clone(&self.ends);
        to.set_write_timeout(Some(Duration::from_millis(50))).unwrap();
        thread::spawn(move || {
            while !ends.load(Ordering::Relaxed) {
                // A write that times out shows that the flood waits.
                match to.write(&bytes) {
                    Err(error) if error.kind() != ErrorKind::WouldBlock => return,
                    _ => {}
                }
            }
        });
    }
}

impl Drop for Floods {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
    }
}

fn garbage() -> Vec<u8> {
    (0..100_000u32).map(|at| (at.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

/// Intact requests, all different.
fn requests() -> Vec<u8> {
    let mut encoder = Encoder::new(0);
    let request = |id| Request { id, command: wire::Command::GetSnapshot { offset: 0 } };
    (0..2000).flat_map(|id| encoder.encode(&request(id), &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()).collect()
}

/// Intact frames, each of which changes the map.
fn frames() -> Vec<u8> {
    let mut encoder = Encoder::new(0);
    let row = |number: u32| {
        Message::Row(Row {
            vertex: (number % 60) as u8,
            radius_mm: 1000,
            visits: number,
            neighbours: u64::from(number),
        })
    };
    (0..1 << 16).flat_map(|number| encoder.encode(&row(number), &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()).collect()
}

/// A robot that sends as fast as it can to each client, and the name of its line.
fn flooding_robot(bytes: &[u8]) -> (Arc<Floods>, String) {
    let port = TcpListener::bind("127.0.0.1:0").unwrap();
    let name = format!("tcp:{}", port.local_addr().unwrap());
    let floods = Arc::new(Floods::default());
    let (weak, bytes) = (Arc::downgrade(&floods), bytes.to_vec());
    thread::spawn(move || {
        while let Ok((client, _)) = port.accept() {
            let Some(floods) = weak.upgrade() else { return };
            floods.send(client, bytes.clone());
        }
    });
    (floods, name)
}

fn command(line: &str, arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_toposlam")).args(["command", line]).args(arguments).output().unwrap()
}

#[test]
fn a_flooded_robot_answers_commands_in_bounded_memory() {
    let (mut robot, address) = Process::robot();
    let floods = Floods::default();
    let connect = || TcpStream::connect(&address).unwrap();
    for bytes in [garbage(), vec![7; 100_000], vec![0; 100_000], requests()] {
        floods.send(connect(), bytes);
    }
    let silent: Vec<TcpStream> = (0..4).map(|_| connect()).collect();
    let end = Instant::now() + FLOOD;
    while Instant::now() < end {
        let output = command(&format!("tcp:{address}"), &["info"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    robot.assert_bounded("a flooded robot");
    drop(silent);
}

#[test]
fn clients_of_a_robot_that_floods_them_stay_in_bounded_memory() {
    let directory = tempfile::tempdir().unwrap();
    let list = directory.path().join("robots.txt");
    for (what, bytes) in [("garbage", garbage()), ("frames", frames())] {
        let (floods, name) = flooding_robot(&bytes);
        std::fs::write(&list, format!("{name} a\n{name} b\n")).unwrap();
        let list = list.to_str().unwrap();
        let clients: [(&str, &[&str]); 3] = [
            ("serve", &["serve", &name, "--listen", "127.0.0.1:0"]),
            // Nobody reads its output.
            ("monitor --headless", &["monitor", &name, "--headless", "--json"]),
            ("fleet", &["fleet", list]),
        ];
        let mut clients = clients.map(|(client, arguments)| (client, Process::start(arguments, Stdio::piped())));
        thread::sleep(FLOOD);
        for (client, process) in &mut clients {
            process.assert_bounded(&format!("{client} under a flood of {what}"));
        }
        drop(clients);
        drop(floods);
    }
}

/// A browser that sends without end, and one that never reads.
#[test]
fn flooded_servers_stay_in_bounded_memory() {
    let (_robot, address) = Process::robot();
    let line = format!("tcp:{address}");
    let mut server = Process::start(&["serve", &line, "--listen", "127.0.0.1:0"], Stdio::piped());
    let mut printed = String::new();
    BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut printed).unwrap();
    let address = printed.trim_end().trim_end_matches('/').split_once("http://").unwrap().1.to_owned();
    let floods = Floods::default();
    let mut silent = Vec::new();
    for number in 0..40 {
        let mut browser = TcpStream::connect(&address).unwrap();
        if number % 4 == 0 {
            floods.send(browser, vec![b'x'; 100_000]);
        } else {
            write!(browser, "GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
            silent.push(browser);
        }
    }
    thread::sleep(FLOOD);
    server.assert_bounded("a flooded page");
    drop((floods, silent));
}

#[cfg(feature = "recording")]
#[test]
fn a_flooded_recording_answers_commands_in_bounded_memory() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("office.mcap");
    let file = file.to_str().unwrap();
    let (_robot, address) = Process::robot();
    let line = format!("tcp:{address}");
    let recorded =
        Command::new(env!("CARGO_BIN_EXE_toposlam")).args(["record", &line, file, "--seconds", "2"]).output();
    assert!(recorded.unwrap().status.success());
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let mut recording = Process::start(&["play", file, "--listen", &port, "--loop"], Stdio::null());
    let connect = || loop {
        match TcpStream::connect(&port) {
            Ok(stream) => return stream,
            Err(_) => thread::sleep(Duration::from_millis(20)),
        }
    };
    let floods = Floods::default();
    floods.send(connect(), garbage());
    let _silent = connect();
    let end = Instant::now() + FLOOD;
    while Instant::now() < end {
        let output = command(&format!("tcp:{port}"), &["info"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    recording.assert_bounded("a flooded recording");
}
