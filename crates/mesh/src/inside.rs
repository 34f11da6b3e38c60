//! How often shells wind round a point, by rays.
//!
//! A ray goes up (+z) from the point; every triangle that it leaves through counts +1, every one
//! that it enters through −1. A ray that grazes a side, or a point that lies on a surface, gives
//! no answer instead of a wrong one: the caller then asks at another point. So callers ask at
//! points that are unlikely to stand below anything: [`odd_point`] of a triangle.
//!
//! Unit mm, frame that of the mesh.

use crate::topology::Solid;
use geom::bounding::{Bounds, BoxTree};
use nalgebra::{Point3, Vector3};
use std::cell::Cell;

/// From this number of rays on, sorting the triangles into a tree pays: building it costs as much
/// as some 200 passes over all of them.
const MANY_RAYS: usize = 200;

/// Twice the area of a projected triangle is zero below this share of its terms. Rounding is some
/// 1e-16; at 1e-12 a ray 10 pm beside a side of 10 mm counts as grazing it.
const GRAZING: f64 = 1e-12;

/// How many triangles many rays may meet in all: about a second. Thousands of shells inside each
/// other would take hours; beyond this, rays give no answer.
const MOST_VISITS: usize = 20_000_000;

/// How many triangles few rays may meet: as many as [`MANY_RAYS`] of them do, each asked again
/// some times.
fn most_visits(n_triangles: usize) -> usize {
    MOST_VISITS.max(4 * MANY_RAYS * n_triangles)
}

/// Rays through some shells of a solid.
pub(crate) struct Rays<'a> {
    solid: &'a Solid,
    triangles: Vec<u32>,
    tree: Option<BoxTree>,
    top: f64,
    visits_left: Cell<usize>,
}

impl<'a> Rays<'a> {
    /// Prepares about `n_rays` rays through the shells that `wanted` names.
    pub(crate) fn new(solid: &'a Solid, n_rays: usize, wanted: impl Fn(u32) -> bool) -> Self {
        let triangles: Vec<u32> = (0..solid.mesh().triangles.len() as u32)
            .filter(|t| wanted(solid.shell_of()[*t as usize]))
            .collect();
        let boxes = || triangles.iter().map(|t| Bounds::of(&solid.mesh().corners(*t))).collect();
        let tree = (n_rays >= MANY_RAYS).then(|| BoxTree::new(boxes()));
        let top = solid.mesh().bounds().max.z;
        let few = most_visits(triangles.len());
        let visits_left = Cell::new(if tree.is_some() { MOST_VISITS } else { few });
        Self { solid, triangles, tree, top, visits_left }
    }

    /// Returns how often each shell but `skipped` winds round `p`, for those that do; `None` when
    /// the ray grazes something or `p` lies within `touch` (mm) below or above a surface.
    pub(crate) fn windings(
        &self,
        p: &Point3<f64>,
        skipped: u32,
        touch: f64,
    ) -> Option<Vec<(u32, i32)>> {
        // Asking the tree costs as much as looking at what it finds.
        self.visit(1)?;
        let met = match &self.tree {
            None => None,
            Some(tree) => {
                let end = Point3::new(p.x, p.y, self.top.max(p.z));
                Some(tree.meeting(&Bounds::of([p, &end]).grown(touch)))
            }
        };
        self.visit(met.as_ref().map_or(self.triangles.len(), Vec::len))?;
        let mut crossings = Vec::new();
        let mut visit = |triangle: u32| {
            let shell = self.solid.shell_of()[triangle as usize];
            let crossing = match shell == skipped {
                true => Crossing::None,
                false => self.crossing(triangle, p, touch),
            };
            if let Crossing::Winds(sign) = crossing {
                crossings.push((shell, sign));
            }
            !matches!(crossing, Crossing::Unclear)
        };
        let clear = match met {
            None => self.triangles.iter().all(|t| visit(*t)),
            Some(met) => met.into_iter().all(|i| visit(self.triangles[i as usize])),
        };
        clear.then(|| sum_by_shell(crossings))
    }

    /// Returns whether `p` is nearer than `touch` (mm) to a triangle of `shell`, or whether that
    /// would take too long to find out.
    pub(crate) fn touches(&self, p: &Point3<f64>, shell: u32, touch: f64) -> bool {
        if self.visit(self.triangles.len()).is_none() {
            return true;
        }
        self.triangles
            .iter()
            .filter(|t| self.solid.shell_of()[**t as usize] == shell)
            .any(|t| distance_to(&self.solid.mesh().corners(*t), p) < touch)
    }

    /// Counts visits; `None` from the moment that there are too many.
    fn visit(&self, n: usize) -> Option<()> {
        let left = self.visits_left.get().checked_sub(n);
        self.visits_left.set(left.unwrap_or(0));
        left.map(|_| ())
    }

    fn crossing(&self, triangle: u32, p: &Point3<f64>, touch: f64) -> Crossing {
        let corners = self.solid.mesh().corners(triangle);
        let arms = corners.map(|c| c - p);
        let beside = |k: usize| {
            let one_way = arms.iter().all(|arm| arm[k] > 0.0);
            one_way || arms.iter().all(|arm| arm[k] < 0.0)
        };
        if beside(0) || beside(1) || arms.iter().all(|arm| arm.z < -touch) {
            return Crossing::None;
        }
        let [a, b, c] = arms;
        let weights = [turn(&b, &c), turn(&c, &a), turn(&a, &b)];
        let (left, right) = (weights.iter().any(|w| *w > 0.0), weights.iter().any(|w| *w < 0.0));
        if left && right {
            return Crossing::None;
        }
        if weights.contains(&0.0) {
            return Crossing::Unclear;
        }
        let sum: f64 = weights.iter().sum();
        let rise: f64 = weights.iter().zip(&arms).map(|(w, arm)| w / sum * arm.z).sum();
        if rise.abs() <= touch {
            Crossing::Unclear
        } else if rise < 0.0 {
            Crossing::None
        } else {
            Crossing::Winds(if left { 1 } else { -1 })
        }
    }
}

