//! As much of HTTP/1.1 (RFC 9112) as print servers need: one request over one connection.
//!
//! Print servers stand in the local network and speak plain HTTP. A body is streamed with its length
//! told beforehand. A server that refuses a request before it has read all of it closes the
//! connection; its answer is read all the same, because it says why.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

/// Longest wait for a connection.
const CONNECT: Duration = Duration::from_secs(10);

/// Longest silence of a server: after an upload some of them first read the whole file.
const SILENCE: Duration = Duration::from_secs(120);

/// How long the answer to a question may take as a whole.
const QUESTION: Duration = Duration::from_secs(15);

/// The same where a server has something to do with what it got: print servers read whole programs.
const WORK: Duration = Duration::from_secs(120);

/// Longest answer that is read, bytes: a list of some ten thousand files.
const LONGEST_ANSWER: u64 = 16 << 20;

/// A server: `http://host:port/base`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Server {
    /// Name or address.
    pub host: String,
    /// Port.
    pub port: u16,
    /// What every path begins with; without a slash at its end.
    pub base: String,
}

/// Why an address is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// Encrypted connections are not built in.
    #[error("https is not built in")]
    Encrypted,
    /// Another scheme.
    #[error("only http is spoken")]
    Scheme,
    /// A user's name or password in it.
    #[error("it holds a user name or password")]
    Credentials,
    /// No host, a port that is no number, or signs that no address has.
    #[error("it is not http://HOST[:PORT]")]
    Malformed,
}

impl Server {
    /// Reads an address; `http://` may be left out.
    ///
    /// # Errors
    ///
    /// [`AddressError`], which does not repeat the address: it may hold a secret.
    pub fn parse(text: &str) -> Result<Self, AddressError> {
        let rest = match text.split_once("://") {
            Some((scheme, rest)) if scheme.eq_ignore_ascii_case("http") => rest,
            Some((scheme, _)) if scheme.eq_ignore_ascii_case("https") => {
                return Err(AddressError::Encrypted);
            }
            Some(_) => return Err(AddressError::Scheme),
            None => text,
        };
        let (place, path) = rest.split_once('/').unwrap_or((rest, ""));
        if place.contains('@') {
            return Err(AddressError::Credentials);
        }
        let is_plain = |c: char| c.is_ascii_graphic() && !"?#\"<>\\".contains(c);
        if !place.chars().chain(path.chars()).all(is_plain) {
            return Err(AddressError::Malformed);
        }
        let (host, port) = match place.strip_prefix('[') {
            Some(literal) => {
                let (host, after) = literal.split_once(']').ok_or(AddressError::Malformed)?;
                (host, after.strip_prefix(':'))
            }
            None => match place.split_once(':') {
                Some((host, port)) => (host, Some(port)),
                None => (place, None),
            },
        };
        let port = port.map_or(Ok(80), str::parse).map_err(|_| AddressError::Malformed)?;
        if host.is_empty() || port == 0 {
            return Err(AddressError::Malformed);
        }
        let base = path.trim_end_matches('/');
        let base = if base.is_empty() { String::new() } else { format!("/{base}") };
        Ok(Self { host: host.to_owned(), port, base })
    }

    /// Returns host and port as a request names them.
    #[must_use]
    pub fn authority(&self) -> String {
        let host =
            if self.host.contains(':') { format!("[{}]", self.host) } else { self.host.clone() };
        if self.port == 80 { host } else { format!("{host}:{}", self.port) }
    }

    fn connect(&self) -> io::Result<TcpStream> {
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
        for address in (self.host.as_str(), self.port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(SILENCE))?;
                    stream.set_write_timeout(Some(SILENCE))?;
                    return Ok(stream);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// `GET` or `POST`.
    pub method: &'static str,
    /// After the server's base, percent-encoded.
    pub path: &'a str,
    /// More lines of the head: name and value, without line breaks.
    pub headers: &'a [(&'static str, &'a str)],
}

/// A body of known length.
pub struct Body<'a> {
    /// Its `Content-Type`.
    pub kind: &'a str,
    /// Its length in bytes.
    pub length: u64,
    /// Its bytes.
    pub bytes: &'a mut dyn Read,
}

/// What a server answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// 200 and the like.
    pub status: u16,
    /// The body.
    pub body: Vec<u8>,
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum Silence {
    /// No connection was made.
    #[error("{0}")]
    Unreachable(io::Error),
    /// The connection broke off.
    #[error("{0}")]
    Broken(io::Error),
    /// What came is not HTTP.
    #[error("its answer is not HTTP")]
    NotHttp,
    /// The body could not be read.
    #[error("{0}")]
    Body(io::Error),
}

