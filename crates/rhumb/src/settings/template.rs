//! Start and end programs: lines with names in braces that are filled in.
//!
//! `{first_layer_temperature}` becomes the value of that setting, by the name under which it stands
//! at the end of a program (PrusaSlicer's name where it has one).

use super::key::{KEYS, Kind};
use super::merge::Settings;
use crate::failure::Failure;

/// Returns the lines of a program with all names filled in.
///
/// # Errors
///
/// `ConfigSyntax` for a brace without its partner, `ConfigUnknownKey` for a name that is none.
pub fn fill(program: &str, name: &str, settings: &Settings) -> Result<Vec<String>, Failure> {
    program
        .lines()
        .enumerate()
        .map(|(index, line)| fill_line(line, settings).map_err(|why| why.at(name, index + 1)))
        .collect()
}

enum Fault {
    OpenBrace,
    NoSuchName(String),
}

impl Fault {
    fn at(self, program: &str, line: usize) -> Failure {
        match self {
            Self::OpenBrace => Failure::new(
                "ConfigSyntax",
                format!("{program}, line {line}: a brace has no partner"),
            ),
            Self::NoSuchName(name) => Failure::new(
                "ConfigUnknownKey",
                format!("{program}, line {line}: there is nothing to fill in for {{{name}}}"),
            )
            .hint("names are those of the settings at the end of a program"),
        }
    }
}

fn fill_line(line: &str, settings: &Settings) -> Result<String, Fault> {
    let mut filled = String::new();
    let mut rest = line;
    while let Some((before, after)) = rest.split_once('{') {
        let (name, tail) = after.split_once('}').ok_or(Fault::OpenBrace)?;
        filled.push_str(before);
        filled.push_str(&value_of(name.trim(), settings)?);
        rest = tail;
    }
    if rest.contains('}') {
        return Err(Fault::OpenBrace);
    }
    filled.push_str(rest);
    Ok(filled)
}

fn value_of(name: &str, settings: &Settings) -> Result<String, Fault> {
    KEYS.iter()
        // A program inside a program would be filled in without end.
        .find(|key| key.program_name == name && key.kind != Kind::Text)
        .map(|key| settings.get(key).0.to_string())
        .ok_or_else(|| Fault::NoSuchName(name.chars().take(60).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_filled_in() {
        let settings = Settings::defaults();
        let program = "M109 S{first_layer_temperature}\n; {layer_height} mm, {perimeters} walls";
        assert_eq!(
            fill(program, "start_gcode", &settings).unwrap(),
            ["M109 S215", "; 0.2 mm, 2 walls"]
        );
    }

    #[test]
    fn mistakes_are_named() {
        let settings = Settings::defaults();
        let class = |program: &str| fill(program, "p", &settings).unwrap_err().class();
        assert_eq!(class("M109 S{temprature}"), "ConfigUnknownKey");
        assert_eq!(class("M109 S{temperature"), "ConfigSyntax");
        assert_eq!(class("M109 Stemperature}"), "ConfigSyntax");
        assert_eq!(class("{start_gcode}"), "ConfigUnknownKey");
    }
}
