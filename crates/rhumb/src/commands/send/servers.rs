//! What Moonraker and `OctoPrint` want to be asked, and what they answer.

use serde_json::Value;

use super::keys::Key;
use super::without;
use crate::args::ServerKind;
use crate::failure::Failure;
use crate::http::{Answer, Body, Request, Server, Silence, ask, encoded};

/// A print server whose kind is known.
#[derive(Debug)]
pub(super) struct PrintServer<'a> {
    server: &'a Server,
    key: &'a Option<Key>,
    kind: ServerKind,
    /// Whether it said what it is, or the user did.
    is_known: bool,
}

impl<'a> PrintServer<'a> {
    /// Asks which of the two stands there, and whether it takes the key. One that knows no such
    /// question is taken for Moonraker until it knows no upload of that kind; one that answers with a
    /// page for people, or anything else that neither says, gets no program.
    pub(super) fn find(
        server: &'a Server,
        key: &'a Option<Key>,
        told: Option<ServerKind>,
    ) -> Result<Self, Failure> {
        let kinds =
            told.map_or(vec![ServerKind::Moonraker, ServerKind::Octoprint], |kind| vec![kind]);
        let mut is_another = false;
        for kind in kinds {
            let found = Self { server, key, kind, is_known: true };
            let answer = found.get(match kind {
                ServerKind::Moonraker => "/server/info",
                ServerKind::Octoprint => "/api/version",
            })?;
            match answer.status {
                401 | 403 => return Err(found.key_refused()),
                200..300 if object(&answer).is_some() => return Ok(found),
                200..300 => is_another = true,
                _ if told.is_some() => return Ok(found),
                _ => {}
            }
        }
        let guessed = Self { server, key, kind: ServerKind::Moonraker, is_known: false };
        if is_another { Err(guessed.unknown()) } else { Ok(guessed) }
    }

    fn unknown(&self) -> Failure {
        let message = format!("neither Moonraker nor OctoPrint answers at {}", self.host());
        Failure::new("PrinterRefused", message)
            .hint("check the port: Moonraker has 7125, OctoPrint 5000 or 80")
    }

    /// Returns the other kind to try, when an upload found nobody who knows it.
    pub(super) fn other(&self) -> Option<Self> {
        let is_guess = !self.is_known && self.kind == ServerKind::Moonraker;
        is_guess.then_some(Self { kind: ServerKind::Octoprint, ..*self })
    }

