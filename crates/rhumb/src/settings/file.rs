//! One settings file: TOML with keys of one section.
//!
//! The library's own error texts repeat whole lines of the file, which may be megabytes or hold a
//! secret: only its message and position are used.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::key::{Key, Kind, Section, Value};
use super::ranges;
use crate::failure::{Failure, shown};

/// What a file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FileSettings {
    /// The profile it builds on.
    pub inherits: Option<String>,
    /// Its values.
    pub values: Vec<(&'static Key, Value)>,
}

/// Reads a settings file of a section; `name` is what messages call it.
///
/// # Errors
///
/// `ConfigSyntax`, `ConfigUnknownKey`, `ConfigType` or `ConfigRange`, with the line.
pub fn read(text: &[u8], name: &str, section: Section) -> Result<FileSettings, Failure> {
    let text = std::str::from_utf8(text).map_err(|error| {
        let at = error.valid_up_to();
        Failure::new("ConfigSyntax", format!("{name}: byte {at} is not UTF-8"))
            .hint("save the file as UTF-8")
    })?;
    let table = DeTable::parse(text).map_err(|error| {
        let line = line_of(text, error.span());
        let message: String = error.message().chars().take(200).collect();
        Failure::new("ConfigSyntax", format!("{name}, line {line}: {message}"))
    })?;
    let mut settings = FileSettings::default();
    for (key, value) in table.get_ref() {
        let line = line_of(text, Some(key.span()));
        let place = format!("{name}, line {line}");
        let written = key.get_ref().as_ref();
        if written == "inherits" {
            settings.inherits = Some(text_value(value, &place, "inherits")?);
            continue;
        }
        let Some(key) = Key::by_name(written).filter(|key| key.section == section) else {
            return Err(unknown(written, &place, section));
        };
        settings.values.push((key, typed(key, value.get_ref(), &place)?));
    }
    Ok(settings)
}

/// Returns the value that a text on the command line stands for.
///
/// # Errors
///
/// `ConfigType` or `ConfigRange`.
pub fn from_text(key: &'static Key, text: &str, place: &str) -> Result<Value, Failure> {
    let wrong = || wrong_type(key, place);
    match key.kind {
        Kind::Number(..) => number(text).ok_or_else(wrong).and_then(|n| in_range(key, n, place)),
        Kind::Share(..) => share(text).ok_or_else(wrong).and_then(|n| in_range(key, n, place)),
        Kind::Count(..) => {
            let count = text.trim().parse().map_err(|_| wrong())?;
            in_count_range(key, count, place)
        }
        Kind::Switch => match text.trim() {
            "true" | "1" | "yes" | "on" => Ok(Value::Switch(true)),
            "false" | "0" | "no" | "off" => Ok(Value::Switch(false)),
            _ => Err(wrong()),
        },
        Kind::Choice(words) => choice(key, words, text.trim(), place),
        Kind::Layers(words) => layers(key, words, text.trim(), place),
        Kind::Text => Ok(Value::Text(text.to_owned())),
    }
}

/// Says that there is no such key, and which one may be meant.
#[must_use]
pub fn unknown(written: &str, place: &str, section: Section) -> Failure {
    let shown: String = written.chars().take(60).collect();
    let failure =
        Failure::new("ConfigUnknownKey", format!("{place}: there is no setting {shown:?}"));
    match (Key::by_name(written), Key::nearest(written)) {
        (Some(key), _) => failure.hint(format!(
            "{} belongs to the {} settings, this is a {} file",
            key.name,
            key.section.word(),
            section.word()
        )),
        (None, Some(near)) => failure.hint(format!("did you mean {near}?")),
        (None, None) => failure.hint("rhumb profile show lists all settings"),
    }
}