/// Asks a server; a body is what a `POST` brings.
///
/// # Errors
///
/// [`Silence`], when there is no answer.
pub fn ask(
    server: &Server,
    request: &Request<'_>,
    mut body: Option<Body<'_>>,
) -> Result<Answer, Silence> {
    let mut stream = server.connect().map_err(Silence::Unreachable)?;
    let mut head = format!(
        "{} {}{} HTTP/1.1\r\nHost: {}\r\nUser-Agent: rhumb/{}\r\nAccept: application/json\r\n\
         Connection: close\r\n",
        request.method,
        server.base,
        request.path,
        server.authority(),
        env!("CARGO_PKG_VERSION"),
    );
    for (name, value) in request.headers {
        head.push_str(&format!("{name}: {value}\r\n"));
    }
    if let Some(body) = &body {
        head.push_str(&format!(
            "Content-Type: {}\r\nContent-Length: {}\r\n",
            body.kind, body.length
        ));
    }
    head.push_str("\r\n");
    let sent = stream
        .write_all(head.as_bytes())
        .map_err(Silence::Broken)
        .and_then(|()| body.as_mut().map_or(Ok(()), |body| send(&mut stream, body)));
    if let Err(Silence::Body(error)) = sent {
        return Err(Silence::Body(error));
    }
    // Whoever closes early has said why.
    let patience = if body.is_some() { WORK } else { QUESTION };
    match (answer(BufReader::new(Patient::new(stream, patience))), sent) {
        (Ok(answer), _) => Ok(answer),
        (Err(_), Err(broken)) => Err(broken),
        (Err(silence), Ok(())) => Err(silence),
    }
}

fn send(stream: &mut TcpStream, body: &mut Body<'_>) -> Result<(), Silence> {
    let mut buffer = vec![0; 1 << 16];
    let mut left = body.length;
    while left > 0 {
        let most = buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        let count = body.bytes.read(&mut buffer[..most]).map_err(Silence::Body)?;
        if count == 0 {
            let shorter = io::Error::new(io::ErrorKind::UnexpectedEof, "the file became shorter");
            return Err(Silence::Body(shorter));
        }
        stream.write_all(&buffer[..count]).map_err(Silence::Broken)?;
        left -= count as u64;
    }
    stream.flush().map_err(Silence::Broken)
}

/// Reads an answer as long as patience lasts, however slowly it drips, and no more than anybody needs.
struct Patient {
    stream: TcpStream,
    patience: Duration,
    until: Instant,
    left: u64,
}

impl Patient {
    fn new(stream: TcpStream, patience: Duration) -> Self {
        let until = Instant::now() + patience;
        // Heads are small beside bodies.
        Self { stream, patience, until, left: 2 * LONGEST_ANSWER }
    }
}

impl Read for Patient {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let late = || {
            let said = format!("no whole answer came within {} s", self.patience.as_secs());
            io::Error::new(io::ErrorKind::TimedOut, said)
        };
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(late());
        }
        if self.left == 0 {
            return Err(io::Error::new(io::ErrorKind::InvalidData, "the answer never ends"));
        }
        self.stream.set_read_timeout(Some(left))?;
        let count = self.stream.read(into).map_err(|error| match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => late(),
            _ => error,
        })?;
        self.left = self.left.saturating_sub(count as u64);
        Ok(count)
    }
}

/// How a body ends.
enum Length {
    Known(u64),
    Chunked,
    ToTheEnd,
}

fn answer(mut from: impl BufRead) -> Result<Answer, Silence> {
    loop {
        let status = status(&line(&mut from)?).ok_or(Silence::NotHttp)?;
        let mut length = Length::ToTheEnd;
        loop {
            let header = line(&mut from)?;
            let Some((name, value)) = header.split_once(':') else { break };
            let value = value.trim();
            if name.eq_ignore_ascii_case("content-length") && !matches!(length, Length::Chunked) {
                length = Length::Known(value.parse().map_err(|_| Silence::NotHttp)?);
            } else if name.eq_ignore_ascii_case("transfer-encoding") && value.ends_with("chunked") {
                length = Length::Chunked;
            }
        }
        // 100 and the like announce the answer.
        if (100..200).contains(&status) {
            continue;
        }
        if status == 204 {
            return Ok(Answer { status, body: Vec::new() });
        }
        let mut body = Vec::new();
        let read = match length {
            Length::Known(length) => {
                from.take(length.min(LONGEST_ANSWER)).read_to_end(&mut body).map(|_| ())
            }
            Length::ToTheEnd => from.take(LONGEST_ANSWER).read_to_end(&mut body).map(|_| ()),
            Length::Chunked => return chunks(from, &mut body).map(|()| Answer { status, body }),
        };
        // A connection that breaks off after the head has said what counts.
        return read.map(|()| Answer { status, body }).map_err(Silence::Broken);
    }
}

