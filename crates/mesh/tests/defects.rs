//! One defect each, built in code: what is said about it and what comes out.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use mesh::health::{Health, MeshError, solid_from_soup};
use mesh::mesh::Mesh;
use mesh::shapes;
use mesh::soup::{Facet, Soup};
use mesh::topology::Solid;

type Corner = [f32; 3];

/// A box from one corner to the other.
fn block(from: Corner, to: Corner) -> Vec<Facet> {
    let size = [0, 1, 2].map(|k| f64::from(to[k] - from[k]));
    let unit = shapes::block(size[0], size[1], size[2]);
    let snap = |c: f64, k: usize| if c > size[k] / 2.0 { to[k] } else { from[k] };
    let corner = |v: u32| {
        let p = unit.vertices[v as usize];
        [snap(p.x + size[0] / 2.0, 0), snap(p.y + size[1] / 2.0, 1), snap(p.z, 2)]
    };
    unit.triangles.iter().map(|t| t.map(corner)).collect()
}

fn cube() -> Vec<Facet> {
    block([-10.0, -10.0, 0.0], [10.0, 10.0, 20.0])
}

fn turned(facets: &[Facet]) -> Vec<Facet> {
    facets.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
}

fn moved(facets: &[Facet], by: Corner) -> Vec<Facet> {
    let add = |p: Corner| [p[0] + by[0], p[1] + by[1], p[2] + by[2]];
    facets.iter().map(|f| f.map(add)).collect()
}

fn solid(facets: Vec<Facet>) -> (Solid, Health) {
    let (solid, health) = solid_from_soup(&Soup { facets }).unwrap();
    solid.check().unwrap();
    assert_eq!(solid.open_sides(), 0);
    (solid, health)
}

fn codes(health: &Health) -> Vec<&'static str> {
    health.notes.iter().map(|n| n.code).collect()
}

/// Checks the notes and the volume, mm³.
fn check(facets: Vec<Facet>, expected: &[&str], volume: f64) -> Health {
    let (_, health) = solid(facets);
    assert_eq!(codes(&health), expected, "{:?}", health.notes);
    let error = (health.volume_mm3 - volume).abs();
    assert!(error < 1e-3 * volume.max(1.0), "{} mm³, not {volume}", health.volume_mm3);
    health
}

fn refused(facets: Vec<Facet>) {
    let error = solid_from_soup(&Soup { facets }).unwrap_err();
    assert_eq!(error.class(), "NoVolume");
    assert!(matches!(error, MeshError::NoVolume { .. }));
}

#[test]
fn seams() {
    let shifted = |shift: f32| -> Vec<Facet> {
        let shift_odd = |(i, f): (usize, &Facet)| {
            let odd = i % 2 == 1;
            f.map(|p| p.map(|c| if odd && c == 10.0 { c + shift } else { c }))
        };
        cube().iter().enumerate().map(shift_odd).collect()
    };
    let one_step = f32::from_bits(10_f32.to_bits() + 1) - 10.0;
    check(shifted(one_step), &["VerticesWelded"], 8000.0);
    check(shifted(1e-3), &["VerticesWelded"], 8000.0);
    // -0 and 0 are the same place, and not worth a word.
    let at_origin = moved(&cube(), [10.0, 10.0, 0.0]);
    let minus = at_origin
        .iter()
        .enumerate()
        .map(|(i, f)| f.map(|p| p.map(|c| if c == 0.0 && i % 2 == 1 { -0.0 } else { c })));
    check(minus.collect(), &[], 8000.0);
}

#[test]
fn far_from_the_origin() {
    check(moved(&cube(), [1e6, 1e6, 0.0]), &[], 8000.0);
    let (_, health) = solid(moved(&cube(), [1e8, 1e8, 0.0]));
    assert_eq!(codes(&health), ["PrecisionLost"]);
}

#[test]
fn facets_too_many() {
    let points = vec![[[3.0; 3]; 3], [[0.0, 0.0, 20.0], [0.0, 0.0, 20.0], [10.0, 10.0, 20.0]]];
    check([cube(), points].concat(), &["DegenerateRemoved"], 8000.0);
    let again = |facets: Vec<Facet>| check(facets, &["DuplicatesRemoved"], 8000.0).duplicate;
    assert_eq!(again([cube(), cube()[4..8].to_vec()].concat()), 4);
    let rotated = cube()[4..8].iter().map(|[a, b, c]| [*b, *c, *a]).collect();
    assert_eq!(again([cube(), rotated].concat()), 4);
    assert_eq!(again([cube(), cube()].concat()), 12);
    assert_eq!(again([cube(), turned(&cube()[4..6])].concat()), 2);
    assert_eq!(again([cube(), turned(&cube())].concat()), 12);
}

