//! The robot's end of TCP lines: every client receives the robot's stream and may send commands.

use std::{
    collections::VecDeque,
    io::{self, Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
};

use toposlam::wire::{Inbox, MAX_FRAME_BYTES};

/// The most clients; further ones are disconnected.
const CLIENTS: usize = 64;
/// Maximum backlog of a client, in bytes. Output beyond it is lost for that client, as on a line that is too slow.
const BACKLOG_BYTES: usize = 1 << 16;
/// Maximum number of bytes in one read of a client.
const READ_BYTES: usize = 4096;
/// Maximum number of reads of a client per exchange.
const READS: usize = 16;

/// A TCP port that serves a robot's stream and accepts commands.
///
/// Its memory is bounded, whatever the clients do: [`Broadcast::MAX_BUFFERED_BYTES`]. A client that does not read loses output. A
/// client that sends more than the robot can take waits, and delays no other client.
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
    /// The client whose frame is taken first in the next exchange.
    first: usize,
}

struct Connection {
    stream: TcpStream,
    unsent: VecDeque<u8>,
    /// Bytes that were read and not yet taken.
    unread: VecDeque<u8>,
    /// The begun or complete frame.
    frame: Vec<u8>,
    /// Whether the begun frame is longer than any frame, and is dropped up to its closing zero.
    is_too_long: bool,
}

impl Broadcast {
    /// The most bytes in the buffers of all clients together.
    pub const MAX_BUFFERED_BYTES: usize = CLIENTS * (BACKLOG_BYTES + READ_BYTES + MAX_FRAME_BYTES);
    /// The most bytes that [`Broadcast::exchange`] returns: what a robot decodes in one turn of its main loop.
    pub const RECEIVED_BYTES: usize = Inbox::BYTES_PER_TURN as usize;

