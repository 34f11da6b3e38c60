//! `rhumb send`: a program to a print server, Moonraker or `OctoPrint`.
//!
//! Requests and answers as the servers' documentation has them:
//! <https://moonraker.readthedocs.io/en/latest/external_api/file_manager/> and
//! <https://docs.octoprint.org/en/master/api/files.html>. Which of the two stands there is asked
//! first, with the key, so that a wrong key is told before a long upload. The key is never shown,
//! not even where a server repeats it.

mod keys;
mod servers;
mod upload;

use std::fs::File;
use std::io::{IsTerminal, Seek};
use std::path::Path;

use super::{DONE, LOOK, display_name, say, say_json};
use crate::args::{IfExists, Manner, Send};
use crate::failure::Failure;
use crate::http::{AddressError, Server};
use crate::interrupt::Interrupt;
use crate::progress::{Bars, Progress, Silent};
use keys::Key;
use servers::PrintServer;
use upload::Upload;

pub(super) fn run(arguments: &Send, manner: &Manner) -> Result<u8, Failure> {
    let interrupt = Interrupt::on_signals();
    let server = Server::parse(&arguments.to).map_err(address)?;
    let key = keys::find(arguments, &server)?;
    let (file, length) = open(arguments)?;
    let wanted = match &arguments.name {
        Some(name) => name.clone(),
        None => display_name(&arguments.program),
    };
    check_name(&wanted)?;
    let mut target = PrintServer::find(&server, &key, arguments.server)?;
    let mut name = wanted.clone();
    let mut replaces = false;
    if target.has(&name)? {
        match arguments.if_exists {
            IfExists::Refuse => return Err(clash(&name, &target)),
            IfExists::Replace => replaces = true,
            IfExists::Rename => name = free_name(&wanted, &target)?,
            IfExists::Keep => {
                let started = arguments.start.then(|| target.start(&name)).transpose()?;
                return tell(&Sent { name, length: 0, replaces, started, target: &target }, manner);
            }
        }
    }
    let mut progress: Box<dyn Progress> = if manner.quiet || !std::io::stderr().is_terminal() {
        Box::new(Silent)
    } else {
        Box::new(Bars::default())
    };
    let started = loop {
        let again = file.try_clone().and_then(|mut file| file.rewind().map(|()| file));
        let file = again.map_err(|error| unreadable(&arguments.program, &error))?;
        let mut upload = Upload::new(file, length, &name, &target.fields(arguments.start));
        match (upload.send(&target, &mut *progress, &interrupt)?, target.other()) {
            (None, Some(other)) => target = other,
            (started, _) => break started == Some(true),
        }
    };
    drop(progress);
    let started = arguments.start.then_some(started);
    tell(&Sent { name, length, replaces, started, target: &target }, manner)
}

fn address(error: AddressError) -> Failure {
    // The address is not repeated: it may hold a password.
    let failure = Failure::new("Usage", format!("the address of --to cannot be used: {error}"));
    failure.hint(match error {
        AddressError::Encrypted => "use http in the local network, or a tunnel of your own",
        AddressError::Credentials => "keys belong into --api-key, RHUMB_API_KEY or the key file",
        _ => "http://printer.local or 192.168.1.20:7125",
    })
}

fn open(arguments: &Send) -> Result<(File, u64), Failure> {
    let path = &arguments.program;
    let failed = |error: std::io::Error| unreadable(path, &error);
    let metadata = std::fs::metadata(path).map_err(failed)?;
    if metadata.is_dir() {
        return Err(Failure::new("IsDirectory", path.display().to_string()));
    }
    if !metadata.is_file() {
        return Err(Failure::new("NotRegularFile", path.display().to_string()));
    }
    if metadata.len() == 0 {
        return Err(Failure::new("EmptyFile", format!("{} is empty", path.display())));
    }
    Ok((File::open(path).map_err(failed)?, metadata.len()))
}

fn unreadable(path: &Path, error: &std::io::Error) -> Failure {
    let class = match error.kind() {
        std::io::ErrorKind::NotFound => "NotFound",
        std::io::ErrorKind::PermissionDenied => "PermissionDenied",
        _ => "Unreadable",
    };
    Failure::new(class, format!("{}: {error}", path.display()))
}

/// Servers take names with `.gcode` only, and a slash would be a folder.
fn check_name(name: &str) -> Result<(), Failure> {
    let is_bad = |c: char| c.is_control() || c == '/' || c == '\\';
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    let is_program = matches!(ending.as_deref(), Some("gcode" | "gco" | "g"));
    if name.chars().any(is_bad) || !is_program || name.starts_with('.') {
        return Err(Failure::new(
            "Usage",
            format!("{name} is no name of a program on a print server"),
        )
        .hint("give one that ends in .gcode with --name"));
    }
    Ok(())
}

fn clash(name: &str, target: &PrintServer<'_>) -> Failure {
    Failure::new("NameClash", format!("{} has a file {name} already", target.described())).hint(
        "--if-exists replace, rename or keep say what to do with it; --name gives another name",
    )
}

/// Numbers tried for a free name. Whoever has more files of one name than that should name them.
const MOST_NUMBERS: usize = 999;

fn free_name(wanted: &str, target: &PrintServer<'_>) -> Result<String, Failure> {
    let (stem, ending) = wanted.rsplit_once('.').unwrap_or((wanted, "gcode"));
    for number in 2..=MOST_NUMBERS {
        let name = format!("{stem}-{number}.{ending}");
        if !target.has(&name)? {
            return Ok(name);
        }
    }
    Err(clash(wanted, target))
}

/// What was done.
struct Sent<'a> {
    name: String,
    /// Bytes sent; 0 when the file was there.
    length: u64,
    replaces: bool,
    /// Whether the print was begun, when that was asked for.
    started: Option<bool>,
    target: &'a PrintServer<'a>,
}

fn tell(sent: &Sent<'_>, manner: &Manner) -> Result<u8, Failure> {
    let status = if sent.started == Some(false) { LOOK } else { DONE };
    if manner.json {
        say_json(&serde_json::json!({
            "server": sent.target.kind_name(),
            "host": sent.target.host(),
            "name": sent.name,
            "bytes": sent.length,
            "replaced": sent.replaces,
            "started": sent.started == Some(true),
        }))?;
        return Ok(status);
    }
    let mut text = match sent.length {
        0 => format!("{} was there already, on {}", sent.name, sent.target.described()),
        bytes => format!(
            "sent {} ({:.2} MB) to {}",
            sent.name,
            bytes as f64 / 1e6,
            sent.target.described()
        ),
    };
    text.push_str(match (sent.replaces, sent.started) {
        (_, Some(false)) => "; it did not start to print: is the printer ready and connected?",
        (true, Some(true)) => ", in place of an older one; it prints",
        (false, Some(true)) => "; it prints",
        (true, None) => ", in place of an older one",
        (false, None) => "",
    });
    if !manner.quiet || status != DONE {
        say(&format!("{text}\n"))?;
    }
    Ok(status)
}

/// Takes a key out of a text that a server sent.
fn without(text: &str, key: Option<&Key>) -> String {
    match key {
        Some(key) => text.replace(key.secret(), "***"),
        None => text.to_owned(),
    }
}