fn chunks(mut from: impl BufRead, body: &mut Vec<u8>) -> Result<(), Silence> {
    loop {
        let head = line(&mut from)?;
        let size = head.split(';').next().unwrap_or_default().trim();
        let size = u64::from_str_radix(size, 16).map_err(|_| Silence::NotHttp)?;
        if size == 0 || body.len() as u64 + size > LONGEST_ANSWER {
            return Ok(());
        }
        (&mut from).take(size).read_to_end(body).map_err(Silence::Broken)?;
        line(&mut from)?;
    }
}

fn line(from: &mut impl BufRead) -> Result<String, Silence> {
    const LONGEST: u64 = 1 << 16;
    let mut bytes = Vec::new();
    let count = from.take(LONGEST).read_until(b'\n', &mut bytes).map_err(Silence::Broken)?;
    if count == 0 {
        let closed = io::Error::new(io::ErrorKind::UnexpectedEof, "it closed the connection");
        return Err(Silence::Broken(closed));
    }
    Ok(String::from_utf8_lossy(&bytes).trim_end().to_owned())
}

fn status(line: &str) -> Option<u16> {
    let (version, rest) = line.split_once(' ')?;
    let code = rest.get(..3)?.parse().ok()?;
    (version.starts_with("HTTP/1.") && (100..600).contains(&code)).then_some(code)
}

/// Returns a text as it stands in a path: all but letters, digits and `-._~` as `%XX`.
#[must_use]
pub fn encoded(text: &str) -> String {
    let mut path = String::new();
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            path.push(char::from(byte));
        } else {
            path.push_str(&format!("%{byte:02X}"));
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses() {
        let server = |host: &str, port, base: &str| {
            Ok(Server { host: host.into(), port, base: base.into() })
        };
        assert_eq!(Server::parse("http://printer.local"), server("printer.local", 80, ""));
        assert_eq!(Server::parse("10.0.0.7:7125/"), server("10.0.0.7", 7125, ""));
        assert_eq!(Server::parse("HTTP://[fe80::1]:5000/octo/"), server("fe80::1", 5000, "/octo"));
        assert_eq!(Server::parse("https://a"), Err(AddressError::Encrypted));
        assert_eq!(Server::parse("ftp://a"), Err(AddressError::Scheme));
        assert_eq!(Server::parse("http://me:secret@a"), Err(AddressError::Credentials));
        for bad in
            ["", "http://", "http://a:b", "http://a b", "http://a:0", "http://a/\r\nX: y", "[::1"]
        {
            assert_eq!(Server::parse(bad), Err(AddressError::Malformed), "{bad}");
        }
    }

    #[test]
    fn answers_of_all_lengths() {
        let read = |text: &str| answer(BufReader::new(text.as_bytes()));
        let known = read("HTTP/1.1 201 Created\r\nContent-Length: 2\r\n\r\nokrest").unwrap();
        assert_eq!(known, Answer { status: 201, body: b"ok".to_vec() });
        let open = read("HTTP/1.0 404 Nope\r\n\r\nto the end").unwrap();
        assert_eq!(open, Answer { status: 404, body: b"to the end".to_vec() });
        let chunked = "HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n\
                       3\r\nabc\r\n2;x=y\r\nde\r\n0\r\n\r\n";
        assert_eq!(read(chunked).unwrap(), Answer { status: 200, body: b"abcde".to_vec() });
        assert!(matches!(read("SSH-2.0-OpenSSH\r\n"), Err(Silence::NotHttp)));
        assert!(matches!(read(""), Err(Silence::Broken(_))));
    }

    #[test]
    fn names_in_paths() {
        assert_eq!(encoded("a b/ü.gcode"), "a%20b%2F%C3%BC.gcode");
    }
}
