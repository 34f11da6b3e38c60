//! A model that stands on the bed turned by some angle is printed the same: only the bed is turned.

use std::collections::BTreeMap;

use mesh::mesh::Mesh;
use mesh::shapes;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestRunner};

use crate::program::{Motion, motions};
use crate::run::Scratch;

/// Thick layers and little inside: the order of things is what is tested.
const QUICK: [&str; 6] = [
    "--set",
    "layer_height_mm=0.3",
    "--set",
    "first_layer_height_mm=0.3",
    "--set",
    "fill_density=10%",
];

fn program(mesh: &Mesh, angle: f64) -> String {
    program_in(&[], mesh, angle)
}

fn program_in(layers: &[&str], mesh: &Mesh, angle: f64) -> String {
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle.to_radians());
    let mut turned = mesh.clone();
    for p in &mut turned.vertices {
        *p = turn * *p;
    }
    let scratch = Scratch::new();
    scratch.file("model.stl", mesh::stl::write(&turned));
    let mut arguments = vec!["slice", "model.stl", "-q", "-o", "-", "--orient", "keep"];
    arguments.extend(QUICK);
    arguments.extend(layers);
    scratch.run(&arguments).expect(0).out
}

/// How far numbers of two programs may differ when the corners of the model were rounded anew: a
/// step of the last place, more for what is computed from such numbers.
const SAME_RAIL_MM: f64 = 0.001_1;
const SAME_FILAMENT_MM: f64 = 1e-4;
const SAME_SPEED_SHARE: f64 = 0.02;
const SAME_TURN_DEG: f64 = 2.1e-4;

/// Expects that two programs differ in nothing but the turn of the bed, motion by motion from the
/// first that lays something, and there by one angle and whole turns. Returns that angle.
fn differ_by(one: &str, other: &str) -> f64 {
    let [one, other] = [one, other].map(motions);
    let [one, other] = [&one, &other].map(|all| {
        let first = all.iter().position(Motion::lays).unwrap();
        &all[first..]
    });
    assert_eq!(one.len(), other.len(), "as many motions");
    let by = other[0].to[1] - one[0].to[1];
    for (a, b) in one.iter().zip(other) {
        let lines = || format!("{a:?}\n{b:?}");
        assert_eq!((a.role, a.layer, a.width), (b.role, b.layer, b.width), "{}", lines());
        assert!((a.to[0] - b.to[0]).abs() <= SAME_RAIL_MM, "{}", lines());
        assert!((a.to[2] - b.to[2]).abs() <= SAME_RAIL_MM, "{}", lines());
        assert!((a.e - b.e).abs() <= SAME_FILAMENT_MM, "{}", lines());
        assert!((a.speed / b.speed - 1.0).abs() <= SAME_SPEED_SHARE, "{}", lines());
        // Half a turn one way or the other is the same to a travel; the count goes on from there.
        let off = (b.to[1] - a.to[1] - by + 180.0).rem_euclid(360.0) - 180.0;
        assert!(!a.lays() || off.abs() <= SAME_TURN_DEG, "{}", lines());
    }
    by
}

#[test]
fn turning_a_cube_turns_the_bed_and_nothing_else() {
    let cube = shapes::cube(12.0);
    let straight = program(&cube, 0.0);
    for angle in [17.3, -45.0, 123.456] {
        let by = differ_by(&straight, &program(&cube, angle));
        // A cube cannot be told from one that is turned by a right angle.
        let off = (by - angle + 45.0).rem_euclid(90.0) - 45.0;
        assert!(off.abs() <= SAME_TURN_DEG, "turned by {angle}, printed by {by}");
    }
}

/// Way and volume by layer and role.
fn sums(text: &str) -> BTreeMap<(usize, &str), [f64; 2]> {
    let mut sums = BTreeMap::new();
    for motion in motions(text).iter().filter(|motion| motion.lays()) {
        let sum: &mut [f64; 2] = sums.entry((motion.layer.unwrap(), motion.role)).or_default();
        sum[0] += motion.path();
        sum[1] += motion.volume();
    }
    sums
}

