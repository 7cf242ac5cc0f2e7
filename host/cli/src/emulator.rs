//! Runs the firmware in an emulated STM32F405 and simulates its environment.
//!
//! QEMU's USART2 connects to the model of the sensor bus, USART1 to the caller. The emulated machine has no I2C, so the
//! firmware reaches its sensors through the SC18IM700 bridge, with the same bytes as on a robot.

pub mod microbit;
mod stack;

use std::{
    io::{self, Read, Write},
    net::{TcpListener, TcpStream},
    ops::ControlFlow,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use toposlam::ring::RingFrame;

use toposlam_sim::chip::Srf08Bank;
use toposlam_sim::injector::{BridgeCounts, FaultRates, FaultyBridge};

use self::stack::stack_high_water;

const BUFFER_BYTES: usize = 4096;
/// After a lost byte the firmware waits for a fixed number of wake-ups, which takes 20 s with the clock alone. With
/// faults, zeros on USART1 wake it whenever the line to the bridge has been quiet for this long; between frames zeros
/// have no meaning.
const WAKE_AFTER: Duration = Duration::from_millis(1);
/// Zeros per wake-up. A host cannot wait less than about four milliseconds; this many zeros reduce the delay of a lost
/// byte to a quarter of a second.
const WAKE: [u8; 4] = [0; 4];

/// Configuration of a run.
#[derive(Clone, Debug)]
pub struct Emulation {
    /// The emulator: a name on the search path, or a file.
    pub qemu: PathBuf,
    /// The firmware image, as flashed.
    pub elf: PathBuf,
    /// Number of times a sonar reads as still ranging before it answers.
    pub ranging_polls: u32,
    /// Timeout of the whole run.
    pub timeout: Duration,
    /// Number of frames without any sensor after the last frame of the world, so that the firmware can repeat its
    /// messages; then the sensor bus is silent.
    pub blind_frames: u64,
    /// The run ends when USART1 has then been quiet for this long.
    pub quiet: Duration,
    /// Fault rates between the firmware and its sensors, from the world's first frame to its last.
    pub faults: FaultRates,
    /// Seed of the faults.
    pub fault_seed: u64,
}

impl Emulation {
    /// Runs the firmware in the emulator on the search path, with a timeout of ten minutes.
    pub fn new(elf: impl Into<PathBuf>) -> Self {
        Self {
            qemu: "qemu-system-arm".into(),
            elf: elf.into(),
            ranging_polls: 0,
            timeout: Duration::from_secs(600),
            blind_frames: 64,
            quiet: Duration::from_millis(500),
            faults: FaultRates::NONE,
            fault_seed: 0,
        }
    }

    /// Runs the firmware until the frames are used up and USART1 is quiet, `received` breaks, or the firmware ends by
    /// itself. `received` gets the firmware's output on USART1 in pieces of any length; bytes that it appends to its
    /// second argument are sent to the firmware.
    /// second argument is sent to the firmware.
    ///
    /// # Errors
    /// If the emulator cannot be started or its connection fails, if the firmware ends with a failure (a panic or a
    /// hard fault), and after the timeout.
    pub fn run(
        &self,
        frames: impl FnMut() -> Option<RingFrame<16>> + Send,
        mut received: impl FnMut(&[u8], &mut Vec<u8>) -> ControlFlow<()>,
    ) -> anyhow::Result<Outcome> {
        if !self.elf.is_file() {
            bail!("no firmware image at {}: build it with `cargo firmware`", self.elf.display());
        }
        let started = Instant::now();
        let deadline = started + self.timeout;
        let [usart1, usart2, monitor] = [listen()?, listen()?, listen()?];
        let mut machine = Machine::start(&self.qemu, &self.elf, [&usart1, &usart2, &monitor])?;
        let mut usart1 = machine.accept(&usart1, deadline)?;
        let usart2 = machine.accept(&usart2, deadline)?;
        let monitor = machine.accept(&monitor, deadline)?;

        let progress = Arc::new(Progress::default());
        let to_firmware = Mutex::new(usart1.try_clone()?);
        let (ending, bridge) = thread::scope(|scope| {
            let stop = usart2.try_clone()?;
            let bus = scope.spawn(|| self.play_bus(usart2, frames, &progress, &to_firmware));
            let ending =
                self.listen_until_the_end(&mut machine, &mut usart1, &progress, deadline, &to_firmware, &mut received);
            // Closing the line ends the thread that reads it.
            let _ = stop.shutdown(std::net::Shutdown::Both);
            match bus.join() {
                Ok(counts) => ending.map(|ending| (ending, counts)),
                Err(_) => bail!("the model of the sensor bus failed"),
            }
        })?;
        let stack_high_water_bytes = if ending.is_running() { stack_high_water(monitor).ok() } else { None };
        machine.end();
        match ending {
            Ending::Exited(status) if !status.success() => {
                bail!("the firmware ended with a failure (a panic or a hard fault); the emulator's {status}")
            }
            Ending::Exited(_) | Ending::WorldOver | Ending::BrokenOff => Ok(Outcome {
                ending,
                frames: progress.frames.load(Ordering::Relaxed),
                bus_bytes: progress.bus_bytes.load(Ordering::Relaxed),
                stack_high_water_bytes,
                bridge,
                seconds: started.elapsed().as_secs_f64(),
            }),
        }
    }

    /// Answers the firmware's bytes on USART2 like the bridge and the rangers behind it, until the line closes.
    fn play_bus(
        &self,
        line: TcpStream,
        frames: impl FnMut() -> Option<RingFrame<16>>,
        progress: &Progress,
        to_firmware: &Mutex<TcpStream>,
    ) -> BridgeCounts {
        let mut bridge = FaultyBridge::new(Srf08Bank::new(frames, self.ranging_polls), self.faults, self.fault_seed);
        // The line fails when the emulator ends.
        let _ = self.answer_bus(line, &mut bridge, progress, to_firmware);
        bridge.counts()
    }

    fn answer_bus<WORLD: FnMut() -> Option<RingFrame<16>>>(
        &self,
        mut line: TcpStream,
        bridge: &mut FaultyBridge<Srf08Bank<WORLD>>,
        progress: &Progress,
        to_firmware: &Mutex<TcpStream>,
    ) -> io::Result<()> {
        let has_faults = self.faults != FaultRates::NONE;
        line.set_read_timeout(has_faults.then_some(WAKE_AFTER))?;
        let mut buffer = [0; BUFFER_BYTES];
        loop {
            let count = match line.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(count) => count,
                Err(error) if is_timeout(&error) => {
                    if bridge.devices().frames() > 0 {
                        send(to_firmware, &WAKE)?;
                    }
                    continue;
                }
                Err(error) => return Err(error),
            };
            let answer: Vec<u8> = buffer[..count].iter().flat_map(|&byte| bridge.byte(byte)).collect();
            let (frames, blind_frames) = (bridge.devices().frames(), bridge.devices().blind_frames());
            bridge.set_faulty(has_faults && frames > 0 && blind_frames == 0);
            progress.bus_bytes.fetch_add(count as u64, Ordering::Relaxed);
            progress.frames.store(frames, Ordering::Relaxed);
            if blind_frames > self.blind_frames {
                progress.world_over.store(true, Ordering::Release);
            } else if !answer.is_empty() {
                line.write_all(&answer)?;
            }
        }
    }

    fn listen_until_the_end(
        &self,
        machine: &mut Machine,
        usart1: &mut TcpStream,
        progress: &Progress,
        deadline: Instant,
        to_firmware: &Mutex<TcpStream>,
        received: &mut impl FnMut(&[u8], &mut Vec<u8>) -> ControlFlow<()>,
    ) -> anyhow::Result<Ending> {
        usart1.set_read_timeout(Some(Duration::from_millis(20)))?;
        let mut buffer = [0; BUFFER_BYTES];
        let mut answer = Vec::new();
        let mut last_byte = Instant::now();
        loop {
            match usart1.read(&mut buffer) {
                Ok(0) => return machine.wait_for_exit(deadline),
                Ok(count) => {
                    last_byte = Instant::now();
                    if received(&buffer[..count], &mut answer).is_break() {
                        return Ok(Ending::BrokenOff);
                    }
                    send(to_firmware, &answer).context("writing USART1")?;
                    answer.clear();
                }
                Err(error) if is_timeout(&error) => {}
                Err(error) if error.kind() == io::ErrorKind::ConnectionReset => return machine.wait_for_exit(deadline),
                Err(error) => return Err(error).context("reading USART1"),
            }
            let now = Instant::now();
            if !progress.world_over.load(Ordering::Acquire) {
                // The quiet time starts at the end of the world at the earliest.
                last_byte = now;
            } else if now.duration_since(last_byte) >= self.quiet {
                return Ok(Ending::WorldOver);
            }
            if now >= deadline {
                bail!(
                    "the emulation was not over after {} s; the firmware had read {} frames",
                    self.timeout.as_secs(),
                    progress.frames.load(Ordering::Relaxed)
                );
            }
        }
    }
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The frames were used up and USART1 was quiet.
    WorldOver,
    /// The caller ended the run.
    BrokenOff,
    /// The firmware ended the emulator.
    Exited(ExitStatus),
}