#[test]
fn windings() {
    let reoriented = |facets: Vec<Facet>| check(facets, &["FacetsReoriented"], 8000.0).flipped;
    assert_eq!(reoriented(turned(&cube())), 12);
    let some = |wanted: fn(usize) -> bool| -> Vec<Facet> {
        let turn = |(i, f): (usize, &Facet)| if wanted(i) { turned(&[*f])[0] } else { *f };
        cube().iter().enumerate().map(turn).collect()
    };
    assert_eq!(reoriented(some(|i| i == 0)), 1);
    assert_eq!(reoriented(some(|i| i % 2 == 1)), 6);
}

#[test]
fn holes() {
    let without = |range: std::ops::Range<usize>| {
        let mut facets = cube();
        facets.drain(range);
        facets
    };
    let health = check(without(4..5), &["HolesClosed"], 8000.0);
    assert_eq!((health.open_edges, health.open_edges_left), (3, 0));
    check(without(2..4), &["HolesClosed"], 8000.0);
    check(without(4..6), &["HolesClosed"], 8000.0);
    let (_, health) = solid(without(4..8));
    assert_eq!(codes(&health), ["HolesClosed", "ShapeGuessed"]);
    assert!(health.guessed);
    // A vertex in the middle of a neighbour's side: no hole, but a crack.
    let mut cracked = without(2..4);
    let at = |x: f32, y: f32| [x, y, 20.0];
    cracked.push([at(-10.0, -10.0), at(10.0, -10.0), at(0.0, 10.0)]);
    cracked.push([at(10.0, -10.0), at(10.0, 10.0), at(0.0, 10.0)]);
    cracked.push([at(-10.0, -10.0), at(0.0, 10.0), at(-10.0, 10.0)]);
    check(cracked, &["TJunction"], 8000.0);
}

#[test]
fn surfaces_without_an_inside() {
    let wall = [[0.0, -10.0, 0.0], [0.0, 10.0, 0.0], [0.0, 10.0, 20.0], [0.0, -10.0, 20.0_f32]];
    let partition = vec![[wall[0], wall[1], wall[2]], [wall[0], wall[2], wall[3]]];
    check([cube(), partition.clone()].concat(), &["OpenShellDropped"], 8000.0);
    let fin = vec![[[-10.0, -10.0, 20.0], [10.0, -10.0, 20.0], [0.0, -10.0, 30.0]]];
    check([cube(), fin].concat(), &["OpenShellDropped", "NonManifold"], 8000.0);
    refused(partition);
    refused(cube()[..1].to_vec());
    refused(block([-10.0, 0.0, 0.0], [10.0, 0.0, 20.0]));
    refused(vec![[[3.0; 3]; 3]; 12]);
    refused((1..13).map(|i| [0.0, i as f32, 2.0 * i as f32].map(|c| [c; 3])).collect());
    refused(moebius_strip());
    refused(Vec::new());
}

/// Damage that can be mended in several ways is mended in one, however the file is ordered. Each
/// was found by a search in random damage.
#[test]
fn the_order_of_facets_decides_nothing() {
    let without = |missing: &[usize]| -> Vec<Facet> {
        (0..12).filter(|i| !missing.contains(i)).map(|i| cube()[i]).collect()
    };
    let doubled = |missing: &[usize], i: usize| [without(missing), vec![cube()[i]]].concat();
    let lined = |missing: &[usize], i: usize| [without(missing), turned(&cube()[i..=i])].concat();
    let said = |facets: Vec<Facet>| {
        let (solid, health) = solid(facets);
        (solid.mesh().triangles.len(), health.volume_mm3.round(), codes(&health))
    };
    for facets in [doubled(&[2, 4], 5), lined(&[2, 4], 5), without(&[0, 2, 5, 11])] {
        let first = said(facets.clone());
        for (stride, shift) in [(1, 3), (1, 7), (5, 0), (5, 2), (7, 1), (7, 4)] {
            let at = |i: usize| facets[(i * stride + shift) % facets.len()];
            assert_eq!(said((0..facets.len()).map(at).collect()), first, "{stride}, {shift}");
        }
    }
}

