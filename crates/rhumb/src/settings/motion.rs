//! How lines are ordered, laid and travelled to, from settings.

use geom::tolerance::Tolerances;
use machine::gcode::Dialect;
use plan::acceleration::Accelerations;
use plan::cooling::CoolingParams;
use plan::order::{OrderParams, WallOrder};
use plan::planner::{HeatParams, PlanParams};
use plan::resample::ResampleParams;
use plan::route::{FilamentParams, Speeds};
use plan::scarf::{ScarfParams, ScarfPlacement};
use plan::seam::SeamPosition;
use plan::tilt::TiltParams;
use slicer::clearance::{LayerOrder, NozzleProfile, Uphill};

use super::lookup::Lookup;
use super::resolve::conflict;
use super::{head, surface};
use crate::failure::Failure;
use crate::stages::LayerKind;

/// How far combed travel keeps from outlines, as a share of the width of the outermost bead.
const COMB_SHARE: f64 = 0.4;

pub(super) fn plan(
    get: &Lookup<'_>,
    dialect: Dialect,
    tolerances: &Tolerances,
) -> Result<PlanParams, Failure> {
    let curved = surface::layers(get) != LayerKind::Planar;
    let diameter = get.number("filament_diameter_mm");
    Ok(PlanParams {
        order: OrderParams {
            seam: match get.text("seam_position") {
                "nearest" => SeamPosition::Nearest,
                "rear" => SeamPosition::Rear(get.number("seam_angle_deg").to_radians()),
                "random" => SeamPosition::Random,
                "corner" => SeamPosition::Corner,
                _ => SeamPosition::Aligned,
            },
            infill_first: get.switch("infill_first"),
            walls: wall_order(get)?,
            uphill: curved,
        },
        speeds: Speeds {
            external_perimeter: get.number("external_perimeter_speed_mm_per_s"),
            perimeter: get.number("perimeter_speed_mm_per_s"),
            small_perimeter: get.number("small_perimeter_speed_mm_per_s"),
            infill: get.number("infill_speed_mm_per_s"),
            solid_infill: get.number("solid_infill_speed_mm_per_s"),
            top_solid_infill: get.number("top_solid_infill_speed_mm_per_s"),
            gap_fill: get.number("gap_fill_speed_mm_per_s"),
            bridge: get.number("bridge_speed_mm_per_s"),
            overhang: [3, 2, 1, 0].map(|k| get.number(&format!("overhang_speed_{k}_mm_per_s"))),
            ironing: get.number("ironing_speed_mm_per_s"),
            support: [
                get.number("support_material_speed_mm_per_s"),
                get.number("support_material_interface_speed_mm_per_s"),
            ],
            first_layer: get.number("first_layer_speed_mm_per_s"),
            travel: get.number("travel_speed_mm_per_s"),
        },
        filament: FilamentParams {
            area: std::f64::consts::FRAC_PI_4 * diameter * diameter,
            multiplier: get.number("extrusion_multiplier"),
            volume_per_second: get.number("max_volumetric_speed_mm3_per_s"),
            least_flow: get.number("min_volumetric_speed_mm3_per_s"),
            retract_length: get.number("retract_length_mm"),
            restart_extra: get.number("retract_restart_extra_mm"),
            retract_speed: get.number("retract_speed_mm_per_s"),
            feed_speed: match get.number("deretract_speed_mm_per_s") {
                0.0 => get.number("retract_speed_mm_per_s"),
                speed => speed,
            },
            retract_between_layers: get.switch("retract_layer_change"),
            retract_before_travel: get.number("retract_before_travel_mm"),
            retract_lift: get.number("retract_lift_mm"),
            wipe: get.number("wipe_mm"),
            // Within the half of the outermost bead, so that its own ends are inside.
            comb: get
                .switch("avoid_crossing_perimeters")
                .then(|| COMB_SHARE * get.number("external_perimeter_extrusion_width_mm")),
        },
        resample: ResampleParams {
            chord: tolerances.chord_mm(),
            travel_chord: get.number("travel_chord_mm"),
            dialect,
            azimuth: 0.0,
        },
        accelerations: accelerations(get),
        scarf: scarf(get),
        cooling: CoolingParams {
            least_layer_time: get.number("slowdown_below_layer_time_s"),
            least_speed: get.number("min_print_speed_mm_per_s"),
        },
        heat: HeatParams {
            first_layer_temperature: get.number("first_layer_temperature_c"),
            temperature: get.number("temperature_c"),
            fan: get.number("fan_speed"),
            bridge_fan: get.number("bridge_fan_speed"),
            least_fan: get.number("min_fan_speed"),
            short_layer: get.number("slowdown_below_layer_time_s"),
            long_layer: get.number("fan_below_layer_time_s"),
            layers_without_fan: get.count("disable_fan_first_layers"),
            full_fan_layer: get.count("full_fan_speed_layer"),
        },
        curved,
        tilt: TiltParams { tilt: head::tilt(get), clears: clears(get) },
    })
}

/// In which order walls come: by the name that PrusaSlicer has for it, or by that of OrcaSlicer.
fn wall_order(get: &Lookup<'_>) -> Result<WallOrder, Failure> {
    let external_first = get.switch("external_perimeters_first");
    match get.text("wall_sequence") {
        word @ "inner-outer-inner" if external_first => {
            Err(conflict("external_perimeters_first says another order than wall_sequence", word))
        }
        "inner-outer-inner" => Ok(WallOrder::InnerOuterInner),
        "outer-inner" => Ok(WallOrder::OutsideIn),
        _ if external_first => Ok(WallOrder::OutsideIn),
        _ => Ok(WallOrder::InsideOut),
    }
}

/// The steepest slope that a nozzle clears, seen from its own axis, radians.
fn clears(get: &Lookup<'_>) -> f64 {
    let uphill = Uphill {
        extent: f64::INFINITY,
        thickness: get.number("layer_height_mm"),
        allowance: crate::stages::GOUGE_MM,
        order: LayerOrder::LowToHigh,
    };
    nozzle(get).steepest(&uphill)
}

pub(super) fn nozzle(get: &Lookup<'_>) -> NozzleProfile {
    NozzleProfile {
        flat_radius: get.number("nozzle_flat_radius_mm"),
        half_angle: get.number("nozzle_half_angle_deg").to_radians(),
        block_height: get.number("nozzle_block_height_mm"),
        block_radius: get.number("nozzle_block_radius_mm"),
    }
}

fn accelerations(get: &Lookup<'_>) -> Accelerations {
    let of = |what: &str| get.number(&format!("{what}_acceleration_mm_per_s2"));
    Accelerations {
        external_perimeter: of("external_perimeter"),
        perimeter: of("perimeter"),
        infill: of("infill"),
        solid_infill: of("solid_infill"),
        top_solid_infill: of("top_solid_infill"),
        bridge: of("bridge"),
        first_layer: of("first_layer"),
        travel: of("travel"),
        usual: of("default"),
    }
}

fn scarf(get: &Lookup<'_>) -> ScarfParams {
    ScarfParams {
        placement: match get.text("scarf_seam_placement") {
            "contours" => ScarfPlacement::Contours,
            "everywhere" => ScarfPlacement::Everywhere,
            _ => ScarfPlacement::Nowhere,
        },
        inner: get.switch("scarf_seam_on_inner_perimeters"),
        start: get.number("scarf_seam_start_height"),
        length: get.number("scarf_seam_length_mm"),
        entire: get.switch("scarf_seam_entire_loop"),
        piece: get.number("scarf_seam_max_segment_length_mm"),
    }
}
