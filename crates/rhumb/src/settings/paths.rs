//! What is laid in a layer, from settings.

use geom::tolerance::Tolerances;
use machine::profile::Printer;
use slicer::adhesion::AdhesionParams;
use slicer::compensation::CompensationParams;
use slicer::fuzzy::FuzzyParams;
use slicer::infill::{InfillParams, IroningParams, Pattern, SolidPattern};
use slicer::layer::{FirstLayerParams, PathParams};
use slicer::polyhole::PolyholeParams;
use slicer::skins::SkinParams;
use slicer::support::{SupportParams, SupportPattern};
use slicer::thin::ThinParams;
use slicer::walls::WallParams;

use super::lookup::Lookup;

pub(super) fn paths(get: &Lookup<'_>, printer: &Printer, tolerances: &Tolerances) -> PathParams {
    let density = get.number("fill_density");
    PathParams {
        walls: WallParams {
            count: get.count("perimeters"),
            external_width: get.number("external_perimeter_extrusion_width_mm"),
            width: get.number("perimeter_extrusion_width_mm"),
            one_on_top: get.switch("only_one_perimeter_top"),
            more_on_overhangs: get.switch("extra_perimeters"),
        },
        thin: ThinParams {
            least_width: get.number("thin_width_min_mm"),
            least_gap: get.number("gap_width_min_mm"),
            greatest_width: get.number("thin_width_max_mm"),
        },
        skins: SkinParams {
            top_layers: solid_layers(get, "top"),
            bottom_layers: solid_layers(get, "bottom"),
            solid_below_area: get.number("solid_infill_below_area_mm2"),
            all_solid: density >= 1.0,
            solid_every: get.count("solid_infill_every_layers"),
        },
        first_layer: FirstLayerParams {
            width: Some(get.number("first_layer_extrusion_width_mm")).filter(|width| *width > 0.0),
            one_wall: get.switch("only_one_perimeter_first_layer"),
        },
        infill: InfillParams {
            density,
            pattern: pattern(get.text("fill_pattern")),
            solid_pattern: solid_pattern(get.text("solid_fill_pattern")),
            top_pattern: solid_pattern(get.text("top_fill_pattern")),
            angle: get.number("fill_angle_deg").to_radians(),
            width: get.number("infill_extrusion_width_mm"),
            solid_width: get.number("solid_infill_extrusion_width_mm"),
            top_width: get.number("top_infill_extrusion_width_mm"),
            longest_join: get.number("infill_anchor_max_mm"),
            bridge_flow: get.number("bridge_flow_ratio"),
            overlap: get.number("infill_overlap"),
            // Branches lie over each other in every layer.
            every: match get.text("fill_pattern") {
                "lightning" => 1,
                _ => get.count("infill_every_layers"),
            },
            thickest: get.number("nozzle_diameter_mm").min(get.number("infill_extrusion_width_mm")),
            ironing: get.switch("ironing").then(|| IroningParams {
                spacing: get.number("ironing_spacing_mm"),
                flow: get.number("ironing_flow"),
                inset: get.number("top_infill_extrusion_width_mm") / 2.0,
            }),
        },
        adhesion: AdhesionParams {
            skirts: get.count("skirts"),
            skirt_distance: get.number("skirt_distance_mm"),
            brim_width: get.number("brim_width_mm"),
            brim_outside: matches!(get.text("brim_type"), "outer_only" | "outer_and_inner"),
            brim_inside: matches!(get.text("brim_type"), "inner_only" | "outer_and_inner"),
            brim_separation: get.number("brim_separation_mm"),
            reach: printer.rail.max,
        },
        compensation: CompensationParams {
            all: get.number("xy_size_compensation_mm"),
            holes: get.number("hole_size_compensation_mm"),
            first_layer: get.number("elefant_foot_compensation_mm"),
            polyholes: get.switch("hole_to_polyhole").then(|| PolyholeParams {
                threshold: get.number("hole_to_polyhole_threshold_mm"),
                is_twisted: get.switch("hole_to_polyhole_twisted"),
                nozzle: get.number("nozzle_diameter_mm"),
            }),
        },
        fuzzy: get.switch("fuzzy_skin").then(|| FuzzyParams {
            depth: get.number("fuzzy_skin_thickness_mm"),
            step: get.number("fuzzy_skin_point_dist_mm"),
        }),
        support: support(get, printer),
        vase: get.switch("spiral_vase"),
        tolerance: tolerances.simplify_mm(),
    }
}

