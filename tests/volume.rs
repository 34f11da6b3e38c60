//! As much material as the part holds, in outlines that close.

use crate::program::{Motion, beads, motions, stl_volume, walls};
use crate::run::{Scratch, model, sliced};

/// Solid, without anything beside the part.
const SOLID: [&str; 4] = ["--set", "fill_density=100%", "--set", "skirts=0"];
/// Thicker layers where a part is large: a third less to compute.
const COARSE: [&str; 4] = ["--set", "layer_height_mm=0.3", "--set", "first_layer_height_mm=0.3"];

fn laid(motions: &[Motion]) -> f64 {
    motions.iter().filter(|motion| motion.lays()).map(Motion::volume).sum()
}

/// A solid print holds the volume of its mesh to within a share of it, on the axis and beside it.
#[track_caller]
fn holds_its_volume(name: &str, more: &[&str], share: f64) {
    let wanted = stl_volume(&std::fs::read(model(name)).unwrap());
    let arguments: Vec<&str> = SOLID.into_iter().chain(more.iter().copied()).collect();
    let text = sliced(name, &arguments);
    let motions = motions(&text);
    let error = laid(&motions) / wanted - 1.0;
    assert!(error.abs() <= share, "{name} gets {:+.3} % of its volume too much", error * 100.0);
    // What is drawn back is fed again, but for what is drawn back at the end.
    let fed: f64 = motions.iter().map(|motion| motion.e).sum();
    let for_part: f64 = motions.iter().filter(|motion| motion.lays()).map(|motion| motion.e).sum();
    assert!(
        (-0.801..1e-3).contains(&(fed - for_part)),
        "{name}: {fed} mm are fed, {for_part} laid"
    );
}

#[test]
fn a_solid_cube() {
    holds_its_volume("cube", &[], 0.01);
    holds_its_volume("cube", &["--place", "45,30"], 0.01);
}

#[test]
fn a_solid_cross() {
    holds_its_volume("cross", &COARSE, 0.01);
}

#[test]
fn solid_steps() {
    holds_its_volume("steps", &[], 0.01);
}

#[test]
fn a_solid_gear() {
    holds_its_volume("gear", &[], 0.01);
}

#[test]
fn a_solid_lens_dome_and_cone() {
    for name in ["lens", "dome", "cone"] {
        holds_its_volume(name, &[], 0.01);
    }
}

#[test]
fn thin_walls() {
    holds_its_volume("wall-0.6", &[], 0.02);
    holds_its_volume("wall-0.6", &["--place", "0,50"], 0.02);
    holds_its_volume("vase", &COARSE, 0.02);
}

/// A place in the text is known to 1 µm along the rail.
const SAME_PLACE_MM: f64 = 0.002;

#[test]
fn every_wall_closes() {
    for name in ["cube", "cross", "steps", "gear", "lens", "dome", "vase", "mushroom"] {
        let text = sliced(name, &COARSE);
        let motions = motions(&text);
        // Inner walls with what of them hangs over; the outer ones never change their name.
        let (walls, outer) = (walls(&motions), beads(&motions, "External perimeter"));
        assert!(!outer.is_empty(), "{name} has no walls");
        for wall in walls.iter().chain(&outer) {
            let (first, last) = (&wall[0], &wall[wall.len() - 1]);
            let (a, b) = (first.at(0.0), last.at(1.0));
            let gap = (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2]);
            assert!(gap <= SAME_PLACE_MM, "{name}: line {} leaves {gap} mm open", last.line);
        }
    }
}

#[test]
fn every_layer_of_a_convex_part_has_one_outer_wall() {
    for (name, layers) in [("cube", 67), ("dome", 50), ("cone", 66)] {
        let text = sliced(name, &COARSE);
        let motions = motions(&text);
        let walls = beads(&motions, "External perimeter");
        let mut seen: Vec<usize> = walls.iter().map(|wall| wall[0].layer.unwrap()).collect();
        seen.dedup();
        assert_eq!(seen.len(), walls.len(), "{name}: a layer has two outer walls");
        assert_eq!(seen, (0..seen.len()).collect::<Vec<_>>(), "{name}: a layer has none");
        assert!(seen.len() >= layers - 2, "{name}: {} layers", seen.len());
    }
}

/// Moved outwards a small triangle gains more at its corners than along its sides.
#[test]
fn outlines_moved_outwards_gain_at_their_corners() {
    let scratch = Scratch::new();
    let corners = ["0 0 0", "8 0 0", "4 7 0", "4 2.3 8"];
    let facet = |at: [usize; 3]| {
        let [a, b, c] = at.map(|k| corners[k]);
        format!(
            "facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n"
        )
    };
    let facets: String = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(facet).concat();
    scratch.file("tetrahedron.stl", format!("solid t\n{facets}endsolid t\n"));
    // Nearly all that becomes of a small block lies beyond its corners.
    scratch.cube("cube.stl", 2.0);
    for (model, by, layers) in [
        ("tetrahedron.stl", "0.3", "planar"),
        ("tetrahedron.stl", "1", "planar"),
        ("tetrahedron.stl", "2", "planar"),
        ("tetrahedron.stl", "2", "caps"),
        ("cube.stl", "2", "conical"),
    ] {
        let grown = format!("xy_size_compensation_mm={by}");
        let plain = ["slice", model, "-q", "-o", "x.gcode", "--orient", "keep"];
        let more = ["--set", &grown, "--set", "fill_density=1", "--layers", layers];
        let ran = scratch.run(&[&plain[..], &more].concat());
        assert!(
            matches!(ran.code, Some(0 | 1)),
            "{model} {by} {layers}: {:?} {}",
            ran.code,
            ran.err
        );
    }
}
