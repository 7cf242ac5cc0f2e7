//! Web server for several browsers: one page, the newest state, and a stream of states.

use std::io::{self, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use super::http::{self, Refusal, Request};
use super::newest::{Change, Newest, Seen};
use super::state::State;

const PAGE: &str = include_str!("page.html");

/// Send buffer of the operating system for a browser that does not read, in addition to the browser's receive buffer.
const SEND_BUFFER_BYTES: usize = 64 * 1024;

/// Limits of a server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Host names that browsers may use besides the addresses of this computer and `localhost`.
    pub names: Vec<String>,
    /// Maximum number of connections; further ones are refused.
    pub connections: usize,
    /// Timeout of a request, and of each write to a browser. Then the browser is dropped.
    pub patience: Duration,
    /// Minimum interval between two states for the same browser.
    pub pace: Duration,
    /// Without a new state for this long, the server sends a comment, which detects browsers that have disconnected.
    pub keep_alive: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            names: Vec::new(),
            connections: 64,
            patience: Duration::from_secs(5),
            pace: Duration::from_millis(50),
            keep_alive: Duration::from_secs(10),
        }
    }
}

/// A web server that runs until it is dropped.
pub struct Server {
    address: SocketAddr,
    shared: Arc<Shared>,
    accepting: Option<thread::JoinHandle<()>>,
}

struct Shared {
    options: Options,
    newest: Newest,
    connections: AtomicUsize,
}

impl Server {
    /// Serves at an address, `HOST:PORT`; port 0 selects any free port. Browsers get `state` until the first
    /// [`Server::publish`].
    ///
    /// # Errors
    /// If the address is not one of this computer, or is in use.
    pub fn bind(address: &str, options: Options, state: &State) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared { options, newest: Newest::new(state), connections: AtomicUsize::new(0) });
        let accepting = thread::Builder::new().spawn({
            let shared = Arc::clone(&shared);
            move || accept(&listener, &shared)
        })?;
        Ok(Self { address, shared, accepting: Some(accepting) })
    }

    /// The address of the listening socket.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Replaces the newest state. Never waits for a browser.
    pub fn publish(&self, state: &State) {
        self.shared.newest.publish(state);
    }

    /// Number of open connections.
    pub fn connections(&self) -> usize {
        self.shared.connections.load(Ordering::Relaxed)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.newest.close();
        // A connection wakes the thread that blocks in `accept`.
        let ip = match self.address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
            ip => ip,
        };
        let woken = TcpStream::connect_timeout(&SocketAddr::new(ip, self.address.port()), Duration::from_secs(1));
        if let (Ok(_), Some(accepting)) = (woken, self.accepting.take()) {
            let _ = accepting.join();
        }
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    loop {
        let accepted = listener.accept();
        if shared.newest.is_closed() {
            return;
        }
        let Ok((stream, _)) = accepted else {
            // The process has no free sockets; an immediate retry would fail as well.
            thread::sleep(Duration::from_millis(50));
            continue;
        };
        let place = Place::take(shared);
        // If no thread can be started, the connection is closed.
        let _ = thread::Builder::new().spawn(move || {
            // A browser that has disconnected needs no response.
            let _ = place.answer(stream);
        });
    }
}

/// One of the limited number of connections.
struct Place {
    shared: Arc<Shared>,
    is_free: bool,
}

impl Place {
    fn take(shared: &Arc<Shared>) -> Self {
        let before = shared.connections.fetch_add(1, Ordering::Relaxed);
        Self { shared: Arc::clone(shared), is_free: before < shared.options.connections }
    }

    fn answer(&self, mut stream: TcpStream) -> io::Result<()> {
        let Options { names, patience, .. } = &self.shared.options;
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(*patience))?;
        socket2::SockRef::from(&stream).set_send_buffer_size(SEND_BUFFER_BYTES)?;
        if !self.is_free {
            return refuse(&mut stream, Refusal::TooMany);
        }
        let here = stream.local_addr()?.ip();
        match http::read(&mut stream, *patience) {
            None => Ok(()),
            Some(Err(refusal)) => refuse(&mut stream, refusal),
            Some(Ok(request)) if !http::is_ours(&request.host, here, names) => {
                refuse(&mut stream, Refusal::ForeignHost)
            }
            Some(Ok(request)) => self.give(&mut stream, &request),
        }
    }

    fn give(&self, stream: &mut TcpStream, request: &Request) -> io::Result<()> {
        let wants_body = match request.method.as_str() {
            "GET" => true,
            "HEAD" => false,
            _ => return refuse(stream, Refusal::OnlyReading),
        };
        let body = match request.path.as_str() {
            "/" => page(stream)?,
            "/map.json" => {
                http::write_head(stream, "200 OK", "application/json", &[])?;
                self.shared.newest.json()
            }
            "/events" => {
                http::write_head(stream, "200 OK", "text/event-stream", &[])?;
                return if wants_body { self.stream(stream) } else { Ok(()) };
            }
            _ => return refuse(stream, Refusal::NotFound),
        };
        if wants_body { stream.write_all(body.as_bytes()) } else { Ok(()) }
    }

    /// Sends the newest state and then each new one, until the browser disconnects or is too slow, or the server ends.
    fn stream(&self, stream: &mut TcpStream) -> io::Result<()> {
        let Options { pace, keep_alive, .. } = self.shared.options;
        let mut seen = Seen::default();
        stream.write_all(b"retry: 1000\n\n")?;
        loop {
            let text = match self.shared.newest.wait(&mut seen, keep_alive) {
                Change::Closed => return Ok(()),
                Change::Nothing => ":\n\n".to_owned(),
                Change::Parts { map, live } => {
                    let event = |name, data: Option<Arc<str>>| {
                        data.map_or(String::new(), |data| format!("event: {name}\ndata: {data}\n\n"))
                    };
                    event("map", map) + &event("live", live)
                }
            };
            stream.write_all(text.as_bytes())?;
            thread::sleep(pace);
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.shared.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The page. The browser runs only its script and style, which carry a random nonce.
fn page(stream: &mut TcpStream) -> io::Result<String> {
    let nonce = format!("{:032x}", rand::random::<u128>());
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'"
    );
    http::write_head(stream, "200 OK", "text/html; charset=utf-8", &[("Content-Security-Policy", &policy)])?;
    Ok(PAGE.replace("{{nonce}}", &nonce))
}

fn refuse(stream: &mut TcpStream, refusal: Refusal) -> io::Result<()> {
    let allow: &[_] = if refusal == Refusal::OnlyReading { &[("Allow", "GET, HEAD")] } else { &[] };
    http::write_head(stream, refusal.status(), "text/plain; charset=utf-8", allow)?;
    stream.write_all(refusal.why().as_bytes())
}
