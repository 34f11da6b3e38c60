//! All sources put together, and which one each value came from.

use std::fmt;
use std::path::{Path, PathBuf};

use super::file::{self, FileSettings};
use super::key::{KEYS, Key, Section, Value};
use crate::failure::Failure;

/// Where a value came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// Nobody set it.
    Default,
    /// A profile that comes with rhumb.
    BuiltIn(&'static str),
    /// A file.
    File(PathBuf),
    /// `--set` or another option.
    CommandLine,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Default => f.write_str("default"),
            Self::BuiltIn(name) => write!(f, "built-in {name}"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::CommandLine => f.write_str("command line"),
        }
    }
}

/// A profile that comes with rhumb.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuiltIn {
    /// What it is called.
    pub name: &'static str,
    /// Which kind of settings it holds.
    pub section: Section,
    /// Its text.
    pub text: &'static str,
}

/// All of them; the first of each section is the default.
pub const BUILT_IN: &[BuiltIn] = &[
    BuiltIn {
        name: "generic-polar",
        section: Section::Printer,
        text: include_str!("../../profiles/generic-polar.toml"),
    },
    BuiltIn {
        name: "klipper-polar",
        section: Section::Printer,
        text: include_str!("../../profiles/klipper-polar.toml"),
    },
    BuiltIn {
        name: "rrf-polar",
        section: Section::Printer,
        text: include_str!("../../profiles/rrf-polar.toml"),
    },
    BuiltIn {
        name: "marlin-polar",
        section: Section::Printer,
        text: include_str!("../../profiles/marlin-polar.toml"),
    },
    BuiltIn {
        name: "grblhal-polar",
        section: Section::Printer,
        text: include_str!("../../profiles/grblhal-polar.toml"),
    },
    BuiltIn {
        name: "core-r-theta",
        section: Section::Printer,
        text: include_str!("../../profiles/core-r-theta.toml"),
    },
    BuiltIn {
        name: "tilt-core-r-theta",
        section: Section::Printer,
        text: include_str!("../../profiles/tilt-core-r-theta.toml"),
    },
    BuiltIn {
        name: "polar-two-axis",
        section: Section::Printer,
        text: include_str!("../../profiles/polar-two-axis.toml"),
    },
    BuiltIn {
        name: "hexapod",
        section: Section::Printer,
        text: include_str!("../../profiles/hexapod.toml"),
    },
    BuiltIn {
        name: "hexapod-fixed",
        section: Section::Printer,
        text: include_str!("../../profiles/hexapod-fixed.toml"),
    },
    BuiltIn {
        name: "linuxcnc-rotary",
        section: Section::Printer,
        text: include_str!("../../profiles/linuxcnc-rotary.toml"),
    },
    BuiltIn {
        name: "dsh-4-6b",
        section: Section::Printer,
        text: include_str!("../../profiles/dsh-4-6b.toml"),
    },
    BuiltIn {
        name: "pla",
        section: Section::Material,
        text: include_str!("../../profiles/pla.toml"),
    },
    BuiltIn {
        name: "petg",
        section: Section::Material,
        text: include_str!("../../profiles/petg.toml"),
    },
    BuiltIn { name: "0.2", section: Section::Print, text: include_str!("../../profiles/0.2.toml") },
    BuiltIn {
        name: "0.12",
        section: Section::Print,
        text: include_str!("../../profiles/0.12.toml"),
    },
];

/// What the user asked for: names or files of profiles, and single values.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sources {
    /// Printer profile.
    pub printer: Option<String>,
    /// Material profile.
    pub material: Option<String>,
    /// Print profile.
    pub print: Option<String>,
    /// `key=value` pairs, later ones win.
    pub set: Vec<String>,
}

/// A value for every setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    values: Vec<(Value, Source)>,
}

/// Profiles that build on profiles: deeper is a mistake.
const LONGEST_CHAIN: usize = 16;

