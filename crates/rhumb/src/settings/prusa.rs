//! Takes over settings of PrusaSlicer: what it exports as a configuration, an INI file of one value a
//! key. Print and filament settings have the same names there, and mostly the same meaning; where a
//! value is a share of another setting, it is worked out. What has no counterpart is told, and so is
//! what has one that does not take the value. Settings of a printer are not taken over: a Cartesian
//! machine is another.

use std::collections::BTreeMap;

use super::file::from_text;
use super::key::{KEYS, Key, Kind, Section, Value};
use crate::failure::Failure;

/// What a configuration amounts to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Imported {
    /// The settings, in the order of [`KEYS`].
    pub taken: Vec<(&'static Key, Value)>,
    /// Keys that have a counterpart, whose values it does not take: key, value, why.
    pub refused: Vec<(String, String, String)>,
    /// Keys without a counterpart.
    pub unknown: Vec<String>,
}

/// Other names of settings; the later of two wins. A filament may override what a printer says.
const OTHER_NAMES: [(&str, &str); 9] = [
    ("max_fan_speed", "fan_speed"),
    ("top_fill_pattern", "solid_fill_pattern"),
    ("retract_length", "retract_length_mm"),
    ("filament_retract_length", "retract_length_mm"),
    ("filament_retract_speed", "retract_speed_mm_per_s"),
    ("filament_retract_restart_extra", "retract_restart_extra_mm"),
    ("filament_retract_lift", "retract_lift_mm"),
    ("filament_retract_before_travel", "retract_before_travel_mm"),
    ("initial_layer_height", "first_layer_height_mm"),
];

/// Keys that stand at the end of our programs, too, but mean something else there: how coarse the
/// lines of a program are is not how coarse outlines are.
const OTHER_MEANINGS: [&str; 1] = ["gcode_resolution"];

/// What a percentage is of; of itself, the other names say.
const SHARES_OF: [(&str, &str); 16] = [
    ("first_layer_extrusion_width", "first_layer_height"),
    ("small_perimeter_speed", "perimeter_speed"),
    ("first_layer_height", "layer_height"),
    ("external_perimeter_speed", "perimeter_speed"),
    ("first_layer_speed", "perimeter_speed"),
    ("solid_infill_speed", "infill_speed"),
    ("top_solid_infill_speed", "solid_infill_speed"),
    ("extrusion_width", "layer_height"),
    ("external_perimeter_extrusion_width", "layer_height"),
    ("perimeter_extrusion_width", "layer_height"),
    ("infill_extrusion_width", "layer_height"),
    ("solid_infill_extrusion_width", "layer_height"),
    ("top_infill_extrusion_width", "layer_height"),
    ("support_material_extrusion_width", "layer_height"),
    ("support_material_xy_spacing", "external_perimeter_extrusion_width"),
    ("support_material_interface_speed", "support_material_speed"),
];

/// Shares of shares of shares: there are no more.
const DEEPEST: usize = 4;

/// Reads a configuration; `name` is what messages call it.
///
/// # Errors
///
/// `ConfigSyntax` when it is none, or one of many profiles.
pub fn read(text: &[u8], name: &str) -> Result<Imported, Failure> {
    let text = std::str::from_utf8(text).map_err(|error| {
        let at = error.valid_up_to();
        Failure::new("ConfigSyntax", format!("{name}: byte {at} is not UTF-8"))
    })?;
    let given = given(text, name)?;
    let mut imported = Imported::default();
    let mut found: BTreeMap<usize, Value> = BTreeMap::new();
    for (written, raw) in &given {
        let Some((index, key)) = counterpart(written) else {
            imported.unknown.push((*written).to_owned());
            continue;
        };
        // A filament that overrides nothing.
        if *raw == "nil" {
            continue;
        }
        let refused = |why: String| ((*written).to_owned(), (*raw).to_owned(), why);
        let is_overridden = !written.starts_with("filament_retract")
            && given.get(format!("filament_{written}").as_str()).is_some_and(|v| *v != "nil");
        if is_overridden {
            continue;
        }
        match value(&given, written, key, name) {
            Ok(value) => {
                found.insert(index, value);
            }
            Err(why) => imported.refused.push(refused(why)),
        }
    }
    if given.get("brim_type") == Some(&"no_brim") {
        found.extend(counterpart("brim_width").map(|(index, _)| (index, Value::Number(0.0))));
    }
    if found.is_empty() {
        let what = format!("{name}: there is no setting of PrusaSlicer in it");
        return Err(Failure::new("ConfigSyntax", what).hint(EXPORT));
    }
    imported.taken = found.into_iter().map(|(index, value)| (&KEYS[index], value)).collect();
    Ok(imported)
}

const EXPORT: &str = "in PrusaSlicer: File, Export, Export Config";

