//! Why a command cannot go on: a class that scripts rely on, an exit status, and words.

use std::fmt;

/// Classes of failure and the exit status of each.
const CLASSES: &[(&str, u8)] = &[
    ("Usage", 2),
    ("NotFound", 3),
    ("IsDirectory", 3),
    ("PermissionDenied", 3),
    ("NotRegularFile", 3),
    ("Unreadable", 3),
    ("EmptyFile", 4),
    ("WrongFormat", 4),
    ("TruncatedBinary", 4),
    ("AsciiSyntax", 4),
    ("Encoding", 4),
    ("NotFinite", 4),
    ("NumberRange", 4),
    ("NoTriangles", 4),
    ("GcodeSyntax", 4),
    ("GcodeUnsupported", 4),
    ("LogSyntax", 4),
    ("NoCalibration", 4),
    ("NoVolume", 5),
    ("NothingToPrint", 5),
    ("OutOfEnvelope", 5),
    ("ConfigSyntax", 6),
    ("ConfigUnknownKey", 6),
    ("ConfigType", 6),
    ("ConfigRange", 6),
    ("ConfigConflict", 6),
    ("KeysExposed", 6),
    ("OutputIsInput", 7),
    ("OutputDenied", 7),
    ("OutputFull", 7),
    ("OutputIsDirectory", 7),
    ("OutputTwice", 7),
    ("LimitExceeded", 8),
    ("SelfCheckFailed", 9),
    ("ScanFailed", 10),
    ("PrinterSilent", 10),
    ("PrinterOffline", 10),
    ("PrinterRefused", 10),
    ("PrinterFull", 10),
    ("KeyRefused", 10),
    ("NameClash", 10),
    ("Bug", 70),
    ("Interrupted", 130),
    ("BrokenPipe", 141),
];

/// A failure of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    class: &'static str,
    message: String,
    hint: Option<String>,
}

impl Failure {
    /// Returns a failure of a known class; the message says what, where, measured and limit.
    ///
    /// # Panics
    ///
    /// Debug builds panic on a class that is not in the table.
    #[must_use]
    pub fn new(class: &'static str, message: impl Into<String>) -> Self {
        debug_assert!(CLASSES.iter().any(|(name, _)| *name == class), "{class} has no exit status");
        Self { class, message: message.into(), hint: None }
    }

    /// Says which file it is about, unless the message does already.
    #[must_use]
    pub fn about(mut self, file: &std::path::Path) -> Self {
        let name = match file.to_string_lossy() {
            name if name == "-" => "standard input".into(),
            name => name,
        };
        if !names(&self.message, &name) {
            // The end of a long path tells more than its begin, and the message must have room.
            let skipped = name.chars().count().saturating_sub(LONGEST_NAME);
            let end: String = name.chars().skip(skipped).collect();
            let cut = if skipped > 0 { "..." } else { "" };
            self.message = format!("{cut}{end}: {}", self.message);
        }
        self
    }

    /// Adds what the user can do.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The class.
    #[must_use]
    pub fn class(&self) -> &'static str {
        self.class
    }

    /// The class of this name, if there is one.
    #[must_use]
    pub fn known_class(name: &str) -> Option<&'static str> {
        CLASSES.iter().map(|(class, _)| *class).find(|class| *class == name)
    }

    /// What, where, measured and limit.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }

    /// What the user can do.
    #[must_use]
    pub fn advice(&self) -> Option<&str> {
        self.hint.as_deref()
    }

    /// The exit status of the process.
    #[must_use]
    pub fn exit_status(&self) -> u8 {
        CLASSES.iter().find(|(name, _)| *name == self.class).map_or(70, |(_, status)| *status)
    }

    /// Returns one JSON object that says the same.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::json!({"error": {
            "class": self.class,
            "message": self.message,
            "hint": self.hint,
            "exit": self.exit_status(),
        }})
        .to_string()
    }
}

/// Longest message, in characters: what comes from a hostile file must not fill a terminal.
const LONGEST_MESSAGE: usize = 1000;

/// Longest name of a file in a message, in characters.
const LONGEST_NAME: usize = 200;

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error[{}]: {}", self.class, on_one_line(&self.message))?;
        if let Some(hint) = &self.hint {
            write!(f, "\nhint: {}", on_one_line(hint))?;
        }
        Ok(())
    }
}

impl std::error::Error for Failure {}

/// Text without control characters, cut where it gets too long.
fn on_one_line(text: &str) -> String {
    let mut line: String = text
        .chars()
        .take(LONGEST_MESSAGE)
        .map(|c| if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') { '?' } else { c })
        .collect();
    if text.chars().nth(LONGEST_MESSAGE).is_some() {
        line.push_str(" ...");
    }
    line
}

/// Whether a message names a file, and not only a word that holds its name.
fn names(message: &str, file: &str) -> bool {
    let is_apart = |letter: Option<char>| letter.is_none_or(|l| !l.is_alphanumeric());
    message.match_indices(file).any(|(at, _)| {
        is_apart(message[..at].chars().next_back())
            && is_apart(message[at + file.len()..].chars().next())
    })
}

/// A number that a user gave, as short as it can be said: 1e300 has 301 digits.
#[must_use]
pub(crate) fn shown(number: f64) -> String {
    format!("{number:?}").trim_end_matches(".0").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_is_one_line_and_a_hint() {
        let failure = Failure::new("OutOfEnvelope", "the part\nis too tall").hint("scale it down");
        assert_eq!(
            failure.to_string(),
            "error[OutOfEnvelope]: the part?is too tall\nhint: scale it down"
        );
        assert_eq!(failure.exit_status(), 5);
        assert!(Failure::new("Usage", "x".repeat(9999)).to_string().len() < 1100);
        let long = format!("{}/cube.stl", "x".repeat(999));
        let named = Failure::new("NoVolume", "no inside").about(long.as_ref()).to_string();
        assert!(named.ends_with("x/cube.stl: no inside") && named.len() < 300, "{named}");
        assert_eq!(failure.clone().about("part".as_ref()), failure, "it is named already");
        assert_ne!(failure.clone().about("a".as_ref()), failure, "a word is no name of a file");
        assert_eq!([0.2, 10.0, 1e300].map(shown), ["0.2", "10", "1e300"]);
        let json: serde_json::Value = serde_json::from_str(&failure.to_json()).unwrap();
        assert_eq!(json["error"]["exit"], 5);
    }
}
