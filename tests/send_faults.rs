//! Print servers with faults: silence, drops, nonsense and floods. None holds a run up, and no key is
//! shown.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use crate::run::Scratch;

const KEY: &str = "S3CRET-and-more";

/// How long a question may stay open before a server is given up, with room for slow machines.
const PATIENCE: Duration = Duration::from_secs(60);

/// What a server does with a connection.
type Fault = fn(TcpStream);

fn reply(mut stream: TcpStream, text: &str) {
    let mut some = [0; 1024];
    let _ = stream.read(&mut some);
    let _ = stream.write_all(text.as_bytes());
}

fn silent(stream: TcpStream) {
    std::thread::sleep(PATIENCE);
    drop(stream);
}

/// A byte a second.
fn drips(mut stream: TcpStream) {
    for byte in b"HTTP/1.1 200 OK\r\nContent-Length: 5000\r\n\r\n".iter().cycle() {
        std::thread::sleep(Duration::from_secs(1));
        if stream.write_all(&[*byte]).is_err() {
            return;
        }
    }
}

fn floods(mut stream: TcpStream) {
    let _ = stream.write_all(b"HTTP/1.1 200 OK\r\n\r\n");
    while stream.write_all(&[b'x'; 1 << 16]).is_ok() {}
}

fn announces_for_ever(mut stream: TcpStream) {
    while stream.write_all(b"HTTP/1.1 100 Continue\r\n\r\n").is_ok() {}
}

fn breaks_off(mut stream: TcpStream) {
    let _ = stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 5000\r\n\r\n{\"a\":");
}

/// Sends a program to a server that treats every connection alike; returns the status and how long it
/// took.
fn told(fault: Fault, more: &[&str]) -> (i32, Duration) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            std::thread::spawn(move || fault(stream));
        }
    });
    let scratch = Scratch::new();
    scratch.file("part.gcode", "G28\nG1 X5\n");
    let mut all = vec!["send", "part.gcode", "--to", &url];
    all.extend(more);
    let begin = Instant::now();
    let output = scratch.rhumb(&all).env("RHUMB_API_KEY", KEY).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let heard = String::from_utf8_lossy(&output.stdout);
    let status = output.status.code().unwrap();
    assert!(status == 0 || status == 10 && said.starts_with("error["), "{status} {said}");
    assert!(!said.contains("S3CRET") && !heard.contains("S3CRET"), "{said} {heard}");
    (status, begin.elapsed())
}

#[test]
fn servers_with_faults_end_soon_and_no_key_is_shown() {
    let page = |stream: TcpStream| {
        reply(stream, "HTTP/1.1 200 OK\r\nContent-Length: 20\r\n\r\n<html>hello</html>..");
    };
    let broken = |stream: TcpStream| {
        reply(stream, "HTTP/1.1 500 Internal Server Error\r\nContent-Length: 0\r\n\r\n");
    };
    let nonsense = |stream: TcpStream| reply(stream, "\u{1b}[2J\0\0\r\n\r\n\u{1b}[31m");
    for fault in [page, broken, nonsense, breaks_off, floods, announces_for_ever, |_| {}] {
        for kind in ["moonraker", "octoprint"] {
            let (status, took) = told(fault, &["--server", kind]);
            assert!(status == 10 && took < PATIENCE, "{kind}: {status} {took:?}");
        }
    }
}

#[test]
fn servers_that_never_finish_are_given_up() {
    let slow = [silent, drips]
        .map(|fault: Fault| std::thread::spawn(move || told(fault, &["--server", "moonraker"])));
    for slow in slow {
        let (status, took) = slow.join().unwrap();
        assert!(status == 10 && took < PATIENCE, "{status} {took:?}");
    }
}

/// Another host that a server names must never get the key.
#[test]
fn redirections_are_not_followed() {
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    other.set_nonblocking(true).unwrap();
    let address = other.local_addr().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let to = format!("Location: http://{address}/api/files/local");
            reply(stream, &format!("HTTP/1.1 302 Found\r\n{to}\r\nContent-Length: 0\r\n\r\n"));
        }
    });
    let scratch = Scratch::new();
    scratch.file("part.gcode", "G28\n");
    for kind in ["moonraker", "octoprint"] {
        let all = ["send", "part.gcode", "--to", &url, "--server", kind];
        let output = scratch.rhumb(&all).env("RHUMB_API_KEY", KEY).output().unwrap();
        assert_eq!(output.status.code(), Some(10), "{output:?}");
    }
    assert!(other.accept().is_err(), "nobody came to the other server");
}
