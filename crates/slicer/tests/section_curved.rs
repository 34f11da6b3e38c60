//! Sections of random closed meshes: every outline closes, and the layers add up to the part.

use std::f64::consts::TAU;

use geom::region::Region;
use mesh::measure::volume_mm3;
use mesh::mesh::Mesh;
use mesh::shapes;
use mesh::topology::Solid;
use nalgebra::{Isometry3, Rotation3, Vector3};
use rayon::prelude::*;
use slicer::section::{Cutter, Tears, level_range};
use slicer::surface::{Caps, Cone, LayerSurface, Plane, Spheres};

/// Numbers from 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| 2.0 * self.next() - 1.0)
    }
}

/// A mesh turned anyhow about a point near the axis, all of it above the bed.
fn tumbled(mesh: &Mesh, random: &mut Random) -> Mesh {
    let turn = Rotation3::new(random.vector() * 3.0);
    let bounds = mesh.bounds();
    let centre = nalgebra::center(&bounds.min, &bounds.max);
    let shift = random.vector() * 6.0;
    let mut mesh = mesh.clone();
    for p in &mut mesh.vertices {
        *p = turn * (*p - centre.coords) + shift;
    }
    let lift = 0.1 - mesh.bounds().min.z;
    mesh.transformed(&Isometry3::translation(0.0, 0.0, lift))
}

/// A mesh whose vertices are each moved by up to `amount`: no longer smooth, still closed.
fn noisy(mesh: &Mesh, amount: f64, random: &mut Random) -> Mesh {
    let mut mesh = mesh.clone();
    for p in &mut mesh.vertices {
        *p += random.vector() * amount;
    }
    mesh
}

/// A sphere with a second one inside, turned inside out: a shell 0.3 mm thick.
fn thin_shell() -> Mesh {
    let (mut outer, inner) = (shapes::icosphere(3, 12.0), shapes::icosphere(3, 11.7));
    let first = outer.vertices.len() as u32;
    let lift = Vector3::new(0.0, 0.0, 0.3);
    outer.vertices.extend(inner.vertices.iter().map(|p| p + lift));
    outer
        .triangles
        .extend(inner.triangles.iter().map(|[a, b, c]| [a + first, c + first, b + first]));
    outer
}

fn meshes() -> Vec<(&'static str, Mesh)> {
    let mut random = Random(5);
    let mut meshes = vec![
        ("noisy sphere", noisy(&shapes::icosphere(3, 14.0), 0.25, &mut random)),
        ("torus", shapes::torus(14.0, 5.0, 40, 16)),
        ("thin shell", thin_shell()),
        ("tiny facets", noisy(&shapes::icosphere(4, 5.0), 0.004, &mut random)),
        ("block", shapes::block(31.0, 17.0, 23.0)),
        ("tetrahedron", shapes::tetrahedron(30.0)),
        ("cross", shapes::cross(9.0)),
    ];
    for (_, mesh) in &mut meshes {
        *mesh = tumbled(mesh, &mut random);
    }
    meshes.push(("plate under the axis", shapes::block(40.0, 40.0, 3.0)));
    meshes.push(("mushroom", shapes::mushroom(96)));
    meshes
}

fn surfaces() -> Vec<(String, Box<dyn LayerSurface>)> {
    let mut surfaces: Vec<(String, Box<dyn LayerSurface>)> = Vec::new();
    for degrees in [-45.0, -30.0, -10.0, 10.0, 20.0, 30.0, 45.0_f64] {
        let cone = Cone::new(degrees.to_radians()).expect("below 90°");
        surfaces.push((format!("cone {degrees}"), Box::new(cone)));
    }
    for centre in [0.0, -5.0, -40.0] {
        surfaces
            .push((format!("spheres {centre}"), Box::new(Spheres::new(centre).expect("a height"))));
    }
    surfaces.push(("caps".into(), Box::new(Caps::new(60.0).expect("a radius"))));
    surfaces
}

/// Levels and weights of an integral from `low` to `high`: the three-point Gauss rule on `pieces`.
fn gauss_levels([low, high]: [f64; 2], pieces: u32) -> Vec<(f64, f64)> {
    let rule = [(-0.6_f64.sqrt(), 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.6_f64.sqrt(), 5.0 / 18.0)];
    let step = (high - low) / f64::from(pieces);
    (0..pieces)
        .flat_map(|k| {
            let middle = low + step * (f64::from(k) + 0.5);
            rule.map(|(node, weight)| (middle + node * step / 2.0, weight * step))
        })
        .collect()
}

