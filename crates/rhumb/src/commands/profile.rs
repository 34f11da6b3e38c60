//! `rhumb profile`: settings and where they come from.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use mesh::model::{self, Embedded};

use super::{DONE, LOOK, display_name, say, say_json, write_file};
use crate::args::{Manner, Profile, SettingsArguments};
use crate::failure::Failure;
use crate::input;
use crate::settings::merge::BUILT_IN;
use crate::settings::orca;
use crate::settings::prusa::{self, Imported};
use crate::settings::{Job, KEYS, Section, Settings, Sources};

pub(super) fn run(profile: &Profile, manner: &Manner) -> Result<u8, Failure> {
    match profile {
        Profile::List => list(),
        Profile::Show { name, settings } => show(name.as_deref(), settings, manner),
        Profile::Check { file } => check(file),
        Profile::Import { file, output } => import(file, output.as_deref(), manner),
    }
}

/// Takes over settings of PrusaSlicer, and says which it could not.
fn import(file: &Path, output: Option<&Path>, manner: &Manner) -> Result<u8, Failure> {
    let name = display_name(file);
    let bytes = input::read(file)?;
    let embedded = model::embedded_settings(&bytes)
        .map_err(|error| Failure::new(error.class(), error.to_string()).about(file))?;
    let imported = match &embedded {
        Some(Embedded::Prusa(text)) => prusa::read(&orca::uncommented(text), &name)?,
        Some(Embedded::Orca(json)) => orca::read(json, &name)?,
        None if bytes.starts_with(b"PK") => {
            let what = format!("{name}: there are no settings of a slicer in it");
            return Err(Failure::new("ConfigSyntax", what));
        }
        None => prusa::read(&bytes, &name)?,
    };
    let stem = file.file_stem().filter(|_| file != Path::new("-")).unwrap_or("prusa".as_ref());
    let base = output.map_or_else(|| stem.to_owned(), |path| path.as_os_str().to_owned());
    let mut written = Vec::new();
    for section in [Section::Print, Section::Material] {
        let Some(text) = imported.toml(section, &name) else { continue };
        let mut target = base.clone();
        target.push(format!(".{}.toml", section.word()));
        let target = PathBuf::from(target);
        write_file(&target, &[file], text.as_bytes())?;
        written.push((section, target.display().to_string()));
    }
    let conflict = conflict(&written);
    if manner.json {
        let taken: serde_json::Map<String, serde_json::Value> = imported
            .taken
            .iter()
            .map(|(key, value)| (key.name.to_owned(), value.to_string().into()))
            .collect();
        let refused: Vec<_> = imported
            .refused
            .iter()
            .map(|(key, value, why)| serde_json::json!({"key": key, "value": value, "why": why}))
            .collect();
        let files: Vec<&String> = written.iter().map(|(_, file)| file).collect();
        say_json(&serde_json::json!({
            "written": files, "taken": taken, "refused": refused, "unknown": imported.unknown,
            "conflict": conflict.as_ref().map(ToString::to_string),
        }))?;
    } else {
        say(&import_text(&imported, &written))?;
        if let Some(conflict) = &conflict {
            say(&format!("with our other settings as they are: {conflict}\n"))?;
        }
    }
    Ok(if conflict.is_some() { LOOK } else { DONE })
}

/// What keeps new profiles from being used together with our defaults.
fn conflict(written: &[(Section, String)]) -> Option<Failure> {
    let file = |wanted| {
        let file = written.iter().find(|(section, _)| *section == wanted);
        file.map(|(_, file)| Path::new(".").join(file).to_string_lossy().into_owned())
    };
    let sources = Sources {
        print: file(Section::Print),
        material: file(Section::Material),
        ..Sources::default()
    };
    Settings::load(&sources, &input::read).and_then(|settings| Job::resolve(&settings)).err()
}

fn import_text(imported: &Imported, written: &[(Section, String)]) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    for (section, file) in written {
        let keys: Vec<_> =
            imported.taken.iter().filter(|(key, _)| key.section == *section).collect();
        let _ = writeln!(out, "{file}: {} settings, for --{} {file}", keys.len(), section.word());
        for (key, value) in keys {
            let _ = writeln!(out, "  {} = {value}", key.name);
        }
    }
    if !imported.refused.is_empty() {
        let _ = writeln!(out, "not taken over, for their values; ours stay as they are:");
        for (key, value, why) in &imported.refused {
            let value: String = value.chars().take(60).collect();
            let _ = writeln!(out, "  {key} = {value}: {why}");
        }
    }
    if !imported.unknown.is_empty() {
        let _ = writeln!(out, "not taken over, having no counterpart:");
        let _ = writeln!(out, "  {}", imported.unknown.join(", "));
    }
    out
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
