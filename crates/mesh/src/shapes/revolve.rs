//! Solids of revolution about the z axis.

use crate::mesh::Mesh;
use nalgebra::Point3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Returns the solid that a profile sweeps about the z axis, in `n_segments` flat segments.
///
/// The profile is a line of points (radius, z) with the material to its left: up along the
/// outside, back along the inside. Points of radius 0 lie on the axis and become one vertex. A
/// profile that touches the axis at both ends encloses a ball; any other is closed from its last
/// point to its first and encloses a ring.
///
/// # Panics
///
/// When there are fewer than three segments or three profile points.
#[must_use]
pub fn revolved(profile: &[[f64; 2]], n_segments: u32) -> Mesh {
    assert!(n_segments >= 3 && profile.len() >= 3, "a solid has at least three of each");
    let mut mesh = Mesh::default();
    let mut rings = Vec::new();
    for &[radius, z] in profile {
        let start = mesh.vertices.len() as u32;
        if radius == 0.0 {
            mesh.vertices.push(Point3::new(0.0, 0.0, z));
            rings.push((start, 0));
        } else {
            for i in 0..n_segments {
                let (sin, cos) = (f64::from(i) / f64::from(n_segments) * TAU).sin_cos();
                mesh.vertices.push(Point3::new(radius * cos, radius * sin, z));
            }
            rings.push((start, 1));
        }
    }
    let on_axis = profile[0][0] == 0.0 && profile[profile.len() - 1][0] == 0.0;
    let n_bands = if on_axis { rings.len() - 1 } else { rings.len() };
    for k in 0..n_bands {
        let (low, high) = (rings[k], rings[(k + 1) % rings.len()]);
        let vertex = |(start, stride): (u32, u32), i: u32| start + stride * (i % n_segments);
        for i in 0..n_segments {
            let (a, b) = (vertex(low, i), vertex(low, i + 1));
            let (c, d) = (vertex(high, i), vertex(high, i + 1));
            if a != b {
                mesh.triangles.push([a, b, c]);
            }
            if c != d {
                mesh.triangles.push([b, d, c]);
            }
        }
    }
    mesh
}

/// Points of a profile along an arc about (`centre_r`, `centre_z`), angles from the horizontal.
fn arc(centre: [f64; 2], radius: f64, from_rad: f64, to_rad: f64, n: u32) -> Vec<[f64; 2]> {
    (0..=n)
        .map(|i| {
            let (sin, cos) =
                (from_rad + (to_rad - from_rad) * f64::from(i) / f64::from(n)).sin_cos();
            [centre[0] + radius * cos, centre[1] + radius * sin]
        })
        .collect()
}

/// Returns a cone.
#[must_use]
pub fn cone(radius: f64, height: f64, n_segments: u32) -> Mesh {
    revolved(&[[0.0, 0.0], [radius, 0.0], [0.0, height]], n_segments)
}

/// Returns half a ball on its flat side.
#[must_use]
pub fn dome(radius: f64, n_segments: u32) -> Mesh {
    let mut profile = vec![[0.0, 0.0]];
    profile.extend(arc([0.0, 0.0], radius, 0.0, FRAC_PI_2, n_segments / 4));
    // The cosine of a right angle is not quite zero.
    profile.last_mut().expect("not empty")[0] = 0.0;
    revolved(&profile, n_segments)
}

/// Returns a ring with a round section.
#[must_use]
pub fn torus(radius: f64, tube_radius: f64, n_segments: u32, n_tube: u32) -> Mesh {
    let mut profile = arc([radius, tube_radius], tube_radius, -FRAC_PI_2, TAU - FRAC_PI_2, n_tube);
    profile.pop();
    profile[0][1] = 0.0;
    revolved(&profile, n_segments)
}

/// Returns a plano-convex lens: a shallow cap of a sphere on a rim, flat side down.
#[must_use]
pub fn lens(radius: f64, sphere_radius: f64, rim: f64, n_segments: u32) -> Mesh {
    let edge_rad = (radius / sphere_radius).acos();
    let centre_z = rim - (sphere_radius * sphere_radius - radius * radius).sqrt();
    let mut profile = vec![[0.0, 0.0], [radius, 0.0]];
    profile.extend(arc([0.0, centre_z], sphere_radius, edge_rad, FRAC_PI_2, 16));
    profile[2] = [radius, rim];
    profile.last_mut().expect("not empty")[0] = 0.0;
    revolved(&profile, n_segments)
}

