//! What holds for any input.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use mesh::health::{Health, solid_from_soup};
use mesh::mesh::Mesh;
use mesh::orient::{OrientParams, Rest, rest};
use mesh::place::{placed, reference_azimuth};
use mesh::repair::repair;
use mesh::soup::{Facet, Soup};
use mesh::topology::Solid;
use mesh::weld::weld;
use mesh::{measure, shapes, stl};
use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use proptest::prelude::*;
use proptest::sample::{Index, select};

const USUAL: OrientParams = OrientParams {
    class_tolerance_rad: std::f64::consts::PI / 180.0,
    overhang_rad: std::f64::consts::FRAC_PI_4,
};

fn soup_of(mesh: &Mesh) -> Soup {
    let single = |p: Point3<f64>| [p.x as f32, p.y as f32, p.z as f32];
    let corners = (0..mesh.triangles.len() as u32).map(|t| mesh.corners(t));
    Soup { facets: corners.map(|c| c.map(single)).collect() }
}

fn mesh_of(facets: &[Facet]) -> Mesh {
    let corners = facets.as_flattened().iter();
    Mesh {
        vertices: corners.map(|p| Point3::from(p.map(f64::from))).collect(),
        triangles: (0..facets.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    }
}

fn shape() -> impl Strategy<Value = Mesh> {
    select(&shapes::NAMES[..]).prop_map(|name| shapes::by_name(name).unwrap())
}

fn small_shape() -> impl Strategy<Value = Mesh> {
    select(&["cube", "cross", "steps", "tetrahedron", "plate", "wall-1.0"][..])
        .prop_map(|name| shapes::by_name(name).unwrap())
}

fn pose() -> impl Strategy<Value = Isometry3<f64>> {
    let angle = -3.0..3.0;
    (angle.clone(), angle.clone(), angle, -90.0..90.0, -90.0..90.0).prop_map(|(a, b, c, x, y)| {
        let rotation = Rotation3::from_euler_angles(a, b, c);
        Isometry3::from_parts(Vector3::new(x, y, 0.0).into(), rotation.into())
    })
}

/// Facets between the points of a grid of 3 × 3 × 3: everything that can go wrong, often.
fn tangle() -> impl Strategy<Value = Soup> {
    let point = [0_u8..3, 0_u8..3, 0_u8..3].prop_map(|p| p.map(f32::from));
    let facet = [point.clone(), point.clone(), point];
    prop::collection::vec(facet, 1..40).prop_map(|facets| Soup { facets })
}

/// Some facets of a sound shape removed, doubled or turned over.
fn damaged() -> impl Strategy<Value = Soup> {
    let damage = prop::collection::vec((any::<Index>(), 0_u8..4), 0..6);
    (small_shape(), damage).prop_map(|(mesh, damage)| {
        let mut facets = soup_of(&mesh).facets;
        for (index, kind) in damage {
            let i = index.index(facets.len());
            match kind {
                0 if facets.len() > 1 => drop(facets.remove(i)),
                1 => facets.push(facets[i]),
                2 => facets[i].swap(0, 1),
                _ => facets[i].rotate_left(1),
            }
        }
        Soup { facets }
    })
}

fn shuffled(soup: &Soup, seed: u64) -> Soup {
    let mut facets = soup.facets.clone();
    let mut state = seed;
    for i in (1..facets.len()).rev() {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        facets.swap(i, (state >> 33) as usize % (i + 1));
    }
    Soup { facets }
}

/// What must not depend on the order of the facets.
fn numbers(health: &Health) -> ([usize; 8], Vec<&'static str>) {
    let counts = [
        health.facets,
        health.triangles,
        health.shells,
        health.open_edges,
        health.nonmanifold_edges,
        health.flipped,
        health.degenerate,
        health.duplicate,
    ];
    (counts, health.notes.iter().map(|n| n.code).collect())
}

/// Failures become tests of their own, not files.
fn cases(n: u32) -> ProptestConfig {
    ProptestConfig { cases: n, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn what_is_written_is_read(
        facets in prop::collection::vec(any::<[[i32; 3]; 3]>(), 1..200),
    ) {
        // Thousandths of a millimetre, exact or rounded to f32 alike.
        let facets: Vec<Facet> =
            facets.iter().map(|f| f.map(|p| p.map(|c| (f64::from(c) / 1000.0) as f32))).collect();
        let (soup, report) = stl::read(&stl::write(&mesh_of(&facets))).unwrap();
        prop_assert_eq!(report.notes.len(), 0);
        prop_assert_eq!(soup.facets, facets);
    }

    #[test]
    fn ascii_is_read_as_stl_io_reads_it(
        facets in prop::collection::vec(prop::array::uniform9(-1e6_f32..1e6), 1..50),
    ) {
        let mut text = "solid a\n".to_owned();
        for f in &facets {
            text += "facet normal 0 0 0\nouter loop\n";
            for p in f.chunks(3) {
                text += &format!("vertex {} {:e} {:.3}\n", p[0], p[1], p[2]);
            }
            text += "endloop\nendfacet\n";
        }
        text += "endsolid a\n";
        let (soup, _) = stl::read(text.as_bytes()).unwrap();
        let mut reader = std::io::Cursor::new(text.as_bytes());
        let oracle = stl_io::create_stl_reader(&mut reader).unwrap();
        let expected: Vec<Facet> =
            oracle.map(|t| t.unwrap().vertices.map(|v| v.0.map(|c| c + 0.0))).collect();
        prop_assert_eq!(soup.facets, expected);
    }

    #[test]
    fn bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = stl::read(&bytes);
        let mut text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex ".to_vec();
        text.extend(&bytes);
        let _ = stl::read(&text);
        let mut binary = vec![0; 84];
        binary[80] = (bytes.len() / 50) as u8;
        binary.extend(&bytes[..bytes.len() / 50 * 50]);
        if let Ok((soup, _)) = stl::read(&binary) {
            let _ = solid_from_soup(&soup);
        }
    }

    #[test]
    fn damaged_text_never_panics(at in any::<Index>(), byte in any::<u8>(), cut in any::<Index>()) {
        let facet = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex \
                     0 1 0\n endloop\nendfacet\n";
        let mut text = format!("solid a\n{facet}{facet}endsolid a\n").into_bytes();
        let at = at.index(text.len());
        text[at] = byte;
        let _ = stl::read(&text);
        let _ = stl::read(&text[..cut.index(text.len())]);
    }

    #[test]
    fn welding_keeps_the_volume(mesh in shape(), pose in pose()) {
        let soup = soup_of(&mesh.transformed(&pose));
        let loose = measure::volume_mm3(&mesh_of(&soup.facets));
        let (welded, report) = weld(&soup);
        prop_assert_eq!(report.corners, 3 * soup.facets.len());
        prop_assert_eq!(welded.vertices.len(), mesh.vertices.len());
        let volume = measure::volume_mm3(&welded);
        prop_assert!((volume - loose).abs() <= 1e-9 * loose.abs());
        prop_assert_eq!(Solid::new(welded).open_sides(), 0);
    }

    #[test]
    fn sound_shapes_need_no_repair(mesh in shape(), pose in pose()) {
        let (solid, health) = solid_from_soup(&soup_of(&mesh.transformed(&pose))).unwrap();
        prop_assert_eq!(&health.notes, &[]);
        let volume = measure::volume_mm3(&mesh);
        prop_assert!((health.volume_mm3 / volume - 1.0).abs() < 1e-4);
        prop_assert!(solid.check().is_ok());
    }

    #[test]
    fn facet_order_does_not_matter(soup in damaged(), seed in any::<u64>()) {
        let (a, b) = (solid_from_soup(&soup), solid_from_soup(&shuffled(&soup, seed)));
        match (a, b) {
            (Ok((_, a)), Ok((_, b))) => {
                prop_assert_eq!(numbers(&a), numbers(&b));
                prop_assert!((a.volume_mm3 - b.volume_mm3).abs() <= 1e-6 * a.area_mm2);
                prop_assert!((a.area_mm2 - b.area_mm2).abs() <= 1e-6 * a.area_mm2);
            }
            (a, b) => prop_assert_eq!(a.is_ok(), b.is_ok()),
        }
    }

    #[test]
    fn holes_in_a_ball_are_closed(
        level in 1_u32..4,
        missing in prop::collection::vec(any::<Index>(), 1..8),
        pose in pose(),
    ) {
        let ball = shapes::icosphere(level, 10.0).transformed(&pose);
        let mut soup = soup_of(&ball);
        for index in &missing {
            soup.facets.remove(index.index(soup.facets.len()));
        }
        let (solid, health) = solid_from_soup(&soup).unwrap();
        prop_assert_eq!((solid.open_sides(), health.shells), (0, 1));
        prop_assert!(health.has("HolesClosed"));
        prop_assert_eq!(health.guessed, health.has("ShapeGuessed"));
        // What is cut off is less than a facet's area by a facet's width, for each.
        let facet = measure::area_mm2(&ball) / ball.triangles.len() as f64;
        let lost = missing.len() as f64 * facet * facet.sqrt();
        prop_assert!((health.volume_mm3 - measure::volume_mm3(&ball)).abs() < lost);
    }

    #[test]
    fn turning_the_model_does_not_change_how_it_rests(mesh in small_shape(), pose in pose()) {
        let lying = |mesh: &Mesh| {
            let (rotation, rest) = rest(mesh, &USUAL);
            let Rest::Flat(best) = rest else { panic!("{rest:?}") };
            let (solid, _) = placed(&Solid::new(mesh.clone()), &rotation);
            (best, solid)
        };
        let (a, solid) = lying(&mesh);
        let (b, turned) = lying(&mesh.transformed(&pose));
        let total = measure::area_mm2(&mesh);
        prop_assert!((a.class_area_mm2 - b.class_area_mm2).abs() < 1e-6 * total);
        prop_assert!((a.bed_area_mm2 - b.bed_area_mm2).abs() < 1e-6 * total);
        prop_assert!((a.overhang_area_mm2 - b.overhang_area_mm2).abs() < 1e-6 * total);
        let (a, b) = (solid.mesh().bounds(), turned.mesh().bounds());
        prop_assert_eq!(b.min.z, 0.0);
        prop_assert!((a.max.z - b.max.z).abs() < 1e-9);
    }
}

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn tangles_become_solids_or_are_refused(soup in tangle()) {
        if let Ok((solid, health)) = solid_from_soup(&soup) {
            prop_assert!(solid.check().is_ok(), "{:?}", solid.check());
            prop_assert_eq!(solid.open_sides(), health.open_edges_left);
            let sides: usize = solid.shells().iter().map(|s| s.open_sides).sum();
            prop_assert_eq!(sides, solid.open_sides());
            let triangles: usize = solid.shells().iter().map(|s| s.triangles).sum();
            prop_assert_eq!(triangles, solid.mesh().triangles.len());
        }
    }

    #[test]
    fn the_number_of_threads_does_not_matter(soup in tangle()) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let alone = pool.install(|| solid_from_soup(&soup));
        prop_assert_eq!(alone, solid_from_soup(&soup));
    }

    #[test]
    fn a_second_repair_finds_nothing_to_do(soup in tangle()) {
        let (mesh, _) = repair(weld(&soup).0);
        let (again, report) = repair(mesh.clone());
        prop_assert!(!report.has_changes(), "{report:?}");
        prop_assert_eq!(again, mesh);
    }

    #[test]
    fn the_reference_turns_with_the_part(soup in tangle(), angle in 0.01..6.2) {
        let mesh = mesh_of(&soup.facets);
        let turned = mesh.transformed(&Isometry3::rotation(Vector3::z() * angle));
        let reference = reference_azimuth(&mesh);
        let found = reference_azimuth(&turned);
        let back = turned.transformed(&Isometry3::rotation(Vector3::z() * -found));
        let straight = mesh.transformed(&Isometry3::rotation(Vector3::z() * -reference));
        // Symmetric parts may differ by their symmetry: compare moments, not angles.
        let moments = |mesh: &Mesh| measure::surface_moments(mesh).map(|m| m.second_mm4);
        if let (Some(a), Some(b)) = (moments(&straight), moments(&back)) {
            prop_assert!((a - b).norm() < 1e-5 * a.norm().max(1.0), "{reference} {found}");
        }
    }
}
