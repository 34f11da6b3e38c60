//! Settings that a 3MF holds, taken over like a configuration of PrusaSlicer: those of PrusaSlicer stand
//! there as remarks, those of OrcaSlicer and Bambu Studio as a JSON object with names of their own.

use serde_json::Value;

use super::prusa::{self, Imported};
use crate::failure::Failure;

/// What keys of OrcaSlicer are called in PrusaSlicer, where they mean the same.
const NAMES: [(&str, &str); 62] = [
    ("initial_layer_print_height", "first_layer_height"),
    ("wall_loops", "perimeters"),
    ("outer_wall_line_width", "external_perimeter_extrusion_width"),
    ("inner_wall_line_width", "perimeter_extrusion_width"),
    ("sparse_infill_line_width", "infill_extrusion_width"),
    ("internal_solid_infill_line_width", "solid_infill_extrusion_width"),
    ("top_surface_line_width", "top_infill_extrusion_width"),
    ("support_line_width", "support_material_extrusion_width"),
    ("line_width", "extrusion_width"),
    ("initial_layer_line_width", "first_layer_extrusion_width"),
    ("only_one_wall_first_layer", "only_one_perimeter_first_layer"),
    ("top_shell_thickness", "top_solid_min_thickness"),
    ("bottom_shell_thickness", "bottom_solid_min_thickness"),
    ("small_perimeter_speed", "small_perimeter_speed"),
    ("top_shell_layers", "top_solid_layers"),
    ("bottom_shell_layers", "bottom_solid_layers"),
    ("sparse_infill_density", "fill_density"),
    ("sparse_infill_pattern", "fill_pattern"),
    ("internal_solid_infill_pattern", "solid_fill_pattern"),
    ("top_surface_pattern", "top_fill_pattern"),
    ("infill_direction", "fill_angle"),
    ("minimum_sparse_infill_area", "solid_infill_below_area"),
    ("infill_anchor_max", "infill_anchor_max"),
    ("is_infill_first", "infill_first"),
    ("only_one_wall_top", "only_one_perimeter_top"),
    ("reduce_crossing_wall", "avoid_crossing_perimeters"),
    ("extra_perimeters_on_overhangs", "extra_perimeters"),
    ("spiral_mode", "spiral_vase"),
    ("xy_contour_compensation", "xy_size_compensation"),
    ("elefant_foot_compensation", "elefant_foot_compensation"),
    ("hole_to_polyhole", "hole_to_polyhole"),
    ("hole_to_polyhole_threshold", "hole_to_polyhole_threshold"),
    ("hole_to_polyhole_twisted", "hole_to_polyhole_twisted"),
    ("outer_wall_speed", "external_perimeter_speed"),
    ("inner_wall_speed", "perimeter_speed"),
    ("sparse_infill_speed", "infill_speed"),
    ("internal_solid_infill_speed", "solid_infill_speed"),
    ("top_surface_speed", "top_solid_infill_speed"),
    ("gap_infill_speed", "gap_fill_speed"),
    ("initial_layer_speed", "first_layer_speed"),
    ("default_acceleration", "default_acceleration"),
    ("outer_wall_acceleration", "external_perimeter_acceleration"),
    ("inner_wall_acceleration", "perimeter_acceleration"),
    ("top_surface_acceleration", "top_solid_infill_acceleration"),
    ("initial_layer_acceleration", "first_layer_acceleration"),
    ("travel_acceleration", "travel_acceleration"),
    ("skirt_loops", "skirts"),
    ("brim_object_gap", "brim_separation"),
    ("enable_support", "support_material"),
    ("support_on_build_plate_only", "support_material_buildplate_only"),
    ("support_top_z_distance", "support_material_contact_distance"),
    ("support_bottom_z_distance", "support_material_bottom_contact_distance"),
    ("support_object_xy_distance", "support_material_xy_spacing"),
    ("support_base_pattern_spacing", "support_material_spacing"),
    ("support_interface_spacing", "support_material_interface_spacing"),
    ("support_interface_top_layers", "support_material_interface_layers"),
    ("nozzle_temperature", "temperature"),
    ("nozzle_temperature_initial_layer", "first_layer_temperature"),
    ("hot_plate_temp", "bed_temperature"),
    ("hot_plate_temp_initial_layer", "first_layer_bed_temperature"),
    ("filament_flow_ratio", "extrusion_multiplier"),
    ("slow_down_layer_time", "slowdown_below_layer_time"),
];