/// Returns a mushroom: 20 mm of flat overhang all round under a domed cap.
#[must_use]
pub fn mushroom(n_segments: u32) -> Mesh {
    const CAP: f64 = 25.0;
    const RISE: f64 = 14.0;
    const UNDERSIDE: f64 = 20.0;
    let mut profile = vec![[0.0, 0.0], [8.0, 0.0], [8.0, 1.0], [5.0, 3.0], [5.0, UNDERSIDE]];
    let dome = arc([0.0, 0.0], 1.0, 0.0, FRAC_PI_2, 12);
    profile.extend(dome.iter().map(|[r, z]| [CAP * r, UNDERSIDE + RISE * z]));
    profile.last_mut().expect("not empty")[0] = 0.0;
    revolved(&profile, n_segments)
}

/// Returns an umbrella blown inside out: a thin cover on a stem that rises outwards by 15°.
#[must_use]
pub fn umbrella(n_segments: u32) -> Mesh {
    const STEM: f64 = 4.0;
    const RIM: f64 = 25.0;
    const UNDERSIDE: f64 = 15.0;
    const THICKNESS: f64 = 2.4;
    let rise = 15.0_f64.to_radians().tan();
    let cover = |r: f64| UNDERSIDE + rise * (r - STEM);
    let profile = [
        [0.0, 0.0],
        [8.0, 0.0],
        [8.0, 1.5],
        [STEM, 3.5],
        [STEM, cover(STEM)],
        [RIM, cover(RIM)],
        [RIM, cover(RIM) + THICKNESS],
        [0.0, cover(0.0) + THICKNESS],
    ];
    revolved(&profile, n_segments)
}

/// Returns a vase with a wall of 1.2 mm and a bottom of 1.6 mm.
#[must_use]
pub fn vase(n_segments: u32) -> Mesh {
    const HEIGHT: f64 = 60.0;
    const WALL: f64 = 1.2;
    const BOTTOM: f64 = 1.6;
    let radius = |z: f64| 18.0 + 5.0 * (z / HEIGHT * 1.5 * std::f64::consts::PI).sin();
    let heights = |from: f64, n: u32| {
        (0..=n).map(move |i| from + (HEIGHT - from) * f64::from(i) / f64::from(n))
    };
    let mut profile = vec![[0.0, 0.0]];
    profile.extend(heights(0.0, 12).map(|z| [radius(z), z]));
    let mut inside: Vec<_> = heights(BOTTOM, 12).map(|z| [radius(z) - WALL, z]).collect();
    inside.reverse();
    profile.extend(inside);
    profile.push([0.0, BOTTOM]);
    revolved(&profile, n_segments)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::volume_mm3;
    use std::f64::consts::PI;

    #[test]
    fn volumes_approach_the_round_ones() {
        let near = |mesh: &Mesh, exact: f64| {
            let volume = volume_mm3(mesh);
            assert!(volume < exact && volume > 0.995 * exact, "{volume} for {exact}");
        };
        near(&cone(15.0, 20.0, 200), PI * 225.0 * 20.0 / 3.0);
        near(&dome(15.0, 200), 2.0 / 3.0 * PI * 15.0_f64.powi(3));
        near(&torus(20.0, 6.0, 200, 100), 2.0 * PI * PI * 20.0 * 36.0);
        let cap = 60.0 - (3600.0_f64 - 400.0).sqrt();
        near(&lens(20.0, 60.0, 1.0, 400), PI * 400.0 + PI * cap * cap * (60.0 - cap / 3.0));
    }

    #[test]
    fn a_cone_of_n_segments_has_the_volume_of_its_pyramid() {
        let base = 96.0 / 2.0 * 225.0 * (TAU / 96.0).sin();
        assert!((volume_mm3(&cone(15.0, 20.0, 96)) - base * 20.0 / 3.0).abs() < 1e-9);
    }
}
