//! Keys of print servers: from the command line, the environment, or a file that only its owner can
//! read.
//!
//! The file has a line for each server, `"printer.local:7125" = "key"`. Where it lies:
//! `$XDG_CONFIG_HOME/rhumb/keys.toml`, else `~/.config/rhumb/keys.toml`, on Windows
//! `%APPDATA%\rhumb\keys.toml`.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::args::Send;
use crate::failure::Failure;
use crate::http::Server;

/// A secret that no message shows.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Key(String);

impl Key {
    fn new(text: &str) -> Result<Self, Failure> {
        let text = text.trim();
        if text.is_empty() || !text.chars().all(|c| c.is_ascii_graphic()) {
            let message = "the key is empty or has signs that no key has";
            return Err(Failure::new("Usage", message));
        }
        Ok(Self(text.to_owned()))
    }

    /// The key itself, for the request.
    pub(super) fn secret(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(***)")
    }
}

/// Returns the key for a server: that of `--api-key`, of `RHUMB_API_KEY`, or of the key file.
pub(super) fn find(arguments: &Send, server: &Server) -> Result<Option<Key>, Failure> {
    if let Some(key) = &arguments.api_key {
        return Key::new(key).map(Some);
    }
    if let Ok(key) = std::env::var("RHUMB_API_KEY")
        && !key.is_empty()
    {
        return Key::new(&key).map(Some);
    }
    let (path, is_wanted) = match &arguments.keys {
        Some(path) => (path.clone(), true),
        None => match usual_file() {
            Some(path) => (path, false),
            None => return Ok(None),
        },
    };
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound && !is_wanted => {
            return Ok(None);
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(Failure::new("NotFound", format!("{}: {error}", path.display())));
        }
        Err(error) => {
            return Err(Failure::new("PermissionDenied", format!("{}: {error}", path.display())));
        }
    };
    check_permissions(&path)?;
    in_file(&text, &path, server)
}

fn usual_file() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let base = folder("XDG_CONFIG_HOME")
        .map(PathBuf::from)
        .or_else(|| folder("APPDATA").map(PathBuf::from))
        .or_else(|| folder("HOME").map(|home| PathBuf::from(home).join(".config")))?;
    Some(base.join("rhumb").join("keys.toml"))
}

/// The key of a server; one with a port stands before one without.
fn in_file(text: &str, path: &Path, server: &Server) -> Result<Option<Key>, Failure> {
    // What is wrong with it is not quoted: the line may hold a key.
    let malformed = || {
        Failure::new("ConfigSyntax", format!("{} is no list of keys", path.display()))
            .hint("its lines are \"printer.local:7125\" = \"key\"")
    };
    let table: toml::Table = text.parse().map_err(|_| malformed())?;
    let names = [format!("{}:{}", server.host, server.port), server.host.clone()];
    match names.iter().find_map(|name| table.get(name)) {
        Some(value) => Key::new(value.as_str().ok_or_else(malformed)?).map(Some),
        None => Ok(None),
    }
}

#[cfg(unix)]
fn check_permissions(path: &Path) -> Result<(), Failure> {
    use std::os::unix::fs::PermissionsExt;
    let failed = |error| Failure::new("PermissionDenied", format!("{}: {error}", path.display()));
    let mode = std::fs::metadata(path).map_err(failed)?.permissions().mode() & 0o777;
    if mode & 0o077 == 0 {
        return Ok(());
    }
    let message = format!("others can read {} (mode {mode:o})", path.display());
    Err(Failure::new("KeysExposed", message).hint(format!("chmod 600 {}", path.display())))
}

/// Elsewhere, who may read a file is not a matter of its mode.
#[cfg(not(unix))]
fn check_permissions(_: &Path) -> Result<(), Failure> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_of_a_port_wins_and_nothing_shows_it() {
        let text = "\"p.local\" = \"any\"\n\"p.local:5000\" = \"special\"\n";
        let key = |address: &str| {
            in_file(text, Path::new("keys.toml"), &Server::parse(address).unwrap()).unwrap()
        };
        assert_eq!(key("p.local:5000").unwrap().secret(), "special");
        assert_eq!(key("p.local").unwrap().secret(), "any");
        assert_eq!(key("q.local"), None);
        assert!(!format!("{:?}", key("p.local")).contains("any"));
        let server = Server::parse("p.local").unwrap();
        let broken = in_file("p.local = secret-key", Path::new("keys.toml"), &server).unwrap_err();
        assert!(!broken.to_string().contains("secret-key"), "{broken}");
        assert!(Key::new("a\r\nX: y").is_err());
    }
}
