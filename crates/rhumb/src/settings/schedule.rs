//! Heights of layers and widths of beads, from settings.

use slicer::level::adaptive::AdaptiveParams;
use slicer::level::{ScheduleParams, Snap};

use super::lookup::Lookup;
use crate::failure::Failure;

pub(super) fn check_layers(get: &Lookup<'_>) -> Result<(), Failure> {
    let (least, greatest) = (get.number("min_layer_height_mm"), get.number("max_layer_height_mm"));
    for name in ["layer_height_mm", "first_layer_height_mm"] {
        let height = get.number(name);
        if height < least || height > greatest {
            return Err(Failure::new(
                "ConfigRange",
                format!(
                    "{name} = {height} is out of range; this printer lays {least} to {greatest} mm"
                ),
            )
            .hint("min_layer_height_mm and max_layer_height_mm belong to the printer settings"));
        }
    }
    let thickest = get.number("layer_height_mm").max(get.number("first_layer_height_mm"));
    let nozzle = get.number("nozzle_diameter_mm");
    for (name, width) in widths(get) {
        // Below its thickness a line is no bead, above about three bores it does not form one.
        if width < thickest || width > 3.0 * nozzle {
            return Err(Failure::new(
                "ConfigRange",
                format!(
                    "{name} = {width} is out of range; layers of {thickest} mm and a nozzle of \
                     {nozzle} mm give beads from {thickest} to {} mm",
                    3.0 * nozzle
                ),
            ));
        }
    }
    let (thinnest, widest) = (get.number("thin_width_min_mm"), get.number("thin_width_max_mm"));
    if thinnest >= widest {
        return Err(Failure::new(
            "ConfigConflict",
            format!("thin_width_min_mm = {thinnest} is not below thin_width_max_mm = {widest}"),
        ));
    }
    Ok(())
}

const WIDTHS: [&str; 5] = [
    "external_perimeter_extrusion_width_mm",
    "perimeter_extrusion_width_mm",
    "infill_extrusion_width_mm",
    "solid_infill_extrusion_width_mm",
    "top_infill_extrusion_width_mm",
];

/// The widths of beads that a print has.
fn widths(get: &Lookup<'_>) -> impl Iterator<Item = (&'static str, f64)> {
    let support = Some("support_material_extrusion_width_mm");
    let support = support.filter(|_| get.switch("support_material"));
    let first = Some("first_layer_extrusion_width_mm").filter(|name| get.number(name) > 0.0);
    WIDTHS.into_iter().chain(support).chain(first).map(|name| (name, get.number(name)))
}

pub(super) fn schedule(get: &Lookup<'_>) -> Result<ScheduleParams, Failure> {
    // A bead is no bead when it is thicker than wide.
    let narrowest = widths(get).map(|(_, width)| width).fold(f64::INFINITY, f64::min);
    let params = ScheduleParams {
        first_layer_height: get.number("first_layer_height_mm"),
        layer_height: get.number("layer_height_mm"),
        least_height: get.number("min_layer_height_mm"),
        greatest_height: get.number("max_layer_height_mm").min(narrowest),
        increment: get.number("z_increment_mm"),
        snap: match get.text("snap") {
            "greedy" => Snap::Greedy,
            "off" => Snap::Off,
            _ => Snap::Optimal,
        },
        adaptive: get.switch("adaptive").then(|| AdaptiveParams {
            cusp: get.number("cusp_mm"),
            area_share: get.number("cusp_area_share"),
            growth: CAP_GROWTH,
        }),
    };
    if params.snap == Snap::Optimal || params.adaptive.is_some() {
        check_increment(&params)?;
    }
    Ok(params)
}

/// How much thicker layers of an adaptive schedule may become per mm of height: a layer of 0.2 mm
/// is followed by one of at most 0.22 mm. More, and the change is seen on the part; less, and thin
/// layers reach far beyond the slope that asks for them.
const CAP_GROWTH: f64 = 0.1;

fn check_increment(params: &ScheduleParams) -> Result<(), Failure> {
    let (least, greatest) = (params.least_height, params.greatest_height);
    // Limits may be off by the rounding of their decimals.
    const NOISE: f64 = 1e-6;
    let thickest = (greatest / params.increment + NOISE).floor() * params.increment;
    if thickest + NOISE * params.increment < least {
        return Err(Failure::new(
            "ConfigConflict",
            format!(
                "no multiple of z_increment_mm = {} lies between {least} and {greatest} mm, the \
                 limits of a layer",
                params.increment
            ),
        )
        .hint("min_layer_height_mm and max_layer_height_mm belong to the printer settings"));
    }
    Ok(())
}
