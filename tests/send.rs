//! Programs sent to servers that answer as the documentation of Moonraker and `OctoPrint` says.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};

use serde_json::Value;

use crate::run::{Ran, Scratch};

const KEY: &str = "kjh34gh2-secret-8";

/// A server on this machine. It stops with the test's process.
struct Server {
    address: String,
    seen: Arc<Mutex<Seen>>,
}

#[derive(Default)]
struct Seen {
    /// Methods and paths, in order.
    asked: Vec<String>,
    /// The fields of the form that was uploaded last, and the file's name and bytes.
    form: Vec<(String, String)>,
    file: Option<(String, Vec<u8>)>,
}

/// How a server behaves.
#[derive(Clone, Copy, Default)]
struct Manner {
    is_octoprint: bool,
    /// Refuses requests without the key.
    wants_key: bool,
    /// The status and body of an upload, when it is not taken.
    refuses: Option<(u16, &'static str)>,
    /// A file that is there.
    has: &'static str,
    /// Whether the printer is ready to print.
    is_ready: bool,
    /// Answers an upload before it has read it, and closes.
    is_hasty: bool,
    /// Knows nothing but uploads.
    is_silent: bool,
}

impl Server {
    fn start(manner: Manner) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let seen = Arc::new(Mutex::new(Seen::default()));
        let shared = Arc::clone(&seen);
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                serve(&stream.unwrap(), manner, &shared);
            }
        });
        Self { address, seen }
    }

    fn asked(&self) -> Vec<String> {
        self.seen.lock().unwrap().asked.clone()
    }

    fn field(&self, name: &str) -> Option<String> {
        let seen = self.seen.lock().unwrap();
        seen.form.iter().find(|(field, _)| field == name).map(|(_, value)| value.clone())
    }

    fn file(&self) -> Option<(String, Vec<u8>)> {
        self.seen.lock().unwrap().file.clone()
    }
}

