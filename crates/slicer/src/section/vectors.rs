//! The cut against published numbers, where the folder with the vectors is at hand.

use std::f64::consts::PI;

use mesh::mesh::Mesh;
use mesh::topology::Solid;
use nalgebra::Point3;
use serde_json::Value;

use super::curved::CurvedCut;
use super::{Cutter, level_range};
use crate::surface::{Cone, LayerSurface, Plane, Spheres};

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

fn point(value: &Value) -> Point3<f64> {
    Point3::from([0, 1, 2].map(|k| value[k].as_f64().expect("a coordinate")))
}

fn list(value: &Value) -> &Vec<Value> {
    value.as_array().expect("a list")
}

/// The surface of a case and the level that the case calls `c`.
fn surface(case: &Value) -> (Box<dyn LayerSurface>, f64) {
    let (c, sign) = (number(case, "c"), number(case, "sg"));
    match case["kind"].as_str().expect("a kind") {
        "plane" => (Box::new(Plane), c),
        "cone" => {
            let cone = match case["T"].as_f64() {
                Some(slope) => Cone::from_slope(sign * slope),
                None => Cone::new(sign * number(case, "alpha_deg").to_radians()),
            };
            (Box::new(cone.unwrap()), c)
        }
        _ => (Box::new(Spheres::new(number(case, "zc")).unwrap()), c + number(case, "zc")),
    }
}

fn triangle(corners: [Point3<f64>; 3]) -> Solid {
    Solid::new(Mesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]] })
}

#[test]
fn crossings_of_edges() {
    let Some(all) = vectors("edge_roots.json") else { return };
    let cases = list(&all["cases"]);
    assert!(cases.len() > 200);
    for case in cases {
        let (surface, level) = surface(case);
        let (a, b) = (point(&case["A"]), point(&case["B"]));
        let solid = triangle([a, b, Point3::new(1.0, 2.0, 90.0)]);
        let cutter = Cutter::at_levels(&solid, surface.as_ref(), vec![level]);
        let cut = CurvedCut::new(&cutter, level, 0.01);
        let found = crossings_of_first_side(&cut, &cutter);
        let id = case["id"].as_str().expect("an id");
        let roots = list(&case["roots"]);
        assert_eq!(found.len(), roots.len(), "{case}");
        for ((is_leave, at), root) in found.iter().zip(roots) {
            assert_eq!(*is_leave, root["type"] == "leave", "{case}");
            let residual = surface.level(at) - level;
            assert!(residual.abs() < 1e-9, "{case}: off by {residual}");
            let tolerance = match id {
                "cone_edge_along_ruling_plus_axis" => f64::INFINITY,
                id if id.contains("near_tangent") || id.contains("just_in") => 1e-4,
                _ => 1e-9,
            };
            let share = (at - a).norm() / (b - a).norm();
            let off = (share - number(root, "t")).abs();
            assert!(off < tolerance, "{case}: t off by {off}");
        }
    }
}

/// Crossings of side 0–1 of facet 0 along it: whether the side leaves K there, and where.
fn crossings_of_first_side(cut: &CurvedCut<'_>, cutter: &Cutter<'_>) -> Vec<(bool, Point3<f64>)> {
    let side = cutter.solid.sides()[0][0];
    let at = |leaves: bool| {
        let p = cut.crossing(2 * side + u32::from(leaves));
        (leaves, cutter.form.convex(&p))
    };
    match (cut.holds_vertex(0), cut.holds_vertex(1)) {
        (true, true) => vec![],
        (true, false) => vec![at(true)],
        (false, true) => vec![at(false)],
        (false, false) if cut.dips(0, 1) => vec![at(false), at(true)],
        (false, false) => vec![],
    }
}

#[test]
fn arcs_in_triangles() {
    let Some(all) = vectors("triangles.json") else { return };
    let cases = list(&all["cases"]);
    assert_eq!(cases.len(), 80);
    for case in cases {
        let (surface, level) = surface(case);
        let corners = [0, 1, 2].map(|k| point(&case["tri"][k]));
        let solid = triangle(corners);
        let range = level_range(&solid, surface.as_ref()).unwrap();
        let shift = level - number(case, "c");
        for (found, expected) in range.iter().zip(list(&case["f_range"])) {
            assert!((found - shift - expected.as_f64().expect("a number")).abs() < 1e-6, "{case}");
        }
        let cutter = Cutter::at_levels(&solid, surface.as_ref(), vec![level]);
        arcs_of_triangle(case, &cutter, level);
    }
}

