//! Solids that are known exactly, built in code: for tests, benchmarks and first prints.
//!
//! All are watertight, face outward, share their vertices, stand on z = 0 and are centred on the
//! z axis; lengths in mm. [`by_name`] offers the ones that make good prints, each at most 200 kB
//! as binary STL.

mod extrude;
mod revolve;
mod sphere;

pub use extrude::{extruded, gear};
pub use revolve::{cone, dome, lens, mushroom, revolved, torus, umbrella, vase};
pub use sphere::icosphere;

use crate::mesh::Mesh;
use nalgebra::Point3;

/// The names that [`by_name`] knows, sorted.
pub const NAMES: [&str; 16] = [
    "cone",
    "cross",
    "cube",
    "dome",
    "gear",
    "lens",
    "mushroom",
    "plate",
    "sphere",
    "steps",
    "tetrahedron",
    "torus",
    "umbrella",
    "vase",
    "wall-0.6",
    "wall-1.0",
];

/// Returns the shape of a name from [`NAMES`], at a size that prints.
#[must_use]
pub fn by_name(name: &str) -> Option<Mesh> {
    Some(match name {
        "cone" => cone(15.0, 20.0, 96),
        "cross" => cross(20.0),
        "cube" => cube(20.0),
        "dome" => dome(15.0, 72),
        "gear" => gear(24, 2.0, 8.0, 4.0),
        "lens" => lens(20.0, 60.0, 1.0, 96),
        "mushroom" => mushroom(96),
        "plate" => plate(),
        "sphere" => icosphere(3, 15.0),
        "steps" => steps(),
        "tetrahedron" => tetrahedron(30.0),
        "torus" => torus(20.0, 6.0, 72, 24),
        "umbrella" => umbrella(96),
        "vase" => vase(72),
        "wall-0.6" => block(40.0, 0.6, 20.0),
        "wall-1.0" => block(40.0, 1.0, 20.0),
        _ => return None,
    })
}

/// Returns a cube.
#[must_use]
pub fn cube(side: f64) -> Mesh {
    block(side, side, side)
}

/// Returns a box.
#[must_use]
pub fn block(size_x: f64, size_y: f64, size_z: f64) -> Mesh {
    let at = |i: i32, j: i32, k: i32| {
        let half = |n: i32, size: f64| (f64::from(n) - 0.5) * size;
        Point3::new(half(i, size_x), half(j, size_y), f64::from(k) * size_z)
    };
    cells(&[[0, 0, 0]], at)
}

/// Returns a cube with a cube on each of its six faces: overhangs of 90° in every direction and
/// flats at three heights. The surface is that of the union, without inner walls.
#[must_use]
pub fn cross(side: f64) -> Mesh {
    let arms = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 0]];
    let at = |i: i32, j: i32, k: i32| {
        let half = |n: i32| (f64::from(n) - 0.5) * side;
        Point3::new(half(i), half(j), f64::from(k + 1) * side)
    };
    cells(&arms, at)
}

/// Returns four columns side by side with flat tops at 3.07, 7.33, 11.9 and 15 mm: heights that no
/// round layer thickness meets.
#[must_use]
pub fn steps() -> Mesh {
    const TOPS: [f64; 4] = [3.07, 7.33, 11.9, 15.0];
    const COLUMN: f64 = 12.0;
    const DEPTH: f64 = 24.0;
    let mut outline = vec![[-2.0 * COLUMN, 0.0], [2.0 * COLUMN, 0.0]];
    for (i, top) in TOPS.iter().enumerate().rev() {
        let left = (i as f64 - 2.0) * COLUMN;
        outline.extend([[left + COLUMN, *top], [left, *top]]);
    }
    let mut mesh = extruded(&outline, &[], DEPTH);
    for p in &mut mesh.vertices {
        *p = Point3::new(p.x, DEPTH / 2.0 - p.z, p.y);
    }
    mesh
}

