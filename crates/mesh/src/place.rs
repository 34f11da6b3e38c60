//! Where a part stands on the bed, and a direction that turns with it.
//!
//! A part stands on z = 0 with the centre of its footprint on the axis of the bed. The footprint
//! is the smallest circle around the part seen from above: unlike a bounding box, it turns with
//! the part, so a part that is turned about z is placed the same way, but turned.

mod azimuth;

pub use azimuth::reference_azimuth;

use crate::mesh::Mesh;
use crate::topology::Solid;
use geom::circle::{Circle, smallest_around};
use nalgebra::{Isometry3, Point2, Point3, Rotation3, Vector2, Vector3};
use std::f64::consts::TAU;

/// How a part gets from the Model frame to the Part frame: turned, then shifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The turn.
    pub rotation: Rotation3<f64>,
    /// The shift after it, mm.
    pub shift: Vector3<f64>,
}

impl Placement {
    /// Returns the placement that sets a mesh, turned by `rotation`, on the bed and on the axis.
    #[must_use]
    pub fn on_bed(mesh: &Mesh, rotation: &Rotation3<f64>) -> Self {
        let turned = || mesh.vertices.iter().map(|p| rotation * p);
        let shift = match smallest_around(&outermost(turned)) {
            None => Vector3::zeros(),
            Some(circle) => {
                let bottom = turned().map(|p| p.z).fold(f64::INFINITY, f64::min);
                Vector3::new(-circle.centre.x, -circle.centre.y, -bottom)
            }
        };
        Self { rotation: *rotation, shift }
    }

    /// Returns the position of a point after the placement.
    ///
    /// The rotation is applied as a matrix: quarter turns are exact, so flat faces stay exactly
    /// flat.
    #[must_use]
    pub fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        self.rotation * p + self.shift
    }

    /// Returns a mesh after the placement.
    #[must_use]
    pub fn mesh(&self, mesh: &Mesh) -> Mesh {
        let vertices = mesh.vertices.iter().map(|p| self.point(p)).collect();
        Mesh { vertices, triangles: mesh.triangles.clone() }
    }

    /// Returns the transform `part_from_model`.
    #[must_use]
    pub fn isometry(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.shift.into(), self.rotation.into())
    }
}

/// Sets a solid, turned by `rotation`, on the bed and on the axis.
#[must_use]
pub fn placed(solid: &Solid, rotation: &Rotation3<f64>) -> (Solid, Placement) {
    let placement = Placement::on_bed(solid.mesh(), rotation);
    (solid.moved(|p| placement.point(p)), placement)
}

/// Returns the smallest circle around a mesh seen from above; `None` when it has no vertices.
#[must_use]
pub fn footprint(mesh: &Mesh) -> Option<Circle> {
    smallest_around(&outermost(|| mesh.vertices.iter().copied()))
}

/// The points seen from above, without those that are surely inside their hull: a hull needs a
/// sort of its points, and most points of a mesh are inside.
fn outermost<I: ExactSizeIterator<Item = Point3<f64>>>(points: impl Fn() -> I) -> Vec<Point2<f64>> {
    let points = || points().map(|p| p.xy());
    // Points far out in each direction and its opposite are in the hull, and so is all between.
    const N_DIRECTIONS: usize = 16;
    const N_WAYS: usize = N_DIRECTIONS / 2;
    let ways: [[f64; 2]; N_WAYS] = std::array::from_fn(|i| {
        let (sin, cos) = (i as f64 / N_DIRECTIONS as f64 * TAU).sin_cos();
        [cos, sin]
    });
    let mut far = [(f64::NEG_INFINITY, Point2::origin()); N_DIRECTIONS];
    // Any points make such a polygon: of many, some are enough for one that holds nearly as much.
    let step = 1 + points().len() / MANY;
    for p in points().step_by(step) {
        for (i, [x, y]) in ways.iter().enumerate() {
            let reach = p.x * x + p.y * y;
            if reach > far[i].0 {
                far[i] = (reach, p);
            }
            if -reach > far[i + N_WAYS].0 {
                far[i + N_WAYS] = (-reach, p);
            }
        }
    }
    let corners = far.map(|(_, p)| p);
    let mean = corners.iter().map(|p| p.coords).sum::<Vector2<f64>>();
    let centre = Point2::from(mean / N_DIRECTIONS as f64);
    let inside = inscribed(&corners, &centre).max(0.0).powi(2);
    let left: Vec<Point2<f64>> =
        points().filter(|p| nalgebra::distance_squared(p, &centre) >= inside).collect();
    if left.len() <= FEW { left } else { far_in_sectors(left, &centre) }
}

/// A point this far from a side, mm, is on that side of it: far above rounding, and a point left in
/// only takes time.
const SURELY: f64 = 1e-6;

/// So many points hold nearly all of what all of them hold.
const MANY: usize = 1 << 16;

/// A hull of so many points takes no time to speak of.
const FEW: usize = 4096;

