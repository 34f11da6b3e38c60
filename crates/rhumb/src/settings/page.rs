//! The page of all settings, `docs/settings.md`, as it follows from the table.

use std::fmt::Write;

use super::key::{KEYS, Key, Kind, Section, Value};

/// Units by the end of a setting's name, the longest first.
const UNITS: [(&str, &str); 17] = [
    ("_mm3_per_s", "mm³/s"),
    ("_g_per_cm3", "g/cm³"),
    ("_mm_per_s2", "mm/s²"),
    ("_deg_per_s2", "°/s²"),
    ("_mm_per_s", "mm/s"),
    ("_deg_per_s", "°/s"),
    ("_per_second", "1/s"),
    ("_kg_m2", "kg·m²"),
    ("_min_mm2", "mm²"),
    ("_mm2", "mm²"),
    ("_mm3", "mm³"),
    ("_mm", "mm"),
    ("_deg", "°"),
    ("_s", "s"),
    ("_c", "°C"),
    ("_a", "A"),
    ("_g", "g"),
];

/// Returns the unit of a setting; empty for numbers of things, shares, names and switches.
#[must_use]
pub fn unit(key: &Key) -> &'static str {
    match key.kind {
        Kind::Number(..) => {
            UNITS.iter().find(|(end, _)| key.name.ends_with(end)).map_or("", |(_, unit)| unit)
        }
        _ => "",
    }
}

/// Returns the page, in Markdown.
#[must_use]
pub fn markdown() -> String {
    let mut page = String::from(HEAD);
    for section in Section::ALL {
        let _ = write!(page, "\n## {}\n\n{TABLE_HEAD}", title(section));
        for key in KEYS.iter().filter(|key| key.section == section) {
            let _ = writeln!(
                page,
                "| `{}` | {} | {} | {} | {} |",
                key.name,
                default(key),
                range(key),
                unit(key),
                key.meaning.replace('|', "\\|")
            );
        }
    }
    page
}

const HEAD: &str = "# Settings\n\n\
    All settings with default, range and unit. Written by `UPDATE_GOLDEN=1 cargo test -- \
    settings_page` from the tables in `crates/rhumb/src/settings/key/`; a test holds it up to \
    date.\n\n\
    Give one with `--set NAME=VALUE`, or several in a file (`--printer`, `--material`, `--print`). \
    Shares may be written as percentages.\n";

const TABLE_HEAD: &str = "| setting | default | range | unit | meaning |\n\
    | --- | --- | --- | --- | --- |\n";

fn title(section: Section) -> &'static str {
    match section {
        Section::Printer => "Printer",
        Section::Material => "Material",
        Section::Print => "Print",
    }
}

fn default(key: &Key) -> String {
    match key.default.value() {
        Value::Text(text) if text.is_empty() => String::new(),
        Value::Text(text) => format!("`{}`", text.replace('\n', "\\n")),
        other => other.to_string(),
    }
}

fn range(key: &Key) -> String {
    match key.kind {
        Kind::Number(least, greatest) | Kind::Share(least, greatest) => {
            format!("{least} … {greatest}")
        }
        Kind::Count(least, greatest) => format!("{least} … {greatest}"),
        Kind::Switch => "true, false".into(),
        Kind::Choice(words) => words.join(", "),
        Kind::Layers(words) => format!("{}, or ranges", words.join(", ")),
        Kind::Text => "text".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_those_of_the_names() {
        let of = |name| unit(Key::by_name(name).unwrap());
        assert_eq!(of("bed_acceleration_deg_per_s2"), "°/s²");
        assert_eq!(of("solid_infill_below_area_mm2"), "mm²");
        assert_eq!(of("bed_inertia_kg_m2"), "kg·m²");
        assert_eq!(of("temperature_c"), "°C");
        assert_eq!(of("fill_density"), "");
    }
}
