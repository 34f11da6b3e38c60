//! Every setting there is.
//!
//! Keys carry their unit and use PrusaSlicer's words where it has them. A key without a unit is a
//! number of things, a share, a name or a switch.

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

/// Counts of a motor, which no program needs to say.
const fn motor(
    name: &'static str,
    (default, least, greatest): (i64, i64, i64),
    meaning: &'static str,
) -> Key {
    let default = Default::Count(default);
    let kind = Kind::Count(least, greatest);
    Key { name, section: Printer, kind, default, program_name: "", meaning }
}

const fn drive(name: &'static str, default: &'static str, meaning: &'static str) -> Key {
    text(Printer, name, "", default, meaning)
}

use Section::{Material, Print, Printer};

const DIALECTS: &[&str] = &[
    "polar",
    "rrf-direct",
    "klipper-polar",
    "rrf-polar",
    "marlin-polar",
    "grblhal-polar",
    "cartesian",
];

const PATTERNS: &[&str] = &[
    "rectilinear",
    "alignedrectilinear",
    "grid",
    "triangles",
    "stars",
    "cubic",
    "gyroid",
    "honeycomb",
    "concentric",
    "archimedeanchords",
];

const SOLID_PATTERNS: &[&str] =
    &["rectilinear", "monotonic", "monotoniclines", "grid", "concentric", "archimedeanchords"];

const TOP_PATTERNS: &[&str] =
    &["monotonic", "monotoniclines", "rectilinear", "grid", "concentric", "archimedeanchords"];

