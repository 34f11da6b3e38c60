//! Curves against published numbers, where the folder with the vectors is at hand.

use geom::spherical::{Loxodrome, spiral_length, spiral_turned, turns_for};
use serde_json::Value;

/// The vectors, from a `shared/vectors` folder beside the repository; `None` in a plain clone.
fn vectors(name: &str) -> Option<Value> {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = manifest.ancestors().nth(3)?.join("shared/vectors").join(name);
    let text = std::fs::read_to_string(path).ok()?;
    Some(serde_json::from_str(&text).expect("the vectors are JSON"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number in {value}"))
}

/// The radius of a parallel at the distance `rho` from the axis along the meridian.
fn radius(case: &Value, rho: f64) -> f64 {
    match case["R"].as_f64() {
        Some(sphere) => sphere * (rho / sphere).sin(),
        None => rho * number(case, "cos_alpha"),
    }
}

#[test]
fn lengths_of_spirals_and_back() {
    let Some(vectors) = vectors("spirals.json") else { return };
    let cases = vectors["arc_length"].as_array().expect("cases");
    assert_eq!(cases.len(), 40);
    for case in cases {
        let (pitch, theta) = (number(case, "h"), number(case, "theta"));
        let length = spiral_length(pitch, theta, |rho| radius(case, rho));
        let expected = number(case, "length");
        assert!((length / expected - 1.0).abs() < 1e-8, "{length}: {case}");
        let third = spiral_turned(pitch, length / 3.0, theta, |rho| radius(case, rho));
        let expected = number(case, "theta_at_third");
        assert!((third / expected - 1.0).abs() < 1e-8, "{third}: {case}");
    }
}

#[test]
fn turns_of_loxodromes_and_of_spherical_spirals() {
    let Some(vectors) = vectors("spirals.json") else { return };
    let loxodrome = &vectors["loxodrome"];
    let (slope, sphere) = (number(loxodrome, "k"), number(loxodrome, "R"));
    let curve = Loxodrome { radius: sphere, slope, meridian: 0.0 };
    for place in loxodrome["spacing"].as_array().expect("places") {
        // The vectors count from a pole towards the equator, the curve from the equator up.
        let latitude = number(place, "psi_deg").to_radians() - std::f64::consts::FRAC_PI_2;
        let spacing = curve.spacing(latitude.tan().asinh() / slope);
        assert!((spacing / number(place, "ds") - 1.0).abs() < 1e-8, "{spacing}: {place}");
    }
    let turns = &vectors["turns"];
    let (sphere, width) = (number(turns, "R"), number(turns, "h"));
    let right = turns_for(sphere, width);
    assert!((right / number(turns, "turns_pole_to_pole") - 1.0).abs() < 1e-12);
    // What the source's example says leaves gaps between beads.
    let claimed = std::f64::consts::PI * sphere / number(turns, "thesis_claim");
    assert!((claimed / number(turns, "spacing_if_100_turns") - 1.0).abs() < 1e-12);
}