fn serve(stream: &TcpStream, manner: Manner, seen: &Mutex<Seen>) {
    let mut from = BufReader::new(stream.try_clone().unwrap());
    let mut lines = Vec::new();
    loop {
        let mut line = String::new();
        if from.read_line(&mut line).unwrap() == 0 || line == "\r\n" {
            break;
        }
        lines.push(line.trim_end().to_owned());
    }
    let Some((request, headers)) = lines.split_first() else { return };
    let header = |wanted: &str| {
        headers.iter().find_map(|line| {
            let (name, value) = line.split_once(": ")?;
            name.eq_ignore_ascii_case(wanted).then_some(value)
        })
    };
    let asked = request.strip_suffix(" HTTP/1.1").unwrap().to_owned();
    assert!(header("Host").is_some());
    seen.lock().unwrap().asked.push(asked.clone());
    let is_upload = asked == "POST /server/files/upload" || asked == "POST /api/files/local";
    let knows_key = !manner.wants_key || header("X-Api-Key") == Some(KEY);
    if is_upload && manner.is_hasty {
        reply(stream, 413, r#"{"error": {"message": "Request entity too large"}}"#);
        return;
    }
    let mut body = vec![0; header("Content-Length").map_or(0, |n| n.parse().unwrap())];
    from.read_exact(&mut body).unwrap();
    let (status, said) = match (asked.as_str(), manner.is_octoprint) {
        _ if manner.is_silent && !asked.starts_with("POST ") => (404, String::new()),
        _ if !knows_key && manner.is_octoprint => (403, r#"{"error": "no permission"}"#.to_owned()),
        _ if !knows_key => (401, r#"{"error": {"code": 401, "message": "Unauthorized"}}"#.into()),
        ("GET /server/info", false) => (200, r#"{"result": {"klippy_state": "ready"}}"#.into()),
        ("GET /api/version", true) => (200, r#"{"api": "0.1", "server": "1.10.3"}"#.into()),
        ("GET /server/files/list?root=gcodes", false) => {
            (200, format!(r#"{{"result": [{{"path": "{}", "size": 5}}]}}"#, manner.has))
        }
        ("POST /server/files/upload", false) | ("POST /api/files/local", true) => {
            read_form(&body, header("Content-Type").unwrap(), &mut seen.lock().unwrap());
            manner
                .refuses
                .map_or_else(|| (201, taken(manner, body.len())), |(s, b)| (s, b.to_owned()))
        }
        (path, true) if path == format!("GET /api/files/local/{}", manner.has) => {
            (200, r#"{"name": "there"}"#.into())
        }
        (path, true) if path.starts_with("POST /api/files/local/") => (204, String::new()),
        (path, false) if path.starts_with("POST /printer/print/start?filename=") => {
            (200, r#"{"result": "ok"}"#.into())
        }
        _ => (404, r#"{"error": {"code": 404, "message": "Not Found"}}"#.into()),
    };
    reply(stream, status, &said);
}

fn taken(manner: Manner, length: usize) -> String {
    if manner.is_octoprint {
        return format!(r#"{{"done": true, "effectivePrint": {}}}"#, manner.is_ready);
    }
    format!(
        r#"{{"item": {{"root": "gcodes", "size": {}}}, "print_started": {}, "print_queued": false,
           "action": "create_file"}}"#,
        length / 2,
        manner.is_ready
    )
}

fn reply(mut stream: &TcpStream, status: u16, body: &str) {
    let head = format!(
        "HTTP/1.1 {status} Words\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n",
        body.len()
    );
    stream.write_all((head + body).as_bytes()).unwrap();
    let _ = stream.shutdown(Shutdown::Write);
    // What is still on its way is read, or the client would lose the answer to a reset.
    let _ = std::io::copy(&mut stream.take(64 << 20), &mut std::io::sink());
}

fn read_form(body: &[u8], kind: &str, seen: &mut Seen) {
    let boundary = format!("--{}", kind.strip_prefix("multipart/form-data; boundary=").unwrap());
    let find = |from: &[u8], what: &[u8]| from.windows(what.len()).position(|w| w == what);
    (seen.form, seen.file) = (Vec::new(), None);
    let mut rest = &body[boundary.len()..];
    while let Some(part) = rest.strip_prefix(b"\r\n") {
        let end = find(part, b"\r\n\r\n").unwrap();
        let head = std::str::from_utf8(&part[..end]).unwrap();
        let length = find(&part[end + 4..], format!("\r\n{boundary}").as_bytes()).unwrap();
        let value = &part[end + 4..][..length];
        let word = |name: &str| head.split(&format!(" {name}=\"")).nth(1)?.split('"').next();
        match word("filename") {
            Some(name) => seen.file = Some((name.to_owned(), value.to_vec())),
            None => {
                let value = String::from_utf8(value.to_vec()).unwrap();
                seen.form.push((word("name").unwrap().to_owned(), value));
            }
        }
        rest = &part[end + 4 + length + 2 + boundary.len()..];
    }
    assert_eq!(rest, b"--\r\n");
}

/// A program of some size, with bytes of all kinds.
fn program() -> Vec<u8> {
    (0..300_000_u32).flat_map(|k| format!("G1 R{k}\r\n").into_bytes()).collect()
}

/// Sends it, and expects that the key is shown nowhere.
fn send(scratch: &Scratch, server: &Server, more: &[&str]) -> Ran {
    let url = format!("http://{}", server.address);
    let mut all = vec!["send", "part.gcode", "--to", &url];
    all.extend(more);
    let output = scratch
        .rhumb(&all)
        .env("XDG_CONFIG_HOME", scratch.path("config"))
        .env_remove("RHUMB_API_KEY")
        .output()
        .unwrap();
    let ran = Ran::from(output);
    assert!(!ran.out.contains(KEY) && !ran.err.contains(KEY), "{ran:?}");
    ran
}

fn scratch() -> Scratch {
    let scratch = Scratch::new();
    scratch.file("part.gcode", program());
    scratch
}

const MOONRAKER: Manner = Manner {
    is_octoprint: false,
    wants_key: false,
    refuses: None,
    has: "",
    is_ready: true,
    is_hasty: false,
    is_silent: false,
};
const OCTOPRINT: Manner = Manner { is_octoprint: true, wants_key: true, ..MOONRAKER };

#[test]
fn moonraker_gets_the_very_bytes_and_prints_them_when_told() {
    let (scratch, server) = (scratch(), Server::start(MOONRAKER));
    let ran = send(&scratch, &server, &[]).expect(0);
    assert!(ran.out.starts_with("sent part.gcode (") && ran.out.contains("Moonraker"), "{ran:?}");
    assert_eq!(server.file(), Some(("part.gcode".to_owned(), program())));
    assert_eq!(server.field("root").as_deref(), Some("gcodes"));
    assert_eq!(server.field("print").as_deref(), Some("false"));
    let ran = send(&scratch, &server, &["--start", "--json", "--name", "ünter.gcode"]).expect(0);
    assert_eq!(server.field("print").as_deref(), Some("true"));
    assert_eq!(server.file().unwrap().0, "ünter.gcode");
    let said: Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!((&said["started"], &said["server"]), (&true.into(), &"moonraker".into()));
    assert_eq!(said["bytes"], program().len());
}

#[test]
fn servers_that_do_not_say_what_they_are_get_it_too() {
    for manner in [MOONRAKER, OCTOPRINT] {
        let (scratch, server) = (scratch(), Server::start(Manner { is_silent: true, ..manner }));
        send(&scratch, &server, &["--api-key", KEY, "--start"]).expect(0);
        assert_eq!(server.file(), Some(("part.gcode".to_owned(), program())));
        assert_eq!(server.field("select").is_some(), manner.is_octoprint);
    }
}

#[test]
fn octoprint_gets_the_key_and_selects_what_it_prints() {
    let (scratch, server) = (scratch(), Server::start(OCTOPRINT));
    send(&scratch, &server, &["--api-key", KEY, "--start"]).expect(0);
    assert_eq!(server.file(), Some(("part.gcode".to_owned(), program())));
    assert_eq!(server.field("select").as_deref(), Some("true"));
    assert_eq!(server.field("print").as_deref(), Some("true"));
    let idle = Server::start(Manner { is_ready: false, ..OCTOPRINT });
    let ran = send(&scratch, &idle, &["--api-key", KEY, "--start"]).expect(1);
    assert!(ran.out.contains("did not start"), "{ran:?}");
}

#[test]
fn a_refused_key_is_told_before_anything_is_sent() {
    for manner in [OCTOPRINT, Manner { wants_key: true, ..MOONRAKER }] {
        let (scratch, server) = (scratch(), Server::start(manner));
        send(
            &scratch,
            &server,
            &["--server", if manner.is_octoprint { "octoprint" } else { "moonraker" }],
        )
        .refused("KeyRefused", 10);
        send(&scratch, &server, &["--api-key", "wrong"]).refused("KeyRefused", 10);
        assert!(
            server.asked().iter().all(|asked| asked.starts_with("GET ")),
            "{:?}",
            server.asked()
        );
    }
}

#[test]
fn keys_come_from_the_environment_or_from_a_file_of_the_owner_alone() {
    let (scratch, server) = (scratch(), Server::start(OCTOPRINT));
    let url = format!("http://{}", server.address);
    let mut from_environment = scratch.rhumb(&["send", "part.gcode", "--to", &url]);
    let ran = Ran::from(from_environment.env("RHUMB_API_KEY", KEY).output().unwrap());
    ran.expect(0);
    std::fs::create_dir_all(scratch.path("config/rhumb")).unwrap();
    let file = scratch.file("config/rhumb/keys.toml", format!("\"127.0.0.1\" = \"{KEY}\"\n"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = |mode| std::fs::set_permissions(&file, PermissionsExt::from_mode(mode)).unwrap();
        mode(0o644);
        send(&scratch, &server, &["--if-exists", "replace"]).refused("KeysExposed", 6);
        mode(0o600);
    }
    send(&scratch, &server, &["--if-exists", "replace"]).expect(0);
    std::fs::write(&file, format!("127.0.0.1 = {KEY}")).unwrap();
    send(&scratch, &server, &[]).refused("ConfigSyntax", 6);
}

#[test]
fn names_that_are_taken_are_refused_replaced_numbered_or_kept() {
    for manner in [MOONRAKER, OCTOPRINT] {
        let manner = Manner { has: "part.gcode", ..manner };
        let (scratch, server) = (scratch(), Server::start(manner));
        let key = ["--api-key", KEY];
        send(&scratch, &server, &key).refused("NameClash", 10);
        send(&scratch, &server, &[&key[..], &["--if-exists", "keep", "--start"]].concat())
            .expect(0);
        assert_eq!(server.file(), None, "nothing was sent");
        assert!(server.asked().last().unwrap().starts_with("POST "), "it is started");
        let ran =
            send(&scratch, &server, &[&key[..], &["--if-exists", "replace"]].concat()).expect(0);
        assert!(ran.out.contains("in place of an older one"), "{ran:?}");
        assert_eq!(server.file().unwrap().0, "part.gcode");
        send(&scratch, &server, &[&key[..], &["--if-exists", "rename"]].concat()).expect(0);
        assert_eq!(server.file().unwrap().0, "part-2.gcode");
    }
}

#[test]
fn what_a_server_will_not_take_is_told_in_its_words() {
    let full = r#"{"error": "[Errno 28] No space left on device"}"#;
    let printing = r#"{"error": {"code": 403, "message": "File is loaded, upload not permitted"}}"#;
    let echo = "{\"error\": \"what is kjh34gh2-secret-8?\"}";
    for (manner, refusal, class, words) in [
        (OCTOPRINT, (500, full), "PrinterFull", "No space left"),
        (MOONRAKER, (507, ""), "PrinterFull", "no room"),
        (MOONRAKER, (403, printing), "PrinterRefused", "File is loaded"),
        (
            OCTOPRINT,
            (409, r#"{"error": "is being printed"}"#),
            "PrinterRefused",
            "is being printed",
        ),
        (OCTOPRINT, (415, "<html>no</html>"), "PrinterRefused", "415"),
        (MOONRAKER, (500, echo), "PrinterRefused", "what is ***?"),
    ] {
        let server = Server::start(Manner { refuses: Some(refusal), ..manner });
        let ran = send(&scratch(), &server, &["--api-key", KEY]).refused(class, 10);
        assert!(ran.err.contains(words), "{words}: {}", ran.err);
    }
    // One that answers and closes before it has read everything.
    let hasty = Server::start(Manner { is_hasty: true, ..MOONRAKER });
    let ran = send(&scratch(), &hasty, &[]).refused("PrinterRefused", 10);
    assert!(ran.err.contains("no file this large"), "{}", ran.err);
}

#[test]
fn nobody_there_and_no_print_server_there() {
    let scratch = scratch();
    // A port that was just free.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let nobody = Server { address, seen: Arc::default() };
    send(&scratch, &nobody, &[]).refused("PrinterOffline", 10);
    let other = Server::start(Manner { is_octoprint: true, ..MOONRAKER });
    send(&scratch, &other, &["--server", "moonraker"]).refused("PrinterRefused", 10);
    for (url, more) in
        [("https://a", "https"), ("http://me:secret@a", "password"), ("ftp://a", "http")]
    {
        let ran = scratch.run(&["send", "part.gcode", "--to", url]).refused("Usage", 2);
        assert!(ran.err.contains(more) && !ran.err.contains("secret"), "{}", ran.err);
    }
    scratch.run(&["send", "absent.gcode", "--to", "http://127.0.0.1:1"]).refused("NotFound", 3);
    scratch.file("part.stl", "solid");
    scratch.run(&["send", "part.stl", "--to", "http://127.0.0.1:1"]).refused("Usage", 2);
}
