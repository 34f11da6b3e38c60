//! Broken models print like their sound twins: to half a percent of the volume.

use std::path::Path;

use mesh::mesh::Mesh;
use mesh::shapes;
use nalgebra::Point3;
use serde_json::Value;

use crate::run::{Scratch, say, shared};

/// Most difference of what is laid, as a share.
const MOST: f64 = 0.005;

type Facet = [Point3<f64>; 3];

fn facets(mesh: &Mesh) -> Vec<Facet> {
    (0..).zip(&mesh.triangles).map(|(t, _)| mesh.corners(t)).collect()
}

/// Facets as a file has them, each with corners of its own.
fn file(facets: &[Facet]) -> Vec<u8> {
    let vertices: Vec<Point3<f64>> = facets.iter().flatten().copied().collect();
    let count = u32::try_from(facets.len()).unwrap();
    let triangles = (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    mesh::stl::write(&Mesh { vertices, triangles })
}

fn turned([a, b, c]: Facet) -> Facet {
    [a, c, b]
}

/// What is done to a model.
type Damage = (&'static str, fn(&mut Vec<Facet>));

/// Damage that files really have.
const DAMAGES: [Damage; 10] = [
    ("a facet is missing", |all| {
        all.remove(all.len() / 3);
    }),
    ("five facets are missing", |all| {
        for k in 1..=5 {
            all.remove(k * all.len() / 7);
        }
    }),
    ("every third facet is turned", |all| {
        all.iter_mut().step_by(3).for_each(|facet| *facet = turned(*facet));
    }),
    ("all is inside out", |all| all.iter_mut().for_each(|facet| *facet = turned(*facet))),
    ("every fourth facet is there twice", |all| {
        all.extend(all.clone().iter().step_by(4));
    }),
    ("every facet has both faces", |all| {
        all.extend(all.clone().into_iter().map(turned));
    }),
    ("seams are open by rounding", |all| {
        for (k, corner) in all.iter_mut().flatten().enumerate() {
            corner.x += [0.0, 1e-6, -1e-6][k % 3];
        }
    }),
    ("a facet is split on one side of its edge only", |all| {
        let [a, b, c] = all.remove(0);
        let middle = nalgebra::center(&a, &b);
        all.extend([[a, middle, c], [middle, b, c]]);
    }),
    ("facets without area and a loose one", |all| {
        let [a, b, _] = all[0];
        all.extend([[a, a, b], [b, b, b]]);
        let inside = nalgebra::center(&nalgebra::center(&a, &b), &all[all.len() / 2][1]);
        let by = |x, y| inside + nalgebra::Vector3::new(x, y, 0.0);
        all.push([by(0.0, 0.0), by(0.1, 0.0), by(0.0, 0.1)]);
    }),
    ("a copy of itself lies in the same place, a little smaller", |all| {
        let sum = all.iter().flatten().fold(nalgebra::Vector3::zeros(), |sum, p| sum + p.coords);
        let centre = Point3::from(sum / (3 * all.len()) as f64);
        let smaller = |facet: &Facet| facet.map(|p| centre + (p - centre) * 0.6);
        all.extend(all.clone().iter().map(smaller));
    }),
];

/// The volume that is laid for the part, mm³.
fn laid(scratch: &Scratch, name: &str, more: &[&str]) -> f64 {
    let mut all = vec!["slice", name, "-o", "x.gcode", "--json", "--orient", "keep"];
    all.extend(["--set", "skirts=0"]);
    all.extend(more);
    let ran = scratch.run(&all);
    assert!(matches!(ran.code, Some(0 | 1)), "{name}: {}", ran.err);
    let report: Value = serde_json::from_str(&ran.out).unwrap();
    report["print"]["part_mm3"].as_f64().unwrap()
}

#[test]
fn broken_models_print_like_their_twins() {
    let models = [
        ("cube", shapes::cube(8.0)),
        ("dome", shapes::dome(5.0, 32)),
        ("gear", shapes::gear(8, 1.0, 3.0, 1.5)),
        ("ball", shapes::icosphere(3, 4.0)),
    ];
    let solid = ["--set", "fill_density=100%"];
    let mut faults = Vec::new();
    for (name, sound) in &models {
        let scratch = Scratch::new();
        scratch.file("twin.stl", file(&facets(sound)));
        let twin = laid(&scratch, "twin.stl", &solid);
        for (damage, break_it) in DAMAGES {
            // The smaller copy of what has a bore would lie in the bore.
            if *name == "gear" && damage.starts_with("a copy") {
                continue;
            }
            let mut broken = facets(sound);
            break_it(&mut broken);
            scratch.file("broken.stl", file(&broken));
            let broken = laid(&scratch, "broken.stl", &solid);
            let off = broken / twin - 1.0;
            if off.abs() > MOST {
                faults.push(format!("{name}, {damage}: {:+.2} %", off * 100.0));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Real files, where they lie beside the clone, against what the program itself says the mended
/// solid is (`--export-placed`).
#[test]
fn real_broken_models_print_like_what_they_are_mended_to() {
    let Some(folder) = shared("models/real") else { return };
    let coarse = ["--set", "layer_height_mm=0.3", "--set", "fill_density=0"];
    for name in [
        "benchy",
        "bunny_open",
        "conveyor_holes",
        "einsy_base_nonmanifold",
        "hourglass_flipped",
        "teapot_open",
        "voron_cw2_main_body",
    ] {
        let path = folder.join(format!("{name}.stl"));
        if !Path::new(&path).exists() {
            say(&format!("skipped: there is no {name}"));
            continue;
        }
        let scratch = Scratch::new();
        let export = [&coarse[..], &["--export-placed", "twin.stl"]].concat();
        let broken = laid(&scratch, path.to_str().unwrap(), &export);
        let twin = laid(&scratch, "twin.stl", &coarse);
        let off = broken / twin - 1.0;
        assert!(off.abs() <= MOST, "{name}: {broken} of {twin} mm³, {:+.2} %", off * 100.0);
        say(&format!("{name}: {broken:.1} mm³, its twin {twin:.1} mm³"));
    }
}
