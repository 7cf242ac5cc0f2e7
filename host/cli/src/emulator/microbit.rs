//! Runs the small robot's image on QEMU's machine `microbit`.
//!
//! The machine counts instructions: each takes 64 ns of the machine's time, so the 16 MHz timer of the image counts 1.024 ticks
//! an instruction, the same in every run.

use std::{
    io::{self, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use toposlam::ring::{Echo, RingFrame};

use super::{BUFFER_BYTES, Machine, is_timeout, listen};

/// In place of the number of bytes for the robot: the run is over.
const END: u8 = 255;
/// How often a wait looks at the clock.
const POLL: Duration = Duration::from_millis(200);

/// The running machine. `SONARS` is the number of sensors of its ring.
pub struct Microbit<const SONARS: usize> {
    machine: Machine,
    line: TcpStream,
    deadline: Instant,
}

impl<const SONARS: usize> Microbit<SONARS> {
    /// Starts an image.
    ///
    /// # Errors
    /// If there is no image, or the emulator cannot be started.
    pub fn start(qemu: &Path, elf: &Path, timeout: Duration) -> anyhow::Result<Self> {
        if !elf.is_file() {
            bail!("no image of the small robot at {}", elf.display());
        }
        let deadline = Instant::now() + timeout;
        let line = listen()?;
        let mut command = Command::new(qemu);
        command.args(["-M", "microbit", "-display", "none", "-monitor", "none", "-icount", "shift=6"]);
        command.args(["-semihosting-config", "enable=on,target=native"]);
        command.arg("-serial").arg(format!("tcp:{},nodelay=on", line.local_addr()?));
        command.arg("-kernel").arg(elf).stdout(Stdio::piped());
        let mut machine = Machine::spawn(command)?;
        let line = machine.accept(&line, deadline)?;
        line.set_read_timeout(Some(POLL))?;
        Ok(Self { machine, line, deadline })
    }

    /// Sends a ring frame, and at most 254 bytes for the robot's line.
    ///
    /// # Errors
    /// If the line fails.
    pub fn send(&mut self, frame: &RingFrame<SONARS>, for_robot: &[u8]) -> anyhow::Result<()> {
        let codes = frame.echoes.iter().flat_map(|echo| code(*echo).to_le_bytes());
        let mut bytes: Vec<u8> = codes.collect();
        bytes.push(u8::try_from(for_robot.len()).ok().filter(|&count| count != END).context("too many bytes")?);
        bytes.extend_from_slice(for_robot);
        self.line.write_all(&bytes).context("writing the line")
    }

    /// Waits for bytes of the robot.
    ///
    /// # Errors
    /// If the image ended or the line fails, and after the timeout.
    pub fn receive(&mut self) -> anyhow::Result<Vec<u8>> {
        let mut buffer = [0; BUFFER_BYTES];
        loop {
            match self.line.read(&mut buffer) {
                Ok(0) => bail!("the image ended with a failure (a panic or a hard fault)"),
                Ok(count) => return Ok(buffer[..count].to_vec()),
                Err(error) if is_timeout(&error) => {}
                Err(error) if error.kind() == io::ErrorKind::ConnectionReset => {
                    bail!("the image ended with a failure (a panic or a hard fault)")
                }
                Err(error) => return Err(error).context("reading the line"),
            }
            if Instant::now() >= self.deadline {
                bail!("the emulation was not over in time");
            }
        }
    }

    /// Ends the run. Returns what the image prints, one figure a line.
    ///
    /// # Errors
    /// If the image does not end well, or not in time.
    pub fn end(mut self) -> anyhow::Result<String> {
        let mut last: Vec<u8> = [0; SONARS].iter().flat_map(|code: &u16| code.to_le_bytes()).collect();
        last.push(END);
        self.line.write_all(&last).context("writing the line")?;
        let status = self.machine.wait_for_exit_status(self.deadline)?;
        let mut printed = String::new();
        if let Some(mut pipe) = self.machine.child.stdout.take() {
            pipe.read_to_string(&mut printed)?;
        }
        if !status.success() {
            bail!("the image ended with a failure; the emulator's {status}: {printed}");
        }
        Ok(printed)
    }
}

/// An echo as in the message `Ring`.
fn code(echo: Echo) -> u16 {
    match echo {
        Echo::Dead => 0,
        Echo::Silence => 1,
        Echo::Range { range_mm } => range_mm.saturating_add(2),
    }
}