fn moebius_strip() -> Vec<Facet> {
    const N: u32 = 60;
    let at = |i: u32, side: f64| {
        let turn = f64::from(i) / f64::from(N) * std::f64::consts::TAU;
        let radius = 20.0 + side * (turn / 2.0).cos();
        [radius * turn.cos(), radius * turn.sin(), side * (turn / 2.0).sin()].map(|c| c as f32)
    };
    let quad = |i: u32| [at(i, -5.0), at(i, 5.0), at(i + 1, -5.0), at(i + 1, 5.0)];
    (0..N).map(quad).flat_map(|[a, b, c, d]| [[a, c, d], [a, d, b]]).collect()
}

#[test]
fn solids_that_touch() {
    let beside = |x: f32, y: f32, z: f32| [cube(), moved(&cube(), [x, y, z])].concat();
    for facets in [
        beside(20.0, 20.0, 0.0),
        beside(20.0, 20.0, 20.0),
        beside(20.0, 0.0, 0.0),
        beside(0.0, 0.0, 20.0),
        [cube(), block([-5.0, -5.0, 20.0], [5.0, 5.0, 25.0])].concat(),
    ] {
        let (_, health) = solid(facets);
        assert_eq!(codes(&health), ["NonManifold"]);
        assert_eq!(health.shells, 2);
    }
}

#[test]
fn solids_that_overlap() {
    let self_intersection = |facets: Vec<Facet>, volume: f64| {
        let health = check(facets, &["SelfIntersection"], volume);
        assert!(health.overlaps);
    };
    self_intersection([cube(), moved(&cube(), [10.0, 0.0, 0.0])].concat(), 16_000.0);
    self_intersection([cube(), moved(&cube(), [7.3, 5.1, 3.7])].concat(), 16_000.0);
    let small = block([-5.0, -5.0, 5.0], [5.0, 5.0, 15.0]);
    self_intersection([cube(), small.clone()].concat(), 9000.0);
    check([cube(), turned(&small)].concat(), &[], 7000.0);
}

#[test]
fn a_figure_of_eight_is_kept() {
    let bow = [[-10.0, -10.0], [10.0, 10.0], [10.0, -10.0], [-10.0, 10.0_f32]];
    let at = |i: usize, z: f32| [bow[i % 4][0], bow[i % 4][1], z];
    let mut facets = Vec::new();
    for i in 0..4 {
        let [a, b] = [at(i, 0.0), at(i + 1, 0.0)];
        let [c, d] = [at(i, 20.0), at(i + 1, 20.0)];
        facets.extend([[a, b, d], [a, d, c]]);
    }
    facets.extend([[at(0, 0.0), at(2, 0.0), at(1, 0.0)], [at(0, 0.0), at(3, 0.0), at(2, 0.0)]]);
    facets
        .extend([[at(0, 20.0), at(1, 20.0), at(2, 20.0)], [at(0, 20.0), at(2, 20.0), at(3, 20.0)]]);
    let (_, health) = solid(facets);
    assert_eq!(codes(&health), ["SelfIntersection"]);
}

#[test]
fn slivers_survive() {
    // Lids with a facet of 20 mm by 20 nm.
    let outline = [[-10.0, -10.0], [10.0, -10.0], [10.0, 10.0], [0.0, 10.00002], [-10.0, 10.0]];
    let mesh: Mesh = shapes::extruded(&outline, &[], 20.0);
    let single = |p: nalgebra::Point3<f64>| [p.x as f32, p.y as f32, p.z as f32];
    let corners = (0..mesh.triangles.len() as u32).map(|t| mesh.corners(t).map(single));
    let health = check(corners.collect(), &[], 8000.004);
    assert_eq!((health.facets, health.triangles, health.shells), (16, 16, 1));
}

#[test]
fn many_shells() {
    let mut facets = Vec::new();
    for i in 0..40 {
        for j in 0..40 {
            let from = [i as f32, j as f32, 0.0];
            facets.extend(block(from, [from[0] + 0.6, from[1] + 0.6, 0.6]));
        }
    }
    assert_eq!(check(facets, &[], 1600.0 * 0.216).shells, 1600);
    // Shells in shells, solid and hollow by turns.
    let mut facets = Vec::new();
    for i in 0..50 {
        let (low, high) = (i as f32 * 0.1, 20.0 - i as f32 * 0.1);
        let shell = block([low; 3], [high; 3]);
        facets.extend(if i % 2 == 0 { shell } else { turned(&shell) });
    }
    let (_, health) = solid(facets);
    assert_eq!((health.shells, codes(&health)), (50, vec![]));
}