/// The lines of a configuration; of a key that stands twice, the last.
fn given<'a>(text: &'a str, name: &str) -> Result<BTreeMap<&'a str, &'a str>, Failure> {
    let mut given = BTreeMap::new();
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with(['#', ';']) {
            continue;
        }
        if line.starts_with('[') {
            let what = format!("{name}, line {number}: this is a bundle of many profiles");
            return Err(Failure::new("ConfigSyntax", what).hint(EXPORT));
        }
        let Some((key, value)) = line.split_once('=') else {
            let what = format!("{name}, line {number}: expected `key = value`");
            return Err(Failure::new("ConfigSyntax", what).hint(EXPORT));
        };
        given.insert(key.trim(), value.trim());
    }
    Ok(given)
}

/// The setting that a key of PrusaSlicer stands for.
fn counterpart(written: &str) -> Option<(usize, &'static Key)> {
    let other = OTHER_NAMES.iter().find(|(name, _)| *name == written).map(|(_, name)| *name);
    KEYS.iter().enumerate().find(|(_, key)| {
        let is_it = match other {
            Some(other) => key.name == other,
            None => key.program_name == written && !OTHER_MEANINGS.contains(&written),
        };
        is_it && key.section != Section::Printer
    })
}

/// The value of a setting, or why it has none.
fn value(
    given: &BTreeMap<&str, &str>,
    written: &str,
    key: &'static Key,
    name: &str,
) -> Result<Value, String> {
    let raw = given.get(written).copied().unwrap_or_default();
    let told = |text: &str| from_text(key, text, name).map_err(|failure| why(&failure, name));
    match key.kind {
        Kind::Number(..) | Kind::Count(..) => {
            let number = number(given, written, 0).ok_or_else(|| match first(raw) {
                "0" => "PrusaSlicer works it out of the nozzle".to_owned(),
                _ => "it is no number here".to_owned(),
            })?;
            told(&number.to_string())
        }
        // Fans run at so many per cent, without a sign for it.
        Kind::Share(..) if written.ends_with("fan_speed") => told(&format!("{}%", first(raw))),
        Kind::Share(..) | Kind::Switch => told(first(raw)),
        Kind::Choice(_) | Kind::Layers(_) => told(raw),
        Kind::Text => {
            let text = raw.split(';').next().unwrap_or_default();
            told(text.trim_matches('"'))
        }
    }
}

/// A failure without the place that it begins with.
fn why(failure: &Failure, name: &str) -> String {
    let text = failure.to_string();
    let text = text.split_once("]: ").map_or(text.as_str(), |(_, rest)| rest);
    text.strip_prefix(name).unwrap_or(text).trim_start_matches([':', ' ']).to_owned()
}

/// The value of the first extruder.
fn first(raw: &str) -> &str {
    raw.split(',').next().unwrap_or_default().trim()
}

/// A number; a percentage of another setting is worked out, and a width of 0 is the usual one.
fn number(given: &BTreeMap<&str, &str>, written: &str, depth: usize) -> Option<f64> {
    let raw = first(given.get(written)?);
    let is_width = written.ends_with("extrusion_width");
    let Some(share) = raw.strip_suffix('%') else {
        let number: f64 = raw.parse().ok()?;
        let is_usual = is_width && number == 0.0 && written != "extrusion_width";
        return if is_usual { number_of_usual_width(given, depth) } else { Some(number) };
    };
    let (_, whole) = SHARES_OF.iter().find(|(name, _)| *name == written)?;
    let share: f64 = share.trim().parse().ok()?;
    let whole = if depth < DEEPEST { number(given, whole, depth + 1)? } else { return None };
    // No digits that nobody wrote.
    Some((share / 100.0 * whole * 1e6).round() / 1e6)
}

fn number_of_usual_width(given: &BTreeMap<&str, &str>, depth: usize) -> Option<f64> {
    number(given, "extrusion_width", depth + 1).filter(|width| *width > 0.0)
}

impl Imported {
    /// Returns the settings of a section as a TOML file; `None` when there are none.
    #[must_use]
    pub fn toml(&self, section: Section, name: &str) -> Option<String> {
        let mut table = toml::Table::new();
        for (key, value) in self.taken.iter().filter(|(key, _)| key.section == section) {
            let value = match value {
                Value::Number(number) => toml::Value::Float(*number),
                Value::Count(count) => toml::Value::Integer(*count),
                Value::Switch(switch) => toml::Value::Boolean(*switch),
                Value::Text(text) => toml::Value::String(text.clone()),
            };
            table.insert(key.name.to_owned(), value);
        }
        let name: String = name.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
        let head = format!("# {} settings of {name}, as PrusaSlicer has them\n", section.word());
        (!table.is_empty()).then(|| head + &table.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::file;

    fn taken<'a>(imported: &'a Imported, name: &str) -> Option<&'a Value> {
        imported.taken.iter().find(|(key, _)| key.name == name).map(|(_, value)| value)
    }

