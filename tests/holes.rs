//! `hole_to_polyhole`: what is drilled lets through what it is drawn for.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use mesh::mesh::Mesh;
use mesh::shapes::extruded;

use crate::program::{Motion, motions};
use crate::run::sliced_mesh as sliced;

const BORE: [f64; 2] = [-9.0, 0.0];
const NUT: [f64; 2] = [9.0, 0.0];

fn polygon([x, y]: [f64; 2], radius: f64, sides: u32) -> Vec<[f64; 2]> {
    let angle = |k: u32| -TAU * f64::from(k) / f64::from(sides);
    (0..sides).map(|k| [x + radius * angle(k).cos(), y + radius * angle(k).sin()]).collect()
}

/// A plate with a bore of 3 mm and a hole for a nut.
fn plate() -> Mesh {
    let outline = [[-16.0, -8.0], [16.0, -8.0], [16.0, 8.0], [-16.0, 8.0]];
    extruded(&outline, &[polygon(BORE, 1.5, 48), polygon(NUT, 3.0, 6)], 16.0)
}

/// Where the outer walls around a hole are followed, seen from it: the layer, distance and direction.
fn around(all: &[Motion<'_>], [x, y]: [f64; 2]) -> Vec<(usize, f64, f64)> {
    let walls = all.iter().filter(|m| m.lays() && m.role == "External perimeter");
    let places = walls.flat_map(|m| [0.0, 0.5, 1.0].map(|t| (m.layer.unwrap(), m.at(t))));
    let seen = places.map(|(layer, [px, py, _])| {
        let (dx, dy) = (px - x, py - y);
        (layer, dx.hypot(dy), dy.atan2(dx))
    });
    seen.filter(|(_, distance, _)| *distance < 4.5).collect()
}

/// The least and the greatest distance in a layer.
fn reach(seen: &[(usize, f64, f64)], layer: usize) -> [f64; 2] {
    let of_layer = seen.iter().filter(|s| s.0 == layer).map(|s| s.1);
    of_layer.fold([f64::MAX, 0.0], |[least, most], d| [least.min(d), most.max(d)])
}

/// The direction of a corner, by sixths of a turn.
fn corner(seen: &[(usize, f64, f64)], layer: usize) -> f64 {
    let farthest = seen.iter().filter(|s| s.0 == layer).max_by(|a, b| a.1.total_cmp(&b.1));
    farthest.unwrap().2.rem_euclid(FRAC_PI_3)
}

#[test]
fn bores_become_hexagons_that_let_the_screw_through() {
    // Half a bead of 0.45 mm outside of the circle, and round the corners.
    let least = 1.5 + 0.225;
    let most = 1.5 / FRAC_PI_3.sin() + 0.225;
    let curved = [["conical", "--cone-angle=20"], ["conical", "--cone-angle=-20"]];
    for surface in [["planar", "--place=0,0"]].iter().chain(&curved) {
        // The nozzle stands over the middle of a leaning bead by half its thickness along the normal.
        let slack = if surface[0] == "planar" { 0.01 } else { 0.06 };
        let arguments = ["--layers", surface[0], surface[1], "--set", "hole_to_polyhole=true"];
        let text = sliced(&plate(), &arguments);
        let all = motions(&text);
        let (bore, nut) = (around(&all, BORE), around(&all, NUT));
        let layers = [40, 41, 42, 43];
        for layer in layers {
            let [near, far] = reach(&bore, layer);
            assert!((near - least).abs() < slack, "{surface:?} {layer}: {near}");
            assert!((far - most).abs() < 2.0 * slack, "{surface:?} {layer}: {far}");
            let [near, far] = reach(&nut, layer);
            assert!((near - 3.0 * FRAC_PI_3.sin() - 0.225).abs() < slack, "{near}");
            assert!((far - 3.0 - 0.225).abs() < 2.0 * slack, "{far}");
        }
        // Corners of a layer stand over the middles of the sides below.
        for pair in layers.windows(2) {
            let turn = corner(&bore, pair[1]) - corner(&bore, pair[0]);
            let turn = turn.rem_euclid(FRAC_PI_3);
            assert!((turn - PI / 6.0).abs() < 0.05, "{surface:?}: {turn}");
        }
    }
}

/// So does the layer on the bed, below which there is none to tell that the bore goes straight up.
#[test]
fn hexagons_begin_on_the_bed_and_turn_with_the_part() {
    const ON: [&str; 2] = ["--set", "hole_to_polyhole=true"];
    let straight = sliced(&plate(), &ON);
    let straight = around(&motions(&straight), BORE);
    let [_, far] = reach(&straight, 0);
    assert!((far - 1.5 / FRAC_PI_3.sin() - 0.225).abs() < 0.02, "{far}");
    let angle: f64 = 20.0_f64.to_radians();
    let turned = sliced(&plate(), &[&ON[..], &["--rotate-z", "20"]].concat());
    let turned = around(&motions(&turned), [BORE[0] * angle.cos(), BORE[0] * angle.sin()]);
    for layer in [0, 1, 40] {
        let by = corner(&turned, layer) - corner(&straight, layer) - angle;
        let off = (by + FRAC_PI_3 / 2.0).rem_euclid(FRAC_PI_3) - FRAC_PI_3 / 2.0;
        assert!(off.abs() < 0.05, "{layer}: {off}");
    }
}

/// A funnel has another circle in every layer and stays as it is.
#[test]
fn only_what_goes_straight_up_is_a_bore() {
    let funnel = mesh::shapes::revolved(&[[3.0, 0.0], [9.0, 0.0], [9.0, 6.0], [5.0, 6.0]], 64);
    let with = sliced(&funnel, &["--set", "hole_to_polyhole=true"]);
    let without = sliced(&funnel, &[]);
    let beads = |text: &str| {
        let lines = text.lines().filter(|line| line.starts_with("G1 "));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(beads(&with) == beads(&without));
}
