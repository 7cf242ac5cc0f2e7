//! A pseudo terminal from `script` of util-linux that runs a program, and the text on its screen.

use std::io::{Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

const ROWS: u16 = 36;
const COLUMNS: u16 = 120;
/// Timeout of every wait in these tests.
const PATIENCE: Duration = Duration::from_secs(120);

pub(super) struct PseudoTerminal {
    script: Child,
    keys: ChildStdin,
    bytes: Receiver<Vec<u8>>,
    parser: vt100::Parser,
}

impl PseudoTerminal {
    /// Runs a shell command in a terminal; `None`, with a message, if `script` is missing.
    pub(super) fn running(command: &str) -> Option<Self> {
        let version = Command::new("script").arg("--version").output();
        if !version.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains("util-linux")) {
            assert!(std::env::var_os("CI").is_none(), "`script` of util-linux is missing");
            println!("SKIPPED: `script` of util-linux is missing");
            return None;
        }
        let modes = "echo modes $(stty -g)";
        let all = format!("stty cols {COLUMNS} rows {ROWS}; {modes}; {command}; code=$?; {modes}; exit $code");
        let mut script = Command::new("script")
            .args(["--quiet", "--return", "--command", &all, "/dev/null"])
            .env("TERM", "xterm-256color")
            .env("RUST_BACKTRACE", "0")
            .env("SHELL", "/bin/sh")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let keys = script.stdin.take().unwrap();
        let mut output = script.stdout.take().unwrap();
        let (sender, bytes) = channel();
        thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = output.read(&mut buffer) {
                if sender.send(buffer[..count].to_vec()).is_err() {
                    return;
                }
            }
        });
        Some(Self { script, keys, bytes, parser: vt100::Parser::new(ROWS, COLUMNS, 0) })
    }

    /// Waits until a text is on the screen.
    pub(super) fn wait_for(&mut self, text: &str) {
        self.wait_until(text, |screen| screen.contains(text));
    }

    /// Waits until the screen satisfies a condition.
    pub(super) fn wait_until(&mut self, what: &str, is_so: impl Fn(&str) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !is_so(&self.text()) {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.bytes.recv_timeout(left) {
                Ok(bytes) => self.parser.process(&bytes),
                Err(error) => panic!("not so: {what} ({error}), but\n{}", self.text()),
            }
        }
    }

    pub(super) fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
        self.keys.flush().unwrap();
    }

    /// The text on the screen.
    pub(super) fn text(&self) -> String {
        self.parser.screen().contents()
    }

    /// Whether a program uses the alternate screen.
    pub(super) fn is_taken(&self) -> bool {
        self.parser.screen().alternate_screen() && self.parser.screen().hide_cursor()
    }

    /// Waits until the command ends and returns its exit code. Screen, cursor and modes must be restored.
    pub(super) fn end(mut self) -> Option<i32> {
        while let Ok(bytes) = self.bytes.recv_timeout(PATIENCE) {
            self.parser.process(&bytes);
        }
        let screen = self.parser.screen();
        let text = screen.contents();
        assert!(!screen.alternate_screen() && !screen.hide_cursor(), "{text}");
        let modes: Vec<&str> = text.lines().filter(|line| line.starts_with("modes ")).collect();
        assert!(modes.len() == 2 && modes[0] == modes[1], "{text}");
        self.script.wait().unwrap().code()
    }
}