/// All settings, by section, in the order in which they are shown.
pub const KEYS: &[Key] = &[
    text(Printer, "printer_model", "printer_model", "generic-polar", "what the machine is called"),
    choice(Printer, "dialect", DIALECTS, "the words in which it wants its program"),
    number(
        Printer,
        "rail_min_mm",
        "rail_min",
        (-25.0, -500.0, 500.0),
        "least carriage position; negative when the carriage passes the centre of the bed",
    ),
    number(
        Printer,
        "rail_max_mm",
        "rail_max",
        (120.0, 1.0, 1000.0),
        "greatest carriage position: the radius that can be printed",
    ),
    number(
        Printer,
        "rail_speed_mm_per_s",
        "rail_speed",
        (150.0, 1.0, 2000.0),
        "greatest speed of the carriage",
    ),
    number(
        Printer,
        "rail_acceleration_mm_per_s2",
        "rail_acceleration",
        (1500.0, 1.0, 100_000.0),
        "greatest acceleration of the carriage",
    ),
    number(
        Printer,
        "rail_jerk_mm_per_s",
        "rail_jerk",
        (8.0, 0.0, 100.0),
        "speed that the carriage may jump by, for the time estimate",
    ),
    number(
        Printer,
        "bed_speed_deg_per_s",
        "bed_speed",
        (360.0, 0.1, 100_000.0),
        "greatest turning speed of the bed",
    ),
    number(
        Printer,
        "bed_acceleration_deg_per_s2",
        "bed_acceleration",
        (3000.0, 0.1, 1_000_000.0),
        "greatest turning acceleration of the bed",
    ),
    number(
        Printer,
        "bed_jerk_deg_per_s",
        "bed_jerk",
        (20.0, 0.0, 1000.0),
        "turning speed that the bed may jump by, for the time estimate",
    ),
    Key {
        name: "bed_reversed",
        section: Printer,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "bed_reversed",
        meaning: "whether a growing angle turns the bed counter-clockwise seen from above",
    },
    number(
        Printer,
        "turns_max",
        "turns_max",
        (0.0, 0.0, 1_000_000.0),
        "turns of the bed from home, either way, that its wires allow; 0 for no bound",
    ),
    number(
        Printer,
        "bed_map_fade_mm",
        "bed_map_fade",
        (10.0, 0.1, 1000.0),
        "height above which a probed bed is no longer corrected for",
    ),
    number(
        Printer,
        "z_max_mm",
        "max_print_height",
        (200.0, 1.0, 2000.0),
        "greatest height of the lift",
    ),
    number(
        Printer,
        "z_speed_mm_per_s",
        "machine_max_feedrate_z",
        (15.0, 0.1, 500.0),
        "greatest speed of the lift",
    ),
    number(
        Printer,
        "z_acceleration_mm_per_s2",
        "machine_max_acceleration_z",
        (300.0, 1.0, 10_000.0),
        "greatest acceleration of the lift",
    ),
    number(
        Printer,
        "extruder_speed_mm_per_s",
        "machine_max_feedrate_e",
        (120.0, 1.0, 1000.0),
        "greatest speed of the filament, whether fed or drawn back",
    ),
    number(
        Printer,
        "path_acceleration_mm_per_s2",
        "machine_max_acceleration_extruding",
        (1500.0, 1.0, 100_000.0),
        "greatest acceleration of the nozzle along its path",
    ),
    number(
        Printer,
        "home_rail_mm",
        "home_rail",
        (120.0, -500.0, 1000.0),
        "where the carriage stands after homing",
    ),
    number(
        Printer,
        "home_z_mm",
        "home_z",
        (5.0, 0.0, 2000.0),
        "where the lift stands after homing",
    ),
    number(
        Printer,
        "axis_clearance_mm",
        "axis_clearance",
        (0.02, 0.001, 10.0),
        "nothing runs nearer past the rotation axis, unless straight through it",
    ),
    drive(
        "rail_transmission",
        "belt 20x2",
        "how its motor moves the carriage: belt TEETHxPITCH, screw LEAD, pinion RADIUS or step TRAVEL, mm",
    ),
    motor(
        "rail_motor_steps",
        (200, 4, 10_000),
        "full steps in a turn of the motor of the carriage",
    ),
    motor("rail_microsteps", (16, 1, 1024), "pulses in a full step of that motor"),
    number(
        Printer,
        "rail_gear_ratio",
        "",
        (1.0, 0.01, 1000.0),
        "turns of that motor for one behind its gear",
    ),
    motor("bed_motor_steps", (200, 4, 10_000), "full steps in a turn of the motor of the bed"),
    motor("bed_microsteps", (16, 1, 1024), "pulses in a full step of that motor"),
    number(
        Printer,
        "bed_gear_ratio",
        "",
        (5.0, 0.01, 1000.0),
        "turns of that motor for one behind its gear",
    ),
    number(
        Printer,
        "bed_inertia_kg_m2",
        "",
        (0.004, 0.0, 100.0),
        "moment of inertia of bed and part, for the lag of the bed's motor",
    ),
    number(
        Printer,
        "bed_motor_current_a",
        "",
        (2.5, 0.01, 100.0),
        "amplitude of the currents of the bed's motor, likewise",
    ),
    drive(
        "z_transmission",
        "screw 8",
        "how its motor moves the lift: belt TEETHxPITCH, screw LEAD, pinion RADIUS or step TRAVEL, mm",
    ),
    motor("z_motor_steps", (200, 4, 10_000), "full steps in a turn of the motor of the lift"),
    motor("z_microsteps", (16, 1, 1024), "pulses in a full step of that motor"),
    number(
        Printer,
        "z_gear_ratio",
        "",
        (1.0, 0.01, 1000.0),
        "turns of that motor for one behind its gear",
    ),
    drive(
        "extruder_transmission",
        "pinion 3.68",
        "how its motor moves the filament: belt TEETHxPITCH, screw LEAD, pinion RADIUS or step TRAVEL, mm",
    ),
    motor(
        "extruder_motor_steps",
        (200, 4, 10_000),
        "full steps in a turn of the motor of the filament",
    ),
    motor("extruder_microsteps", (16, 1, 1024), "pulses in a full step of that motor"),
    number(
        Printer,
        "extruder_gear_ratio",
        "",
        (3.0, 0.01, 1000.0),
        "turns of that motor for one behind its gear",
    ),
    number(
        Printer,
        "moves_per_second",
        "moves_per_second",
        (500.0, 10.0, 100_000.0),
        "moves that the firmware takes in a second",
    ),
    number(
        Printer,
        "nozzle_diameter_mm",
        "nozzle_diameter",
        (0.4, 0.05, 3.0),
        "bore of the nozzle",
    ),
    number(
        Printer,
        "nozzle_flat_radius_mm",
        "nozzle_flat_radius",
        (0.3, 0.05, 5.0),
        "radius of the flat face around the bore; limits how steep curved layers may be",
    ),
    number(
        Printer,
        "nozzle_half_angle_deg",
        "nozzle_half_angle",
        (15.0, 1.0, 85.0),
        "half the angle of the nozzle's cone, from its axis",
    ),
    number(
        Printer,
        "nozzle_block_height_mm",
        "nozzle_block_height",
        (30.0, 0.5, 500.0),
        "height of the underside of the heater block above the tip",
    ),
    number(
        Printer,
        "nozzle_block_radius_mm",
        "nozzle_block_radius",
        (20.0, 0.5, 500.0),
        "how far the heater block and what carries it reach from the nozzle's axis",
    ),
    number(
        Printer,
        "carriage_height_mm",
        "carriage_height",
        (60.0, 1.0, 1000.0),
        "height of the underside of the carriage and its rail above the tip",
    ),
    number(
        Printer,
        "carriage_width_mm",
        "carriage_width",
        (60.0, 1.0, 1000.0),
        "width of the carriage and its rail, across the rail, the nozzle in the middle",
    ),
    number(
        Printer,
        "min_layer_height_mm",
        "min_layer_height",
        (0.04, 0.01, 1.0),
        "thinnest layer that prints well",
    ),
    number(
        Printer,
        "max_layer_height_mm",
        "max_layer_height",
        (0.32, 0.02, 2.0),
        "thickest layer that prints well",
    ),
    number(
        Printer,
        "max_nozzle_temperature_c",
        "max_nozzle_temperature",
        (280.0, 100.0, 500.0),
        "hottest nozzle allowed",
    ),
    number(
        Printer,
        "min_extrude_temperature_c",
        "min_extrude_temperature",
        (170.0, 0.0, 400.0),
        "coldest nozzle that may feed filament",
    ),
    number(
        Printer,
        "max_bed_temperature_c",
        "max_bed_temperature",
        (110.0, 0.0, 200.0),
        "hottest bed allowed",
    ),
    number(
        Printer,
        "z_increment_mm",
        "z_increment",
        (0.005, 0.001, 0.5),
        "what the lift moves by; layer heights are whole multiples of it, unless snap = off",
    ),
    text(
        Printer,
        "start_gcode",
        "",
        "G28\nM190 S{first_layer_bed_temperature}\nM109 S{first_layer_temperature}",
        "program before the print; names in braces are filled in",
    ),
    text(Printer, "end_gcode", "", "M104 S0\nM140 S0\nM107\nM84", "program after the print"),
    text(Material, "filament_type", "filament_type", "PLA", "what the filament is"),
    number(
        Material,
        "filament_diameter_mm",
        "filament_diameter",
        (1.75, 0.5, 5.0),
        "diameter of the filament",
    ),
    number(
        Material,
        "filament_density_g_per_cm3",
        "filament_density",
        (1.24, 0.1, 20.0),
        "density, for the weight",
    ),
    number(Material, "temperature_c", "temperature", (210.0, 100.0, 500.0), "nozzle temperature"),
    number(
        Material,
        "first_layer_temperature_c",
        "first_layer_temperature",
        (215.0, 100.0, 500.0),
        "nozzle temperature of the first layer",
    ),
    number(Material, "bed_temperature_c", "bed_temperature", (60.0, 0.0, 200.0), "bed temperature"),
    number(
        Material,
        "first_layer_bed_temperature_c",
        "first_layer_bed_temperature",
        (60.0, 0.0, 200.0),
        "bed temperature of the first layer",
    ),
    number(
        Material,
        "extrusion_multiplier",
        "extrusion_multiplier",
        (1.0, 0.5, 2.0),
        "filament fed for each that the volume asks for",
    ),
    number(
        Material,
        "max_volumetric_speed_mm3_per_s",
        "filament_max_volumetric_speed",
        (11.0, 0.1, 200.0),
        "most volume that melts in a second",
    ),
    number(
        Material,
        "min_volumetric_speed_mm3_per_s",
        "filament_min_volumetric_speed",
        (0.1, 0.0, 200.0),
        "least volume in a second without oozing and cooking: short layers are not slowed down \
         further, and beads near the axis, where the bed is too slow for it, are reported; 0 for none",
    ),
    number(
        Material,
        "retract_length_mm",
        "retract_length",
        (0.8, 0.0, 20.0),
        "filament drawn back before a travel; 0 for never",
    ),
    number(
        Material,
        "retract_speed_mm_per_s",
        "retract_speed",
        (35.0, 1.0, 200.0),
        "speed of drawing back and feeding again",
    ),
    number(
        Material,
        "retract_before_travel_mm",
        "retract_before_travel",
        (2.0, 0.0, 1000.0),
        "travels shorter than this leave the filament alone",
    ),
    number(
        Material,
        "retract_lift_mm",
        "retract_lift",
        (0.2, 0.0, 20.0),
        "how far the nozzle is lifted while the filament is drawn back",
    ),
    number(
        Material,
        "wipe_mm",
        "wipe_distance",
        (0.0, 0.0, 50.0),
        "how far the nozzle runs back along the line while the filament is drawn back",
    ),
    number(
        Material,
        "pressure_advance_s",
        "pressure_advance",
        (0.0, 0.0, 2.0),
        "filament pushed ahead of its flow, for each mm/s of its speed; told to the firmware before the \
         print, 0 leaves it as it is",
    ),
    share(Material, "fan_speed", 1.0, "part fan"),
    share(
        Material,
        "bridge_fan_speed",
        1.0,
        "part fan for bridges and overhanging walls, where that is more",
    ),
    count(Material, "disable_fan_first_layers", (1, 0, 1000), "layers at the bottom without fan"),
    number(
        Material,
        "slowdown_below_layer_time_s",
        "slowdown_below_layer_time",
        (8.0, 0.0, 600.0),
        "layers that take less are slowed down",
    ),
    number(
        Material,
        "min_print_speed_mm_per_s",
        "min_print_speed",
        (10.0, 0.1, 200.0),
        "but never below this speed",
    ),
    choice(
        Print,
        "layers",
        &["planar", "conical", "spherical", "caps", "auto"],
        "the surface that layers follow: planes, cones about the axis, spheres about a point of it, \
         or the same cap of a sphere lifted; auto weighs the first three for the part",
    ),
    number(
        Print,
        "cone_angle_deg",
        "cone_angle",
        (30.0, -75.0, 75.0),
        "slope of conical layers; positive when they fall outwards, negative for bowls",
    ),
    Key {
        name: "cone_angle_max",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "cone_angle_max",
        meaning: "whether the slope of conical layers is lowered to what the nozzle clears",
    },
    number(
        Print,
        "sphere_centre_mm",
        "sphere_centre",
        (-60.0, -1e5, 0.0),
        "height of the centre of spherical layers",
    ),
    number(
        Print,
        "cap_radius_mm",
        "cap_radius",
        (100.0, 1.0, 1e5),
        "radius of the sphere whose cap is lifted",
    ),
    count(Print, "base_layers", (2, 0, 1000), "planar layers under curved ones"),
    choice(
        Print,
        "blend",
        &["none", "morph"],
        "whether conical layers begin as wedges on the planar ones, or grow out of them, each a little \
         steeper and half to one and a half layers thick",
    ),
    choice(
        Print,
        "top",
        &["curved", "planar"],
        "whether the flat face on top of a part in curved layers is left to them, which shows as \
         steps, or finished by planar layers",
    ),
    number(Print, "layer_height_mm", "layer_height", (0.2, 0.01, 2.0), "thickness of a layer"),
    number(
        Print,
        "first_layer_height_mm",
        "first_layer_height",
        (0.2, 0.01, 2.0),
        "thickness of the first layer",
    ),
    choice(
        Print,
        "snap",
        &["optimal", "greedy", "off"],
        "whether layers end on the flat faces of the part: on all that can be met, by the \
         published rule, or not",
    ),
    number(
        Print,
        "flat_area_min_mm2",
        "flat_area_min",
        (1.0, 0.0, 100_000.0),
        "flat faces smaller than this are not looked for",
    ),
    number(
        Print,
        "flat_depth_mm",
        "flat_depth",
        (0.01, 0.0001, 0.5),
        "how far the facets of one flat face may lie from its height",
    ),
    Key {
        name: "adaptive",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "adaptive_layer_height",
        meaning: "whether layers are as thick as the slopes and the printer bear, instead of \
                  layer_height_mm",
    },
    number(
        Print,
        "cusp_mm",
        "cusp",
        (0.1, 0.001, 2.0),
        "highest stair step on a slope when layers are adaptive",
    ),
    share(
        Print,
        "cusp_area_share",
        0.0,
        "share of the area of a layer that may have higher stair steps",
    ),
    count(Print, "perimeters", (2, 0, 100), "number of walls"),
    Key {
        name: "external_perimeters_first",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "external_perimeters_first",
        meaning: "whether the outermost wall comes before those behind it",
    },
    Key {
        name: "avoid_crossing_perimeters",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "avoid_crossing_perimeters",
        meaning: "whether travel inside an island goes round its holes and notches, with the filament ready, \
                  instead of across them; on flat layers",
    },
    Key {
        name: "only_one_perimeter_top",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "only_one_perimeter_top",
        meaning: "whether islands with nothing above have a single wall, and more of the top pattern",
    },
    Key {
        name: "extra_perimeters",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "extra_perimeters",
        meaning: "whether steep overhangs get up to four more walls, so that no infill begins in \
                  mid-air",
    },
    Key {
        name: "spiral_vase",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "spiral_vase",
        meaning: "whether above bottom_solid_layers a single wall climbs without a break: one turn \
                  of the bed a layer, no infill, no top",
    },
    choice(
        Print,
        "seam_position",
        &["nearest", "aligned", "rear", "random", "corner"],
        "where walls begin: where the nozzle is nearest (least travel), above the seam below, farthest \
         towards seam_angle_deg, anywhere, or in the sharpest corner that points into the part",
    ),
    number(
        Print,
        "seam_angle_deg",
        "seam_angle",
        (90.0, -360.0, 360.0),
        "direction of the seams with seam_position = rear, on the bed from its x axis",
    ),
    number(
        Print,
        "external_perimeter_extrusion_width_mm",
        "external_perimeter_extrusion_width",
        (0.45, 0.05, 5.0),
        "width of the outermost wall",
    ),
    number(
        Print,
        "perimeter_extrusion_width_mm",
        "perimeter_extrusion_width",
        (0.45, 0.05, 5.0),
        "width of the other walls",
    ),
    number(
        Print,
        "infill_extrusion_width_mm",
        "infill_extrusion_width",
        (0.45, 0.05, 5.0),
        "width of sparse lines",
    ),
    number(
        Print,
        "solid_infill_extrusion_width_mm",
        "solid_infill_extrusion_width",
        (0.45, 0.05, 5.0),
        "width of solid lines",
    ),
    number(
        Print,
        "top_infill_extrusion_width_mm",
        "top_infill_extrusion_width",
        (0.4, 0.05, 5.0),
        "width of solid lines that are seen from above",
    ),
    number(
        Print,
        "thin_width_min_mm",
        "thin_width_min",
        (0.2, 0.02, 5.0),
        "thinnest single bead; thinner places stay empty and are reported",
    ),
    number(
        Print,
        "gap_width_min_mm",
        "gap_width_min",
        (0.08, 0.01, 5.0),
        "thinnest gap between beads that is filled",
    ),
    number(Print, "thin_width_max_mm", "thin_width_max", (0.85, 0.05, 5.0), "widest single bead"),
    count(
        Print,
        "top_solid_layers",
        (4, 0, 1000),
        "solid layers under a surface that is seen from above",
    ),
    count(
        Print,
        "bottom_solid_layers",
        (4, 0, 1000),
        "solid layers over a surface that is seen from below",
    ),
    share(Print, "fill_density", 0.15, "share of the inside that is filled"),
    choice(
        Print,
        "fill_pattern",
        PATTERNS,
        "lines of sparse areas; all but the last two are fixed in space, so that layers of any shape \
         stand on each other",
    ),
    choice(
        Print,
        "solid_fill_pattern",
        SOLID_PATTERNS,
        "lines of solid areas; on curved layers concentric loops or the spiral",
    ),
    choice(
        Print,
        "top_fill_pattern",
        TOP_PATTERNS,
        "lines of solid areas that are seen from above; monotonic ones are laid from one side to the \
         other, joined at their ends or (monotoniclines) each on its own",
    ),
    number(
        Print,
        "infill_anchor_max_mm",
        "infill_anchor_max",
        (10.0, 0.0, 1000.0),
        "longest piece along a wall that joins two sparse lines: up to that it costs less than the \
         travel that it saves",
    ),
    number(
        Print,
        "fill_angle_deg",
        "fill_angle",
        (45.0, -360.0, 360.0),
        "direction of parallel lines, from the part's own reference direction",
    ),
    number(
        Print,
        "solid_infill_below_area_mm2",
        "solid_infill_below_area",
        (20.0, 0.0, 100_000.0),
        "sparse areas smaller than this become solid",
    ),
    Key {
        name: "infill_overlap",
        section: Print,
        kind: Kind::Share(0.0, 0.5),
        default: Default::Number(0.0),
        program_name: "infill_overlap",
        meaning: "how far sparse lines reach into the walls, by their width",
    },
    Key {
        name: "infill_first",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "infill_first",
        meaning: "whether infill comes before walls, on planar layers",
    },
    Key {
        name: "ironing",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "ironing",
        meaning: "whether what is seen from above is smoothed by a second run with hardly any material",
    },
    number(
        Print,
        "ironing_spacing_mm",
        "ironing_spacing",
        (0.15, 0.02, 2.0),
        "distance of the lines of that run",
    ),
    share(Print, "ironing_flow", 0.2, "material of that run by what a solid layer takes"),
    number(
        Print,
        "ironing_speed_mm_per_s",
        "ironing_speed",
        (20.0, 0.1, 1000.0),
        "speed of that run",
    ),
    number(
        Print,
        "xy_size_compensation_mm",
        "xy_size_compensation",
        (0.0, -2.0, 2.0),
        "how far all outlines move outwards, those of holes into the holes; negative for a smaller part",
    ),
    number(
        Print,
        "hole_size_compensation_mm",
        "hole_size_compensation",
        (0.0, -2.0, 2.0),
        "how far outlines of holes move into the material besides, for wider holes",
    ),
    number(
        Print,
        "elefant_foot_compensation_mm",
        "elefant_foot_compensation",
        (0.0, 0.0, 2.0),
        "how far outlines of the first layer move inwards, against what the bed squeezes out",
    ),
    Key {
        name: "fuzzy_skin",
        section: Print,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "fuzzy_skin",
        meaning: "whether outer walls are rough, from the second layer on",
    },
    number(
        Print,
        "fuzzy_skin_thickness_mm",
        "fuzzy_skin_thickness",
        (0.3, 0.0, 2.0),
        "how far points of a rough wall lie inside of the outline at most",
    ),
    number(
        Print,
        "fuzzy_skin_point_dist_mm",
        "fuzzy_skin_point_dist",
        (0.8, 0.1, 10.0),
        "mean distance of these points",
    ),
    count(Print, "skirts", (1, 0, 100), "loops around the part on the first layer"),
    number(
        Print,
        "skirt_distance_mm",
        "skirt_distance",
        (6.0, 0.0, 200.0),
        "distance of the skirt from part or brim",
    ),
    number(
        Print,
        "brim_width_mm",
        "brim_width",
        (0.0, 0.0, 200.0),
        "width of the brim; 0 for none",
    ),
    number(
        Print,
        "brim_separation_mm",
        "brim_separation",
        (0.1, 0.0, 10.0),
        "gap between brim and part",
    ),
    number(
        Print,
        "external_perimeter_speed_mm_per_s",
        "external_perimeter_speed",
        (30.0, 0.1, 1000.0),
        "speed of the outermost wall",
    ),
    number(
        Print,
        "perimeter_speed_mm_per_s",
        "perimeter_speed",
        (45.0, 0.1, 1000.0),
        "speed of the other walls",
    ),
    number(
        Print,
        "infill_speed_mm_per_s",
        "infill_speed",
        (60.0, 0.1, 1000.0),
        "speed of sparse lines",
    ),
    number(
        Print,
        "solid_infill_speed_mm_per_s",
        "solid_infill_speed",
        (50.0, 0.1, 1000.0),
        "speed of solid lines",
    ),
    number(
        Print,
        "top_solid_infill_speed_mm_per_s",
        "top_solid_infill_speed",
        (35.0, 0.1, 1000.0),
        "speed of solid lines that are seen from above",
    ),
    number(
        Print,
        "gap_fill_speed_mm_per_s",
        "gap_fill_speed",
        (25.0, 0.1, 1000.0),
        "speed of single beads",
    ),
    number(
        Print,
        "bridge_speed_mm_per_s",
        "bridge_speed",
        (30.0, 0.1, 1000.0),
        "speed of infill that spans a gap",
    ),
    number(
        Print,
        "bridge_flow_ratio",
        "bridge_flow_ratio",
        (1.0, 0.3, 2.0),
        "material of bridges by what their place holds",
    ),
    number(
        Print,
        "overhang_speed_0_mm_per_s",
        "overhang_speed_0",
        (15.0, 0.0, 1000.0),
        "greatest speed of walls that the layer below does not carry at all; 0 for no bound",
    ),
    number(
        Print,
        "overhang_speed_1_mm_per_s",
        "overhang_speed_1",
        (20.0, 0.0, 1000.0),
        "greatest speed of walls carried by up to a quarter of their width; 0 for no bound",
    ),
    number(
        Print,
        "overhang_speed_2_mm_per_s",
        "overhang_speed_2",
        (25.0, 0.0, 1000.0),
        "greatest speed of walls carried by a quarter to a half of their width; 0 for no bound",
    ),
    number(
        Print,
        "overhang_speed_3_mm_per_s",
        "overhang_speed_3",
        (0.0, 0.0, 1000.0),
        "greatest speed of walls carried by a half to three quarters of their width; 0 for no bound",
    ),
    number(
        Print,
        "first_layer_speed_mm_per_s",
        "first_layer_speed",
        (20.0, 0.1, 1000.0),
        "greatest speed on the first layer",
    ),
    number(
        Print,
        "travel_speed_mm_per_s",
        "travel_speed",
        (120.0, 0.1, 2000.0),
        "speed without extruding",
    ),
    number(
        Print,
        "simplify_mm",
        "gcode_resolution",
        (0.002, 0.0001, 0.5),
        "how far simplified outlines may lie from the mesh",
    ),
    number(
        Print,
        "chord_mm",
        "chord",
        (0.005, 0.0005, 1.0),
        "how far the nozzle may lie from its line between two points of the program",
    ),
    number(Print, "travel_chord_mm", "travel_chord", (0.1, 0.0005, 5.0), "the same for travel"),
    number(
        Print,
        "overhang_angle_deg",
        "overhang_angle",
        (45.0, 1.0, 89.0),
        "facets that face down beyond this angle from the vertical count as overhang",
    ),
    number(
        Print,
        "flat_angle_deg",
        "flat_angle",
        (1.0, 0.01, 20.0),
        "facets within this angle count as one flat face",
    ),
];

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
                (Kind::Choice(words), Default::Text(word)) => words.contains(&word),
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
