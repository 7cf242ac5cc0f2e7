//! The robot's end of TCP lines: whoever connects hears what the robot says and may tell it what to do.

use std::{
    collections::VecDeque,
    io::{self, Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
};

/// What a listener may be behind, in bytes; what is said beyond that is lost to it, as on a line that is too slow.
const BACKLOG_BYTES: usize = 1 << 16;

/// A TCP port at which a robot speaks and is spoken to.
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
/// robot.exchange(b"what the robot says");
/// let mut heard = [0; 19];
/// laptop.read_exact(&mut heard)?;
/// assert_eq!(&heard, b"what the robot says");
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
    /// Listens at an address, `HOST:PORT`; port 0 is any free one.
    ///
    /// # Errors
    /// When the address is not this computer's, or taken.
    pub fn bind(address: &str) -> io::Result<Self> {
        let port = TcpListener::bind(address)?;
        port.set_nonblocking(true)?;
        Ok(Self { port, listeners: Vec::new() })
    }

    /// The address that it listens at.
    ///
    /// # Errors
    /// When the system does not know it.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.port.local_addr()
    }

    /// How many are connected.
    pub const fn listeners(&self) -> usize {
        self.listeners.len()
    }

    /// How many bytes are still on their way to the slowest of them.
    pub fn unsent_bytes(&self) -> usize {
        self.listeners.iter().map(|listener| listener.unsent.len()).max().unwrap_or(0)
    }

    /// Says something to all and gives what they said meanwhile. Never waits; who went away is forgotten.
    pub fn exchange(&mut self, said: &[u8]) -> Vec<u8> {
        while let Ok((stream, _)) = self.port.accept() {
            if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                self.listeners.push(Connection { stream, unsent: VecDeque::new() });
            }
        }
        let mut heard = Vec::new();
        self.listeners.retain_mut(|listener| listener.exchange(said, &mut heard).is_ok());
        heard
    }
}

impl Connection {
    fn exchange(&mut self, said: &[u8], heard: &mut Vec<u8>) -> io::Result<()> {
        if self.unsent.len() + said.len() <= BACKLOG_BYTES {
            self.unsent.extend(said);
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
                Ok(count) => heard.extend_from_slice(&buffer[..count]),
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
    fn everyone_hears_the_robot_and_the_robot_hears_everyone() {
        let mut broadcast = Broadcast::bind("127.0.0.1:0").unwrap();
        let mut clients: Vec<TcpStream> =
            (0..2).map(|_| TcpStream::connect(broadcast.address().unwrap()).unwrap()).collect();
        while broadcast.listeners() < 2 {
            broadcast.exchange(&[]);
        }
        broadcast.exchange(b"abc");
        for client in &mut clients {
            let mut heard = [0; 3];
            client.read_exact(&mut heard).unwrap();
            assert_eq!(&heard, b"abc");
            client.write_all(b"x").unwrap();
        }
        let mut heard = Vec::new();
        while heard.len() < 2 {
            heard.extend(broadcast.exchange(&[]));
        }
        clients.clear();
        while broadcast.listeners() > 0 {
            broadcast.exchange(b"anyone?");
        }
    }
}
