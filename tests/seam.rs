//! Seams stand where they are asked for.

use crate::program::motions;
use crate::run::sliced;

/// The outer walls of a program in the dialect `polar`: the places of each, the first one its seam.
fn walls(text: &str) -> Vec<Vec<[f64; 2]>> {
    let mut walls: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut is_open = false;
    for motion in &motions(text) {
        let lays = motion.e > 0.0 && motion.path() > 0.0 && motion.role == "External perimeter";
        if lays {
            if !is_open {
                let [x, y, _] = motion.at(0.0);
                walls.push(vec![[x, y]]);
            }
            let wall = walls.last_mut().unwrap();
            wall.extend([0.25, 0.5, 0.75, 1.0].map(|share| {
                let [x, y, _] = motion.at(share);
                [x, y]
            }));
        }
        is_open = lays;
    }
    walls
}

#[test]
fn rear_is_a_direction_on_the_bed_however_the_model_is_turned() {
    for (turned, degrees) in [("keep", "200"), ("0,0,35", "200"), ("flat", "-20")] {
        let angle = format!("seam_angle_deg={degrees}");
        let arguments = ["--orient", turned, "--place", "14,3", "--set", "seam_position=rear"];
        let mut all = arguments.to_vec();
        all.extend(["--set", &angle]);
        let (sin, cos) = degrees.parse::<f64>().unwrap().to_radians().sin_cos();
        let along = |[x, y]: &[f64; 2]| x * cos + y * sin;
        let walls = walls(&sliced("dome", &all));
        assert!(walls.len() > 30, "{}", walls.len());
        for wall in &walls {
            let farthest = wall.iter().map(along).fold(f64::MIN, f64::max);
            // The chord tolerance, and what short pieces may move.
            assert!(along(&wall[0]) > farthest - 0.03, "{turned} {degrees}: {:?}", wall[0]);
        }
    }
}

#[test]
fn random_seams_form_no_line() {
    let walls = walls(&sliced("cube", &["--set", "seam_position=random"]));
    assert!(walls.len() > 90);
    // Eight parts of the outline, by azimuth: none has more than a third of the seams, none has few.
    let mut parts = [0; 8];
    for wall in &walls {
        let [x, y] = wall[0];
        let turn = y.atan2(x) / std::f64::consts::TAU + 0.5;
        parts[((turn * 8.0) as usize).min(7)] += 1;
    }
    assert!(
        parts.iter().all(|&count| count * 3 < walls.len() && count * 30 > walls.len()),
        "{parts:?}"
    );
}

#[test]
fn corner_hides_in_a_notch_of_the_outline() {
    // The inner corners of the cross, in the layers that have its arms.
    let walls = walls(&sliced("cross", &["--set", "seam_position=corner"]));
    let reach = |[x, y]: &[f64; 2]| x.hypot(*y);
    let mut seen = 0;
    for wall in &walls {
        let nearest = wall.iter().map(reach).fold(f64::MAX, f64::min);
        let farthest = wall.iter().map(reach).fold(f64::MIN, f64::max);
        if farthest > 2.0 * nearest {
            seen += 1;
            assert!(reach(&wall[0]) < 1.5 * nearest, "{:?} {nearest}", wall[0]);
        }
    }
    assert!(seen > 50, "{seen}");
}