#[test]
fn outlines_close_and_layers_add_up_to_the_volume() {
    for (mesh_name, mesh) in meshes() {
        let volume = volume_mm3(&mesh);
        let solid = Solid::new(mesh);
        for (surface_name, surface) in surfaces() {
            // Caps have no single thickness by level; the volume is that of the columns above the
            // chart, which the sphere's area does not tell. They are tested for closing alone.
            let is_cap = surface_name == "caps";
            let range = level_range(&solid, surface.as_ref()).unwrap();
            let levels = gauss_levels(range, 250);
            let cuts = levels.iter().map(|(level, _)| *level).collect();
            let cutter = Cutter::at_levels(&solid, surface.as_ref(), cuts);
            let sections: Vec<_> =
                (0..levels.len()).into_par_iter().map(|k| cutter.section(k, 5e-4)).collect();
            let mut sum = 0.0;
            for (section, (level, weight)) in sections.iter().zip(&levels) {
                assert_eq!(section.tears, Tears::default(), "{mesh_name}, {surface_name}");
                sum +=
                    weight * surface.chart(*level).area(&section.region) / surface.level_step(1.0);
            }
            let error = sum / volume - 1.0;
            assert!(is_cap || error.abs() < 1e-4, "{mesh_name}, {surface_name}: {error:e}");
        }
    }
}

/// The real models beside the repository that are closed as they come; none in a plain clone.
fn real_models() -> Vec<(String, Solid)> {
    let manifest = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let Some(folder) = manifest.ancestors().nth(3).map(|dir| dir.join("shared/models/real")) else {
        return Vec::new();
    };
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("a readable folder").path()).collect();
    paths.sort();
    let read = |path: &std::path::PathBuf| {
        let bytes = std::fs::read(path).expect("a readable model");
        // Larger ones take minutes without optimization and show nothing else.
        const MOST_BYTES: usize = 3_000_000;
        if path.extension()? != "stl" || bytes.len() > MOST_BYTES {
            return None;
        }
        let soup = mesh::stl::read(&bytes).ok()?.0;
        let (solid, health) = mesh::health::solid_from_soup(&soup).ok()?;
        let lowest = solid.mesh().bounds().min;
        let centre = nalgebra::center(&lowest, &solid.mesh().bounds().max);
        let shift = Vector3::new(-centre.x, -centre.y, 0.1 - lowest.z);
        // The volume of shells that overlap counts twice what a section has once.
        let is_closed = health.repairs().next().is_none()
            && health.nonmanifold_edges == 0
            && health.shells == 1;
        let name = path.file_name()?.to_string_lossy().into_owned();
        is_closed.then(|| (name, solid.moved(|p| p + shift)))
    };
    paths.iter().filter_map(read).collect()
}

#[test]
fn real_models_close_and_add_up_too() {
    for (k, (name, solid)) in real_models().iter().enumerate() {
        let volume = volume_mm3(solid.mesh());
        // Cones both ways and spheres; each model meets other ones.
        let surfaces = surfaces();
        let chosen = [k % 3, 3 + k % 4, 7 + k % 3];
        for (surface_name, surface) in chosen.map(|i| &surfaces[i]) {
            let range = level_range(solid, surface.as_ref()).unwrap();
            let levels = gauss_levels(range, 120);
            let cuts = levels.iter().map(|(level, _)| *level).collect();
            let cutter = Cutter::at_levels(solid, surface.as_ref(), cuts);
            let areas: Vec<f64> = (0..levels.len())
                .into_par_iter()
                .map(|k| {
                    let section = cutter.section(k, 1e-3);
                    assert_eq!(section.tears, Tears::default(), "{name}, {surface_name}");
                    surface.chart(levels[k].0).area(&section.region)
                })
                .collect();
            let sum: f64 = areas.iter().zip(&levels).map(|(area, (_, weight))| area * weight).sum();
            let error = sum / surface.level_step(1.0) / volume - 1.0;
            assert!(error.abs() < 1e-4, "{name}, {surface_name}: {error:e}");
        }
    }
}

fn section(solid: &Solid, surface: &dyn LayerSurface, level: f64) -> Region {
    let cutter = Cutter::at_levels(solid, surface, vec![level]);
    let section = cutter.section(0, 0.001);
    assert_eq!(section.tears, Tears::default());
    section.region
}

