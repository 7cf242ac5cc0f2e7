//! What this process has used of the computer, and what it may use.

use std::io;
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

/// What the system may hold for a line that is not read yet: some ten seconds of a robot at its normal pace.
#[cfg(unix)]
const RECEIVE_BUFFER_BYTES: usize = 1 << 15;

/// The time that all threads of this process have computed, in it or for it in the system; `None` where it is not known.
pub fn computing_time() -> Option<Duration> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(Duration::new(u64::try_from(time.tv_sec).ok()?, u32::try_from(time.tv_nsec).ok()?))
    }
    #[cfg(not(unix))]
    None
}

/// The memory of this process that is in use now, in bytes; `None` where it is not known (it is on Linux). What the system
/// holds for open connections is not in it.
pub fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kibibytes = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().strip_suffix(" kB")?;
    Some(kibibytes.trim().parse::<u64>().ok()? * 1024)
}

/// Lets this process open as many connections as the system allows it; by itself it may often open 1,024 only.
///
/// # Errors
/// When the system does not let it.
pub fn allow_many_connections() -> io::Result<()> {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        let limit = getrlimit(Resource::Nofile);
        setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum })?;
    }
    Ok(())
}

/// Lets that many connect before the first of them is accepted. The system may drop what is beyond, and with the usual 128 some of a
/// thousand believe that they are connected and hear nothing.
pub(super) fn expect_many(port: &TcpListener, count: usize) -> io::Result<()> {
    #[cfg(unix)]
    rustix::net::listen(port, i32::try_from(count).unwrap_or(i32::MAX))?;
    #[cfg(not(unix))]
    let _ = (port, count);
    Ok(())
}

/// Bounds what the system holds for a line that is not read; a thousand that grow as they like can take all of its memory.
pub(super) fn bound_receiving(stream: &mio::net::TcpStream) -> io::Result<()> {
    #[cfg(unix)]
    rustix::net::sockopt::set_socket_recv_buffer_size(stream, RECEIVE_BUFFER_BYTES)?;
    #[cfg(not(unix))]
    let _ = stream;
    Ok(())
}

/// The same for what was said and did not leave yet.
pub(super) fn bound_sending(stream: &TcpStream) -> io::Result<()> {
    #[cfg(unix)]
    rustix::net::sockopt::set_socket_send_buffer_size(stream, RECEIVE_BUFFER_BYTES)?;
    #[cfg(not(unix))]
    let _ = stream;
    Ok(())
}