/// Keys that both have, with values of another meaning: a threshold that is measured from the other side,
/// a skin that is no switch, an ironing that is none either.
const OTHER_MEANINGS: [&str; 2] = ["fuzzy_skin", "seam_position"];

/// Values that have other words.
const WORDS: [(&str, &str, &str); 9] = [
    ("wall_sequence", "inner wall/outer wall", "inner-outer"),
    ("wall_sequence", "outer wall/inner wall", "outer-inner"),
    ("wall_sequence", "inner-outer-inner wall", "inner-outer-inner"),
    ("fill_pattern", "zig-zag", "rectilinear"),
    ("fill_pattern", "line", "rectilinear"),
    ("fill_pattern", "tri-hexagon", "stars"),
    ("solid_fill_pattern", "monotonicline", "monotoniclines"),
    ("top_fill_pattern", "monotonicline", "monotoniclines"),
    ("solid_fill_pattern", "zig-zag", "rectilinear"),
];

/// Takes the signs of remarks off the lines of a configuration that are settings.
#[must_use]
pub fn uncommented(text: &[u8]) -> Vec<u8> {
    let lines = text.split(|byte| *byte == b'\n');
    let bare = lines.map(|line| match line.strip_prefix(b"; ") {
        Some(setting) if setting.contains(&b'=') => setting,
        _ => line,
    });
    bare.collect::<Vec<_>>().join(&b'\n')
}

/// Reads the settings of OrcaSlicer; `name` is what messages call the file.
///
/// # Errors
///
/// `ConfigSyntax` when they are none.
pub fn read(json: &[u8], name: &str) -> Result<Imported, Failure> {
    let wrong = |what: String| Failure::new("ConfigSyntax", format!("{name}: {what}"));
    let all: Value = serde_json::from_slice(json).map_err(|error| wrong(error.to_string()))?;
    let all = all.as_object().ok_or_else(|| wrong("settings are no object".to_owned()))?;
    let mut text = String::new();
    let mut unknown = Vec::new();
    for (key, value) in all {
        if OTHER_MEANINGS.contains(&key.as_str()) {
            unknown.push(key.clone());
            continue;
        }
        let known = NAMES.iter().find(|(orca, _)| orca == key).map(|(_, prusa)| *prusa);
        let key = known.unwrap_or(key);
        let value = line(value);
        let word = WORDS.iter().find(|(of, word, _)| *of == key && *word == value);
        let value = word.map_or(value.as_str(), |(_, _, word)| word);
        // What has a line of its own is none of these settings.
        if !value.contains(['\n', '\r']) && !key.contains(['\n', '\r', '=']) {
            text.push_str(&format!("{key} = {value}\n"));
        }
    }
    let mut imported = prusa::read(text.as_bytes(), name)?;
    imported.unknown.extend(unknown);
    Ok(imported)
}

/// A value as a configuration has it: those of several extruders one after the other.
fn line(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(values) => values.iter().map(line).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_orca_become_ours() {
        let json = br#"{"wall_loops": "4", "sparse_infill_density": "22%", "layer_height": "0.16",
            "sparse_infill_pattern": "tri-hexagon", "nozzle_temperature": ["215"],
            "outer_wall_speed": "33", "prime_tower_width": "35", "fuzzy_skin": "none"}"#;
        let imported = read(json, "x.3mf").unwrap();
        let taken: Vec<String> =
            imported.taken.iter().map(|(key, value)| format!("{}={value}", key.name)).collect();
        for wanted in [
            "perimeters=4",
            "fill_density=0.22",
            "layer_height_mm=0.16",
            "fill_pattern=stars",
            "external_perimeter_speed_mm_per_s=33",
        ] {
            assert!(taken.iter().any(|pair| pair == wanted), "{wanted} in {taken:?}");
        }
        assert_eq!(imported.unknown, ["prime_tower_width", "fuzzy_skin"]);
        assert!(read(b"[1]", "x").is_err() && read(b"{", "x").is_err());
    }

    #[test]
    fn every_name_is_one_of_ours() {
        for (orca, prusa) in NAMES {
            let text = format!("{prusa} = 1\nperimeters = 2\nlayer_height = 0.2\n");
            let imported = prusa::read(text.as_bytes(), "x").unwrap();
            let is_special = prusa == "extrusion_width";
            assert!(imported.unknown.is_empty() || is_special, "{orca}: {prusa}");
        }
    }
}
