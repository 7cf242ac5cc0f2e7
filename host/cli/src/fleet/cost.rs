//! Resources of this process: use and limits.

use std::io;
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

/// Receive buffer of the operating system per line: about ten seconds of a robot at its normal pace.
#[cfg(unix)]
const RECEIVE_BUFFER_BYTES: usize = 1 << 15;

/// CPU time of all threads of this process, user and system; `None` if it is not available.
pub fn computing_time() -> Option<Duration> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(Duration::new(u64::try_from(time.tv_sec).ok()?, u32::try_from(time.tv_nsec).ok()?))
    }
    #[cfg(not(unix))]
    None
}

/// Resident memory of this process, in bytes; `None` if it is not available (it is on Linux). Excludes the operating
/// system's buffers for open connections.
pub fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kibibytes = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().strip_suffix(" kB")?;
    Some(kibibytes.trim().parse::<u64>().ok()? * 1024)
}

/// Raises this process's limit of open connections to the system's maximum; the default is often 1,024.
///
/// # Errors
/// If the operating system refuses.
pub fn allow_many_connections() -> io::Result<()> {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        let limit = getrlimit(Resource::Nofile);
        setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, maximum: limit.maximum })?;
    }
    Ok(())
}

/// The most connections from this process to one port of this computer; `None` if it is not available. Each takes an open file
/// and a local port.
pub fn most_connections() -> Option<u64> {
    #[cfg(unix)]
    let files = rustix::process::getrlimit(rustix::process::Resource::Nofile).current;
    #[cfg(not(unix))]
    let files = None;
    let range = std::fs::read_to_string("/proc/sys/net/ipv4/ip_local_port_range").ok();
    let ports = range.and_then(|range| {
        let mut ends = range.split_whitespace().map_while(|end| end.parse::<u64>().ok());
        let (first, last) = (ends.next()?, ends.next()?);
        Some(last.saturating_sub(first) + 1)
    });
    [files, ports].into_iter().flatten().min()
}

/// Sets the number of connections that may wait to be accepted. The system may drop any beyond it: with the usual 128,
/// some of a thousand clients appear connected but receive nothing.
pub(super) fn expect_many(port: &TcpListener, count: usize) -> io::Result<()> {
    #[cfg(unix)]
    rustix::net::listen(port, i32::try_from(count).unwrap_or(i32::MAX))?;
    #[cfg(not(unix))]
    let _ = (port, count);
    Ok(())
}

/// Limits the receive buffer of a line; a thousand unlimited buffers can use all memory of the system.
pub(super) fn bound_receiving(stream: &mio::net::TcpStream) -> io::Result<()> {
    #[cfg(unix)]
    rustix::net::sockopt::set_socket_recv_buffer_size(stream, RECEIVE_BUFFER_BYTES)?;
    #[cfg(not(unix))]
    let _ = stream;
    Ok(())
}

/// Limits the send buffer of a line.
pub(super) fn bound_sending(stream: &TcpStream) -> io::Result<()> {
    #[cfg(unix)]
    rustix::net::sockopt::set_socket_send_buffer_size(stream, RECEIVE_BUFFER_BYTES)?;
    #[cfg(not(unix))]
    let _ = stream;
    Ok(())
}