impl Settings {
    /// Returns the defaults.
    #[must_use]
    pub fn defaults() -> Self {
        Self { values: KEYS.iter().map(|key| (key.default.value(), Source::Default)).collect() }
    }

    /// Puts the sources together; `read` reads files.
    ///
    /// # Errors
    ///
    /// What is wrong with a profile or a value, with its place.
    pub fn load(
        sources: &Sources,
        read: &dyn Fn(&Path) -> Result<Vec<u8>, Failure>,
    ) -> Result<Self, Failure> {
        let mut settings = Self::defaults();
        for section in Section::ALL {
            let named = match section {
                Section::Printer => &sources.printer,
                Section::Material => &sources.material,
                Section::Print => &sources.print,
            };
            let first = BUILT_IN.iter().find(|profile| profile.section == section);
            let name = named.as_deref().or(first.map(|profile| profile.name));
            if let Some(name) = name {
                settings.take_profile(name, section, Path::new(""), read)?;
            }
        }
        for pair in &sources.set {
            settings.set(pair)?;
        }
        Ok(settings)
    }

    /// Sets one value from `key=value`.
    ///
    /// # Errors
    ///
    /// `Usage` without `=`, else what is wrong with key or value.
    pub fn set(&mut self, pair: &str) -> Result<(), Failure> {
        let Some((name, text)) = pair.split_once('=') else {
            return Err(Failure::new("Usage", format!("--set {pair:?} is not key=value")));
        };
        let name = name.trim();
        let Some(key) = Key::by_name(name) else {
            return Err(file::unknown(name, "--set", Section::Print));
        };
        let value = file::from_text(key, text, "--set")?;
        self.put(key, value, Source::CommandLine);
        Ok(())
    }

    /// Returns the value of a setting and where it came from.
    ///
    /// # Panics
    ///
    /// When `key` is not one of [`KEYS`].
    #[must_use]
    pub fn get(&self, key: &Key) -> (&Value, &Source) {
        let place = KEYS.iter().position(|other| other.name == key.name);
        let (value, source) = &self.values[place.expect("keys come from the table")];
        (value, source)
    }

    fn put(&mut self, key: &Key, value: Value, source: Source) {
        if let Some(place) = KEYS.iter().position(|other| other.name == key.name) {
            self.values[place] = (value, source);
        }
    }

    /// Takes the values of a profile, after those of the profiles that it builds on.
    fn take_profile(
        &mut self,
        name: &str,
        section: Section,
        folder: &Path,
        read: &dyn Fn(&Path) -> Result<Vec<u8>, Failure>,
    ) -> Result<(), Failure> {
        let mut chain: Vec<(FileSettings, Source)> = Vec::new();
        let mut next = Some((name.to_owned(), folder.to_owned()));
        while let Some((name, folder)) = next {
            if chain.len() == LONGEST_CHAIN {
                return Err(Failure::new(
                    "ConfigConflict",
                    format!("{name}: more than {LONGEST_CHAIN} profiles build on each other"),
                )
                .hint("does a profile inherit from itself?"));
            }
            let (settings, source, folder) = open(&name, section, &folder, read)?;
            next = settings.inherits.clone().map(|parent| (parent, folder));
            chain.push((settings, source));
        }
        for (settings, source) in chain.into_iter().rev() {
            for (key, value) in settings.values {
                self.put(key, value, source.clone());
            }
        }
        Ok(())
    }
}

