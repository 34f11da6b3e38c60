//! Schedules: the published plans, and what holds for stepped blocks of any kind.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rayon::prelude::*;
use serde_json::Value;
use slicer::level::adaptive::{AdaptiveParams, Slope, caps_of};
use slicer::level::greedy::{CloseFaces, Rule, corrected};
use slicer::level::optimal::{Aim, Face, Problem, fills, plan};
use slicer::level::{Extent, FlatFace, Increments, Level, ScheduleParams, Snap, misses, schedule};

/// The vectors, from a `shared/vectors` folder beside the repository; `None` in a plain clone.
fn vectors() -> Option<Value> {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = manifest.ancestors().nth(3)?.join("shared/vectors/layer_heights.json");
    Some(serde_json::from_str(&std::fs::read_to_string(path).ok()?).unwrap())
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number in {value}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn gaps_that_no_layers_fill() {
    let Some(vectors) = vectors() else { return };
    for hole in vectors["holes"].as_array().unwrap() {
        let (a, b) = (number(hole, "a") as u32, number(hole, "b") as u32);
        let uncoverable: Vec<Vec<f64>> =
            hole["uncoverable"].as_array().unwrap().iter().map(numbers).collect();
        for gap in 1..number(hole, "all_from") as u32 + 200 {
            let inside = |r: &Vec<f64>| r[0] <= f64::from(gap) && f64::from(gap) <= r[1];
            let listed = uncoverable.iter().any(inside);
            assert_eq!(fills(gap, a, b), !listed, "{gap} with {a} to {b}");
        }
    }
}

/// A case of the vectors in increments.
struct Case<'a> {
    value: &'a Value,
    grid: Increments,
    faces: Vec<Face>,
    aim: Aim,
    caps: Vec<u32>,
}

impl<'a> Case<'a> {
    fn read(value: &'a Value) -> Self {
        let dz = number(value, "dz");
        let units = |key: &str| (number(value, key) / dz).round() as u32;
        let face = |level: f64| Face { at_milli: (level / dz * 1000.0).round() as i64, weight: 1 };
        let caps = value["cap"].as_array().into_iter().flatten();
        Self {
            value,
            grid: Increments { size: dz, least: units("hmin"), greatest: units("hmax") },
            faces: numbers(&value["flats"]).into_iter().map(face).collect(),
            aim: match value["nominal"].as_f64() {
                Some(height) => Aim::Nominal {
                    height_milli: (height / dz * 1000.0).round() as u64,
                    layer_cost: 0,
                },
                None => Aim::Fewest,
            },
            caps: caps.map(|cap| cap.as_u64().unwrap() as u32).collect(),
        }
    }

    fn plan(&self) -> Vec<u32> {
        plan(&Problem {
            top: (number(self.value, "H") / self.grid.size).round() as u32,
            end_slack: 0,
            first: self.value["first"].as_f64().map(|h| (h / self.grid.size).round() as u32),
            least: self.grid.least,
            greatest: self.grid.greatest,
            aim: self.aim,
            faces: &self.faces,
            miss_milli: 1000,
            caps: &self.caps,
        })
    }

    /// The cost of some heights as the vectors count it, worked out from the bounds alone.
    fn cost(&self, heights: &[u32]) -> [f64; 3] {
        let mut bounds = vec![0.0];
        for height in heights {
            bounds.push(bounds.last().unwrap() + f64::from(*height));
        }
        let miss = |face: &Face| {
            let at = face.at_milli as f64 / 1000.0;
            let error = bounds.iter().map(|b| (b - at).abs()).fold(f64::INFINITY, f64::min);
            error + if error > 0.5 { 1.0 } else { 0.0 }
        };
        let faces = self.faces.iter().map(miss).sum();
        let n = heights.len() as f64;
        let squares = |about: f64| heights.iter().map(|h| (f64::from(*h) - about).powi(2)).sum();
        match self.aim {
            Aim::Fewest => [faces, n, squares(0.0)],
            Aim::Nominal { height_milli, .. } => [faces, squares(height_milli as f64 / 1000.0), n],
        }
    }
}

