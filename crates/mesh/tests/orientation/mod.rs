//! The published vectors of the orientation.

use super::shared;
use mesh::mesh::Mesh;
use mesh::orient::{OrientParams, Rest, candidates, down_to_bed, rest};
use nalgebra::{Matrix3, Point3, Vector3};
use serde_json::Value;

fn vectors() -> Option<Value> {
    let text = std::fs::read_to_string(shared("vectors/orientation.json")?).unwrap();
    Some(serde_json::from_str(&text).unwrap())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn mesh_of(case: &Value) -> Mesh {
    let rows = |name: &str| case[name].as_array().unwrap().iter().map(numbers);
    Mesh {
        vertices: rows("V").map(|p| Point3::new(p[0], p[1], p[2])).collect(),
        triangles: rows("F").map(|t| [t[0] as u32, t[1] as u32, t[2] as u32]).collect(),
    }
}

#[test]
fn rotations_to_the_bed() {
    let Some(vectors) = vectors() else { return };
    let rotations = vectors["rotations"].as_array().unwrap();
    assert_eq!(rotations.len(), 9);
    for case in rotations {
        let rows: Vec<f64> = case["R"].as_array().unwrap().iter().flat_map(numbers).collect();
        let found = down_to_bed(&Vector3::from_vec(numbers(&case["n"])));
        let error = found.matrix() - Matrix3::from_row_slice(&rows);
        assert!(error.norm() < 1e-9, "{}: {error}", case["n"]);
    }
}

#[test]
fn resting_sides() {
    let Some(vectors) = vectors() else { return };
    let cases = vectors["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 10);
    for case in cases {
        let id = &case["id"];
        let params = OrientParams {
            class_tolerance_rad: case["tol_deg"].as_f64().unwrap().to_radians(),
            overhang_rad: 45_f64.to_radians(),
        };
        let mesh = mesh_of(case);
        let (rotation, found) = rest(&mesh, &params);
        let Rest::Flat(best) = found else { panic!("{id}: {found:?}") };
        let near = |name: &str, found: f64| {
            let wanted = case[name].as_f64().unwrap();
            assert!((found - wanted).abs() <= 1e-4 * wanted.max(1.0), "{id}: {name} {found}");
        };
        near("class_area", best.class_area_mm2);
        near("bed_area", best.bed_area_mm2);
        near("height", best.height_mm);
        near("overhang_area", best.overhang_area_mm2);
        assert!((rotation * best.down + Vector3::z()).norm() < 1e-9, "{id}");
        let ranked = candidates(&mesh, &params);
        let classes = case["classes"].as_array().unwrap();
        assert_eq!(ranked.len(), 2 * classes.len(), "{id}");
        for class in classes {
            let wanted = Vector3::from_vec(numbers(&class["dir"]));
            let found = ranked.iter().find(|c| c.down.dot(&wanted) > 1.0 - 1e-9);
            let area = class["area"].as_f64().unwrap();
            assert!(found.is_some_and(|c| (c.class_area_mm2 - area).abs() < 1e-4 * area), "{id}");
        }
    }
}