/// Reads a profile by name or path; returns the folder to which its own names are relative.
fn open(
    name: &str,
    section: Section,
    folder: &Path,
    read: &dyn Fn(&Path) -> Result<Vec<u8>, Failure>,
) -> Result<(FileSettings, Source, PathBuf), Failure> {
    if let Some(profile) = BUILT_IN.iter().find(|p| p.name == name && p.section == section) {
        let settings = file::read(profile.text.as_bytes(), profile.name, section)?;
        return Ok((settings, Source::BuiltIn(profile.name), PathBuf::new()));
    }
    if !name.ends_with(".toml") && !name.contains(std::path::is_separator) {
        let known: Vec<&str> =
            BUILT_IN.iter().filter(|p| p.section == section).map(|p| p.name).collect();
        let word = section.word();
        return Err(Failure::new("ConfigConflict", format!("there is no {word} profile {name:?}"))
            .hint(format!("built in are {}; a file's name ends in .toml", known.join(", "))));
    }
    let path = folder.join(name);
    let bytes = read(&path)?;
    let settings = file::read(&bytes, &path.display().to_string(), section)?;
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    Ok((settings, Source::File(path), folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(sources: &Sources, files: &[(&str, &str)]) -> Result<Settings, Failure> {
        Settings::load(sources, &|path| {
            files
                .iter()
                .find(|(name, _)| Path::new(name) == path)
                .map(|(_, text)| text.as_bytes().to_vec())
                .ok_or_else(|| Failure::new("NotFound", path.display().to_string()))
        })
    }

    fn shown(settings: &Settings, name: &str) -> String {
        let (value, source) = settings.get(Key::by_name(name).unwrap());
        format!("{value} ({source})")
    }

    #[test]
    fn built_in_profiles_are_sound_and_used() {
        let settings = load(&Sources::default(), &[]).unwrap();
        assert_eq!(shown(&settings, "layer_height_mm"), "0.2 (built-in 0.2)");
        for profile in BUILT_IN {
            file::read(profile.text.as_bytes(), profile.name, profile.section).unwrap();
        }
        for profile in BUILT_IN.iter().filter(|profile| profile.section == Section::Printer) {
            let sources = Sources { printer: Some(profile.name.into()), ..Sources::default() };
            crate::settings::Job::resolve(&load(&sources, &[]).unwrap()).unwrap();
        }
        let fine = Sources { print: Some("0.12".into()), ..Sources::default() };
        let fine = load(&fine, &[]).unwrap();
        assert_eq!(shown(&fine, "layer_height_mm"), "0.12 (built-in 0.12)");
        assert_eq!(shown(&fine, "perimeters"), "2 (built-in 0.2)");
    }

    #[test]
    fn files_inherit_and_the_command_line_wins() {
        let files = [
            ("p/mine.toml", "inherits = \"base.toml\"\nperimeters = 4\nskirts = 3"),
            ("p/base.toml", "inherits = \"0.12\"\nperimeters = 3\nbrim_width_mm = 2"),
        ];
        let sources = Sources {
            print: Some("p/mine.toml".into()),
            set: vec!["skirts=0".into(), "fill_density = 40%".into()],
            ..Sources::default()
        };
        let settings = load(&sources, &files).unwrap();
        assert_eq!(shown(&settings, "perimeters"), "4 (p/mine.toml)");
        assert_eq!(shown(&settings, "brim_width_mm"), "2 (p/base.toml)");
        assert_eq!(shown(&settings, "layer_height_mm"), "0.12 (built-in 0.12)");
        assert_eq!(shown(&settings, "skirts"), "0 (command line)");
        assert_eq!(shown(&settings, "fill_density"), "0.4 (command line)");
    }

    #[test]
    fn mistakes_have_their_class() {
        let class =
            |sources: &Sources, files: &[(&str, &str)]| load(sources, files).unwrap_err().class();
        let print = |name: &str| Sources { print: Some(name.into()), ..Sources::default() };
        assert_eq!(class(&print("0.3"), &[]), "ConfigConflict");
        assert_eq!(class(&print("missing.toml"), &[]), "NotFound");
        assert_eq!(
            class(&print("a.toml"), &[("a.toml", "inherits = \"a.toml\"")]),
            "ConfigConflict"
        );
        let set = |pair: &str| Sources { set: vec![pair.into()], ..Sources::default() };
        assert_eq!(class(&set("perimeters"), &[]), "Usage");
        assert_eq!(class(&set("perimeter=2"), &[]), "ConfigUnknownKey");
    }
}