    /// Listens at an address, `HOST:PORT`; port 0 selects any free port.
    ///
    /// # Errors
    /// If the address is not one of this computer, or is in use.
    pub fn bind(address: &str) -> io::Result<Self> {
        let port = TcpListener::bind(address)?;
        port.set_nonblocking(true)?;
        Ok(Self { port, listeners: Vec::new(), first: 0 })
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

    /// Number of bytes in the buffers of all clients.
    pub fn buffered_bytes(&self) -> usize {
        let bytes = |client: &Connection| client.unsent.len() + client.unread.len() + client.frame.len();
        self.listeners.iter().map(bytes).sum()
    }

    /// Sends bytes to all clients and returns frames received from them: at most one of each client, and
    /// [`Broadcast::RECEIVED_BYTES`] in all. The clients take turns. Bytes that no frame can contain are dropped. Never blocks;
    /// removes clients that have disconnected.
    pub fn exchange(&mut self, sent: &[u8]) -> Vec<u8> {
        self.accept();
        self.listeners.retain_mut(|listener| listener.exchange(sent).is_ok());
        let mut received = Vec::new();
        let count = self.listeners.len();
        let first = self.first.checked_rem(count).unwrap_or(0);
        for turn in 0..count {
            let number = (first + turn) % count;
            let client = &mut self.listeners[number];
            if !client.has_frame() {
                continue;
            }
            // The client that has no room is the first one of the next exchange.
            if received.len() + client.frame.len() > Self::RECEIVED_BYTES {
                self.first = number;
                return received;
            }
            received.append(&mut client.frame);
        }
        self.first = first + 1;
        received
    }

    fn accept(&mut self) {
        for _ in 0..CLIENTS {
            let Ok((stream, _)) = self.port.accept() else { return };
            if self.listeners.len() < CLIENTS
                && stream.set_nonblocking(true).is_ok()
                && stream.set_nodelay(true).is_ok()
            {
                self.listeners.push(Connection {
                    stream,
                    unsent: VecDeque::new(),
                    unread: VecDeque::new(),
                    frame: Vec::new(),
                    is_too_long: false,
                });
            }
        }
    }
}

impl Connection {
    fn exchange(&mut self, sent: &[u8]) -> io::Result<()> {
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
        let mut buffer = [0; READ_BYTES];
        for _ in 0..READS {
            self.take_frame();
            if self.has_frame() {
                return Ok(());
            }
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => self.unread.extend(&buffer[..count]),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn has_frame(&self) -> bool {
        self.frame.last() == Some(&0)
    }

    /// Takes bytes up to the end of the next frame.
    fn take_frame(&mut self) {
        while !self.has_frame()
            && let Some(byte) = self.unread.pop_front()
        {
            if self.is_too_long {
                self.is_too_long = byte != 0;
            } else if byte != 0 || !self.frame.is_empty() {
                self.frame.push(byte);
                if self.frame.len() > MAX_FRAME_BYTES {
                    self.is_too_long = byte != 0;
                    self.frame.clear();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;
    use std::time::{Duration, Instant};

    use super::*;

    fn connected(broadcast: &mut Broadcast, count: usize) -> Vec<TcpStream> {
        let address = broadcast.address().unwrap();
        let clients = (0..count).map(|_| TcpStream::connect(address).unwrap()).collect();
        while broadcast.listeners() < count {
            broadcast.exchange(&[]);
        }
        clients
    }

    #[test]
    fn every_client_receives_the_stream_and_can_send() {
        let mut broadcast = Broadcast::bind("127.0.0.1:0").unwrap();
        let mut clients = connected(&mut broadcast, 2);
        broadcast.exchange(b"abc");
        for client in &mut clients {
            let mut received = [0; 3];
            client.read_exact(&mut received).unwrap();
            assert_eq!(&received, b"abc");
            client.write_all(b"x\0").unwrap();
        }
        let mut received = Vec::new();
        while received.len() < 4 {
            received.extend(broadcast.exchange(&[]));
        }
        assert_eq!(received, b"x\0x\0");
        clients.clear();
        while broadcast.listeners() > 0 {
            broadcast.exchange(b"anyone?");
        }
    }

    #[test]
    fn frames_of_clients_are_not_mixed_and_what_is_no_frame_is_dropped() {
        let mut broadcast = Broadcast::bind("127.0.0.1:0").unwrap();
        let mut clients = connected(&mut broadcast, 2);
        clients[0].write_all(b"\0\0begun").unwrap();
        clients[1].write_all(&[7; 4 * MAX_FRAME_BYTES]).unwrap();
        clients[1].write_all(b"\0whole\0").unwrap();
        let mut received = Vec::new();
        while received.is_empty() {
            received = broadcast.exchange(&[]);
        }
        assert_eq!(received, b"whole\0");
        clients[0].write_all(b" and ended\0").unwrap();
        received.clear();
        while received.is_empty() {
            received = broadcast.exchange(&[]);
        }
        assert_eq!(received, b"begun and ended\0");
    }

    /// Some clients send as fast as they can, others never read, and one sends a command.
    #[test]
    fn a_flood_and_readers_that_never_read_take_bounded_memory_and_delay_no_command() {
        let mut broadcast = Broadcast::bind("127.0.0.1:0").unwrap();
        let mut clients = connected(&mut broadcast, CLIENTS);
        let mut asking = clients.pop().unwrap();
        asking.set_nonblocking(true).unwrap();
        let ends = Arc::new(AtomicBool::new(false));
        let floods: Vec<_> = (0..4)
            .map(|seed: u8| {
                let (mut client, ends) = (clients.pop().unwrap(), Arc::clone(&ends));
                // Without zeros, with some, with one after each 60 bytes, and zeros alone.
                let garbage: Vec<u8> = (0..60_000u32)
                    .map(|at| match seed {
                        0 => 7,
                        1 => (at.wrapping_mul(2_654_435_761) >> 24) as u8,
                        2 => u8::from(!at.is_multiple_of(60)),
                        _ => 0,
                    })
                    .collect();
                client.set_write_timeout(Some(Duration::from_millis(50))).unwrap();
                thread::spawn(move || {
                    while !ends.load(Ordering::Relaxed) {
                        // A write that times out shows that the flood waits.
                        let _ = client.write(&garbage);
                    }
                })
            })
            .collect();
        let sent = vec![1; 4000];
        let (mut commands, mut replies) = (0, 0);
        let deadline = Instant::now() + Duration::from_secs(60);
        for turn in 0..3000 {
            if turn % 10 == 0 {
                asking.write_all(b"a command\0").unwrap();
                commands += 1;
            }
            let received = broadcast.exchange(&sent);
            assert!(received.len() <= Broadcast::RECEIVED_BYTES, "{}", received.len());
            assert!(broadcast.buffered_bytes() <= Broadcast::MAX_BUFFERED_BYTES);
            assert!(broadcast.unsent_bytes() <= BACKLOG_BYTES);
            replies += received.windows(10).filter(|bytes| bytes == b"a command\0").count();
            let _ = asking.read(&mut [0; 1 << 16]);
            assert!(Instant::now() < deadline, "turn {turn}");
        }
        while replies < commands {
            replies += broadcast.exchange(&[]).windows(10).filter(|bytes| bytes == b"a command\0").count();
            assert!(Instant::now() < deadline, "{replies} of {commands} commands");
        }
        ends.store(true, Ordering::Relaxed);
        floods.into_iter().for_each(|flood| flood.join().unwrap());
    }

    #[test]
    fn a_client_beyond_the_limit_is_disconnected() {
        let mut broadcast = Broadcast::bind("127.0.0.1:0").unwrap();
        let _clients = connected(&mut broadcast, CLIENTS);
        let mut another = TcpStream::connect(broadcast.address().unwrap()).unwrap();
        another.set_nonblocking(true).unwrap();
        let deadline = Instant::now() + Duration::from_secs(10);
        while !matches!(another.read(&mut [0; 9]), Ok(0)) {
            broadcast.exchange(&[]);
            assert!(Instant::now() < deadline);
        }
        assert_eq!(broadcast.listeners(), CLIENTS);
    }
}