impl Ending {
    fn is_running(self) -> bool {
        !matches!(self, Self::Exited(_))
    }
}

/// Results of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub ending: Ending,
    /// Number of ring frames that the firmware read.
    pub frames: u64,
    /// Number of bytes that the firmware sent to the sensor bus.
    pub bus_bytes: u64,
    /// Maximum stack use of the firmware in bytes, from the remaining fill pattern.
    pub stack_high_water_bytes: Option<usize>,
    /// Faults injected between the firmware and its sensors.
    pub bridge: BridgeCounts,
    /// Duration of the run on the host.
    pub seconds: f64,
}

#[derive(Default)]
struct Progress {
    frames: AtomicU64,
    bus_bytes: AtomicU64,
    world_over: AtomicBool,
}

/// The running emulator; it is killed on drop.
struct Machine {
    child: Child,
}

impl Machine {
    fn start(qemu: &Path, elf: &Path, lines: [&TcpListener; 3]) -> anyhow::Result<Self> {
        let mut command = Command::new(qemu);
        command.args(["-M", "netduinoplus2", "-display", "none"]);
        command.args(["-semihosting-config", "enable=on,target=native"]);
        for (option, line) in ["-serial", "-serial", "-monitor"].into_iter().zip(lines) {
            command.arg(option).arg(format!("tcp:{},nodelay=on", line.local_addr()?));
        }
        command.arg("-kernel").arg(elf).stdout(Stdio::null());
        Self::spawn(command)
    }