/// How much of a role a layer may get more or less when places are rounded anew: mm and mm³.
const SAME_SUMS: [f64; 2] = [0.1, 0.01];

/// The turn of the bed at the first line of material, degrees.
fn first_turn(text: &str) -> f64 {
    motions(text).iter().find(|motion| motion.lays()).unwrap().from[1]
}

/// At any angle, each layer gets as much of everything. Which of two equal ways between lines is
/// taken is left to the last bit, so their order is not compared.
#[test]
fn turning_a_part_by_any_angle_changes_no_layer() {
    // No two sides or corners of it are alike.
    let outline = [[-9.0, -7.3], [11.2, -5.1], [7.7, 9.4], [-0.8, 4.9], [-6.1, 6.2]];
    let hole = vec![[-3.0, -2.2], [2.1, -1.1], [0.6, 1.9]];
    let mesh = shapes::extruded(&outline, &[hole], 4.0);
    let straight = program(&mesh, 0.0);
    let seed = RngSeed::Fixed(7);
    let config =
        Config { cases: 8, rng_seed: seed, failure_persistence: None, ..Config::default() };
    TestRunner::new(config)
        .run(&(-360.0..360.0), |angle| {
            let turned = program(&mesh, angle);
            let by = first_turn(&turned) - first_turn(&straight);
            let off = (by - angle + 180.0).rem_euclid(360.0) - 180.0;
            // A step of the rail at the skirt, 18 mm from the axis.
            prop_assert!(off.abs() <= 0.01, "turned by {angle}, printed by {by}");
            let (a, b) = (sums(&straight), sums(&turned));
            prop_assert!(a.keys().eq(b.keys()), "as many layers with the same roles");
            for (key, sum) in &a {
                for k in 0..2 {
                    let off = (sum[k] - b[key][k]).abs();
                    prop_assert!(off <= SAME_SUMS[k], "{key:?}: {sum:?}, {:?}", b[key]);
                }
            }
            Ok(())
        })
        .unwrap();
}

/// The same with layers of every surface: each layer gets as much material, at the same heights.
#[test]
fn turning_a_part_turns_its_curved_layers() {
    let outline = [[-9.0, -7.3], [11.2, -5.1], [7.7, 9.4], [-0.8, 4.9], [-6.1, 6.2]];
    let mesh = shapes::extruded(&outline, &[], 5.0);
    for layers in [
        ["--layers=conical", "--cone-angle=15"],
        ["--layers=conical", "--cone-angle=-15"],
        ["--layers=spherical", "--sphere-centre=-40"],
        ["--layers=caps", "--cap-radius=60"],
        ["--layers=planar:0-1.5,blend,conical", "--cone-angle=5"],
        ["--layers=planar:0-1.5,spherical:1.5-4,planar", "--sphere-centre=-40"],
    ] {
        let straight = program_in(&layers, &mesh, 0.0);
        let turned = program_in(&layers, &mesh, 73.1);
        let by = first_turn(&turned) - first_turn(&straight);
        let off = (by - 73.1 + 180.0).rem_euclid(360.0) - 180.0;
        assert!(off.abs() <= 0.01, "{layers:?}: printed by {by}");
        let by_layer = |text: &str| {
            let mut layers: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
            for motion in motions(text).iter().filter(|motion| motion.lays()) {
                let sum = layers.entry(motion.layer.unwrap()).or_insert([0.0, f64::NEG_INFINITY]);
                sum[0] += motion.volume();
                sum[1] = sum[1].max(motion.to[2]);
            }
            layers
        };
        let (a, b) = (by_layer(&straight), by_layer(&turned));
        assert!(a.len() > 10 && a.keys().eq(b.keys()), "{layers:?}: as many layers");
        for ((layer, a), b) in a.iter().zip(b.values()) {
            let same = (a[0] - b[0]).abs() <= 0.005 * a[0] && (a[1] - b[1]).abs() <= 0.01;
            assert!(same, "{layers:?}, layer {layer}: {a:?} and {b:?}");
        }
    }
}
