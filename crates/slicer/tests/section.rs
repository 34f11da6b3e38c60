//! Planar sections of solids that are known exactly.

use std::f64::consts::{FRAC_PI_2, PI};

use geom::grid::mm;
use geom::region::{Region, signed_area};
use mesh::measure::volume_mm3;
use mesh::mesh::Mesh;
use mesh::shapes;
use mesh::topology::Solid;
use nalgebra::{Rotation3, Vector3};
use slicer::level::Level;
use slicer::section::{Cutter, Section, Tears};
use slicer::surface::Plane;

/// How far outlines may be thinned out, mm: the program's own default.
const TOLERANCE_MM: f64 = 0.002;

fn cut_at(mesh: &Mesh, heights: &[f64]) -> Vec<Section> {
    // A level of no thickness has its middle where it is.
    let level = |(index, &z): (usize, &f64)| Level { index, lower: z, upper: z };
    cut(mesh, &heights.iter().enumerate().map(level).collect::<Vec<_>>())
}

fn cut(mesh: &Mesh, levels: &[Level]) -> Vec<Section> {
    let solid = Solid::new(mesh.clone());
    let cutter = Cutter::new(&solid, &Plane, levels);
    (0..levels.len()).map(|k| cutter.section(k, TOLERANCE_MM)).collect()
}

/// Two shells in one mesh.
fn both(a: &Mesh, b: &Mesh) -> Mesh {
    let first = u32::try_from(a.vertices.len()).expect("few vertices");
    let moved = b.triangles.iter().map(|t| t.map(|v| v + first));
    Mesh {
        vertices: a.vertices.iter().chain(&b.vertices).copied().collect(),
        triangles: a.triangles.iter().copied().chain(moved).collect(),
    }
}

fn inside_out(mesh: &Mesh) -> Mesh {
    let triangles = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    Mesh { vertices: mesh.vertices.clone(), triangles }
}

fn shifted(mesh: &Mesh, by: [f64; 3]) -> Mesh {
    let mut mesh = mesh.clone();
    for p in &mut mesh.vertices {
        *p += Vector3::from(by);
    }
    mesh
}

#[test]
fn layers_add_up_to_the_volume_and_every_outline_closes() {
    for name in shapes::NAMES {
        let mesh = shapes::by_name(name).expect("the name is listed");
        let top = mesh.bounds().max.z;
        // Layers that end exactly at the top.
        let count = (top / 0.1).ceil();
        let height = top / count;
        let bound = |i: usize| height * i as f64;
        let levels: Vec<Level> = (0..count as usize)
            .map(|index| Level { index, lower: bound(index), upper: bound(index + 1) })
            .collect();
        let sections = cut(&mesh, &levels);
        for section in &sections {
            section.region.check();
            assert_eq!(section.tears, Tears::default(), "{name}");
            assert!(!section.region.is_empty(), "{name} is printed from bottom to top");
        }
        let sum: f64 =
            levels.iter().zip(&sections).map(|(l, s)| l.thickness() * s.region.area()).sum();
        let share = sum / volume_mm3(&mesh) - 1.0;
        // Steps have flats between layers: half a layer of one column at most.
        assert!(share.abs() < if name == "steps" { 5e-3 } else { 1e-3 }, "{name}: {share}");
    }
}

/// Number of outlines that enclose material, and of those around holes.
fn outlines(region: &Region) -> (usize, usize) {
    let left = region.rings().filter(|ring| signed_area(ring) > 0.0).count();
    (left, region.rings().count() - left)
}

