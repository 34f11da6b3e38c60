//! Where the outer wall runs: half a width inside the true section of the mesh.

use std::f64::consts::{PI, TAU};

use crate::program::{Motion, motions};
use crate::run::sliced;

/// Root mean square and largest distance of a wall's centreline from where it belongs, mm.
const RMS_MM: f64 = 0.004;
const LARGEST_MM: f64 = 0.013;
/// Contour that may be missing.
const MISSED_SHARE: f64 = 0.002;
/// How far a bead may stick out of the part, mm.
const OUTSIDE_MM: f64 = 0.02;
/// Where walls are looked at between two places of the program.
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Judges the outer walls of a program. `off` says how far a point at a level lies outside of the
/// section there, and `perimeter` how long the contour is that lies `inside` mm within it; a layer
/// without one is not judged.
fn judge(
    text: &str,
    off: impl Fn([f64; 2], f64) -> f64,
    perimeter: impl Fn(f64, f64) -> Option<f64>,
) {
    let motions = motions(text);
    let walls = |motion: &&Motion| motion.lays() && motion.role == "External perimeter";
    let walls: Vec<&Motion> = motions.iter().filter(walls).collect();
    let mut n_judged = 0;
    for layer in walls.chunk_by(|a, b| a.layer == b.layer) {
        let first = layer[0];
        // The mesh is cut in the middle, the nozzle runs on top.
        let level = first.to[2] - first.height / 2.0;
        let half = first.width / 2.0;
        let Some(wanted) = perimeter(level, half) else { continue };
        n_judged += 1;
        let errors: Vec<f64> = layer
            .iter()
            .flat_map(|motion| SHARES.map(|share| motion.at(share)))
            .map(|[x, y, _]| off([x, y], level) + half)
            .collect();
        let largest = errors.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let square: f64 = errors.iter().map(|e| e * e).sum();
        let rms = (square / errors.len() as f64).sqrt();
        assert!(rms <= RMS_MM, "layer {:?}: rms {rms} mm", first.layer);
        assert!(largest <= LARGEST_MM, "layer {:?}: up to {largest} mm", first.layer);
        let length: f64 = layer.iter().map(|motion| motion.path()).sum();
        let missed = (1.0 - length / wanted).abs();
        assert!(missed <= MISSED_SHARE, "layer {:?}: {length} mm of {wanted}", first.layer);
    }
    assert!(n_judged > 20, "{n_judged} layers were judged");
    for motion in motions.iter().filter(|motion| motion.lays() && motion.role != "Skirt/Brim") {
        let level = motion.to[2] - motion.height / 2.0;
        for [x, y, _] in SHARES.map(|share| motion.at(share)) {
            let outside = off([x, y], level) + motion.width / 2.0;
            assert!(outside <= OUTSIDE_MM, "line {}: {outside} mm outside", motion.line);
        }
    }
}

#[test]
fn the_wall_of_a_cube() {
    for (x, y) in [(0.0_f64, 0.0_f64), (50.0, 20.0), (10.0, 0.0)] {
        let text = sliced("cube", &["--place", &format!("{x},{y}")]);
        let off = |[px, py]: [f64; 2], _| (px - x).abs().max((py - y).abs()) - 10.0;
        judge(&text, off, |_, inside| Some(8.0 * (10.0 - inside)));
    }
}

/// Sides of the bundled cone; its section is a regular polygon with a corner on the x axis.
const SIDES: f64 = 96.0;

#[test]
fn the_wall_of_a_cone() {
    let text = sliced("cone", &[]);
    let inradius = |level: f64| 15.0 * (1.0 - level / 20.0) * (PI / SIDES).cos();
    let off = |[x, y]: [f64; 2], level: f64| {
        let side = (y.atan2(x) / TAU * SIDES).floor() + 0.5;
        let (sin, cos) = (side / SIDES * TAU).sin_cos();
        x * cos + y * sin - inradius(level)
    };
    // Where two beads fit side by side.
    let perimeter = |level: f64, inside: f64| {
        let left = inradius(level) - inside;
        (inradius(level) > 4.0 * inside).then(|| 2.0 * SIDES * left * (PI / SIDES).tan())
    };
    judge(&text, off, perimeter);
}
