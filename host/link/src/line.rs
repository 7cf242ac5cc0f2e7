//! The line to a robot: a local serial port or a TCP connection.

use std::{
    io::{Read, Write},
    net::TcpStream,
    path::Path,
    time::Duration,
};

use anyhow::{Context, ensure};

/// Timeout of a read.
const READ_TIMEOUT: Duration = Duration::from_millis(20);
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// A line to a robot.
pub trait Line: Read + Write {}

impl<LINE: Read + Write> Line for LINE {}

/// Opens a line by its name: `tcp:HOST:PORT`, or a serial port with a speed in baud (8N1).
///
/// # Errors
/// If the serial port does not exist or cannot be opened, or the TCP connection fails.
pub fn open(name: &str, baud: u32) -> anyhow::Result<Box<dyn Line>> {
    if let Some(address) = name.strip_prefix("tcp:") {
        let line = TcpStream::connect(address).with_context(|| format!("connecting to {address}"))?;
        line.set_nodelay(true)?;
        line.set_read_timeout(Some(READ_TIMEOUT))?;
        line.set_write_timeout(Some(WRITE_TIMEOUT))?;
        return Ok(Box::new(line));
    }
    let path = Path::new(name);
    ensure!(!path.is_file() && !path.is_dir(), "{name} is a file or a directory, not a serial port");
    ensure!(
        !cfg!(unix) || path.exists(),
        "{name}: no such file or serial port; a robot on the network is tcp:HOST:PORT"
    );
    let port = serialport::new(name, baud).timeout(READ_TIMEOUT).open();
    Ok(Box::new(port.with_context(|| format!("opening the serial port {name}"))?))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_no_line_is_refused_with_the_reason() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("office.bin");
        let error = |name: &std::path::Path| format!("{:#}", open(name.to_str().unwrap(), 115_200).err().unwrap());
        assert!(error(&file).contains("no such file or serial port"));
        assert!(error(directory.path()).contains("not a serial port"));
        std::fs::write(&file, "").unwrap();
        assert!(error(&file).contains("not a serial port"));
    }
}