fn typed(key: &'static Key, value: &DeValue<'_>, place: &str) -> Result<Value, Failure> {
    let wrong = || wrong_type(key, place);
    match (key.kind, value) {
        (Kind::Number(..) | Kind::Share(..), DeValue::Float(float)) => {
            // Infinity, NaN and what overflows are numbers out of any range.
            let number = float.as_str().replace('_', "").parse().unwrap_or(f64::NAN);
            in_range(key, number, place)
        }
        (Kind::Number(..) | Kind::Share(..), DeValue::Integer(_)) => {
            // Every bound lies far below 2^53, so a count that does not fit is out of range.
            let count = integer(value).unwrap_or(i64::MAX);
            let number = count as f64;
            let number =
                if matches!(key.kind, Kind::Share(..)) { as_share(number) } else { number };
            in_range(key, number, place)
        }
        (Kind::Share(..), DeValue::String(text)) => {
            share(text).ok_or_else(wrong).and_then(|n| in_range(key, n, place))
        }
        (Kind::Count(..), DeValue::Integer(_)) => {
            in_count_range(key, integer(value).unwrap_or(i64::MAX), place)
        }
        (Kind::Switch, DeValue::Boolean(switch)) => Ok(Value::Switch(*switch)),
        (Kind::Choice(words), DeValue::String(text)) => choice(key, words, text, place),
        (Kind::Layers(words), DeValue::String(text)) => layers(key, words, text, place),
        (Kind::Text, DeValue::String(text)) => Ok(Value::Text(text.to_string())),
        _ => Err(wrong()),
    }
}

/// A word for all layers, or ranges of heights.
fn layers(key: &'static Key, words: &[&str], text: &str, place: &str) -> Result<Value, Failure> {
    if !ranges::is_ranges(text) {
        return choice(key, words, text, place);
    }
    match ranges::parse(text) {
        Ok(_) => Ok(Value::Text(text.to_owned())),
        Err(wrong) => Err(Failure::new("ConfigRange", format!("{place}: {} = {wrong}", key.name))),
    }
}

fn integer(value: &DeValue<'_>) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(&integer.as_str().replace('_', ""), integer.radix()).ok()
}

/// A plain decimal number; no `nan`, no `inf`.
fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let plain = text.bytes().all(|c| c.is_ascii_digit() || b"+-.eE".contains(&c));
    text.parse().ok().filter(|_| plain)
}

fn share(text: &str) -> Option<f64> {
    match text.trim().strip_suffix('%') {
        Some(percent) => Some(number(percent)? / 100.0),
        None => number(text).map(as_share),
    }
}

/// A bare number above one can only be a percentage.
fn as_share(number: f64) -> f64 {
    if number > 1.0 { number / 100.0 } else { number }
}

fn choice(key: &'static Key, words: &[&str], text: &str, place: &str) -> Result<Value, Failure> {
    if words.contains(&text) {
        return Ok(Value::Text(text.to_owned()));
    }
    let shown: String = text.chars().take(60).collect();
    Err(Failure::new(
        "ConfigRange",
        format!("{place}: {} cannot be {shown:?}; it is {}", key.name, key.kind.wanted()),
    ))
}

fn in_range(key: &'static Key, number: f64, place: &str) -> Result<Value, Failure> {
    match key.kind {
        Kind::Number(least, greatest) | Kind::Share(least, greatest)
            if least <= number && number <= greatest =>
        {
            Ok(Value::Number(number))
        }
        _ => Err(out_of_range(key, number, place)),
    }
}

fn in_count_range(key: &'static Key, count: i64, place: &str) -> Result<Value, Failure> {
    match key.kind {
        Kind::Count(least, greatest) if least <= count && count <= greatest => {
            Ok(Value::Count(count))
        }
        _ => Err(out_of_range(key, count as f64, place)),
    }
}

fn out_of_range(key: &Key, number: f64, place: &str) -> Failure {
    Failure::new(
        "ConfigRange",
        format!(
            "{place}: {} = {} is out of range; it is {}",
            key.name,
            shown(number),
            key.kind.wanted()
        ),
    )
}

fn wrong_type(key: &Key, place: &str) -> Failure {
    Failure::new("ConfigType", format!("{place}: {} must be {}", key.name, key.kind.wanted()))
}

fn text_value(value: &Spanned<DeValue<'_>>, place: &str, key: &str) -> Result<String, Failure> {
    value
        .get_ref()
        .as_str()
        .map(str::to_owned)
        .ok_or_else(|| Failure::new("ConfigType", format!("{place}: {key} must be a text")))
}

