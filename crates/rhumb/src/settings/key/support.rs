//! Settings of supports.

use super::Section::Print;
use super::{Default, Key, Kind, choice, count, number};

const fn switch(name: &'static str, default: bool, meaning: &'static str) -> Key {
    let default = Default::Switch(default);
    Key { name, section: Print, kind: Kind::Switch, default, program_name: name, meaning }
}

pub(super) const KEYS: &[Key] = &[
    switch(
        "support_material",
        false,
        "whether what no layer below carries is supported by columns that are broken away",
    ),
    switch(
        "support_material_auto",
        true,
        "whether supports are built wherever the part hangs over; without, there are none, since no \
         places are marked by hand",
    ),
    number(
        Print,
        "support_material_threshold_deg",
        "support_material_threshold",
        (0.0, 0.0, 89.0),
        "slopes that rise from the layer by less than this are supported, measured against the surface \
         that layers follow; 0 where a layer reaches beyond the one below by more than half a wall's \
         width",
    ),
    switch(
        "support_material_buildplate_only",
        false,
        "whether supports stand on the bed only, and what they could not reach from there stays without",
    ),
    switch(
        "dont_support_bridges",
        true,
        "whether gaps that lines of up to max_bridge_length_mm span are left to bridges",
    ),
    number(
        Print,
        "max_bridge_length_mm",
        "max_bridge_length",
        (10.0, 0.0, 100.0),
        "longest line that spans a gap without supports",
    ),
    number(
        Print,
        "support_material_contact_distance_mm",
        "support_material_contact_distance",
        (0.2, 0.0, 5.0),
        "least distance along the normal between supports and the part above them, in whole layers",
    ),
    number(
        Print,
        "support_material_bottom_contact_distance_mm",
        "support_material_bottom_contact_distance",
        (0.0, 0.0, 5.0),
        "the same between supports and the part that they stand on; 0 for as much as above",
    ),
    number(
        Print,
        "support_material_xy_spacing_mm",
        "support_material_xy_spacing",
        (0.25, 0.0, 10.0),
        "distance between supports and the part beside them",
    ),
    count(
        Print,
        "support_material_interface_layers",
        (3, 0, 100),
        "dense layers of supports under the part",
    ),
    count(
        Print,
        "support_material_bottom_interface_layers",
        (-1, -1, 100),
        "dense layers of supports on the part; -1 for as many as above",
    ),
    number(
        Print,
        "support_material_interface_spacing_mm",
        "support_material_interface_spacing",
        (0.0, 0.0, 10.0),
        "space between the lines of these layers",
    ),
    choice(
        Print,
        "support_material_pattern",
        &["rectilinear", "rectilinear-grid", "honeycomb"],
        "how the lines of supports run",
    ),
    number(
        Print,
        "support_material_spacing_mm",
        "support_material_spacing",
        (2.5, 0.1, 50.0),
        "space between the lines of supports",
    ),
    number(
        Print,
        "support_material_angle_deg",
        "support_material_angle",
        (0.0, 0.0, 359.0),
        "direction of the lines of supports, from the part's own front",
    ),
    switch(
        "support_material_with_sheath",
        true,
        "whether a line runs around supports; without, lines are joined along the edge",
    ),
    number(
        Print,
        "support_material_extrusion_width_mm",
        "support_material_extrusion_width",
        (0.4, 0.1, 3.0),
        "width of the lines of supports",
    ),
    number(
        Print,
        "support_material_speed_mm_per_s",
        "support_material_speed",
        (60.0, 0.1, 1000.0),
        "speed of supports",
    ),
    number(
        Print,
        "support_material_interface_speed_mm_per_s",
        "support_material_interface_speed",
        (45.0, 0.1, 1000.0),
        "speed of the dense layers of supports",
    ),
];