/// How many solid layers there are at least on this side of the part.
fn solid_layers(get: &Lookup<'_>, side: &str) -> usize {
    /// Rounding of a thickness given in decimals, layers.
    const SLACK: f64 = 1e-6;
    let count = get.count(&format!("{side}_solid_layers"));
    let thickness = get.number(&format!("{side}_solid_min_thickness_mm"));
    let needed = (thickness / get.number("layer_height_mm") - SLACK).ceil().max(0.0) as usize;
    if count == 0 { 0 } else { count.max(needed) }
}

/// How parts are supported, if they are.
fn support(get: &Lookup<'_>, printer: &Printer) -> Option<SupportParams> {
    if !(get.switch("support_material") && get.switch("support_material_auto")) {
        return None;
    }
    let (top_gap, bottom_gap) = (
        get.number("support_material_contact_distance_mm"),
        get.number("support_material_bottom_contact_distance_mm"),
    );
    let top_interface = get.count("support_material_interface_layers");
    let bottom_interface = get.whole("support_material_bottom_interface_layers");
    let bridges = get.switch("dont_support_bridges");
    Some(SupportParams {
        threshold: get.number("support_material_threshold_deg").to_radians(),
        wall_width: get.number("external_perimeter_extrusion_width_mm"),
        on_bed_only: get.switch("support_material_buildplate_only"),
        longest_bridge: if bridges { get.number("max_bridge_length_mm") } else { 0.0 },
        xy_gap: get.number("support_material_xy_spacing_mm"),
        top_gap,
        bottom_gap: if bottom_gap > 0.0 { bottom_gap } else { top_gap },
        top_interface,
        bottom_interface: usize::try_from(bottom_interface).unwrap_or(top_interface),
        width: get.number("support_material_extrusion_width_mm"),
        spacing: get.number("support_material_spacing_mm"),
        interface_spacing: get.number("support_material_interface_spacing_mm"),
        angle: get.number("support_material_angle_deg").to_radians(),
        pattern: match get.text("support_material_pattern") {
            "rectilinear-grid" => SupportPattern::RectilinearGrid,
            "honeycomb" => SupportPattern::Honeycomb,
            _ => SupportPattern::Rectilinear,
        },
        sheath: get.switch("support_material_with_sheath"),
        reach: printer.rail.max,
    })
}

fn pattern(word: &str) -> Pattern {
    match word {
        "alignedrectilinear" => Pattern::AlignedRectilinear,
        "grid" => Pattern::Grid,
        "triangles" => Pattern::Triangles,
        "stars" => Pattern::Stars,
        "cubic" => Pattern::Cubic,
        "lightning" => Pattern::Lightning,
        "gyroid" => Pattern::Gyroid,
        "honeycomb" => Pattern::Honeycomb,
        "concentric" => Pattern::Concentric,
        "archimedeanchords" => Pattern::Archimedean,
        _ => Pattern::Rectilinear,
    }
}

fn solid_pattern(word: &str) -> SolidPattern {
    match word {
        "monotonic" => SolidPattern::Monotonic { joined: true },
        "monotoniclines" => SolidPattern::Monotonic { joined: false },
        "concentric" => SolidPattern::Concentric,
        "archimedeanchords" => SolidPattern::Archimedean,
        _ => SolidPattern::Rectilinear,
    }
}
