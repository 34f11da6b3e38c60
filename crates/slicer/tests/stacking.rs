//! Thickness, order, clearance and overhang against published numbers, where these are at hand.

use mesh::topology::Solid;
use nalgebra::{Point2, Point3, Vector3};
use serde_json::Value;
use slicer::blend::{Aim, Side, fewest};
use slicer::chart::carried_point;
use slicer::clearance::{LayerOrder, NozzleProfile, Uphill};
use slicer::overhang::{overhang, steepest_overhang, unsupported};
use slicer::section::{Cutter, level_range};
use slicer::stacking::{WedgeRule, depth};
use slicer::surface::{Cone, LayerSurface, Plane, Spheres};

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

fn point(value: &Value) -> Point3<f64> {
    Point3::from([0, 1, 2].map(|k| value[k].as_f64().expect("a coordinate")))
}

fn near(found: f64, expected: f64, tolerance: f64, case: &Value) {
    assert!((found - expected).abs() < tolerance, "{found} is not {expected}: {case}");
}

/// The surface of a case; levels of the case are heights on the axis less the second value.
fn surface(case: &Value) -> (Box<dyn LayerSurface>, f64) {
    match case["kind"].as_str().unwrap_or("cone") {
        "plane" => (Box::new(Plane), 0.0),
        "sphere" => {
            let centre = number(case, "zc");
            (Box::new(Spheres::new(centre).expect("a height")), centre)
        }
        _ => {
            let angle = number(case, "sg") * number(case, "alpha_deg").to_radians();
            (Box::new(Cone::new(angle).expect("an angle")), 0.0)
        }
    }
}

#[test]
fn charts_and_normals() {
    let Some(all) = vectors("charts_extrusion.json") else { return };
    for case in list(&all["charts"]) {
        let (surface, shift) = surface(case);
        let (p, level) = (point(&case["p3"]), number(case, "c") + shift);
        let uv = Point2::new(0, 1).map(|k| case["uv"][k].as_f64().expect("a coordinate"));
        assert!((surface.level(&p) - level).abs() < 1e-9, "{case}");
        assert!((surface.flatten(&p) - uv).norm() < 1e-9, "{case}");
        assert!((surface.lift(level, &uv) - p).norm() < 1e-9, "{case}");
        let chart = surface.chart(level);
        near(chart.stretch(uv.coords.norm()), number(case, "lambda_tangential"), 1e-9, case);
        if p.xy().coords.norm() > 0.0 {
            assert!((surface.normal(&p) - point(&case["normal"]).coords).norm() < 1e-9, "{case}");
        }
    }
    for case in list(&all["normal_maps"]) {
        let (surface, shift) = surface(case);
        let (from, to) = (number(case, "c_from") + shift, number(case, "c_to") + shift);
        near(surface.carry(number(case, "s_from"), from, to), number(case, "s_to"), 1e-9, case);
    }
}

#[test]
fn volumes_of_segments() {
    let Some(all) = vectors("charts_extrusion.json") else { return };
    for case in list(&all["extrusion"]) {
        let (surface, _) = surface(case);
        let (from, to) = (point(&case["p0"]), point(&case["p1"]));
        let (depths, nominal) =
            ([&from, &to].map(|p| depth(surface.as_ref(), p, 0.0)), number(case, "h"));
        near(depths[0], number(case, "tau0"), 1e-9, case);
        near(depths[1], number(case, "tau1"), 1e-9, case);
        let rule = WedgeRule { base: 0.0, least: number(case, "tmin") };
        // In short pieces, as beads are laid: the line is straight in plan and curved in space.
        const PIECES: u32 = 64;
        let level = surface.level(&from);
        let at = |k: u32| {
            let p = from.lerp(&to, f64::from(k) / f64::from(PIECES));
            Point3::new(p.x, p.y, surface.height(level, p.xy().coords.norm()))
        };
        let mut volume = 0.0;
        for k in 0..PIECES {
            let ends = [at(k), at(k + 1)];
            let depths = ends.map(|p| depth(surface.as_ref(), &p, 0.0));
            for piece in rule.pieces(depths, nominal) {
                let mean = f64::midpoint(piece.thickness[0], piece.thickness[1]);
                volume += mean * (piece.to - piece.from) * (ends[1] - ends[0]).norm();
            }
        }
        let expected = number(case, "volume_mm3");
        near(volume * number(case, "width"), expected, 1e-4 * expected + 1e-9, case);
    }
}

