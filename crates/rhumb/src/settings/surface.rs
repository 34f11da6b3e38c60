//! The surfaces that layers follow: one for the whole part, or ranges of heights.

use super::lookup::Lookup;
use super::ranges::{self, Word};
use super::resolve::conflict;
use crate::failure::Failure;
use crate::ranges::{Follows, Span};
use crate::stages::LayerKind;

/// The surface of the layers; of ranges the first that is curved.
pub(super) fn layers(get: &Lookup<'_>) -> LayerKind {
    let families = spans(get).into_iter().filter_map(|span| match span.follows {
        Follows::Family(kind) => Some(kind),
        Follows::Blend => None,
    });
    let curved = families.into_iter().find(|kind| *kind != LayerKind::Planar);
    curved.unwrap_or_else(|| family(get.text("layers"), get))
}

fn family(word: &str, get: &Lookup<'_>) -> LayerKind {
    match word {
        "conical" => LayerKind::Conical(get.number("cone_angle_deg").to_radians()),
        "spherical" => LayerKind::Spherical(get.number("sphere_centre_mm")),
        "caps" => LayerKind::Caps(get.number("cap_radius_mm")),
        _ => LayerKind::Planar,
    }
}

/// The ranges of heights; none where one surface serves all.
pub(super) fn spans(get: &Lookup<'_>) -> Vec<Span> {
    let text = get.text("layers");
    if !ranges::is_ranges(text) {
        return Vec::new();
    }
    // What cannot be read was refused where it was set.
    let ranges = ranges::parse(text).unwrap_or_default();
    let span = |range: &ranges::Range| Span {
        follows: match range.word {
            Word::Blend => Follows::Blend,
            word => Follows::Family(family(word.text(), get)),
        },
        from: range.from,
        to: range.to,
    };
    ranges.iter().map(span).collect()
}

/// Planar layers under curved ones: so many, and all that end below where curved ones are to begin.
pub(super) fn base_layers(get: &Lookup<'_>) -> usize {
    // Heights are sums of decimals.
    const NOISE: f64 = 1e-6;
    let above_first = get.number("curved_from_mm") - get.number("first_layer_height_mm");
    let height = get.number("layer_height_mm");
    let below =
        if above_first > -NOISE { 1.0 + (above_first / height + NOISE).floor() } else { 0.0 };
    get.count("base_layers").max(below as usize)
}

/// What goes with some surfaces alone: turns of a vase go over into each other where layers are alike.
pub(super) fn check(get: &Lookup<'_>) -> Result<(), Failure> {
    let text = get.text("layers");
    if ranges::is_ranges(text) {
        return check_ranges(get);
    }
    if !get.switch("spiral_vase") {
        return Ok(());
    }
    if get.switch("support_material") {
        return Err(conflict("spiral_vase has no supports", "support_material = true"));
    }
    if text != "planar" && get.text("blend") == "morph" {
        return Err(conflict("spiral_vase climbs on layers that are all alike", "blend = morph"));
    }
    if ["planar", "conical", "caps"].contains(&text) {
        return Ok(());
    }
    Err(conflict("spiral_vase climbs on layers that are all alike (planar, conical, caps)", text))
}

/// Ranges say for themselves what others settings say of one surface.
fn check_ranges(get: &Lookup<'_>) -> Result<(), Failure> {
    let refuse = |what: &str, value: &str, instead: &str| {
        Err(conflict(what, value).hint(format!("give layers a range instead: {instead}")))
    };
    if get.switch("spiral_vase") {
        return Err(conflict(
            "spiral_vase climbs on layers that are all alike",
            get.text("layers"),
        ));
    }
    if get.text("blend") != "none" {
        return refuse("ranges of layers say where blends lie", "blend = morph", "blend:8-14");
    }
    if get.number("curved_from_mm") > 0.0 {
        return refuse(
            "ranges of layers say where curved ones begin",
            "curved_from_mm",
            "planar:0-8",
        );
    }
    if get.text("top") == "planar" {
        return refuse("ranges of layers say where planar ones are", "top = planar", "planar:20-");
    }
    Ok(())
}
