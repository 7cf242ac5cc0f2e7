//! Minimal HTTP for a page with few browsers: reads the head of a request and closes the connection after the response.

use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Maximum size of a head; that of a browser has about 1 KiB.
const MAX_HEAD_BYTES: usize = 16 * 1024;
const MAX_HEADERS: usize = 100;

/// A request.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request {
    pub(super) method: String,
    /// Without the query string.
    pub(super) path: String,
    pub(super) host: String,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    Malformed,
    ForeignHost,
    NotFound,
    OnlyReading,
    TooSlow,
    TooLong,
    TooMany,
}

impl Refusal {
    pub(super) const fn status(self) -> &'static str {
        match self {
            Self::Malformed => "400 Bad Request",
            Self::ForeignHost => "403 Forbidden",
            Self::NotFound => "404 Not Found",
            Self::OnlyReading => "405 Method Not Allowed",
            Self::TooSlow => "408 Request Timeout",
            Self::TooLong => "431 Request Header Fields Too Large",
            Self::TooMany => "503 Service Unavailable",
        }
    }

    pub(super) const fn why(self) -> &'static str {
        match self {
            Self::Malformed => "This is not an HTTP request.\n",
            Self::ForeignHost => "This server is not known by that name; see the option --name.\n",
            Self::NotFound => "There are /, /map.json and /events.\n",
            Self::OnlyReading => "There is only something to GET here.\n",
            Self::TooSlow => "The request took too long.\n",
            Self::TooLong => "The request is too long.\n",
            Self::TooMany => "There are too many browsers here already.\n",
        }
    }
}

/// Reads the head of a request. `None` if the connection fails or ends, so that no response is possible.
pub(super) fn read(stream: &mut TcpStream, patience: Duration) -> Option<Result<Request, Refusal>> {
    let deadline = Instant::now() + patience;
    let mut head = Vec::new();
    let mut buffer = [0; 4096];
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Some(Err(Refusal::TooSlow));
        }
        stream.set_read_timeout(Some(left)).ok()?;
        match stream.read(&mut buffer) {
            Ok(0) => return None,
            Ok(count) => head.extend_from_slice(&buffer[..count]),
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted => continue,
                _ => return None,
            },
        }
        if let Some(done) = parse(&head) {
            return Some(done);
        }
        if head.len() > MAX_HEAD_BYTES {
            return Some(Err(Refusal::TooLong));
        }
    }
}

/// Parses a head; `None` if it is incomplete.
fn parse(head: &[u8]) -> Option<Result<Request, Refusal>> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        Ok(httparse::Status::Partial) => return None,
        Ok(httparse::Status::Complete(_)) => {}
        Err(httparse::Error::TooManyHeaders) => return Some(Err(Refusal::TooLong)),
        Err(_) => return Some(Err(Refusal::Malformed)),
    }
    let mut hosts = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case("host"));
    let (Some(method), Some(target), Some(host), None) = (request.method, request.path, hosts.next(), hosts.next())
    else {
        return Some(Err(Refusal::Malformed));
    };
    let Ok(host) = std::str::from_utf8(host.value) else { return Some(Err(Refusal::Malformed)) };
    let path = target.split('?').next().unwrap_or(target);
    Some(Ok(Request { method: method.to_owned(), path: path.to_owned(), host: host.to_owned() }))
}

/// Whether a request is for this server: its host is the address of the connection, `localhost`, or one of the names.
///
/// Prevents DNS rebinding: a foreign page can resolve its own name to this computer, and the browser then treats both
/// as the same site. Only the host name distinguishes such a request. The port is ignored, because it may be forwarded.
pub(super) fn is_ours(host: &str, here: IpAddr, names: &[String]) -> bool {
    let without_brackets = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(host);
    let address = host.parse().map(|address: SocketAddr| address.ip()).or_else(|_| without_brackets.parse());
    if let Ok(address) = address {
        return address.to_canonical() == here.to_canonical();
    }
    let name = host.split(':').next().unwrap_or(host);
    name.eq_ignore_ascii_case("localhost") && here.to_canonical().is_loopback()
        || names.iter().any(|ours| name.eq_ignore_ascii_case(ours))
}

/// The head of a response; the end of the connection ends the body.
pub(super) fn write_head(
    stream: &mut impl Write,
    status: &str,
    content_type: &str,
    more: &[(&str, &str)],
) -> io::Result<()> {
    let mut head = format!("HTTP/1.1 {status}\r\nContent-Type: {content_type}\r\n");
    let always = [
        ("Cache-Control", "no-store"),
        ("Connection", "close"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("Referrer-Policy", "no-referrer"),
        ("X-Content-Type-Options", "nosniff"),
    ];
    for (name, value) in always.iter().chain(more) {
        head.extend([*name, ": ", *value, "\r\n"]);
    }
    head.push_str("\r\n");
    stream.write_all(head.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_incomplete_head_is_not_parsed() {
        let whole = b"GET /map.json?x=1 HTTP/1.1\r\nUser-Agent: x\r\nhost: localhost:8080\r\n\r\n";
        for end in 0..whole.len() {
            assert_eq!(parse(&whole[..end]), None, "{end}");
        }
        let request =
            Request { method: "GET".to_owned(), path: "/map.json".to_owned(), host: "localhost:8080".to_owned() };
        assert_eq!(parse(whole), Some(Ok(request)));
    }

    #[test]
    fn a_head_without_exactly_one_host_is_malformed() {
        for hosts in ["", "Host: a\r\nHost: b\r\n", "Host: \u{ff}\r\nHost: a\r\n"] {
            let head = format!("GET / HTTP/1.1\r\n{hosts}\r\n");
            assert_eq!(parse(head.as_bytes()), Some(Err(Refusal::Malformed)), "{hosts:?}");
        }
        assert_eq!(parse(b"\x16\x03\x01 what a TLS client says\r\n\r\n"), Some(Err(Refusal::Malformed)));
    }

    #[test]
    fn a_host_is_accepted_by_local_address_or_configured_name() {
        let loopback: IpAddr = [127, 0, 0, 1].into();
        let mapped: IpAddr = "::ffff:127.0.0.1".parse().unwrap();
        for host in ["127.0.0.1", "127.0.0.1:8080", "localhost:8080", "LocalHost", "[::ffff:127.0.0.1]:80"] {
            assert!(is_ours(host, loopback, &[]) && is_ours(host, mapped, &[]), "{host}");
        }
        for host in ["", "evil.example", "evil.example:8080", "localhost.evil.example", "192.0.2.1:8080", "[::1]", "::"]
        {
            assert!(!is_ours(host, loopback, &[]), "{host}");
        }
        assert!(is_ours("[::1]", "::1".parse().unwrap(), &[]));
        let elsewhere: IpAddr = [192, 0, 2, 1].into();
        assert!(is_ours("192.0.2.1:8080", elsewhere, &[]) && !is_ours("localhost:8080", elsewhere, &[]));
        assert!(is_ours("Robot.Lan:8080", elsewhere, &["robot.lan".to_owned()]));
    }
}
