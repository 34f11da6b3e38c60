//! `rhumb profile`: settings and where they come from.

use std::fmt::Write as _;
use std::path::Path;

use super::{DONE, say, say_json};
use crate::args::{Manner, Profile, SettingsArguments};
use crate::failure::Failure;
use crate::input;
use crate::settings::merge::BUILT_IN;
use crate::settings::{Job, KEYS, Section, Settings, Sources};

pub(super) fn run(profile: &Profile, manner: &Manner) -> Result<u8, Failure> {
    match profile {
        Profile::List => list(),
        Profile::Show { name, settings } => show(name.as_deref(), settings, manner),
        Profile::Check { file } => check(file),
    }
}

fn list() -> Result<u8, Failure> {
    let mut out = String::new();
    for profile in BUILT_IN {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{:<9} {}", profile.section.word(), profile.name);
    }
    say(&out)?;
    Ok(DONE)
}

fn show(name: Option<&str>, arguments: &SettingsArguments, manner: &Manner) -> Result<u8, Failure> {
    let mut sources = arguments.sources();
    if let Some(name) = name {
        match section_of(name)? {
            Section::Printer => sources.printer = Some(name.into()),
            Section::Material => sources.material = Some(name.into()),
            Section::Print => sources.print = Some(name.into()),
        }
    }
    let settings = Settings::load(&sources, &input::read)?;
    if manner.json {
        let values: serde_json::Map<String, serde_json::Value> = KEYS
            .iter()
            .map(|key| {
                let (value, source) = settings.get(key);
                let entry = serde_json::json!({
                    "value": value.to_string(),
                    "source": source.to_string(),
                    "section": key.section.word(),
                    "meaning": key.meaning,
                });
                (key.name.to_owned(), entry)
            })
            .collect();
        say_json(&values)?;
        return Ok(DONE);
    }
    let mut out = String::new();
    for section in Section::ALL {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "[{}]", section.word());
        for key in KEYS.iter().filter(|key| key.section == section) {
            let (value, source) = settings.get(key);
            let value = value.to_string().replace('\n', "\\n");
            let _ = writeln!(out, "{} = {value}    # {source}; {}", key.name, key.meaning);
        }
    }
    say(&out)?;
    Ok(DONE)
}

/// Which kind of settings a built-in profile or a file holds.
fn section_of(name: &str) -> Result<Section, Failure> {
    if let Some(profile) = BUILT_IN.iter().find(|profile| profile.name == name) {
        return Ok(profile.section);
    }
    let bytes = input::read(Path::new(name))?;
    section_that_reads(&bytes, name)
}

/// The section in which all keys of a file are known; the complaint of the nearest one otherwise.
fn section_that_reads(bytes: &[u8], name: &str) -> Result<Section, Failure> {
    let mut first_complaint = None;
    for section in Section::ALL.into_iter().rev() {
        match crate::settings::file::read(bytes, name, section) {
            Ok(_) => return Ok(section),
            // A value that is out of range tells that its key is at home in this section.
            Err(failure) if failure.class() != "ConfigUnknownKey" => return Err(failure),
            Err(failure) => first_complaint = first_complaint.or(Some(failure)),
        }
    }
    Err(first_complaint.expect("there are three sections"))
}

fn check(file: &Path) -> Result<u8, Failure> {
    let name = file.to_string_lossy();
    let bytes = input::read(file)?;
    let section = section_that_reads(&bytes, &name)?;
    let mut sources = Sources::default();
    let path = Some(name.clone().into_owned());
    match section {
        Section::Printer => sources.printer = path,
        Section::Material => sources.material = path,
        Section::Print => sources.print = path,
    }
    Job::resolve(&Settings::load(&sources, &input::read)?)?;
    say(&format!("{name}: {} settings, all well\n", section.word()))?;
    Ok(DONE)
}