#[test]
fn thickness_and_layer_maps() {
    let Some(all) = vectors("stacking.json") else { return };
    for case in list(&all["local_thickness"]) {
        let rule = WedgeRule { base: 0.0, least: number(case, "tmin") };
        let found = rule.thickness_at_depth(number(case, "tau"), number(case, "h"));
        near(found, number(case, "thickness"), 1e-9, case);
    }
    for case in list(&all["tau_formula"]) {
        let (surface, shift) = surface(case);
        let p = match case["psi"].as_f64() {
            Some(psi) => {
                let radius = number(case, "c");
                Point3::new(radius * psi.sin(), 0.0, shift + radius * psi.cos())
            }
            None => Point3::new(number(case, "r"), 0.0, number(case, "z")),
        };
        near(depth(surface.as_ref(), &p, 0.0), number(case, "tau"), 1e-9, case);
    }
    for case in list(&all["thickness"]) {
        // Beside the axis of a cone with its apex on top the layer below is farther off.
        let (r, h) = (number(case, "r"), number(case, "h"));
        let (surface, _) = surface(case);
        if number(case, "sg") < 0.0 || r > h * number(case, "alpha_deg").to_radians().sin() {
            let p = Point3::new(r, 0.0, 50.0);
            let found = surface.level_step(h) * surface.thickness_per_level(&p);
            near(found, number(case, "distance"), 1e-6, case);
        }
    }
    for case in list(&all["layer_map"]) {
        if case["kind"] == "cone" {
            let (surface, _) = surface(case);
            let to = 10.0 + surface.level_step(number(case, "h"));
            near(
                surface.carry(number(case, "s_prev"), 10.0, to),
                number(case, "s_next"),
                1e-9,
                case,
            );
        } else {
            let surface = Spheres::new(-10.0).expect("a height");
            let levels = ["R_prev", "R_next"].map(|key| number(case, key) - 10.0);
            let p = Point2::new(0.0, number(case, "s_prev"));
            let found = carried_point(&surface, &p, levels[0], levels[1]);
            near(found.y, number(case, "s_next"), 1e-9, case);
        }
    }
}

#[test]
fn blends_take_the_published_number_of_layers() {
    let Some(all) = vectors("stacking.json") else { return };
    for case in list(&all["blend"]) {
        let slope = number(case, "sg") * number(case, "alpha_deg").to_radians().tan();
        let (radius, limits) =
            (number(case, "r_max"), [number(case, "hmin"), number(case, "hmax")]);
        let layers = fewest(&Aim::Cone { slope }, 0.0, radius, limits).expect("sound");
        near(layers.len() as f64, number(case, "n_layers"), 1.01, case);
        let mut below = Side::plane(0.0).expect("a plane");
        for layer in &layers {
            let [thin, thick] = below.thickness_to(layer, radius);
            assert!(thin > limits[0] - 1e-4 && thick < limits[1] + 1e-4, "{case}");
            below = *layer;
        }
        near((below.level - below.height(radius)) / radius, slope, 1e-12, case);
        near(below.level, number(case, "height_centre"), 0.35, case);
    }
}