/// Returns a plate with a round, a square and a triangular hole.
#[must_use]
pub fn plate() -> Mesh {
    let square = |x: f64, y: f64, half: f64| {
        vec![[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]
    };
    let round = (0..48).map(|i| {
        let (sin, cos) = (f64::from(i) / 48.0 * std::f64::consts::TAU).sin_cos();
        [8.0 * cos - 12.0, 8.0 * sin]
    });
    let triangle = vec![[4.0, 2.0], [20.0, 2.0], [12.0, 14.0]];
    extruded(&square(0.0, 0.0, 25.0), &[round.collect(), square(12.0, -10.0, 7.0), triangle], 4.0)
}

/// Returns a regular tetrahedron standing on a face.
#[must_use]
pub fn tetrahedron(edge: f64) -> Mesh {
    let radius = edge / 3.0_f64.sqrt();
    let corner = |i: f64| {
        let (sin, cos) = (i / 3.0 * std::f64::consts::TAU).sin_cos();
        Point3::new(radius * cos, radius * sin, 0.0)
    };
    let top = Point3::new(0.0, 0.0, edge * (2.0_f64 / 3.0).sqrt());
    Mesh {
        vertices: vec![corner(0.0), corner(1.0), corner(2.0), top],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    }
}

/// The four corners of each face of a cell, counter-clockwise from outside, with the way out.
const FACES: [([i32; 3], [[i32; 3]; 4]); 6] = [
    ([0, 0, -1], [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]]),
    ([0, 0, 1], [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]),
    ([0, -1, 0], [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]),
    ([1, 0, 0], [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]]),
    ([0, 1, 0], [[1, 1, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]]),
    ([-1, 0, 0], [[0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 1, 1]]),
];

/// Returns the surface of a union of grid cells; `at` places the grid points.
fn cells(cells: &[[i32; 3]], at: impl Fn(i32, i32, i32) -> Point3<f64>) -> Mesh {
    let mut grid: Vec<[i32; 3]> = Vec::new();
    let mut mesh = Mesh::default();
    for cell in cells {
        for (out, corners) in &FACES {
            if cells.contains(&[0, 1, 2].map(|k| cell[k] + out[k])) {
                continue;
            }
            let quad = corners.map(|corner| {
                let point = [0, 1, 2].map(|k| cell[k] + corner[k]);
                let known = grid.iter().position(|p| *p == point);
                known.unwrap_or_else(|| {
                    grid.push(point);
                    mesh.vertices.push(at(point[0], point[1], point[2]));
                    grid.len() - 1
                }) as u32
            });
            mesh.triangles.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure;
    use crate::topology::Solid;

    #[test]
    fn every_shape_is_sound_small_and_in_its_place() {
        assert!(NAMES.is_sorted());
        for name in NAMES {
            let mesh = by_name(name).unwrap();
            assert!(84 + 50 * mesh.triangles.len() <= 200_000, "{name} is too large");
            assert!(measure::volume_mm3(&mesh) > 100.0, "{name} is inside out");
            let bounds = mesh.bounds();
            assert_eq!(bounds.min.z, 0.0, "{name}");
            let off = nalgebra::center(&bounds.min, &bounds.max);
            // Shapes of odd symmetry have their axis, not their box, in the middle.
            if !["tetrahedron", "sphere"].contains(&name) {
                assert!(off.xy().coords.norm() < 1e-9, "{name}: {off}");
            }
            let solid = Solid::new(mesh);
            solid.check().unwrap();
            assert_eq!(solid.open_sides(), 0, "{name}");
            assert_eq!(solid.shells().len(), 1, "{name}");
            assert_eq!(solid.nonmanifold_edges().count, 0, "{name}");
            assert!(solid.pinched_vertices().is_empty(), "{name}");
        }
        assert!(by_name("teapot").is_none());
    }

    #[test]
    fn volumes() {
        let volume = |mesh: &Mesh| measure::volume_mm3(mesh);
        assert!((volume(&cross(20.0)) - 56_000.0).abs() < 1e-6);
        assert_eq!(cross(20.0).triangles.len(), 60);
        assert!((volume(&steps()) - 10_742.4).abs() < 1e-6);
        assert!((volume(&block(40.0, 0.6, 20.0)) - 480.0).abs() < 1e-9);
        let edge: f64 = 30.0;
        assert!((volume(&tetrahedron(edge)) - edge.powi(3) / (6.0 * 2.0_f64.sqrt())).abs() < 1e-9);
        let round = 48.0 / 2.0 * 64.0 * (std::f64::consts::TAU / 48.0).sin();
        assert!((volume(&plate()) - 4.0 * (2500.0 - round - 196.0 - 96.0)).abs() < 1e-6);
    }

    #[test]
    fn steps_have_their_flats() {
        let mesh = steps();
        let mut area_at = [0.0; 4];
        for t in 0..mesh.triangles.len() as u32 {
            let (corners, up) = (mesh.corners(t), mesh.area_vector(t).z);
            for (area, top) in area_at.iter_mut().zip([3.07, 7.33, 11.9, 15.0]) {
                if up > 0.0 && corners.iter().all(|p| p.z == top) {
                    *area += up / 2.0;
                }
            }
        }
        assert!(area_at.iter().all(|area| (area - 288.0).abs() < 1e-9));
    }
}
