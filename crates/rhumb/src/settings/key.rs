//! Every setting there is.
//!
//! Keys carry their unit and use PrusaSlicer's words where it has them. A key without a unit is a
//! number of things, a share, a name or a switch. The lists are in files of their own, one a section.

mod material;
mod print;
mod printer;
mod support;

use std::fmt;

/// Which of the three files a setting belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// Facts of the machine.
    Printer,
    /// What a filament needs.
    Material,
    /// Choices for a print.
    Print,
}

impl Section {
    /// All three, in the order in which they are shown.
    pub const ALL: [Self; 3] = [Self::Printer, Self::Material, Self::Print];

    /// The word for it on the command line.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Printer => "printer",
            Self::Material => "material",
            Self::Print => "print",
        }
    }
}

/// What a setting can be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A real number within bounds.
    Number(f64, f64),
    /// A whole number within bounds.
    Count(i64, i64),
    /// A share of one; may be written as a percentage.
    Share(f64, f64),
    /// Yes or no.
    Switch,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// One of these words for all layers, or ranges of heights with a word each.
    Layers(&'static [&'static str]),
    /// Any text.
    Text,
}

impl Kind {
    /// Says what is wanted, for messages and documentation.
    #[must_use]
    pub fn wanted(&self) -> String {
        match self {
            Self::Number(least, greatest) => format!("a number from {least} to {greatest}"),
            Self::Count(least, greatest) => format!("a whole number from {least} to {greatest}"),
            Self::Share(least, greatest) => format!(
                "a share from {least} to {greatest}, or a percentage such as \"{}%\"",
                (greatest * 20.0).round()
            ),
            Self::Switch => "true or false".into(),
            Self::Choice(words) => format!("one of {}", words.join(", ")),
            Self::Layers(words) => format!(
                "one of {}, or ranges of heights such as planar:0-8,blend:8-14,conical:14-",
                words.join(", ")
            ),
            Self::Text => "a text".into(),
        }
    }
}

/// The value of a setting.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Of a number or a share.
    Number(f64),
    /// Of a count.
    Count(i64),
    /// Of a switch.
    Switch(bool),
    /// Of a choice or a text.
    Text(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Count(count) => write!(f, "{count}"),
            Self::Switch(switch) => write!(f, "{switch}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// A value in the table below, where texts cannot be owned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Default {
    /// Of a number or a share.
    Number(f64),
    /// Of a count.
    Count(i64),
    /// Of a switch.
    Switch(bool),
    /// Of a choice or a text.
    Text(&'static str),
}

impl Default {
    /// Returns it as a value.
    #[must_use]
    pub fn value(&self) -> Value {
        match *self {
            Self::Number(number) => Value::Number(number),
            Self::Count(count) => Value::Count(count),
            Self::Switch(switch) => Value::Switch(switch),
            Self::Text(text) => Value::Text(text.to_owned()),
        }
    }
}

/// A setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// How users write it.
    pub name: &'static str,
    /// Where it belongs.
    pub section: Section,
    /// What it can be.
    pub kind: Kind,
    /// What it is when nobody says anything.
    pub default: Default,
    /// The name under which it stands at the end of a program; PrusaSlicer's where it has one.
    /// Empty for what does not belong there.
    pub program_name: &'static str,
    /// What it does, for people.
    pub meaning: &'static str,
}

impl Key {
    /// Returns the setting that users write as `name`.
    #[must_use]
    pub fn by_name(name: &str) -> Option<&'static Self> {
        KEYS.iter().find(|key| key.name == name)
    }

    /// Returns the name nearest to what was written, if any is near.
    #[must_use]
    pub fn nearest(written: &str) -> Option<&'static str> {
        // Distances of long nonsense are of no use to anyone.
        let written: String = written.chars().take(60).collect();
        let limit = 2 + written.len() / 4;
        KEYS.iter()
            .map(|key| (edits(&written, key.name), key.name))
            .chain(KEYS.iter().filter(|key| is_stem(&written, key.name)).map(|key| (0, key.name)))
            .min()
            .filter(|(distance, _)| *distance <= limit)
            .map(|(_, name)| name)
    }
}