#[test]
fn published_plans() {
    let Some(vectors) = vectors() else { return };
    let cases = vectors["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 37);
    for value in cases {
        let case = Case::read(value);
        let heights = case.plan();
        let id = &value["id"];
        assert_eq!(heights.len() as f64, number(value, "dp_n"), "{id}");
        let wanted = numbers(&value["dp_cost"]);
        for (found, wanted) in case.cost(&heights).iter().zip(&wanted) {
            assert!((found - wanted).abs() < 1e-6, "{id}: {found} is not {wanted}");
        }
        let first = usize::from(value["first"].is_f64());
        for height in &heights[first..] {
            assert!((case.grid.least..=case.grid.greatest).contains(height), "{id}");
        }
    }
}

#[test]
fn published_failures_of_the_greedy_rule() {
    let Some(vectors) = vectors() else { return };
    let mut seen = 0;
    for value in vectors["cases"].as_array().unwrap() {
        if value["greedy_errors"].is_null() {
            continue;
        }
        seen += 1;
        let (height, top) = (number(value, "h_nominal"), number(value, "H"));
        let flats = numbers(&value["flats"]);
        let n = (top / height).ceil() as usize + flats.len() + 2;
        let even: Vec<f64> = (0..n).map(|i| height * i as f64).collect();
        // These plans look at every face and know no increment.
        let rule = Rule {
            least: number(value, "hmin"),
            greatest: number(value, "hmax"),
            increment: 0.0,
            close: CloseFaces::Chased,
        };
        let planes = corrected(&even, &flats, &rule);
        let error = |flat: &f64| planes.iter().map(|z| (z - flat).abs()).fold(f64::MAX, f64::min);
        for (found, wanted) in flats.iter().map(error).zip(numbers(&value["greedy_errors"])) {
            assert!((found - wanted).abs() < 1e-6, "{}: {found} is not {wanted}", value["id"]);
        }
    }
    assert_eq!(seen, 6);
}

#[test]
fn published_caps() {
    let Some(vectors) = vectors() else { return };
    let cases = vectors["cases"].as_array().unwrap();
    let value = cases.iter().find(|case| case["id"] == "adaptive_dome").unwrap();
    let case = Case::read(value);
    let facets: Vec<Vec<f64>> = value["facets"].as_array().unwrap().iter().map(numbers).collect();
    let slopes =
        facets.par_iter().map(|f| Slope { lower: f[0], upper: f[1], cosine: f[2], area: 1.0 });
    let params =
        AdaptiveParams { cusp: number(value, "cusp_eps"), area_share: 0.0, growth: f64::INFINITY };
    assert_eq!(caps_of(slopes, number(value, "H"), &case.grid, &params), case.caps);
}

/// Numbers that look random and are the same on every run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 33) % n
    }
}

/// A stepped block: its flats with areas, and the limits it is printed with.
fn block(numbers: &mut Numbers) -> (Vec<FlatFace>, ScheduleParams) {
    let increment = [0.01, 0.005, 0.02][numbers.below(3) as usize];
    let limits = [(0.1, 0.3), (0.04, 0.32), (0.12, 0.28)];
    let (least_height, greatest_height) = limits[numbers.below(3) as usize];
    let mut level = 1.0;
    let n = 2 + numbers.below(8);
    let mut flat = |_| {
        // A third of the steps are lower than the thinnest layer, or nearly.
        let step = if numbers.below(3) == 0 { numbers.below(80) } else { numbers.below(3000) };
        level += 0.01 + step as f64 / 1000.0;
        FlatFace { level, area: 1.0 + numbers.below(400) as f64 }
    };
    let flats = (0..n).map(&mut flat).collect();
    let params = ScheduleParams {
        first_layer_height: 0.2,
        layer_height: 0.2,
        least_height,
        greatest_height,
        increment,
        snap: Snap::Optimal,
        adaptive: None,
    };
    (flats, params)
}

fn levels(flats: &[FlatFace], params: &ScheduleParams) -> Vec<Level> {
    let top = flats.last().unwrap().level;
    schedule(&Extent { top, flats, caps: &[] }, params)
}

/// Error over all flats, by area; what lies within half an increment is met.
fn error(levels: &[Level], flats: &[FlatFace], increment: f64) -> f64 {
    let beyond = |miss: f64| if miss <= increment / 2.0 + 1e-9 { 0.0 } else { miss };
    misses(levels, flats).iter().zip(flats).map(|(miss, flat)| beyond(*miss) * flat.area).sum()
}

/// The least number of layers that meet the flats of a block as well as can be.
fn fewest(flats: &[FlatFace], params: &ScheduleParams) -> usize {
    // Slopes that bear anything: what is left of an adaptive schedule is its aim.
    let adaptive = AdaptiveParams { cusp: 1.0, area_share: 0.0, growth: 1.0 };
    levels(flats, &ScheduleParams { adaptive: Some(adaptive), ..*params }).len()
}

#[test]
fn stepped_blocks_are_never_worse_than_by_the_greedy_rule() {
    let mut numbers = Numbers(7);
    let (mut better, mut met, mut met_by_greedy, mut exceptions) = (0, 0, 0, 0);
    for k in 0..200 {
        let (flats, params) = block(&mut numbers);
        let optimal = levels(&flats, &params);
        let greedy = levels(&flats, &ScheduleParams { snap: Snap::Greedy, ..params });
        let errors = [&optimal, &greedy].map(|levels| error(levels, &flats, params.increment));
        let round_off = params.increment / 2.0 * flats.iter().map(|f| f.area).sum::<f64>();
        assert!(errors[0] <= errors[1] + round_off, "{k}: {errors:?}");
        better += usize::from(errors[0] < errors[1] - round_off);
        met += usize::from(errors[0] == 0.0);
        met_by_greedy += usize::from(errors[1] == 0.0);
        if optimal.len() > greedy.len() {
            // A face that the rule misses cannot always be met without a layer more.
            exceptions += 1;
            assert!(errors[0] < errors[1], "{k}");
            assert!(fewest(&flats, &params) > greedy.len(), "{k}");
        }
        for level in &optimal[1..] {
            let steps = level.thickness() / params.increment;
            assert!((steps - steps.round()).abs() < 1e-6, "{k}: {level:?}");
            assert!(level.thickness() >= params.least_height - 1e-9, "{k}: {level:?}");
            assert!(level.thickness() <= params.greatest_height + 1e-9, "{k}: {level:?}");
        }
    }
    assert!(exceptions <= 2, "{exceptions} of 200");
    assert!(better > 50 && met > met_by_greedy, "{better} {met} {met_by_greedy}");
}