#[test]
fn holes_islands_and_nested_shells() {
    let plate = cut_at(&shapes::plate(), &[2.0]);
    assert_eq!(outlines(&plate[0].region), (1, 3));
    // A hollow cube with a cube in its hollow.
    let hollow =
        both(&shapes::cube(20.0), &shifted(&inside_out(&shapes::cube(14.0)), [0.0, 0.0, 3.0]));
    let nested = both(&hollow, &shifted(&shapes::cube(8.0), [0.0, 0.0, 6.0]));
    let sections = cut_at(&nested, &[1.5, 4.5, 10.0]);
    let areas = [400.0, 400.0 - 196.0, 400.0 - 196.0 + 64.0];
    let counts = [(1, 0), (1, 1), (2, 1)];
    for ((section, area), count) in sections.iter().zip(areas).zip(counts) {
        assert_eq!(outlines(&section.region), count);
        assert!((section.region.area() - area).abs() < 1e-6, "{}", section.region.area());
    }
    // Two that stand apart, and two that overlap.
    let apart = both(&shapes::cube(10.0), &shifted(&shapes::cube(10.0), [15.0, 0.0, 0.0]));
    assert_eq!(outlines(&cut_at(&apart, &[5.0])[0].region), (2, 0));
    let overlapping = both(&shapes::cube(10.0), &shifted(&shapes::cube(10.0), [4.0, 3.0, 0.0]));
    let section = &cut_at(&overlapping, &[5.0])[0];
    assert_eq!(outlines(&section.region), (1, 0));
    assert!((section.region.area() - (200.0 - 6.0 * 7.0)).abs() < 1e-6);
}

#[test]
fn a_cut_through_vertices_sides_and_facets_is_the_one_just_underneath() {
    // The cross has flats at 20 and 40 mm, with facets in the very plane of the cut.
    let cross = shapes::cross(20.0);
    let area = |z: f64| cut_at(&cross, &[z])[0].region.area();
    for (z, wanted) in [(20.0, 400.0), (20.000_01, 2000.0), (40.0, 2000.0), (40.000_01, 400.0)] {
        assert!((area(z) - wanted).abs() < 1e-6, "{z}: {}", area(z));
    }
    // An octahedron stands on a corner; its widest cut runs along four sides.
    let octahedron = shapes::revolved(&[[0.0, 0.0], [10.0, 10.0], [0.0, 20.0]], 4);
    let sections = cut_at(&octahedron, &[0.0, 10.0, 20.0]);
    assert!(sections[0].region.is_empty(), "a corner is no section");
    assert!((sections[1].region.area() - 200.0).abs() < 1e-4);
    assert!(sections[2].region.area() < 1e-6, "{}", sections[2].region.area());
    assert!(sections.iter().all(|section| section.tears == Tears::default()));
    // Every ring of vertices of a sphere, and its poles.
    let sphere = shapes::icosphere(2, 15.0);
    let mut heights: Vec<f64> = sphere.vertices.iter().map(|p| p.z).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    assert!(heights.len() > 10);
    for section in cut_at(&sphere, &heights) {
        section.region.check();
        assert_eq!(section.tears, Tears::default());
    }
}

#[test]
fn material_lies_to_the_left_of_every_outline() {
    let section = &cut_at(&shapes::plate(), &[1.0])[0];
    // All holes lie inside of the plate's rim.
    for ring in section.region.rings() {
        let is_rim = ring.iter().any(|&p| mm(p).coords.amax() > 24.9);
        assert_eq!(signed_area(ring) > 0.0, is_rim);
    }
}

#[test]
fn a_turned_part_has_turned_sections() {
    let part =
        both(&shapes::gear(12, 2.0, 8.0, 4.0), &shifted(&shapes::cube(5.0), [25.0, 3.0, 0.0]));
    let heights = [0.7, 2.5, 4.9, 7.3];
    let straight = cut_at(&part, &heights);
    for angle in [0.3, FRAC_PI_2, 2.0, PI, -1.1] {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        let mut turned = part.clone();
        for p in &mut turned.vertices {
            *p = turn * *p;
        }
        for (a, b) in straight.iter().zip(&cut_at(&turned, &heights)) {
            assert_eq!(outlines(&a.region), outlines(&b.region));
            // Thinning out may keep other points: within its tolerance all along.
            let most = TOLERANCE_MM * a.region.perimeter();
            assert!((a.region.area() - b.region.area()).abs() < most);
            for ring in a.region.rings() {
                let p = mm(ring[0]).coords.push(0.0);
                // A point a little nearer to the axis than a corner is inside in both, or in none.
                let (p, q) = (p * 0.999, turn * (p * 0.999));
                let inside = a.region.contains(&p.xy().into());
                assert_eq!(inside, b.region.contains(&q.xy().into()));
            }
        }
    }
}