/// Whether `name` is `written` with its unit.
fn is_stem(written: &str, name: &str) -> bool {
    const UNITS: [&str; 7] = ["mm", "mm2", "mm3", "deg", "c", "s", "g"];
    name.strip_prefix(written)
        .and_then(|rest| rest.strip_prefix('_'))
        .is_some_and(|unit| UNITS.contains(&unit.split('_').next().unwrap_or_default()))
}

/// Least number of single-character edits between two words (Levenshtein).
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let above = row[j + 1];
            row[j + 1] = (diagonal + usize::from(x != *y)).min(above + 1).min(row[j] + 1);
            diagonal = above;
        }
    }
    row[b.len()]
}

const fn number(
    section: Section,
    name: &'static str,
    program_name: &'static str,
    (default, least, greatest): (f64, f64, f64),
    meaning: &'static str,
) -> Key {
    let default = Default::Number(default);
    Key { name, section, kind: Kind::Number(least, greatest), default, program_name, meaning }
}

const fn count(
    section: Section,
    name: &'static str,
    (default, least, greatest): (i64, i64, i64),
    meaning: &'static str,
) -> Key {
    let default = Default::Count(default);
    let kind = Kind::Count(least, greatest);
    Key { name, section, kind, default, program_name: name, meaning }
}

const fn choice(
    section: Section,
    name: &'static str,
    words: &'static [&'static str],
    meaning: &'static str,
) -> Key {
    let default = Default::Text(words[0]);
    Key { name, section, kind: Kind::Choice(words), default, program_name: name, meaning }
}

const fn share(section: Section, name: &'static str, default: f64, meaning: &'static str) -> Key {
    let default = Default::Number(default);
    Key { name, section, kind: Kind::Share(0.0, 1.0), default, program_name: name, meaning }
}

const fn text(
    section: Section,
    name: &'static str,
    program_name: &'static str,
    default: &'static str,
    meaning: &'static str,
) -> Key {
    let default = Default::Text(default);
    Key { name, section, kind: Kind::Text, default, program_name, meaning }
}

/// All settings, by section, in the order in which they are shown.
pub const KEYS: &[Key] = &{
    let sections = [printer::KEYS, material::KEYS, print::KEYS, support::KEYS];
    const COUNT: usize =
        printer::KEYS.len() + material::KEYS.len() + print::KEYS.len() + support::KEYS.len();
    let mut all = [print::KEYS[0]; COUNT];
    let (mut at, mut section) = (0, 0);
    while section < sections.len() {
        let mut index = 0;
        while index < sections[section].len() {
            all[at] = sections[section][index];
            (at, index) = (at + 1, index + 1);
        }
        section += 1;
    }
    all
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_defaults_are_in_range() {
        for (i, key) in KEYS.iter().enumerate() {
            assert!(KEYS[..i].iter().all(|other| other.name != key.name), "{}", key.name);
            let fits = match (key.kind, key.default) {
                (Kind::Number(low, high) | Kind::Share(low, high), Default::Number(n)) => {
                    low <= n && n <= high
                }
                (Kind::Count(low, high), Default::Count(n)) => low <= n && n <= high,
                (Kind::Switch, Default::Switch(_)) | (Kind::Text, Default::Text(_)) => true,
                (Kind::Choice(words) | Kind::Layers(words), Default::Text(word)) => {
                    words.contains(&word)
                }
                _ => false,
            };
            assert!(fits, "{}", key.name);
            assert!(!key.meaning.is_empty());
        }
    }

    #[test]
    fn misspelt_names_find_their_neighbour() {
        assert_eq!(Key::nearest("layer_heigth_mm"), Some("layer_height_mm"));
        assert_eq!(Key::nearest("layer_height"), Some("layer_height_mm"));
        assert_eq!(Key::nearest("perimeter"), Some("perimeters"));
        assert_eq!(Key::nearest(&"x".repeat(1_000_000)), None);
    }
}
