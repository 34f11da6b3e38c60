//! The figures of `docs/comparison.md`, printed:
//! `cargo test --release -p rhumb --test main comparison -- --ignored --nocapture`.

use std::path::Path;

use mesh::mesh::Mesh;
use mesh::shapes;
use mesh::topology::Solid;
use nalgebra::Point3;
use slicer::section::{Cutter, level_range};
use slicer::surface::{Cone, LayerSurface, Spheres};

use crate::program::{Motion, motions, stl_volume};
use crate::run::{Scratch, model, say};

/// A nozzle that clears layers of 45°.
const SLIM: [&str; 3] =
    ["nozzle_flat_radius_mm=0.2", "nozzle_half_angle_deg=10", "nozzle_block_height_mm=60"];

/// Slices a model in cones of an angle; returns the program.
fn cones(scratch: &Scratch, model: &Path, angle: &str, more: &[&str]) -> String {
    let mut arguments = vec!["slice", model.to_str().unwrap(), "-o", "out.gcode"];
    arguments.extend(["--no-verify", "--threads", "1", "--layers", "conical"]);
    arguments.extend(["--orient", "keep", "--cone-angle", angle]);
    arguments.extend(SLIM.iter().flat_map(|setting| ["--set", *setting]));
    arguments.extend(more);
    scratch.run(&arguments).expect(0);
    std::fs::read_to_string(scratch.path("out.gcode")).unwrap()
}

/// CPU seconds in user mode of all runs so far.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    // User time of children that have ended, in hundredths of a second.
    fields[13].parse::<f64>().unwrap() / 100.0
}

fn volume_error(text: &str, wanted: f64) -> f64 {
    let laid: f64 = motions(text).iter().filter(|m| m.lays()).map(Motion::volume).sum();
    100.0 * (laid / wanted - 1.0)
}

/// Least and greatest thickness of a layer along its normal, mm: the levels of neighbours.
fn thickness(text: &str, angle: f64) -> [f64; 2] {
    let motions = motions(text);
    let (sin, cos) = angle.to_radians().sin_cos();
    let levels: Vec<f64> = motions
        .iter()
        .filter(|m| m.lays() && m.layer.is_some_and(|k| k > 2))
        .collect::<Vec<_>>()
        .chunk_by(|a, b| a.layer == b.layer)
        .map(|layer| {
            let [x, y, z] = layer[0].at(0.0);
            z + x.hypot(y) * sin / cos
        })
        .collect();
    let steps = levels.windows(2).map(|w| (w[1] - w[0]) * cos);
    steps.fold([f64::MAX, 0.0], |[a, b], step| [a.min(step), b.max(step)])
}

/// How far sections lie from the surface of their mesh, mm.
fn contour_error(mesh: Mesh, surface: &dyn LayerSurface) -> f64 {
    let solid = Solid::new(mesh);
    let corners: Vec<[Point3<f64>; 3]> = solid
        .mesh()
        .triangles
        .iter()
        .map(|t| t.map(|v| solid.mesh().vertices[v as usize]))
        .collect();
    let [low, high] = level_range(&solid, surface).unwrap();
    let levels: Vec<f64> = (1..60).map(|k| low + (high - low) * f64::from(k) / 60.0).collect();
    let cutter = Cutter::at_levels(&solid, surface, levels.clone());
    let mut greatest = 0.0_f64;
    for (k, level) in levels.iter().enumerate() {
        let region = cutter.section(k, 0.002).region;
        for ring in region.rings() {
            for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let (a, b) = (geom::grid::mm(*a), geom::grid::mm(*b));
                for share in [0.0, 0.5] {
                    let p = surface.lift(*level, &(a + (b - a) * share));
                    let off = corners.iter().map(|t| distance(t, &p)).fold(f64::MAX, f64::min);
                    greatest = greatest.max(off);
                }
            }
        }
    }
    greatest
}

/// Distance of a point from a triangle.
fn distance([a, b, c]: &[Point3<f64>; 3], p: &Point3<f64>) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(from, to)| normal.dot(&(*to - *from).cross(&(p - *from))) >= 0.0);
    if inside {
        return (p - a).dot(&normal).abs() / normal.norm();
    }
    [(a, b), (b, c), (c, a)]
        .iter()
        .map(|(from, to)| {
            let along = *to - *from;
            let share = ((p - *from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (p - (*from + along * share)).norm()
        })
        .fold(f64::MAX, f64::min)
}

fn file(scratch: &Scratch, name: &str, mesh: &Mesh) -> std::path::PathBuf {
    scratch.file(name, mesh::stl::write(mesh))
}

#[test]
#[ignore = "prints a table; nothing to pass or fail"]
fn our_column() {
    let scratch = Scratch::new();
    let disc = file(&scratch, "disc.stl", &shapes::extruded(&circle(15.0), &[], 10.0));
    let cross = file(&scratch, "cross7.stl", &shapes::cross(10.0));
    for (angle, degrees) in [("45", 45.0), ("20", 20.0)] {
        let solid = ["--set", "fill_density=100%", "--set", "skirts=0"];
        let text = cones(&scratch, &disc, angle, &solid);
        let wanted = stl_volume(&std::fs::read(&disc).unwrap());
        let [least, most] = thickness(&text, degrees);
        say(&format!(
            "disc 30 x 10, solid, {angle}°: volume {:+.2} %, layers {least:.4} to {most:.4} mm",
            volume_error(&text, wanted)
        ));
    }
    for degrees in [30.0_f64, 45.0] {
        let cone = Cone::new(degrees.to_radians()).unwrap();
        let error = contour_error(shapes::cross(10.0), &cone);
        say(&format!("cross, contour at {degrees}°: {error:.5} mm"));
    }
    let error = contour_error(shapes::cross(10.0), &Spheres::new(-20.0).unwrap());
    say(&format!("cross, contour on spheres: {error:.5} mm"));
    let sphere = file(&scratch, "sphere.stl", &shapes::icosphere(7, 20.0));
    let vase = model("vase");
    let two_thirds = ["--scale", "0.6667"];
    for (name, path, more) in [
        ("cross7", &cross, &[][..]),
        ("vase", &vase, &two_thirds[..]),
        ("sphere", &sphere, &[][..]),
    ] {
        for angle in ["30", "45"] {
            let begin = cpu_seconds();
            cones(&scratch, path, angle, more);
            let cpu = cpu_seconds() - begin;
            let ran = scratch.run(&["verify", "out.gcode"]);
            let told = ran.out.lines().find(|line| line.contains("°/s")).unwrap_or_default();
            say(&format!("{name}, {angle}°: {cpu:.2} s CPU; {told}"));
        }
    }
}

fn circle(radius: f64) -> Vec<[f64; 2]> {
    let at = |k: u32| (std::f64::consts::TAU * f64::from(k) / 720.0).sin_cos();
    (0..720).map(at).map(|(sin, cos)| [radius * cos, radius * sin]).collect()
}
