//! Solids with one outline over their whole height.

use crate::mesh::Mesh;
use nalgebra::{Point2, Point3};
use std::f64::consts::{PI, TAU};

/// Returns the solid over an outline with holes, from z = 0 to `height`.
///
/// Rings may run either way; they must neither cross nor touch.
///
/// # Panics
///
/// When rings cross.
#[must_use]
pub fn extruded(outer: &[[f64; 2]], holes: &[Vec<[f64; 2]>], height: f64) -> Mesh {
    let ring = |points: &[[f64; 2]], turn_left: bool| {
        let mut ring: Vec<Point2<f64>> = points.iter().map(|p| Point2::from(*p)).collect();
        if (twice_area(&ring) > 0.0) != turn_left {
            ring.reverse();
        }
        ring
    };
    let mut rings = vec![ring(outer, true)];
    rings.extend(holes.iter().map(|hole| ring(hole, false)));
    let caps = geom::triangulate::triangulate(&rings).expect("rings do not cross").triangles;
    let points: Vec<Point2<f64>> = rings.iter().flatten().copied().collect();
    let n = points.len() as u32;
    let level = |z: f64| points.iter().map(move |p| Point3::new(p.x, p.y, z));
    let mut mesh = Mesh { vertices: level(0.0).chain(level(height)).collect(), triangles: vec![] };
    for [a, b, c] in caps {
        mesh.triangles.extend([[a, c, b], [a + n, b + n, c + n]]);
    }
    let mut start = 0;
    for ring in &rings {
        let length = ring.len() as u32;
        for i in 0..length {
            let (a, b) = (start + i, start + (i + 1) % length);
            mesh.triangles.extend([[a, b, b + n], [a, b + n, a + n]]);
        }
        start += length;
    }
    mesh
}

fn twice_area(ring: &[Point2<f64>]) -> f64 {
    (0..ring.len()).map(|i| ring[i].coords.perp(&ring[(i + 1) % ring.len()].coords)).sum()
}

/// Returns a spur gear with involute flanks of 20° pressure angle and a round bore.
///
/// `module` is the pitch diameter by the number of teeth, mm.
#[must_use]
pub fn gear(n_teeth: u32, module: f64, thickness: f64, bore_radius: f64) -> Mesh {
    const N_FLANK: u32 = 6;
    const N_BORE: u32 = 48;
    let pitch = f64::from(n_teeth) * module / 2.0;
    let (tip, root) = (pitch + module, pitch - 1.25 * module);
    let base = pitch * 20.0_f64.to_radians().cos();
    // The involute of the base circle: how far its azimuth has turned at a radius.
    let involute = |radius: f64| {
        let angle = (base / radius).min(1.0).acos();
        angle.tan() - angle
    };
    let half_tooth =
        |radius: f64| PI / (2.0 * f64::from(n_teeth)) + involute(pitch) - involute(radius);
    let start = base.max(root);
    let flank: Vec<[f64; 2]> = (0..N_FLANK)
        .map(|i| {
            let radius = start + (tip - start) * f64::from(i) / f64::from(N_FLANK - 1);
            [radius, half_tooth(radius)]
        })
        .collect();
    let mut outline = Vec::new();
    for tooth in 0..n_teeth {
        let middle = TAU * f64::from(tooth) / f64::from(n_teeth);
        let mut add = |radius: f64, turn: f64| {
            let (sin, cos) = (middle + turn).sin_cos();
            outline.push([radius * cos, radius * sin]);
        };
        if root < start {
            add(root, -flank[0][1]);
        }
        flank.iter().for_each(|&[radius, turn]| add(radius, -turn));
        flank.iter().rev().for_each(|&[radius, turn]| add(radius, turn));
        if root < start {
            add(root, flank[0][1]);
        }
    }
    let bore = (0..N_BORE).map(|i| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(N_BORE)).sin_cos();
        [bore_radius * cos, bore_radius * sin]
    });
    extruded(&outline, &[bore.collect()], thickness)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::volume_mm3;

    #[test]
    fn rings_may_run_either_way() {
        let square = |s: f64| vec![[-s, -s], [s, -s], [s, s], [-s, s]];
        let mut hole = square(1.0);
        let mut outer = square(5.0);
        for _ in 0..2 {
            assert!((volume_mm3(&extruded(&outer, &[hole.clone()], 2.0)) - 192.0).abs() < 1e-9);
            outer.reverse();
            hole.reverse();
        }
    }

    #[test]
    fn a_gear_weighs_about_its_pitch_cylinder() {
        let volume = volume_mm3(&gear(24, 2.0, 8.0, 4.0));
        let cylinder = PI * (24.0 * 24.0 - 16.0) * 8.0;
        assert!((volume / cylinder - 1.0).abs() < 0.05, "{volume} for {cylinder}");
    }
}