#[test]
fn nozzles_clear_the_published_angles() {
    let Some(all) = vectors("stacking.json") else { return };
    for case in list(&all["clearance"]) {
        let profile = NozzleProfile {
            flat_radius: number(case, "tip_radius"),
            half_angle: number(case, "half_angle_deg").to_radians(),
            block_height: number(case, "block_height"),
            block_radius: number(case, "block_radius"),
        };
        let order = match case["downhill_first"].as_bool() {
            Some(true) => LayerOrder::LowToHigh,
            _ => LayerOrder::Any,
        };
        let uphill = Uphill {
            extent: number(case, "uphill_extent"),
            thickness: number(case, "h"),
            allowance: number(case, "gouge_allow"),
            order,
        };
        let found = profile.steepest(&uphill).to_degrees();
        near(found, number(case, "alpha_max_deg"), 0.05, case);
    }
}

#[test]
fn overhangs() {
    let Some(all) = vectors("stacking.json") else { return };
    for case in list(&all["overhang"]) {
        let (surface, _) = surface(case);
        let normal: Vector3<f64> = point(&case["n"]).coords;
        let found = overhang(surface.as_ref(), &point(&case["p"]), &normal).to_degrees();
        near(found, number(case, "overhang_deg"), 1e-6, case);
    }
    let degrees = steepest_overhang(0.45, 0.2, 0.5).to_degrees();
    assert!((degrees - 48.366).abs() < 1e-3, "{degrees}");
}

/// A mushroom's cap hangs over on planes; most of it is carried on cones that slope down outwards.
#[test]
fn a_cone_carries_most_of_the_cap_of_a_mushroom() {
    let solid = Solid::new(mesh::shapes::mushroom(96));
    let free = |surface: &dyn LayerSurface| {
        let [low, high] = level_range(&solid, surface).expect("facets");
        let step = surface.level_step(0.2);
        let n = ((high - low) / step) as u32;
        let cuts: Vec<f64> = (0..n).map(|k| low + step * (f64::from(k) + 0.5)).collect();
        let cutter = Cutter::at_levels(&solid, surface, cuts.clone());
        let regions: Vec<_> = (0..cuts.len()).map(|k| cutter.section(k, 0.005).region).collect();
        let mut area = 0.0;
        for k in 1..cuts.len() {
            let (layer, below) = ((&regions[k], cuts[k]), (&regions[k - 1], cuts[k - 1]));
            let found = unsupported(surface, layer, below, 0.2);
            area += surface.chart(cuts[k]).area(&found.region);
        }
        area
    };
    let [planar, conical] = [free(&Plane), free(&Cone::new(0.6).expect("an angle"))];
    assert!(planar > 50.0, "{planar}");
    assert!(conical < planar / 3.0, "{conical} of {planar}");
}

/// A wedge on the bed is filled once: what is not laid in one layer is laid in the next.
#[test]
fn wedges_add_up_to_the_part() {
    const THICKNESS: f64 = 0.2;
    for degrees in [-45.0, -20.0, 15.0, 30.0_f64] {
        let cone = Cone::new(degrees.to_radians()).expect("an angle");
        let step = cone.level_step(THICKNESS);
        for least in [0.0, 0.05, 0.1, 0.2] {
            let rule = WedgeRule { base: 0.0, least };
            for r in [5.0, 5.37, 11.0] {
                // The column along the normal through a place high above the bed.
                let top = 40.0 * step;
                let laid: f64 = (-200..=200)
                    .map(|k| top + f64::from(k) * step)
                    .filter(|level| *level <= top)
                    .map(|level| {
                        let s = cone.carry(r / cone.angle().cos(), top, level);
                        let r = cone.chart(level).radius(s);
                        let p = Point3::new(r, 0.0, cone.height(level, r));
                        if p.z <= 0.0 { 0.0 } else { rule.thickness(&cone, &p, step) }
                    })
                    .sum();
                let high = Point3::new(r, 0.0, cone.height(top, r));
                let missing = depth(&cone, &high, 0.0) - laid;
                assert!((-1e-9..=least + 1e-9).contains(&missing), "{degrees}, {least}: {missing}");
            }
        }
    }
}
