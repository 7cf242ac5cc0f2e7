//! The robot's end of TCP lines: every client receives the robot's stream and may send commands.

use std::{
    collections::VecDeque,
    io::{self, Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
};

/// Maximum backlog of a client, in bytes. Output beyond it is lost for that client, as on a line that is too slow.
const BACKLOG_BYTES: usize = 1 << 16;

/// A TCP port that serves a robot's stream and accepts commands.
///
/// ```
/// use std::io::Read;
/// use std::net::TcpStream;
///
/// use toposlam_link::broadcast::Broadcast;
///
/// let mut robot = Broadcast::bind("127.0.0.1:0")?;
/// let mut laptop = TcpStream::connect(robot.address()?)?;
/// while robot.listeners() == 0 {
///     robot.exchange(&[]);
/// }
/// robot.exchange(b"what a robot sends");
/// let mut received = [0; 18];
/// laptop.read_exact(&mut received)?;
/// assert_eq!(&received, b"what a robot sends");
/// # Ok::<(), std::io::Error>(())
/// ```
pub struct Broadcast {
    port: TcpListener,
    listeners: Vec<Connection>,
}

struct Connection {
    stream: TcpStream,
    unsent: VecDeque<u8>,
}

impl Broadcast {
    /// Listens at an address, `HOST:PORT`; port 0 selects any free port.
    ///
    /// # Errors
    /// If the address is not one of this computer, or is in use.
    pub fn bind(address: &str) -> io::Result<Self> {
        let port = TcpListener::bind(address)?;
        port.set_nonblocking(true)?;
        Ok(Self { port, listeners: Vec::new() })
    }

    /// The address of the listening socket.
    ///
    /// # Errors
    /// If the operating system does not report it.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.port.local_addr()
    }

    /// Number of connected clients.
    pub const fn listeners(&self) -> usize {
        self.listeners.len()
    }

    /// Largest backlog of any client, in bytes.
    pub fn unsent_bytes(&self) -> usize {
        self.listeners.iter().map(|listener| listener.unsent.len()).max().unwrap_or(0)
    }

    /// Sends bytes to all clients and returns the bytes received from them. Never blocks; removes clients that have
    /// disconnected.
    pub fn exchange(&mut self, sent: &[u8]) -> Vec<u8> {
        while let Ok((stream, _)) = self.port.accept() {
            if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                self.listeners.push(Connection { stream, unsent: VecDeque::new() });
            }
        }
        let mut received = Vec::new();
        self.listeners.retain_mut(|listener| listener.exchange(sent, &mut received).is_ok());
        received
    }
}

impl Connection {
    fn exchange(&mut self, sent: &[u8], received: &mut Vec<u8>) -> io::Result<()> {
        if self.unsent.len() + sent.len() <= BACKLOG_BYTES {
            self.unsent.extend(sent);
        }
        while !self.unsent.is_empty() {
            match self.stream.write(self.unsent.as_slices().0) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => drop(self.unsent.drain(..count)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        let mut buffer = [0; 4096];
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => received.extend_from_slice(&buffer[..count]),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_client_receives_the_stream_and_can_send() {
        let mut broadcast = Broadcast::bind("127.0.0.1:0").unwrap();
        let mut clients: Vec<TcpStream> =
            (0..2).map(|_| TcpStream::connect(broadcast.address().unwrap()).unwrap()).collect();
        while broadcast.listeners() < 2 {
            broadcast.exchange(&[]);
        }
        broadcast.exchange(b"abc");
        for client in &mut clients {
            let mut received = [0; 3];
            client.read_exact(&mut received).unwrap();
            assert_eq!(&received, b"abc");
            client.write_all(b"x").unwrap();
        }
        let mut received = Vec::new();
        while received.len() < 2 {
            received.extend(broadcast.exchange(&[]));
        }
        clients.clear();
        while broadcast.listeners() > 0 {
            broadcast.exchange(b"anyone?");
        }
    }
}
