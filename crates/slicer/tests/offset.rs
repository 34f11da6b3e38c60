//! Offsets at true distances: published numbers, where at hand, and properties.

use std::f64::consts::TAU;

use geom::grid::mm;
use geom::polyline::distance_to_segment;
use geom::region::{Fill, Region, ring_sides};
use mesh::topology::Solid;
use nalgebra::{Point2, Vector2};
use serde_json::Value;
use slicer::chart::{Chart, carried};
use slicer::section::Cutter;
use slicer::surface::{Cone, LayerSurface};

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

fn list(value: &Value) -> &Vec<Value> {
    value.as_array().expect("a list")
}

fn chart(surface: &Value) -> Chart {
    match surface["kind"].as_str().expect("a kind") {
        "cone" => Chart::cone(number(surface, "alpha_deg").to_radians()),
        "sphere" => Chart::Sphere { radius: number(surface, "R") },
        _ => Chart::Plane,
    }
}

fn region(rings: &[Vec<Point2<f64>>]) -> Region {
    Region::from_rings(rings.iter().map(Vec::as_slice), Fill::Positive)
}

/// True distance of a point from the border of a region.
fn distance_to_border(chart: &Chart, region: &Region, p: &Point2<f64>) -> f64 {
    let mut nearest = f64::INFINITY;
    for (a, b) in region.rings().flat_map(|ring| ring_sides(ring)) {
        let (a, b) = (mm(a), mm(b));
        // True distances are at least half of those in these charts.
        if distance_to_segment(&a, &b, p) > 2.0 * nearest {
            continue;
        }
        let at = |t: f64| chart.distance(&(a + (b - a) * t), p);
        // Coarse samples, then ternary search about the best of them.
        const SAMPLES: i32 = 12;
        let best = (0..=SAMPLES)
            .map(|k| f64::from(k) / f64::from(SAMPLES))
            .min_by(|x, y| at(*x).total_cmp(&at(*y)))
            .expect("samples");
        let step = 1.0 / f64::from(SAMPLES);
        let (mut low, mut high) = ((best - step).max(0.0), (best + step).min(1.0));
        for _ in 0..40 {
            let (x, y) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if at(x) < at(y) { high = y } else { low = x }
        }
        nearest = nearest.min(at(f64::midpoint(low, high)));
    }
    nearest
}

#[test]
fn walks_end_where_published() {
    let Some(all) = vectors("offset_expmap.json") else { return };
    let cases = list(&all["cases"]);
    assert_eq!(cases.len(), 72);
    for case in cases {
        let chart = chart(&case["surface"]);
        let place = |s: f64, theta: f64| Point2::new(s * theta.cos(), s * theta.sin());
        let (sin, cos) = number(case, "dir_from_meridian").sin_cos();
        let from = place(number(case, "s"), number(case, "theta"));
        let to = chart.walk(&from, &Vector2::new(cos, sin), number(case, "w"));
        let expected = place(number(case, "s_out"), number(case, "theta_out"));
        assert!((to - expected).norm() < 1e-9, "{to}: {case}");
        let distance = chart.distance(&from, &to);
        assert!((distance - number(case, "geodesic_distance_check")).abs() < 1e-9, "{case}");
        let stretch = chart.stretch(from.coords.norm());
        assert!((stretch - number(case, "lambda_tangential")).abs() < 1e-9, "{case}");
    }
}

#[test]
fn insets_as_published() {
    let Some(all) = vectors("offset_rings.json") else { return };
    let cases = list(&all["cases"]);
    assert_eq!(cases.len(), 36);
    for case in cases {
        let chart = chart(&case["surface"]);
        let coordinate = |v: &Value| v.as_f64().expect("a coordinate");
        let point = |p: &Value| Point2::new(coordinate(&p[0]), coordinate(&p[1]));
        let rings: Vec<Vec<Point2<f64>>> =
            list(&case["rings"]).iter().map(|r| list(r).iter().map(point).collect()).collect();
        let (shape, w) = (region(&rings), number(case, "w"));
        let name = format!("{} {} w {w}", case["id"], case["surface"]);
        let area = chart.area(&shape);
        assert!((area / number(case, "in_area") - 1.0).abs() < 1e-5, "{name}: {area}");
        let inset = chart.inset(&shape, w);
        assert_eq!(
            inset.rings().count() as u64,
            case["n_out"].as_u64().expect("a number"),
            "{name}"
        );
        let (area, expected) = (chart.area(&inset), number(case, "out_area"));
        let limit = if w < 1.0 { 0.003 } else { 0.005 };
        assert!((area / expected - 1.0).abs() < limit, "{name}: {area} is not {expected}");
        for p in inset.rings().flatten() {
            let distance = distance_to_border(&chart, &shape, &mm(*p));
            assert!((distance / w - 1.0).abs() < 0.02, "{name}: {distance} at {}", mm(*p));
        }
    }
}

fn polygon(points: &[[f64; 2]]) -> Region {
    region(&[points.iter().map(|p| Point2::from(*p)).collect()])
}