    pub(super) fn kind_name(&self) -> &'static str {
        match self.kind {
            ServerKind::Moonraker => "moonraker",
            ServerKind::Octoprint => "octoprint",
        }
    }

    pub(super) fn host(&self) -> String {
        self.server.authority()
    }

    /// Kind and place, for people.
    pub(super) fn described(&self) -> String {
        let kind = match self.kind {
            ServerKind::Moonraker => "Moonraker",
            ServerKind::Octoprint => "OctoPrint",
        };
        format!("{kind} at {}", self.host())
    }

    /// Returns whether there is a file of this name. A key that may not list files is no reason to
    /// give up: such a server says itself what it does not want.
    pub(super) fn has(&self, name: &str) -> Result<bool, Failure> {
        match self.kind {
            ServerKind::Moonraker => {
                let answer = self.get("/server/files/list?root=gcodes")?;
                let list: Value = serde_json::from_slice(&answer.body).unwrap_or_default();
                let files = list["result"].as_array().map_or(&[][..], Vec::as_slice);
                Ok(answer.status == 200 && files.iter().any(|file| file["path"] == name))
            }
            ServerKind::Octoprint => {
                Ok(self.get(&format!("/api/files/local/{}", encoded(name)))?.status == 200)
            }
        }
    }

    /// Starts to print a file that is there; returns whether it does.
    pub(super) fn start(&self, name: &str) -> Result<bool, Failure> {
        let answer = match self.kind {
            ServerKind::Moonraker => {
                let path = format!("/printer/print/start?filename={}", encoded(name));
                self.post(&path, "application/json", b"{}")?
            }
            ServerKind::Octoprint => {
                let path = format!("/api/files/local/{}", encoded(name));
                self.post(&path, "application/json", br#"{"command": "select", "print": true}"#)?
            }
        };
        match answer.status {
            204 => Ok(true),
            200..300 if object(&answer).is_some() => Ok(true),
            200..300 => Err(self.nonsense("whether it prints is not known")),
            // Not ready, or printing something else.
            400 | 409 | 503 => Ok(false),
            _ => Err(self.refused(&answer)),
        }
    }

    /// The fields that go with an upload.
    pub(super) fn fields(&self, start: bool) -> Vec<(&'static str, &'static str)> {
        let mut fields = Vec::new();
        if self.kind == ServerKind::Moonraker {
            fields.push(("root", "gcodes"));
        } else if start {
            fields.push(("select", "true"));
        }
        fields.push(("print", if start { "true" } else { "false" }));
        fields
    }

    /// Sends a form, and returns whether the print was begun; `None` when the server, which was
    /// only guessed, knows no such upload.
    pub(super) fn upload(&self, body: Body<'_>) -> Result<Option<bool>, Failure> {
        let length = body.length;
        let path = match self.kind {
            ServerKind::Moonraker => "/server/files/upload",
            ServerKind::Octoprint => "/api/files/local",
        };
        let answer = self.ask("POST", path, Some(body))?;
        if !self.is_known && matches!(answer.status, 404 | 405 | 501) {
            return if self.other().is_some() { Ok(None) } else { Err(self.unknown()) };
        }
        if !(200..300).contains(&answer.status) {
            return Err(self.refused(&answer));
        }
        let said = object(&answer)
            .filter(|said| STORED.iter().any(|name| said.get(name).is_some()))
            .ok_or_else(|| self.nonsense("whether the program was stored is not known"))?;
        // Some versions wrap their answers.
        let said = if said["result"].is_object() { &said["result"] } else { &said };
        if said["item"]["size"].as_u64().is_some_and(|size| size > length) {
            return Err(Failure::new(
                "PrinterRefused",
                "the server stored another file than was sent",
            ));
        }
        Ok(Some(match self.kind {
            ServerKind::Moonraker => said["print_started"] == true || said["print_queued"] == true,
            ServerKind::Octoprint => said["effectivePrint"] == true,
        }))
    }

    /// A success in words that such a server never says, as those of proxies and login pages.
    fn nonsense(&self, what: &str) -> Failure {
        let message = format!("the answer is none of {}: {what}", self.described());
        Failure::new("PrinterRefused", message)
            .hint("look at the server's own page; is there a proxy or a login before it?")
    }

    fn get(&self, path: &str) -> Result<Answer, Failure> {
        self.ask("GET", path, None)
    }

    fn post(&self, path: &str, kind: &str, bytes: &[u8]) -> Result<Answer, Failure> {
        let mut from = bytes;
        self.ask("POST", path, Some(Body { kind, length: bytes.len() as u64, bytes: &mut from }))
    }

    fn ask(
        &self,
        method: &'static str,
        path: &str,
        body: Option<Body<'_>>,
    ) -> Result<Answer, Failure> {
        let headers: Vec<(&'static str, &str)> =
            self.key.iter().map(|key| ("X-Api-Key", key.secret())).collect();
        ask(self.server, &Request { method, path, headers: &headers }, body)
            .map_err(|silence| self.silent(&silence))
    }

    fn silent(&self, silence: &Silence) -> Failure {
        let host = self.host();
        match silence {
            Silence::Unreachable(error) => {
                Failure::new("PrinterOffline", format!("{host} cannot be reached: {error}"))
                    .hint("is it switched on, in this network, and is the port right?")
            }
            Silence::Broken(error) => {
                let is_slow = matches!(
                    error.kind(),
                    std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut
                );
                let why =
                    if is_slow { "it did not answer in time".into() } else { error.to_string() };
                Failure::new("PrinterOffline", format!("the connection to {host} broke off: {why}"))
                    .hint("nothing was stored; send it again")
            }
            Silence::NotHttp => {
                Failure::new("PrinterRefused", format!("what answers at {host} is no web server"))
            }
            Silence::Body(error) if error.kind() == std::io::ErrorKind::Interrupted => {
                Failure::new("Interrupted", "interrupted; nothing was stored")
            }
            Silence::Body(error) => Failure::new("Unreadable", format!("program: {error}")),
        }
    }

    fn key_refused(&self) -> Failure {
        let which = if self.key.is_some() { "refuses the key" } else { "wants a key" };
        Failure::new("KeyRefused", format!("{} {which}", self.described()))
            .hint("--api-key, RHUMB_API_KEY or the key file hold it; the server's settings show it")
    }

    /// What an answer that is no success means.
    fn refused(&self, answer: &Answer) -> Failure {
        let words = without(&words(&answer.body), self.key.as_ref());
        let said = if words.is_empty() { String::new() } else { format!(": {words}") };
        let (place, status) = (self.described(), answer.status);
        let lower = words.to_lowercase();
        let is_full =
            ["no space", "errno 28", "disk full", "insufficient storage", "not enough space"]
                .iter()
                .any(|sign| lower.contains(sign));
        if is_full || status == 507 {
            return Failure::new("PrinterFull", format!("{place} has no room left{said}"))
                .hint("delete files there and send it again");
        }
        match (status, self.kind) {
            (401, _) | (403, ServerKind::Octoprint) => self.key_refused(),
            (413, _) => {
                Failure::new("PrinterRefused", format!("{place} takes no file this large{said}"))
            }
            (403, _) | (409, _) => Failure::new(
                "PrinterRefused",
                format!("{place} will not store it ({status}){said}"),
            )
            .hint("is a file of this name being printed? --if-exists rename stores it beside"),
            _ => Failure::new("PrinterRefused", format!("{place} answers {status}{said}")),
        }
    }
}

/// What answers to an upload have at least one of, by version and kind of server.
const STORED: [&str; 5] = ["item", "result", "print_started", "files", "done"];

/// What an answer says; `None` when it is no object of JSON.
fn object(answer: &Answer) -> Option<Value> {
    serde_json::from_slice(&answer.body).ok().filter(Value::is_object)
}

/// What a server says about an error, in at most a line.
fn words(body: &[u8]) -> String {
    let said: Value = serde_json::from_slice(body).unwrap_or_default();
    let message = [&said["error"]["message"], &said["error"], &said["message"]]
        .into_iter()
        .find_map(Value::as_str);
    let text = match message {
        Some(message) => message.to_owned(),
        // Pages for people are no message.
        None => {
            let text = String::from_utf8_lossy(body);
            if text.contains('<') { String::new() } else { text.into_owned() }
        }
    };
    text.lines().next().unwrap_or_default().chars().take(200).collect()
}