/// A round part has much of its surface near its outline, and a long one much of it outside the
/// circle: points that are inside the polygon of what lies farthest from the centre in each of many
/// sectors are left out too.
fn far_in_sectors(points: Vec<Point2<f64>>, centre: &Point2<f64>) -> Vec<Point2<f64>> {
    const N_SECTORS: usize = 512;
    let mut far: Vec<Option<(f64, Point2<f64>)>> = vec![None; N_SECTORS];
    let sector = |p: &Point2<f64>| {
        let share = quarters(&(p - centre)) / 4.0;
        ((share * N_SECTORS as f64) as usize).min(N_SECTORS - 1)
    };
    for p in &points {
        let apart = nalgebra::distance_squared(p, centre);
        let slot = &mut far[sector(p)];
        if slot.is_none_or(|(most, _)| apart > most) {
            *slot = Some((apart, *p));
        }
    }
    let corner = |i: usize| far[i % N_SECTORS].map(|(_, p)| p);
    // What lies farthest in the sector before, in a sector, and in the one after.
    let corners: Vec<Option<[Point2<f64>; 3]>> = (0..N_SECTORS)
        .map(|i| Some([corner(i + N_SECTORS - 1)?, corner(i)?, corner(i + 1)?]))
        .collect();
    let left_of = |p: &Point2<f64>, a: &Point2<f64>, b: &Point2<f64>| {
        (b - a).perp(&(p - a)) > SURELY * nalgebra::distance(a, b)
    };
    // On the inner side of both sides that meet in the sector.
    let is_inside = |p: &Point2<f64>| {
        corners[sector(p)].is_some_and(|[a, b, c]| left_of(p, &a, &b) && left_of(p, &b, &c))
    };
    points.into_iter().filter(|p| !is_inside(p)).collect()
}

/// The direction of an arm as a number from 0 to 4 that grows with its angle, a quarter of a turn
/// for each.
fn quarters(arm: &Vector2<f64>) -> f64 {
    let sum = arm.x.abs() + arm.y.abs();
    if sum == 0.0 {
        return 0.0;
    }
    let along = arm.x / sum;
    if arm.y >= 0.0 { 1.0 - along } else { 3.0 + along }
}

/// The radius of a circle about a centre that is inside a polygon; not above 0 when the centre is
/// outside.
fn inscribed(corners: &[Point2<f64>], centre: &Point2<f64>) -> f64 {
    let apart = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        let side = b - a;
        if side.norm() == 0.0 { f64::INFINITY } else { side.perp(&(centre - a)) / side.norm() }
    };
    (0..corners.len()).map(apart).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn parts_stand_on_the_bed_and_on_the_axis() {
        let mut mesh = shapes::steps();
        mesh.vertices.iter_mut().for_each(|p| *p += Vector3::new(31.0, -7.0, 100.0));
        let solid = Solid::new(mesh);
        for angle in [0.0, 0.5, 2.0] {
            let rotation = Rotation3::from_euler_angles(angle, 0.2, 0.1);
            let (placed, placement) = placed(&solid, &rotation);
            assert_eq!(placed.mesh().bounds().min.z, 0.0);
            let circle = footprint(placed.mesh()).unwrap();
            assert!(circle.centre.coords.norm() < 1e-9);
            assert_eq!(placed.sides(), solid.sides());
            let moved = placement.isometry() * solid.mesh().vertices[3];
            assert!((moved - placed.mesh().vertices[3]).norm() < 1e-9);
            let volume: f64 = placed.shells().iter().map(|s| s.volume_mm3).sum();
            assert!((volume - 10_742.4).abs() < 1e-6);
        }
    }

    #[test]
    fn quarter_turns_are_exact() {
        let to_bed = crate::orient::down_to_bed(&Vector3::x());
        let placed = Placement::on_bed(&shapes::cube(20.0), &to_bed);
        let mesh = placed.mesh(&shapes::cube(20.0));
        assert!(mesh.vertices.iter().all(|p| p.z == 0.0 || p.z == 20.0));
    }

    #[test]
    fn the_filter_keeps_the_footprint() {
        for name in shapes::NAMES {
            let mesh = shapes::by_name(name).unwrap();
            let all: Vec<Point2<f64>> = mesh.vertices.iter().map(|p| p.xy()).collect();
            let (a, b) = (smallest_around(&all).unwrap(), footprint(&mesh).unwrap());
            assert!((a.centre - b.centre).norm() < 1e-9, "{name}");
            assert!((a.radius - b.radius).abs() < 1e-9, "{name}");
        }
        assert!(outermost(|| shapes::icosphere(4, 10.0).vertices.into_iter()).len() < 1000);
        assert_eq!(footprint(&Mesh::default()), None);
    }

    #[test]
    fn of_a_long_part_little_is_left() {
        let mut egg = shapes::icosphere(6, 10.0);
        egg.vertices.iter_mut().for_each(|p| p.x = 1.4 * p.x + 0.1 * p.y);
        let all: Vec<Point2<f64>> = egg.vertices.iter().map(|p| p.xy()).collect();
        assert_eq!(smallest_around(&all), footprint(&egg));
        // Two fifths of them are outside the circle that the egg holds.
        let left = outermost(|| egg.vertices.iter().copied()).len();
        assert!(left < all.len() / 5, "{left} of {}", all.len());
    }
}