/// Adds up the crossings of each shell; those that cancel are left out.
fn sum_by_shell(mut crossings: Vec<(u32, i32)>) -> Vec<(u32, i32)> {
    crossings.sort_unstable();
    let sum = |run: &[(u32, i32)]| (run[0].0, run.iter().map(|(_, sign)| sign).sum());
    let sums = crossings.chunk_by(|a, b| a.0 == b.0).map(sum);
    sums.filter(|(_, winding)| *winding != 0).collect()
}

enum Crossing {
    None,
    Unclear,
    Winds(i32),
}

/// Which way two arms turn, seen from above; exactly 0 when rounding could decide.
fn turn(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    let (one, other) = (a.x * b.y, a.y * b.x);
    let twice_area = one - other;
    if twice_area.abs() <= GRAZING * (one.abs() + other.abs()) { 0.0 } else { twice_area }
}

/// Returns a point inside a triangle that is on none of its lines of symmetry: rays from there
/// seldom meet the diagonals and corners of other parts that share its centre.
pub(crate) fn odd_point(corners: &[Point3<f64>; 3]) -> Point3<f64> {
    const WEIGHTS: [f64; 3] = [0.418, 0.349, 0.233];
    let sum: Vector3<f64> = corners.iter().zip(WEIGHTS).map(|(p, w)| p.coords * w).sum();
    Point3::from(sum)
}

/// Returns the distance from `p` to a triangle.
///
/// Source: C. Ericson (2005), "Real-Time Collision Detection", section 5.1.5, as the least of the
/// distances to the sides, or to the plane when the foot lies inside.
pub(crate) fn distance_to(corners: &[Point3<f64>; 3], p: &Point3<f64>) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let inside =
        |from: &Point3<f64>, to: &Point3<f64>| (to - from).cross(&(p - from)).dot(&normal) >= 0.0;
    let size = normal.norm();
    if size > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return ((p - a).dot(&normal) / size).abs();
    }
    let sides = [(a, b), (b, c), (c, a)];
    sides.iter().map(|(a, b)| distance_to_segment(a, b, p)).fold(f64::INFINITY, f64::min)
}

/// Returns the distance from `p` to the segment from `a` to `b`.
pub(crate) fn distance_to_segment(a: &Point3<f64>, b: &Point3<f64>, p: &Point3<f64>) -> f64 {
    let along = b - a;
    let t = (p - a).dot(&along) / along.norm_squared();
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    (p - (a + along * t)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn a_sphere_winds_once_round_its_inside() {
        let solid = Solid::new(shapes::icosphere(3, 10.0));
        for n_rays in [1, 1000] {
            let rays = Rays::new(&solid, n_rays, |_| true);
            let mut state = 5_u64;
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 33) as f64 / f64::from(1_u32 << 31) * 26.0 - 13.0
            };
            for _ in 0..500 {
                let p = Point3::new(next(), next(), next() + 10.0);
                let from_centre = (p - Point3::new(0.0, 0.0, 10.0)).norm();
                if (from_centre - 9.95).abs() < 0.1 {
                    continue;
                }
                let winding = rays.windings(&p, u32::MAX, 1e-6).expect("a random ray is clear");
                assert_eq!(winding, if from_centre < 10.0 { vec![(0, 1)] } else { vec![] });
            }
        }
    }

    #[test]
    fn unclear_rays_say_so() {
        let solid = Solid::new(shapes::cube(20.0));
        let rays = Rays::new(&solid, 1, |_| true);
        let at = |x: f64, y: f64, z: f64| rays.windings(&Point3::new(x, y, z), u32::MAX, 1e-6);
        assert_eq!(at(10.0, 3.0, 5.0), None, "within a wall");
        assert_eq!(at(3.0, 3.0, 5.0), None, "below a diagonal");
        assert_eq!(at(3.0, 1.0, 20.0), None, "on the top");
        assert_eq!(at(3.0, 1.0, 5.0), Some(vec![(0, 1)]));
        assert_eq!(at(3.0, 1.0, -5.0), Some(vec![]), "in and out");
        assert!(rays.touches(&Point3::new(9.9, 3.0, 5.0), 0, 0.2));
        assert!(!rays.touches(&Point3::new(9.9, 3.0, 5.0), 0, 0.05));
    }

    #[test]
    fn distances() {
        let triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(Point3::from);
        let to = |x: f64, y: f64, z: f64| distance_to(&triangle, &Point3::new(x, y, z));
        assert_eq!(to(1.0, 1.0, -3.0), 3.0);
        assert_eq!(to(-3.0, -4.0, 0.0), 5.0);
        assert_eq!(to(2.0, -2.0, 0.0), 2.0);
        assert!((to(4.0, 4.0, 0.0) - 8.0_f64.sqrt()).abs() < 1e-12);
        let flat = [triangle[0]; 3];
        assert_eq!(distance_to(&flat, &Point3::new(0.0, 3.0, 4.0)), 5.0);
    }
}
