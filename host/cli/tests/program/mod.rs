//! The program as a user runs it, and a simulated robot.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};

pub(crate) const TOPOSLAM: &str = env!("CARGO_BIN_EXE_toposlam");

pub(crate) fn toposlam(arguments: &[&str]) -> Output {
    Command::new(TOPOSLAM).args(arguments).output().unwrap()
}

pub(crate) fn printed(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub(crate) fn complaint(output: &Output) -> String {
    assert!(!output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// `toposlam robot`, which runs until it is dropped.
pub(crate) struct Robot {
    process: Child,
    pub(crate) line: String,
}

impl Robot {
    pub(crate) fn start(address: &str, speed: &str) -> Self {
        let mut process = Command::new(TOPOSLAM)
            .args(["robot", "--plan", "ring", "--speed", speed, "--listen", address])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut first_line = String::new();
        BufReader::new(process.stdout.as_mut().unwrap()).read_line(&mut first_line).unwrap();
        let line = first_line.split_whitespace().last().unwrap().to_owned();
        Self { process, line }
    }

    pub(crate) fn address(&self) -> String {
        self.line.trim_start_matches("tcp:").to_owned()
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}