    const EXPORTED: &str = "# generated by PrusaSlicer 2.7.1\n\nlayer_height = 0.2\n\
        first_layer_height = 75%\nperimeters = 3\nfill_density = 20%\nfill_pattern = gyroid\n\
        perimeter_speed = 40\nexternal_perimeter_speed = 50%\ninfill_speed = 80\n\
        solid_infill_speed = 50%\ntop_solid_infill_speed = 50%\nextrusion_width = 0.46\n\
        perimeter_extrusion_width = 0\ninfill_extrusion_width = 225%\n\
        temperature = 235,215\nfilament_type = PETG;PLA\nretract_length = 0.8\n\
        filament_retract_length = 1.4\nfilament_retract_lift = nil\nmax_fan_speed = 50\n\
        external_perimeters_first = 1\nfilament_max_volumetric_speed = 0\n\
        nozzle_diameter = 0.4\nstart_gcode = G28 ; home = all\nbrim_type = no_brim\nbrim_width = 5\n\
        wipe_tower = 1\ngcode_resolution = 0.0125\n";

    #[test]
    fn settings_are_taken_over() {
        let imported = read(EXPORTED.as_bytes(), "my.ini").unwrap();
        let numbers = [
            ("layer_height_mm", 0.2),
            ("first_layer_height_mm", 0.15),
            ("fill_density", 0.2),
            ("external_perimeter_speed_mm_per_s", 20.0),
            ("solid_infill_speed_mm_per_s", 40.0),
            ("top_solid_infill_speed_mm_per_s", 20.0),
            ("perimeter_extrusion_width_mm", 0.46),
            ("infill_extrusion_width_mm", 0.45),
            ("temperature_c", 235.0),
            ("retract_length_mm", 1.4),
            ("fan_speed", 0.5),
            ("brim_width_mm", 0.0),
        ];
        for (name, wanted) in numbers {
            assert_eq!(taken(&imported, name), Some(&Value::Number(wanted)), "{name}");
        }
        assert_eq!(taken(&imported, "perimeters"), Some(&Value::Count(3)));
        assert_eq!(taken(&imported, "filament_type"), Some(&Value::Text("PETG".into())));
        assert_eq!(taken(&imported, "external_perimeters_first"), Some(&Value::Switch(true)));
        assert_eq!(taken(&imported, "retract_lift_mm"), None);
    }

    #[test]
    fn what_is_not_taken_over_is_told() {
        let imported =
            read(EXPORTED.replace("gyroid", "hilbertcurve").as_bytes(), "my.ini").unwrap();
        let refused: Vec<&str> = imported.refused.iter().map(|(key, ..)| key.as_str()).collect();
        assert_eq!(refused, ["filament_max_volumetric_speed", "fill_pattern"]);
        assert!(imported.refused[1].2.contains("one of rectilinear"), "{:?}", imported.refused[1]);
        for key in ["nozzle_diameter", "start_gcode", "wipe_tower"] {
            assert!(imported.unknown.iter().any(|unknown| unknown == key), "{key}");
        }
        // Every line is in one of the three lists, but for what another key overrides.
        let n_lines = EXPORTED.lines().filter(|line| line.contains(" = ")).count();
        let n_listed = imported.taken.len() + imported.refused.len() + imported.unknown.len();
        assert!(taken(&imported, "simplify_mm").is_none());
        let silent = ["retract_length", "filament_retract_lift"].len();
        assert_eq!(n_listed + silent, n_lines);
    }

    #[test]
    fn what_is_written_is_read_as_a_profile() {
        let imported = read(EXPORTED.as_bytes(), "my.ini").unwrap();
        for section in [Section::Material, Section::Print] {
            let text = imported.toml(section, "my\n.ini").unwrap();
            let again = file::read(text.as_bytes(), "again", section).unwrap();
            let wanted = imported.taken.iter().filter(|(key, _)| key.section == section);
            assert_eq!(again.values.len(), wanted.count());
            for (key, value) in again.values {
                assert_eq!(taken(&imported, key.name), Some(&value), "{}", key.name);
            }
        }
        assert_eq!(imported.toml(Section::Printer, "my.ini"), None);
    }

    #[test]
    fn what_is_no_configuration_is_refused() {
        for text in ["", "[print:fine]\nlayer_height = 0.1\n", "hello\n", "colour = red\n"] {
            assert_eq!(read(text.as_bytes(), "x").unwrap_err().class(), "ConfigSyntax", "{text}");
        }
        assert!(read(b"\xff\xfe", "x").is_err());
        let circle =
            "perimeter_speed = 10%\nlayer_height = 50%\nfirst_layer_height = 50%\nperimeters = 2\n";
        assert_eq!(read(circle.as_bytes(), "x").unwrap().refused.len(), 3);
    }
}
