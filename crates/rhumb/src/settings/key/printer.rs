//! The settings of a printer: facts of the machine.

use super::{Default, Key, Kind, Section, choice, number, text};
use Section::Printer;

const HEADS: &[&str] = &["fixed", "tilt", "two-axis", "hexapod"];

const LAYOUTS: &[&str] = &["6-3", "6-6", "3-3", "joints"];

const TABLES: &[&str] = &["turning", "standing"];

/// A fact of machines with a head that turns the nozzle, which others need not say.
const fn of_head(name: &'static str, range: (f64, f64, f64), meaning: &'static str) -> Key {
    number(Printer, name, "", range, meaning)
}

const fn choice_of_head(
    name: &'static str,
    words: &'static [&'static str],
    meaning: &'static str,
) -> Key {
    let default = Default::Text(words[0]);
    Key { name, section: Printer, kind: Kind::Choice(words), default, program_name: "", meaning }
}

const DIALECTS: &[&str] = &[
    "polar",
    "rrf-direct",
    "klipper-polar",
    "rrf-polar",
    "marlin-polar",
    "grblhal-polar",
    "cartesian",
];

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

/// In the order in which they are shown.
pub(super) const KEYS: &[Key] = &[
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
        (360.0, 1.0, 100_000.0),
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
    of_head(
        "z_min_mm",
        (0.0, -500.0, 0.0),
        "least height of the lift; a head that tilts comes down by more than its tip",
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
        (500.0, 20.0, 100_000.0),
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
    Key {
        name: "remaining_times",
        section: Printer,
        kind: Kind::Switch,
        default: Default::Switch(false),
        program_name: "remaining_times",
        meaning: "whether the program tells the firmware what share is done and how many minutes are \
                  left (M73), where it has a command for that",
    },
    choice(
        Printer,
        "gcode_label_objects",
        &["firmware", "octoprint", "disabled"],
        "how lines of several models are told apart, so that one can be left out: by the firmware's own \
         commands where it has them (EXCLUDE_OBJECT, M486), by comments for OctoPrint, or not",
    ),
    choice_of_head(
        "head",
        HEADS,
        "what turns the nozzle: nothing, one tilt in the plane of the rail (B), two tilts (A and B), or \
         six legs",
    ),
    of_head(
        "pivot_length_mm",
        (43.0, 1.0, 1000.0),
        "from the tip of the nozzle to the point it is turned about",
    ),
    of_head("tilt_min_deg", (-45.0, -85.0, 0.0), "how far the nozzle tilts inwards, to the axis"),
    of_head("tilt_max_deg", (45.0, 0.0, 85.0), "how far the nozzle tilts outwards"),
    of_head("tilt_speed_deg_per_s", (90.0, 0.1, 10_000.0), "greatest speed of a tilt axis"),
    of_head(
        "tilt_acceleration_deg_per_s2",
        (1000.0, 1.0, 1e6),
        "greatest acceleration of a tilt axis",
    ),
    choice_of_head("hexapod_bed", TABLES, "whether the bed turns under a hexapod, or stands"),
    choice_of_head(
        "hexapod_layout",
        LAYOUTS,
        "where its legs meet: base joints in pairs and three platform joints (6-3), pairs on both \
         (6-6), three on both (3-3), or the joints given one by one",
    ),
    of_head("hexapod_base_radius_mm", (150.0, 1.0, 5000.0), "radius of its base joints"),
    of_head("hexapod_platform_radius_mm", (60.0, 1.0, 5000.0), "radius of its platform joints"),
    of_head(
        "hexapod_base_half_angle_deg",
        (12.0, 0.0, 59.0),
        "half the angle between the two base joints of a pair",
    ),
    of_head(
        "hexapod_platform_half_angle_deg",
        (12.0, 0.0, 59.0),
        "half the angle between the two platform joints of a pair",
    ),
    text(
        Printer,
        "hexapod_base_joints_mm",
        "",
        "",
        "base joints one by one, \"x,y,z; …\", six of them, for hexapod_layout = \"joints\"",
    ),
    text(
        Printer,
        "hexapod_platform_joints_mm",
        "",
        "",
        "platform joints one by one, from the point the nozzle is turned about, in the order of the legs",
    ),
    of_head(
        "hexapod_x_mm",
        (0.0, -5000.0, 5000.0),
        "how far the base stands from the axis along x",
    ),
    of_head("hexapod_z_mm", (300.0, -5000.0, 5000.0), "how high the base stands over the bed"),
    of_head(
        "hexapod_home_mm",
        (0.0, 0.0, 5000.0),
        "height between base and platform in the middle of their joints; 0: where legs lean by 45°",
    ),
    of_head("leg_min_mm", (50.0, 0.0, 5000.0), "shortest leg, or begin of a slide"),
    of_head("leg_max_mm", (500.0, 1.0, 5000.0), "longest leg, or end of a slide"),
    of_head("leg_speed_mm_per_s", (200.0, 1.0, 5000.0), "greatest speed of a leg"),
    of_head("leg_acceleration_mm_per_s2", (3000.0, 1.0, 1e5), "greatest acceleration of a leg"),
    of_head(
        "leg_cone_deg",
        (45.0, 1.0, 180.0),
        "how far a leg may lean in its joints from where it points in the middle",
    ),
    of_head("leg_distance_mm", (8.0, 0.0, 500.0), "least distance between the middles of two legs"),
    of_head(
        "leg_condition_max",
        (10.0, 1.0, 1e6),
        "greatest condition number of the legs: how unevenly they hold the platform",
    ),
    of_head(
        "rod_length_mm",
        (0.0, 0.0, 5000.0),
        "length of rods whose base joints slide along the vertical; 0 for legs that change their length",
    ),
    text(
        Printer,
        "start_gcode",
        "",
        "G28\nM190 S{first_layer_bed_temperature}\nM109 S{first_layer_temperature}",
        "program before the print; names in braces are filled in",
    ),
    text(
        Printer,
        "before_layer_gcode",
        "",
        "",
        "program before every layer; layer_num (from 0) and layer_z can be filled in, too",
    ),
    text(Printer, "layer_gcode", "", "", "the same after the begin of every layer has been told"),
    text(Printer, "end_gcode", "", "M104 S0\nM140 S0\nM107\nM84", "program after the print"),
];