/// Shapes on, around and beside the axis.
fn shapes() -> Vec<(&'static str, Region)> {
    let star: Vec<[f64; 2]> = (0..24)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * TAU / 24.0).sin_cos();
            let radius = if k % 2 == 0 { 20.0 } else { 12.0 };
            [radius * cos, radius * sin]
        })
        .collect();
    let circle = |x: f64, y: f64, r: f64, n: u32| -> Vec<[f64; 2]> {
        (0..n)
            .map(|k| {
                let (sin, cos) = (f64::from(k) * TAU / f64::from(n)).sin_cos();
                [x + r * cos, y + r * sin]
            })
            .collect()
    };
    vec![
        ("square", polygon(&[[-15.0, -15.0], [15.0, -15.0], [15.0, 15.0], [-15.0, 15.0]])),
        ("beside", polygon(&[[5.0, -8.0], [25.0, -8.0], [25.0, 12.0], [5.0, 12.0]])),
        ("star", polygon(&star)),
        ("circle", polygon(&circle(9.0, 4.0, 8.0, 200))),
        (
            "frame",
            polygon(&circle(0.0, 0.0, 22.0, 400))
                .difference(&polygon(&circle(1.0, 0.0, 11.0, 300))),
        ),
    ]
}

fn charts() -> [(&'static str, Chart); 5] {
    [
        ("cone 10", Chart::cone(10_f64.to_radians())),
        ("cone 30", Chart::cone(30_f64.to_radians())),
        ("cone 45", Chart::cone(45_f64.to_radians())),
        ("sphere 30", Chart::Sphere { radius: 30.0 }),
        ("sphere 60", Chart::Sphere { radius: 60.0 }),
    ]
}

#[test]
fn both_ways_keep_the_true_distance() {
    for (chart_name, chart) in charts() {
        for (name, shape) in shapes() {
            for distance in [0.225, 0.9] {
                let results = [
                    chart.inset(&shape, distance),
                    chart.outset(&shape, distance),
                    chart.inset_with_loss(&shape, distance).0,
                ];
                for result in results {
                    result.check();
                    for p in result.rings().flatten().step_by(1 + result.point_count() / 60) {
                        let found = distance_to_border(&chart, &shape, &mm(*p));
                        let off = (found - distance).abs();
                        assert!(off < 0.004, "{name}, {chart_name}, {distance}: off by {off}");
                    }
                }
            }
        }
    }
}

#[test]
fn sides_between_points_keep_the_distance_too() {
    for (chart_name, chart) in charts() {
        for (name, shape) in shapes() {
            let inset = chart.inset(&shape, 0.9);
            let sides = inset.rings().flat_map(|ring| ring_sides(ring));
            for (a, b) in sides.step_by(1 + inset.point_count() / 120) {
                let middle = nalgebra::center(&mm(a), &mm(b));
                let off = (distance_to_border(&chart, &shape, &middle) - 0.9).abs();
                assert!(off < 0.006, "{name}, {chart_name}: off by {off} at {middle}");
            }
        }
    }
}

#[test]
fn a_thick_region_loses_nothing_and_opens_to_itself() {
    for (chart_name, chart) in charts() {
        for (name, shape) in shapes() {
            let (inset, loss) = chart.inset_with_loss(&shape, 0.45);
            assert!(loss.abs() < 0.01, "{name}, {chart_name}: {loss}");
            assert!(!inset.is_empty());
            let back = chart.outset_sharp(&inset.thinned(0.01), 0.47);
            let missed = shape.difference(&back).area();
            assert!(missed < 0.002, "{name}, {chart_name}: {missed} mm² of corners");
            let opened = chart.opened(&shape, 0.45);
            let corners = shape.area() - opened.area();
            let in_plane = shape.area() - shape.opened(0.45).area();
            // Corners are sharper or blunter than the chart shows them: on a cone of 45° a right
            // angle across the meridian is one of 71°, which loses 2.1 times as much, and the
            // chart shows that 1.4 times as large.
            let range = -0.01..3.1 * in_plane + 0.02;
            assert!(range.contains(&corners), "{name}, {chart_name}: {corners}, {in_plane}");
        }
    }
}

#[test]
fn flat_charts_are_the_plane() {
    for chart in [Chart::cone(1e-7), Chart::Sphere { radius: 1e7 }] {
        for (name, shape) in shapes() {
            let (curved, flat) = (chart.inset(&shape, 0.45), shape.inset(0.45));
            let apart = curved.difference(&flat).area() + flat.difference(&curved).area();
            assert!(apart < 1e-4 * shape.perimeter(), "{name}: {apart}");
            assert!(curved.point_count() <= flat.point_count() + 4, "{name}");
        }
    }
}

#[test]
fn a_corner_exactly_on_the_axis_moves_like_any_other() {
    for chart in [Chart::Sphere { radius: 60.0 }, Chart::Sphere { radius: 8.0 }] {
        // On it, or a step of the grid beside it.
        let beside = [(0.0, 0.0), (1e-5, 0.0), (-1e-5, 0.0), (0.0, 1e-5), (0.0, -1e-5)];
        for (turn, (u, v)) in
            [0.0, 0.4, 1.0, 2.5, 4.0].into_iter().flat_map(|turn| beside.map(|b| (turn, b)))
        {
            let (sin, cos) = f64::sin_cos(turn);
            let place = |x: f64, y: f64| Point2::new(x * cos - y * sin + u, x * sin + y * cos + v);
            let all = [place(0.0, 0.0), place(1.5, 0.0), place(1.5, 1.5), place(0.0, 1.5)];
            let inset = chart.inset(&region(&[all.to_vec()]), 0.225);
            let corner = place(0.225, 0.225);
            // All within the layer, as far from the borders as asked for.
            for (a, _) in inset.rings().flat_map(|ring| ring_sides(ring)) {
                let away = distance_to_border(&chart, &region(&[all.to_vec()]), &mm(a));
                assert!((away - 0.225).abs() < 0.002, "{chart:?}, {turn}: {away} mm");
            }
            let nearest = inset.rings().flatten().map(|p| (mm(*p) - corner).norm());
            assert!(nearest.fold(f64::INFINITY, f64::min) < 0.002, "{chart:?}, {turn}");
        }
    }
}

/// Many places about the apex, each with whether a region holds it and how far its border is.
fn places(chart: &Chart, shape: &Region, reach: f64) -> Vec<(Point2<f64>, bool, f64)> {
    const HALF: i32 = 12;
    let place = |k: i32| reach * f64::from(k) / f64::from(HALF) + 0.0017;
    (-HALF..=HALF)
        .flat_map(|i| (-HALF..=HALF).map(move |j| Point2::new(place(i), place(j))))
        .map(|p| (p, shape.contains(&p), distance_to_border(chart, shape, &p)))
        .collect()
}

#[test]
fn offsets_know_the_apex() {
    let circle = |x: f64, r: f64, n: u32| -> Region {
        let point = |k: u32| {
            let (sin, cos) = (f64::from(k) * TAU / f64::from(n)).sin_cos();
            [x + r * cos, r * sin]
        };
        polygon(&(0..n).map(point).collect::<Vec<_>>())
    };
    let square = |x: f64, y: f64, half: f64| {
        polygon(&[
            [x - half, y - half],
            [x + half, y - half],
            [x + half, y + half],
            [x - half, y + half],
        ])
    };
    let shapes = [
        ("disc at the apex", circle(0.0, 0.06, 48)),
        ("larger disc at the apex", circle(0.0, 0.3, 48)),
        ("disc beside the apex", circle(0.15, 0.4, 64)),
        ("disc at the apex, not under it", circle(0.5, 0.45, 64)),
        ("square", square(0.1, 0.05, 0.35)),
        ("square beside", square(0.9, 0.1, 0.8)),
        ("corner over the apex", square(0.95, 0.95, 1.0)),
        ("side over the apex", square(0.0, 1.05, 1.1)),
        ("frame", square(0.0, 0.0, 2.0).difference(&square(0.05, 0.1, 0.3))),
        ("plate with a hole beside", square(0.0, 0.0, 2.0).difference(&circle(0.7, 0.5, 48))),
    ];
    for degrees in [10.0, 30.0, 45.0, 60.0_f64] {
        let chart = Chart::cone(degrees.to_radians());
        for (name, shape) in &shapes {
            let places = places(&chart, shape, 1.2);
            for distance in [0.1, 0.225, 0.45, 0.8] {
                let (inset, outset) = (chart.inset(shape, distance), chart.outset(shape, distance));
                inset.check();
                outset.check();
                for (p, is_inside, to_border) in &places {
                    let is_near = *to_border <= distance;
                    if (to_border - distance).abs() < 0.01 {
                        continue;
                    }
                    let found = [inset.contains(p), outset.contains(p)];
                    assert_eq!(
                        found,
                        [*is_inside && !is_near, *is_inside || is_near],
                        "{name}, {degrees}°, {distance} mm: {p}, {to_border} mm from the border"
                    );
                }
            }
        }
    }
}

#[test]
fn no_slivers_are_left_beside_the_apex() {
    // A column whose side passes the axis, cut by cones with their apex beside its top.
    let solid = Solid::new(mesh::shapes::steps());
    for degrees in [15.0, 30.0, 45.0_f64] {
        let cone = Cone::new(degrees.to_radians()).unwrap();
        let step = cone.level_step(0.2);
        for k in 20..48 {
            let upper = 0.4 + step * f64::from(k);
            let middle = upper - step / 2.0;
            let section = Cutter::at_levels(&solid, &cone, vec![middle]).section(0, 0.002);
            let region = carried(&cone, &section.region, middle, upper);
            for island in cone.chart(upper).inset(&region, 0.225).islands() {
                let area = Region::from_island(island.clone()).area();
                assert!(area > 1e-3, "{degrees}°, layer {k}: an island of {area} mm²");
            }
        }
    }
}