#[test]
fn turning_the_part_turns_its_sections() {
    let mut random = Random(11);
    for (name, mesh) in meshes() {
        let solid = Solid::new(mesh);
        for (surface_name, surface) in surfaces() {
            let [low, high] = level_range(&solid, surface.as_ref()).unwrap();
            let turn = Rotation3::new(Vector3::z() * (random.next() * TAU));
            let turned = solid.moved(|p| turn * p);
            for share in [0.1, 0.35, 0.5, 0.8] {
                let level = low + share * (high - low);
                let chart = surface.chart(level);
                let [a, b] = [&solid, &turned]
                    .map(|solid| chart.area(&section(solid, surface.as_ref(), level)));
                let slack = 0.002 * chart.perimeter(&section(&solid, surface.as_ref(), level));
                assert!((a - b).abs() < slack + 1e-6, "{name}, {surface_name}: {a} and {b}");
            }
        }
    }
}

#[test]
fn flat_limits_are_the_plane() {
    let flat: [Box<dyn LayerSurface>; 4] = [
        Box::new(Cone::new(1e-9).unwrap()),
        Box::new(Cone::new(-1e-9).unwrap()),
        Box::new(Spheres::new(-1e9).unwrap()),
        Box::new(Caps::new(1e9).unwrap()),
    ];
    for (name, mesh) in meshes() {
        let solid = Solid::new(mesh);
        let [low, high] = level_range(&solid, &Plane).unwrap();
        for share in [0.03, 0.21, 0.5, 0.77] {
            let level = low + share * (high - low);
            let planar = section(&solid, &Plane, level);
            for surface in &flat {
                let curved = section(&solid, surface.as_ref(), level);
                let apart = planar.difference(&curved).area() + curved.difference(&planar).area();
                assert!(apart < 0.002 * planar.perimeter(), "{name}: {apart} mm²");
            }
        }
    }
}

#[test]
fn points_lie_on_their_layer_and_on_the_mesh() {
    for (surface_name, surface) in surfaces() {
        let solid = Solid::new(shapes::block(24.0, 16.0, 20.0));
        let [low, high] = level_range(&solid, surface.as_ref()).unwrap();
        for k in 1..40 {
            let level = low + (high - low) * f64::from(k) / 40.0;
            for p in section(&solid, surface.as_ref(), level).rings().flatten() {
                let at = surface.lift(level, &geom::grid::mm(*p));
                let off = [at.x.abs() - 12.0, at.y.abs() - 8.0, (at.z - 10.0).abs() - 10.0];
                let nearest = off.into_iter().fold(f64::NEG_INFINITY, f64::max);
                assert!(nearest.abs() < 2e-5, "{surface_name}: {at} is {nearest} off the block");
            }
        }
    }
}

#[test]
fn vertices_sides_and_facets_on_the_level_do_no_harm() {
    // Whole facets of a block lie on planes, its corners on cones of slope 1 and on spheres.
    let block = shapes::block(20.0, 20.0, 20.0);
    let solid = Solid::new(block);
    let surfaces: [Box<dyn LayerSurface>; 4] = [
        Box::new(Plane),
        Box::new(Cone::from_slope(1.0).unwrap()),
        Box::new(Cone::from_slope(-1.0).unwrap()),
        Box::new(Spheres::new(0.0).unwrap()),
    ];
    for surface in &surfaces {
        for p in &solid.mesh().vertices {
            let level = surface.level(p);
            for level in [level.next_down(), level, level.next_up()] {
                section(&solid, surface.as_ref(), level).check();
            }
        }
        for level in [0.0, 10.0, 20.0, 30.0] {
            section(&solid, surface.as_ref(), level).check();
        }
    }
}

#[test]
fn an_open_mesh_is_closed_or_reported() {
    let mut mesh = shapes::block(20.0, 20.0, 20.0);
    mesh.triangles.truncate(10);
    let solid = Solid::new(mesh);
    let surface = Cone::new(0.4).unwrap();
    let [low, high] = level_range(&solid, &surface).unwrap();
    let cuts = (1..30).map(|k| low + (high - low) * f64::from(k) / 30.0).collect();
    let cutter = Cutter::at_levels(&solid, &surface, cuts);
    let torn = (0..29).filter(|&k| cutter.section(k, 0.002).tears != Tears::default()).count();
    assert!(torn > 0, "two facets are missing");
}
