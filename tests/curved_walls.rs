//! Where the outer wall runs on curved layers: half a width from the part's side, measured along the
//! layer, read back from the text.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::program::motions;
use crate::run::sliced;

/// How far the middle of a wall may lie from where it belongs, as a share of its width.
const OFF_SHARE: f64 = 0.02;

/// Half the side of the bundled cube, mm.
const HALF: f64 = 10.0;

/// Heights between which neither floor nor top is near, mm.
const BETWEEN: [f64; 2] = [3.0, 17.0];

/// A surface that layers follow.
#[derive(Clone, Copy)]
enum Surface {
    /// Cones that fall outwards by this angle, radians.
    Cone(f64),
    /// Spheres about this height.
    Spheres(f64),
}

impl Surface {
    /// The point half a layer below, along the normal.
    fn below(self, [x, y, z]: [f64; 3], depth: f64) -> [f64; 3] {
        match self {
            Self::Cone(angle) => {
                let r = x.hypot(y);
                let share = (r - depth * angle.sin()) / r;
                [x * share, y * share, z - depth * angle.cos()]
            }
            Self::Spheres(centre) => {
                let radius = x.hypot(y).hypot(z - centre);
                let share = (radius - depth) / radius;
                [x * share, y * share, centre + (z - centre) * share]
            }
        }
    }

    /// The length of the shortest way on the layer through `p` to the place of that layer straight
    /// above or below `(x, y)`.
    fn distance(self, p: [f64; 3], [x, y]: [f64; 2]) -> f64 {
        let turn = (y * p[0] - x * p[1]).atan2(x * p[0] + y * p[1]);
        let (r, s) = (p[0].hypot(p[1]), x.hypot(y));
        match self {
            // Straight on the unrolled cone.
            Self::Cone(angle) => {
                let (r, s) = (r / angle.cos(), s / angle.cos());
                let turn = turn * angle.cos();
                (s * turn.cos() - r).hypot(s * turn.sin())
            }
            Self::Spheres(centre) => {
                let radius = r.hypot(p[2] - centre);
                let rise = (radius * radius - s * s).sqrt();
                let chord = (x - p[0]).hypot(y - p[1]).hypot(rise - (p[2] - centre));
                2.0 * radius * (chord / 2.0 / radius).asin()
            }
        }
    }

    /// The distance of `p` from the sides of the cube along the layer through it.
    fn to_the_side(self, p: [f64; 3]) -> f64 {
        let sides = (0..4).map(|side| {
            let (sin, cos) = (f64::from(side) * FRAC_PI_2).sin_cos();
            let seen = [p[0] * cos + p[1] * sin, p[1] * cos - p[0] * sin, p[2]];
            let at = |y: f64| self.distance(seen, [HALF, y.clamp(-HALF, HALF)]);
            // The way to a straight side gets longer and longer to both hands of the nearest place.
            let (mut low, mut high) = (seen[1] - 1.0, seen[1] + 1.0);
            for _ in 0..60 {
                let third = (high - low) / 3.0;
                if at(low + third) < at(high - third) {
                    high -= third;
                } else {
                    low += third;
                }
            }
            at(f64::midpoint(low, high))
        });
        sides.fold(f64::INFINITY, f64::min)
    }
}

#[track_caller]
fn walls_keep_their_distance(arguments: &[&str], surface: Surface) {
    let mut all = vec!["--set", "layer_height_mm=0.3", "--set", "nozzle_flat_radius_mm=0.2"];
    all.extend(["--set", "nozzle_half_angle_deg=10", "--set", "nozzle_block_height_mm=60"]);
    all.extend(arguments);
    let text = sliced("cube", &all);
    let (mut n_judged, mut worst) = (0, 0.0_f64);
    for motion in motions(&text) {
        let is_wall = ["External perimeter", "Overhang perimeter"].contains(&motion.role);
        // Two planar layers come first.
        if !motion.lays() || !is_wall || motion.layer < Some(2) {
            continue;
        }
        for at in [0.25, 0.75].map(|share| motion.at(share)) {
            if at[2] < BETWEEN[0] || at[2] > BETWEEN[1] {
                continue;
            }
            let found = surface.to_the_side(surface.below(at, motion.height / 2.0));
            let off = (found - motion.width / 2.0).abs() / motion.width;
            assert!(
                off <= OFF_SHARE,
                "{arguments:?}, line {}: {found:.4} mm from the side, {:.2} mm wide",
                motion.line,
                motion.width
            );
            worst = worst.max(off);
            n_judged += 1;
        }
    }
    assert!(n_judged > 5_000, "{arguments:?}: {n_judged} places were judged");
    assert!(worst > 0.0, "nothing was measured");
}

#[test]
fn walls_run_half_a_width_from_the_side_on_cones() {
    for angle in ["30", "-30", "45"] {
        let slope = angle.parse::<f64>().unwrap() * PI / 180.0;
        let arguments = ["--layers=conical", &format!("--cone-angle={angle}")];
        walls_keep_their_distance(&arguments, Surface::Cone(slope));
    }
}

#[test]
fn walls_run_half_a_width_from_the_side_on_spheres() {
    let arguments = ["--layers=spherical", "--sphere-centre=-40"];
    walls_keep_their_distance(&arguments, Surface::Spheres(-40.0));
}
