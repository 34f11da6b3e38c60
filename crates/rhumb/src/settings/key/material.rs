//! The settings of a material: what a filament needs.

use super::{Key, Kind, Section, count, number, share, text};
use Section::Material;

/// In the order in which they are shown.
pub(super) const KEYS: &[Key] = &[
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
        "retract_restart_extra_mm",
        "retract_restart_extra",
        (0.0, -2.0, 2.0),
        "filament fed after a travel beyond what was drawn back before it; less than 0 leaves some out",
    ),
    number(
        Material,
        "retract_speed_mm_per_s",
        "retract_speed",
        (35.0, 1.0, 200.0),
        "speed of drawing back, and of feeding again",
    ),
    number(
        Material,
        "deretract_speed_mm_per_s",
        "deretract_speed",
        (0.0, 0.0, 200.0),
        "speed of feeding again; 0 for that of drawing back",
    ),
    Key {
        name: "retract_layer_change",
        section: Material,
        kind: Kind::Switch,
        default: super::Default::Switch(false),
        program_name: "retract_layer_change",
        meaning: "whether filament is drawn back before every new layer, however near it begins",
    },
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
    share(Material, "fan_speed", 1.0, "part fan, of layers that take little time"),
    share(
        Material,
        "min_fan_speed",
        1.0,
        "part fan of layers that take long, where that is less than fan_speed",
    ),
    number(
        Material,
        "fan_below_layer_time_s",
        "fan_below_layer_time",
        (60.0, 0.0, 1000.0),
        "layers that take this long have min_fan_speed; from there to slowdown_below_layer_time_s the fan \
         is turned up to fan_speed",
    ),
    count(
        Material,
        "full_fan_speed_layer",
        (0, 0, 1000),
        "layer, counted from 1, at which the fan comes to its full speed, evenly from \
         disable_fan_first_layers on; 0 for at once",
    ),
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
];