/// The line, counted from 1, in which a range begins.
fn line_of(text: &str, span: Option<Range<usize>>) -> usize {
    let start = span.map_or(0, |span| span.start).min(text.len());
    text.as_bytes()[..start].iter().filter(|&&c| c == b'\n').count() + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn print(text: &str) -> Result<FileSettings, Failure> {
        read(text.as_bytes(), "my.toml", Section::Print)
    }

    fn class(text: &str) -> &'static str {
        print(text).unwrap_err().class()
    }

    #[test]
    fn values_of_every_kind() {
        let settings = print(
            "inherits = \"0.2\"\nlayer_height_mm = 0.15\nskirt_distance_mm = 5\nperimeters = 3\n\
             external_perimeters_first = true\nfill_pattern = \"grid\"\nfill_density = \"35%\"\n",
        )
        .unwrap();
        assert_eq!(settings.inherits.as_deref(), Some("0.2"));
        let shown: Vec<String> =
            settings.values.iter().map(|(key, value)| format!("{}={value}", key.name)).collect();
        for expected in [
            "layer_height_mm=0.15",
            "skirt_distance_mm=5",
            "perimeters=3",
            "external_perimeters_first=true",
            "fill_pattern=grid",
            "fill_density=0.35",
        ] {
            assert!(shown.iter().any(|s| s == expected), "{expected} in {shown:?}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (text, expected) in [
            ("layer_height_mm 0.2", "ConfigSyntax"),
            ("perimeters = 2\nperimeters = 3", "ConfigSyntax"),
            ("layer_heigth_mm = 0.2", "ConfigUnknownKey"),
            ("[walls]\nheight = 0.2", "ConfigUnknownKey"),
            ("rail_max_mm = 100", "ConfigUnknownKey"),
            ("layer_height_mm = \"0.2\"", "ConfigType"),
            ("layer_height_mm = true", "ConfigType"),
            ("layer_height_mm = [0.2]", "ConfigType"),
            ("layer_height_mm = -0.2", "ConfigRange"),
            ("layer_height_mm = nan", "ConfigRange"),
            ("layer_height_mm = -inf", "ConfigRange"),
            ("layer_height_mm = 1e-9", "ConfigRange"),
            ("perimeters = 1000000", "ConfigRange"),
            ("fill_pattern = \"spaghetti\"", "ConfigRange"),
            ("fill_density = \"150%\"", "ConfigRange"),
        ] {
            assert_eq!(class(text), expected, "{text}");
        }
        let error = print("\n\nlayer_heigth_mm = 0.2").unwrap_err().to_string();
        assert!(error.contains("line 3") && error.contains("did you mean layer_height_mm?"));
        assert_eq!(read(b"a = \"\xff\"", "x", Section::Print).unwrap_err().class(), "ConfigSyntax");
    }

    #[test]
    fn huge_and_secret_texts_do_not_come_back() {
        let long = format!("{} = 1", "k".repeat(1_000_000));
        assert!(print(&long).unwrap_err().to_string().len() < 500);
        let secret = print("api_key = \"S3CRET\"").unwrap_err().to_string();
        assert!(!secret.contains("S3CRET"), "{secret}");
    }

    #[test]
    fn command_line_texts() {
        let value = |name: &str, text: &str| from_text(Key::by_name(name).unwrap(), text, "--set");
        assert_eq!(value("fill_density", "20%").unwrap(), Value::Number(0.2));
        assert_eq!(value("fill_density", "100").unwrap(), Value::Number(1.0));
        assert_eq!(value("fill_density", "1").unwrap(), Value::Number(1.0));
        assert_eq!(value("perimeters", "3").unwrap(), Value::Count(3));
        assert_eq!(value("external_perimeters_first", "yes").unwrap(), Value::Switch(true));
        assert_eq!(value("layer_height_mm", "nan").unwrap_err().class(), "ConfigType");
        assert_eq!(value("layer_height_mm", "9").unwrap_err().class(), "ConfigRange");
        assert_eq!(value("perimeters", "2.5").unwrap_err().class(), "ConfigType");
    }
}
