//! The estimators against published numbers, where the folder with the vectors is at hand.

use machine::calibration::Sighting;
use machine::calibration::joint::{Magnet, Noise, Place, Problem, Unknowns, derivatives};
use machine::calibration::pairing::{Pair, huber_mean, match_sides};
use machine::calibration::peaks::{Chord, centroid, chord, log_gauss, threshold_midpoint};
use machine::calibration::pins::{Artefact, Distance, Measure, evaluate};
use machine::calibration::ring::{Drawing, find};
use serde_json::Value;
use std::f64::consts::TAU;

fn vectors() -> Option<Value> {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = manifest.ancestors().nth(3)?.join("shared/vectors/calibration.json");
    let text = std::fs::read_to_string(path).ok()?;
    Some(serde_json::from_str(&text).expect("the vectors are JSON"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number in {value}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list of numbers");
    list.iter().map(|n| n.as_f64().expect("a number")).collect()
}

fn sightings(value: &Value) -> Vec<Sighting> {
    let list = value.as_array().expect("a list");
    list.iter().map(numbers).map(|pair| Sighting::new(pair[0], pair[1])).collect()
}

fn near(measured: f64, expected: f64, within: f64, what: &str) {
    assert!((measured - expected).abs() <= within, "{what}: {measured}, not {expected}");
}

#[test]
fn a_pair() {
    let Some(all) = vectors() else { return };
    let cases = all["pair"].as_array().unwrap();
    assert!(!cases.is_empty());
    for case in cases {
        let [plus, minus] = ["plus", "minus"].map(|key| numbers(&case[key]));
        let pair = Pair::new(
            (0, &Sighting::new(plus[0], plus[1])),
            (1, &Sighting::new(minus[0], minus[1])),
        );
        near(pair.a, number(case, "a"), 1e-9, "a");
        near(pair.b, number(case, "b"), 1e-9, "b");
        near(pair.radius, number(case, "r"), 1e-9, "r");
        near(pair.azimuth, number(case, "alpha"), 1e-9, "alpha");
    }
}

/// The sightings of the published ring, near ones first.
fn published(case: &Value) -> Vec<Sighting> {
    let mut all = sightings(&case["plus_s_theta"]);
    all.extend(sightings(&case["minus_s_theta"]));
    all
}

#[test]
fn a_ring_with_missing_and_loose_magnets() {
    let Some(all) = vectors() else { return };
    let case = &all["ring_fit"];
    let pairs = match_sides(&published(case));
    assert_eq!(pairs.len(), 14);
    let params = &case["params"];
    let (sd_a, sd_b) = (number(params, "sig_a"), number(params, "sig_b"));
    let values = |of: fn(&Pair) -> f64| pairs.iter().map(of).collect::<Vec<_>>();
    let a = huber_mean(&values(|pair| pair.a), sd_a).unwrap();
    let b = huber_mean(&values(|pair| pair.b), sd_b).unwrap();
    near(a, number(case, "a"), 1e-8, "a");
    near(b, number(case, "b"), 1e-8, "b");
    let drawing = Drawing { count: Some(16), radius: 100.0, sd: number(params, "sig") };
    let points: Vec<_> = pairs.iter().map(Pair::over_bed).collect();
    let ring = find(&points, &drawing).unwrap();
    near(ring.centre.x, number(case, "ex"), 1e-8, "ex");
    near(ring.centre.y, number(case, "ey"), 1e-8, "ey");
    near(ring.radius, number(case, "rho"), 1e-8, "rho");
    near(ring.angle, number(case, "psi"), 1e-8, "psi");
    let labels = numbers(&case["labels"]);
    for ((label, expected), is_in) in ring.labels.iter().zip(labels).zip(numbers(&case["inliers"]))
    {
        assert_eq!(label.map(f64::from), (is_in > 0.0).then_some(expected));
    }
}

#[test]
fn all_unknowns_at_once() {
    let Some(all) = vectors() else { return };
    let (ring, case) = (&all["ring_fit"], &all["joint_lm"]);
    let seen = published(ring);
    let magnets = numbers(&ring["labels"])
        .iter()
        .enumerate()
        .map(|(k, label)| Magnet {
            place: Place::Ring { azimuth: TAU * label / 16.0 },
            sightings: vec![seen[k], seen[k + 14]],
        })
        .collect();
    let noise =
        Noise { rail: number(case, "sig_s"), cross: number(case, "sig_t"), placement: None };
    let problem = Problem { magnets, noise, priors: Vec::new(), is_free: [true; 6] };
    let solution = problem.solve(&Unknowns::new(0.3, 0.5, 0.2, -0.2, 100.0, 0.05));
    for (k, expected) in numbers(&case["p"]).into_iter().enumerate() {
        near(solution.unknowns[k], expected, 1e-7, "unknown");
    }
    for (k, expected) in numbers(&case["se"]).into_iter().enumerate() {
        near(solution.errors[k], expected, 1e-7, "error");
    }
}

#[test]
fn how_sightings_change() {
    let Some(all) = vectors() else { return };
    let case = &all["observation_jacobian"];
    let p = Unknowns::from_vec(numbers(&case["p"]));
    let sides = numbers(&case["kappa"]);
    for (k, azimuth) in numbers(&case["beta"]).into_iter().enumerate() {
        let [s, theta] = derivatives(&p, azimuth, sides[k]).unwrap();
        for m in 0..6 {
            near(s[m], numbers(&case["ds"][k])[m], 1e-9, "ds");
            near(theta[m], numbers(&case["dtheta"][k])[m], 1e-9, "dtheta");
        }
    }
}

#[test]
fn the_middle_of_a_saturated_bump() {
    let Some(all) = vectors() else { return };
    let case = &all["peak_estimators"];
    let (x, level) = (numbers(&case["x"]), numbers(&case["B"]));
    let middle = centroid(&x, &level, number(case, "centroid_T")).unwrap();
    near(middle, number(case, "centroid"), 1e-9, "centroid");
    let middle = threshold_midpoint(&x, &level, number(case, "threshold_T")).unwrap();
    near(middle, number(case, "threshold_midpoint"), 1e-9, "threshold");
    let window = numbers(&case["loggauss_window"]);
    let half = level.iter().copied().fold(0.0, f64::max) / 2.0;
    let near_to = threshold_midpoint(&x, &level, half).unwrap();
    let middle = log_gauss(&x, &level, [window[0], window[1]], near_to, 4.0).unwrap();
    near(middle, number(case, "loggauss"), 1e-9, "log-Gaussian");
}

#[test]
fn the_circle_of_a_digital_sensor() {
    let Some(all) = vectors() else { return };
    let case = &all["chord_fit"];
    let chords: Vec<Chord> = numbers(&case["s"])
        .into_iter()
        .zip(numbers(&case["half_angle"]))
        .map(|(s, half_angle)| Chord { s, half_angle })
        .collect();
    let circle = chord(&chords, number(case, "a"), number(case, "b")).unwrap();
    near(circle.magnet_radius, number(case, "r0"), 1e-9, "r0");
    near(circle.switch_radius, number(case, "Rm"), 1e-9, "Rm");
    near(circle.s, number(case, "s0"), 1e-9, "s0");
}

#[test]
fn printed_pins() {
    let Some(all) = vectors() else { return };
    let case = &all["print_and_measure"];
    let artefact =
        Artefact { outer: number(case, "L"), inner: number(case, "l"), ..Artefact::default() };
    let distances = [
        (Measure::Ahead, "D1"),
        (Measure::Behind, "D2"),
        (Measure::Outer, "D_outer"),
        (Measure::Inner, "D_inner"),
    ]
    .map(|(of, key)| Distance { of, mm: number(case, key) });
    let said = evaluate(&artefact, &distances, 0.03).unwrap();
    near(said.a.value, number(case, "a"), 1e-9, "a");
    near(said.b.value, number(case, "b"), 1e-9, "b");
    near(said.shrinkage.value, number(case, "k"), 1e-9, "k");
}