    fn spawn(mut command: Command) -> anyhow::Result<Self> {
        let child = command.stdin(Stdio::null()).spawn().with_context(|| {
            let program = Path::new(command.get_program());
            format!("starting the emulator {}; on Debian it is in the package qemu-system-arm", program.display())
        })?;
        Ok(Self { child })
    }

    fn accept(&mut self, listener: &TcpListener, deadline: Instant) -> anyhow::Result<TcpStream> {
        listener.set_nonblocking(true)?;
        loop {
            match listener.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false)?;
                    stream.set_nodelay(true)?;
                    return Ok(stream);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(error) => return Err(error).context("waiting for the emulator"),
            }
            if let Some(status) = self.child.try_wait()? {
                bail!("the emulator ended before it connected: {status}");
            }
            if Instant::now() >= deadline {
                bail!("the emulator did not connect in time");
            }
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn wait_for_exit(&mut self, deadline: Instant) -> anyhow::Result<Ending> {
        self.wait_for_exit_status(deadline).map(Ending::Exited)
    }

    fn wait_for_exit_status(&mut self, deadline: Instant) -> anyhow::Result<ExitStatus> {
        loop {
            if let Some(status) = self.child.try_wait()? {
                return Ok(status);
            }
            if Instant::now() >= deadline {
                bail!("the emulator closed its lines but did not end");
            }
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn end(mut self) {
        self.kill();
    }

    fn kill(&mut self) {
        // Either fails only if the emulator has already ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        self.kill();
    }
}

fn listen() -> anyhow::Result<TcpListener> {
    TcpListener::bind("127.0.0.1:0").context("opening a local port for the emulator")
}

/// Writes all bytes at once, so that bytes of other threads cannot come in between.
fn send(line: &Mutex<TcpStream>, bytes: &[u8]) -> io::Result<()> {
    let mut line = line.lock().map_err(|_| io::Error::other("another thread failed"))?;
    line.write_all(bytes)
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_image_gives_an_error_with_the_build_command() {
        let error = Emulation::new("no-such-image").run(|| None, |_, _| ControlFlow::Continue(())).unwrap_err();
        assert!(error.to_string().contains("cargo firmware"));
    }
}