/// Crossing points by (side, K is left), in the order of the case.
fn arcs_of_triangle(case: &Value, cutter: &Cutter<'_>, level: f64) {
    const CHORD: f64 = 1e-9;
    let cut = CurvedCut::new(cutter, level, CHORD);
    let (mut steps, mut closed) = (Vec::new(), Vec::new());
    if cutter.form.is_flat() {
        steps.extend(super::planar::step(cutter, 0, level));
    } else {
        cut.steps(0, &mut steps, &mut closed);
    }
    assert_eq!(!closed.is_empty(), case["closed_curve"] == true, "{case}");
    let crossings = list(&case["crossings"]);
    let arcs = list(&case["arcs_K_left"]);
    assert_eq!(steps.len(), arcs.len(), "{case}");
    assert_eq!(crossings.len(), 2 * arcs.len());
    if cutter.form.is_flat() {
        return;
    }
    let mirrored = cutter.form.is_mirrored();
    for arc in arcs {
        let end = |key: &str| point(&crossings[arc[key].as_u64().unwrap() as usize]["P"]);
        let (enter, leave) =
            if mirrored { (end("start"), end("end")) } else { (end("end"), end("start")) };
        let at = |crossing: u32| cutter.form.convex(&cut.crossing(crossing));
        let step = steps
            .iter()
            .find(|s| (at(s.enter) - enter).norm() < 1e-6 && (at(s.leave) - leave).norm() < 1e-6)
            .unwrap_or_else(|| panic!("no way from {enter} to {leave}: {case}"));
        let mut line = vec![cut.crossing(step.enter)];
        let sides = [step.enter, step.leave].map(|crossing| cut.place(0, crossing));
        let mut inner = Vec::new();
        let ends = (cut.crossing(step.enter), cut.crossing(step.leave));
        cut.cut(0).between(&ends.0, &ends.1, || sides, &mut inner);
        line.append(&mut inner);
        line.push(ends.1);
        let length: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let expected = number(arc, "length");
        assert!((length - expected).abs() < 1e-6 * (1.0 + expected), "{length}: {case}");
        let Some(_) = arc["shoulder_point"].as_array() else { continue };
        let shoulder = point(&arc["shoulder_point"]);
        let deviation = number(arc, "max_dev_from_chord");
        let hit = line.iter().any(|p| (cutter.form.convex(p) - shoulder).norm() < 1e-5);
        assert!(hit || deviation < 1e-8, "{case}");
    }
}

#[test]
fn layers_of_meshes() {
    const CHORD: f64 = 0.002;
    let Some(all) = vectors("mesh_layers.json") else { return };
    let mut count = 0;
    for mesh in list(&all["meshes"]) {
        let index = |v: &Value| v.as_u64().expect("an index") as u32;
        let solid = Solid::new(Mesh {
            vertices: list(&mesh["V"]).iter().map(point).collect(),
            triangles: list(&mesh["F"]).iter().map(|f| [0, 1, 2].map(|k| index(&f[k]))).collect(),
        });
        for layer in list(&mesh["layers"]) {
            let (surface, level) = surface(layer);
            let cutter = Cutter::at_levels(&solid, surface.as_ref(), vec![level]);
            let section = cutter.section(0, CHORD);
            assert_eq!(section.tears, super::Tears::default());
            section.region.check();
            let chart = surface.chart(level);
            let tolerance = number(layer, "perimeter") * 1.5 * CHORD + 1e-6;
            let area = chart.area(&section.region);
            let name = &mesh["id"];
            assert!((area - number(layer, "area")).abs() < tolerance, "{name} {area}: {layer}");
            let mut areas: Vec<f64> =
                section.region.rings().map(|ring| chart.ring_area(ring)).collect();
            areas.sort_unstable_by(f64::total_cmp);
            let mut expected: Vec<f64> = list(&layer["signed_areas"])
                .iter()
                .map(|a| a.as_f64().expect("a number"))
                .collect();
            expected.retain(|area| area.abs() > tolerance);
            areas.retain(|area| area.abs() > tolerance);
            expected.sort_unstable_by(f64::total_cmp);
            assert_eq!(areas.len(), expected.len(), "{name} {areas:?}: {layer}");
            for (found, expected) in areas.iter().zip(&expected) {
                assert!((found - expected).abs() < tolerance, "{name} {found}: {layer}");
            }
            let perimeter = chart.perimeter(&section.region);
            let slack = 1e-3 * PI * (1.0 + perimeter);
            assert!((perimeter - number(layer, "perimeter")).abs() < slack, "{perimeter}: {layer}");
            count += 1;
        }
    }
    assert_eq!(count, 72);
}
