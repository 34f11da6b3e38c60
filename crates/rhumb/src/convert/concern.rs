//! What of another program a user should know before printing it.

use std::collections::BTreeMap;
use std::fmt;

use machine::gcode::printable;

/// Kinds of concern, by the name that scripts rely on, with what is said.
const KINDS: [(&str, &str); 11] = [
    ("NoMoves", "the program moves nothing"),
    ("UnclosedComment", "a bracket is never closed; all that follows it in its line is a comment"),
    ("UnknownCommand", "passed on as it is; what it does is not known here"),
    ("HomeXY", "homes some axes alone; the machine is taken to stand at its home in all of them"),
    ("NoFeedrate", "a move before any F; the speed that firmwares begin with is taken"),
    ("StartUnknown", "a move before G28; the machine is taken to stand at its home"),
    ("FeedClamped", "faster than the axes; the speed is that of the machine"),
    (
        "DangerousCommand",
        "left out; --allow-dangerous keeps commands that change the machine for good",
    ),
    ("HostAction", "text that a print server may act on, passed on as it is"),
    ("ColdExtrusion", "pushes filament through a nozzle that was told to be too cold"),
    ("ExtrusionSpike", "lays more than a line can hold; firmwares may refuse it"),
];

/// Something that a user should know, the first time it occurs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Concern {
    /// Its kind, which scripts rely on.
    pub code: &'static str,
    /// The line where it occurs first, counted from 1; 0 for the program as a whole.
    pub line: usize,
    /// How many times it occurs.
    pub count: usize,
    /// The begin of that line.
    pub shown: String,
}

impl Concern {
    /// Says it in words.
    #[must_use]
    pub fn words(&self) -> &'static str {
        KINDS.iter().find(|(code, _)| *code == self.code).map_or("", |(_, words)| words)
    }
}

impl fmt::Display for Concern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "warning[{}]: ", self.code)?;
        if self.line > 0 {
            write!(f, "line {} ({}): ", self.line, self.shown)?;
        }
        write!(f, "{}", self.words())?;
        if self.count > 1 { write!(f, "; {} such lines", self.count) } else { Ok(()) }
    }
}

/// Characters of a line that are shown.
const SHOWN: usize = 40;

/// Gathers concerns, each kind once.
#[derive(Debug, Default)]
pub(super) struct Concerns(BTreeMap<&'static str, Concern>);

impl Concerns {
    /// Notes that a line gives reason for a concern.
    pub(super) fn note(&mut self, code: &'static str, line: usize, text: &str) {
        let first = || {
            let begin: String = text.trim().chars().take(SHOWN).collect();
            Concern { code, line, count: 0, shown: printable(&begin) }
        };
        self.0.entry(code).or_insert_with(first).count += 1;
    }

    /// Returns all, in the order of their lines.
    pub(super) fn all(&mut self) -> Vec<Concern> {
        let mut all: Vec<Concern> = std::mem::take(&mut self.0).into_values().collect();
        all.sort_by_key(|concern| concern.line);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_said_once_with_its_first_line() {
        let mut concerns = Concerns::default();
        concerns.note("UnknownCommand", 7, " G777 \u{1b}[2J");
        concerns.note("UnknownCommand", 9, "G778");
        concerns.note("HomeXY", 3, "G28 X");
        let said: Vec<String> = concerns.all().iter().map(Concern::to_string).collect();
        assert_eq!(said.len(), 2);
        assert!(said[0].starts_with("warning[HomeXY]: line 3 (G28 X): homes"), "{}", said[0]);
        assert!(
            said[1].contains("(G777 ?[2J)") && said[1].ends_with("2 such lines"),
            "{}",
            said[1]
        );
        assert!(KINDS.iter().all(|(_, words)| words.len() > 10));
    }
}
