//! How a family of layers meets lines and planes: one convex function for all families.
//!
//! In *convex coordinates* (z negated for bowls) every family is the level sets of a function F
//! that is convex in space, so the set K = {F < C} is a convex solid. Hence a segment meets a layer
//! at most twice, K is cut by a facet in one convex piece, F is greatest at a vertex of a facet and
//! has at most one least place in it.
//!
//! On the line `a + t·along` the layer is where a quadratic `a2·t² + 2b·t + g`, negative in K,
//! vanishes. Its terms are products of sums and differences instead of differences of squares, so
//! that no digits cancel near the layer.

use nalgebra::{Point3, Vector3};

/// The convex function of a family. Convex coordinates are those of the part, with z negated for bowls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    kind: Kind,
    is_mirrored: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// F = z
    Plane,
    /// F = z + slope·r, slope ≥ 0
    Cone { slope: f64 },
    /// F = |p − centre| + centre_z
    Spheres { centre_z: f64 },
    /// F = z + R − √(R² − r²)
    Caps { radius: f64 },
}

/// `a2·t² + 2b·t + g` along a line, negative in K, with `root = √(b² − a2·g)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadratic {
    /// Half the second derivative.
    pub a2: f64,
    /// Half the slope at t = 0.
    pub b: f64,
    /// The value at t = 0.
    pub g: f64,
    /// The root of the discriminant; zero where rounding made that negative.
    pub root: f64,
}

impl Quadratic {
    /// Returns whether the line meets the layer at so large an angle that rounding cannot show in
    /// where it does.
    #[must_use]
    pub fn is_steep(&self) -> bool {
        // Half the slope at the crossing is `root`; beside terms ten thousand times as large it
        // would have lost four of its sixteen digits.
        const LEAST_SHARE: f64 = 1e-4;
        self.root > LEAST_SHARE * (self.a2.abs() + self.b.abs() + self.g.abs())
    }

    /// Returns where the line leaves K: F grows there. Not a number when it never does.
    #[must_use]
    pub fn leaves(&self) -> f64 {
        let Self { a2, b, g, root } = *self;
        if b <= 0.0 { (root - b) / a2 } else { -g / (root + b) }
    }

    /// Returns where the line enters K.
    #[must_use]
    pub fn enters(&self) -> f64 {
        let Self { a2, b, g, root } = *self;
        if b >= 0.0 { -(root + b) / a2 } else { g / (root - b) }
    }
}

impl Form {
    pub(super) fn plane() -> Self {
        Self { kind: Kind::Plane, is_mirrored: false }
    }

    pub(super) fn cone(slope: f64) -> Self {
        Self { kind: Kind::Cone { slope: slope.abs() }, is_mirrored: slope < 0.0 }
    }

    pub(super) fn spheres(centre_z: f64) -> Self {
        Self { kind: Kind::Spheres { centre_z }, is_mirrored: false }
    }

    pub(super) fn caps(radius: f64) -> Self {
        Self { kind: Kind::Caps { radius }, is_mirrored: false }
    }

    /// Returns whether layers are planes: nothing between two points of a facet is curved.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.kind == Kind::Plane
    }

    /// Returns by how much the layer through a point of the part slopes down outwards, radians; negative
    /// in bowls. On the axis it is that of the places beside it.
    #[must_use]
    pub fn slope(&self, p: &Point3<f64>) -> f64 {
        let r = length(p.x, p.y);
        match self.kind {
            Kind::Plane => 0.0,
            Kind::Cone { slope } if self.is_mirrored => -slope.atan(),
            Kind::Cone { slope } => slope.atan(),
            Kind::Spheres { centre_z } => r.atan2(p.z - centre_z),
            Kind::Caps { radius } => (r / radius).min(1.0).asin(),
        }
    }

    /// Returns at which height (mm) a layer lies at distance `r` from the axis; not a number where it does
    /// not reach.
    #[must_use]
    pub fn height(&self, level: f64, r: f64) -> f64 {
        let sagged = |radius: f64| level - r * r / (radius + (radius * radius - r * r).sqrt());
        match self.kind {
            Kind::Plane => level,
            Kind::Cone { slope } if self.is_mirrored => level + slope * r,
            Kind::Cone { slope } => level - slope * r,
            Kind::Spheres { centre_z } => sagged(level - centre_z),
            Kind::Caps { radius } => sagged(radius),
        }
    }

    /// Returns whether convex coordinates have z negated, and F is the negated level.
    #[must_use]
    pub fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// Returns `p` in convex coordinates, or back.
    #[must_use]
    pub fn convex(&self, p: &Point3<f64>) -> Point3<f64> {
        if self.is_mirrored { Point3::new(p.x, p.y, -p.z) } else { *p }
    }

    /// Returns the F of a level, or back.
    #[must_use]
    pub fn value_of_level(&self, level: f64) -> f64 {
        if self.is_mirrored { -level } else { level }
    }

    /// Returns F at `p`, in convex coordinates like all that follows.
    #[must_use]
    pub fn value(&self, p: &Point3<f64>) -> f64 {
        match self.kind {
            Kind::Plane => p.z,
            Kind::Cone { slope } => p.z + slope * length(p.x, p.y),
            Kind::Spheres { centre_z } => {
                let (square, up) = (p.x * p.x + p.y * p.y, p.z - centre_z);
                let distance = (square + up * up).sqrt();
                // |p − centre| − up, without the cancellation of a centre far below.
                if up > 0.0 { p.z + square / (distance + up) } else { distance + centre_z }
            }
            Kind::Caps { radius } => {
                let square = p.x * p.x + p.y * p.y;
                let rise = (radius * radius - square).max(0.0).sqrt();
                p.z + square / (radius + rise)
            }
        }
    }

    /// Returns F at `p` and by how much it begins to grow on the way along `along`; not a number
    /// where that has no direction.
    #[must_use]
    pub fn value_and_growth(&self, p: &Point3<f64>, along: &Vector3<f64>) -> (f64, f64) {
        let inner = p.x * along.x + p.y * along.y;
        let square = p.x * p.x + p.y * p.y;
        match self.kind {
            Kind::Plane => (p.z, along.z),
            Kind::Cone { slope } => {
                let r = square.sqrt();
                (p.z + slope * r, along.z + slope * inner / r)
            }
            Kind::Spheres { centre_z } => {
                let up = p.z - centre_z;
                (self.value(p), (inner + up * along.z) / (square + up * up).sqrt())
            }
            Kind::Caps { radius } => {
                let rise = (radius * radius - square).max(0.0).sqrt();
                (p.z + square / (radius + rise), along.z + inner / rise)
            }
        }
    }

    /// Returns the quadratic of the layer `value` along a line.
    #[must_use]
    pub fn quadratic(&self, value: f64, a: &Point3<f64>, along: &Vector3<f64>) -> Quadratic {
        match self.kind {
            Kind::Plane => {
                let b = along.z / 2.0;
                Quadratic { a2: 0.0, b, g: a.z - value, root: b.abs() }
            }
            Kind::Cone { slope } => cone_quadratic(slope, value - a.z, a, along),
            Kind::Spheres { centre_z } => {
                let from_centre = Vector3::new(a.x, a.y, a.z - centre_z);
                let radius = value - centre_z;
                let g = (self.value(a) - value) * (from_centre.norm() + radius);
                sphere_quadratic(radius, &from_centre, g, along)
            }
            Kind::Caps { radius } => {
                let from_centre = Vector3::new(a.x, a.y, a.z - (value - radius));
                let distance = from_centre.norm();
                let g = (distance - radius) * (distance + radius);
                sphere_quadratic(radius, &from_centre, g, along)
            }
        }
    }

    /// Returns whether F falls at first on the way from `a`, where it is `value_a`, to `b`.
    ///
    /// Costs no root. A segment that F falls into from its lower end has its least place inside, and
    /// a facet can only have one inside when F falls from its lowest corner into a side.
    #[must_use]
    pub fn falls_towards(&self, a: &Point3<f64>, value_a: f64, b: &Point3<f64>) -> bool {
        let along = b - a;
        let inner = a.x * along.x + a.y * along.y;
        match self.kind {
            Kind::Plane => along.z < 0.0,
            // The slope times slope·r, which the value tells.
            Kind::Cone { slope } => (value_a - a.z) * along.z + slope * slope * inner < 0.0,
            Kind::Spheres { centre_z } => inner + (a.z - centre_z) * along.z < 0.0,
            // The slope times √(R² − r²), which the value tells.
            Kind::Caps { radius } => (a.z + radius - value_a) * along.z + inner < 0.0,
        }
    }

    /// Returns where on a line F is least; `None` when there is no such place.
    #[must_use]
    pub fn lowest_on_line(&self, a: &Point3<f64>, along: &Vector3<f64>) -> Option<f64> {
        let flat = along.x * along.x + along.y * along.y;
        let inner = a.x * along.x + a.y * along.y;
        let cross = (a.x * along.y - a.y * along.x).abs();
        let t = match self.kind {
            Kind::Plane => return None,
            Kind::Cone { slope } => {
                let steep = slope * flat.sqrt();
                let a2 = (steep - along.z) * (steep + along.z);
                if a2 <= 0.0 {
                    return None;
                }
                (-inner - cross * along.z / a2.sqrt()) / flat
            }
            Kind::Spheres { centre_z } => {
                -(inner + (a.z - centre_z) * along.z) / along.norm_squared()
            }
            Kind::Caps { radius } => {
                // Along the line the cap is an arc of radius ρ about the foot of the axis; with
                // slope m of the line F is least at −m·ρ/√(1 + m²) from there.
                let rho = (radius * radius - cross * cross / flat).max(0.0).sqrt();
                (-inner - along.z * rho * (flat / (flat + along.z * along.z)).sqrt()) / flat
            }
        };
        t.is_finite().then_some(t)
    }

    /// Returns where in the plane through `a` with the normal `n` (of any length) F is least;
    /// `None` when it is least nowhere.
    #[must_use]
    pub fn lowest_in_plane(&self, a: &Point3<f64>, n: &Vector3<f64>) -> Option<Point3<f64>> {
        let tilt = length(n.x, n.y);
        let on_plane =
            |x: f64, y: f64| Point3::new(x, y, a.z - (n.x * (x - a.x) + n.y * (y - a.y)) / n.z);
        let lowest = match self.kind {
            Kind::Plane => return None,
            // The plane is flatter than the cone: the apex of the layer that touches it.
            Kind::Cone { slope } if tilt < slope * n.z.abs() => on_plane(0.0, 0.0),
            Kind::Cone { .. } => return None,
            Kind::Spheres { centre_z } => {
                let centre = Point3::new(0.0, 0.0, centre_z);
                centre + n * ((a - centre).dot(n) / n.norm_squared())
            }
            Kind::Caps { radius } => {
                let share = radius * n.z.signum() / n.norm();
                on_plane(n.x * share, n.y * share)
            }
        };
        lowest.iter().all(|x| x.is_finite()).then_some(lowest)
    }

    /// Returns the direction whose product with the facet's normal points from the middle of a
    /// chord along `chord` to the place where the layer runs parallel to it.
    #[must_use]
    pub fn conjugate(&self, chord: &Vector3<f64>) -> Vector3<f64> {
        match self.kind {
            Kind::Plane => Vector3::zeros(),
            Kind::Cone { slope } => {
                let square = slope * slope;
                Vector3::new(square * chord.x, square * chord.y, -chord.z)
            }
            Kind::Spheres { .. } | Kind::Caps { .. } => *chord,
        }
    }
}

/// `up` is the height of the apex above `a`.
fn cone_quadratic(slope: f64, up: f64, a: &Point3<f64>, along: &Vector3<f64>) -> Quadratic {
    let (r, run) = (length(a.x, a.y), length(along.x, along.y));
    let (out, steep) = (slope * r, slope * run);
    let cross = slope * (a.x * along.y - a.y * along.x).abs();
    let v = length(up * along.x + along.z * a.x, up * along.y + along.z * a.y);
    Quadratic {
        a2: (steep - along.z) * (steep + along.z),
        b: slope * slope * (a.x * along.x + a.y * along.y) + up * along.z,
        g: (out - up) * (out + up),
        root: slope * ((v - cross) * (v + cross)).max(0.0).sqrt(),
    }
}

fn sphere_quadratic(
    radius: f64,
    from_centre: &Vector3<f64>,
    g: f64,
    along: &Vector3<f64>,
) -> Quadratic {
    let (reach, moment) = (radius * along.norm(), from_centre.cross(along).norm());
    Quadratic {
        a2: along.norm_squared(),
        b: from_centre.dot(along),
        g,
        root: ((reach - moment) * (reach + moment)).max(0.0).sqrt(),
    }
}

/// Faster than `hypot`, and coordinates of a part neither overflow nor vanish when squared.
fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_normals() {
        use crate::surface::{Caps, Cone, LayerSurface, Plane, Spheres};
        let surfaces: [Box<dyn LayerSurface>; 5] = [
            Box::new(Plane),
            Box::new(Cone::new(0.6).unwrap()),
            Box::new(Cone::new(-0.4).unwrap()),
            Box::new(Spheres::new(-12.0).unwrap()),
            Box::new(Caps::new(80.0).unwrap()),
        ];
        for surface in surfaces {
            for (x, y, z) in [(3.0, 4.0, 2.0), (-30.0, 1.0, 9.0), (0.5, -0.2, 0.0)] {
                let p = Point3::new(x, y, z);
                let (normal, slope) = (surface.normal(&p), surface.form().slope(&p));
                let out = normal.x * x / length(x, y) + normal.y * y / length(x, y);
                assert!((out.atan2(normal.z) - slope).abs() < 1e-12, "{:?} {p}", surface.form());
            }
        }
    }

    fn forms() -> [Form; 5] {
        [Form::cone(0.5), Form::cone(-1.0), Form::spheres(-20.0), Form::caps(60.0), Form::plane()]
    }

    fn random(seed: &mut u64) -> f64 {
        *seed =
            seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn the_growth_is_the_derivative() {
        let seed = &mut 3;
        for form in forms() {
            for _ in 0..100 {
                let mut point = || Point3::from([(); 3].map(|()| 40.0 * random(seed) - 20.0));
                let (p, along) = (point(), point().coords);
                let (value, growth) = form.value_and_growth(&p, &along);
                assert!((value - form.value(&p)).abs() < 1e-12);
                let step = 1e-6;
                let [before, after] = [-step, step].map(|step| form.value(&(p + along * step)));
                assert!((growth - (after - before) / (2.0 * step)).abs() < 1e-5 * along.norm());
            }
        }
    }

    #[test]
    fn the_least_places_are_least() {
        let seed = &mut 7;
        for form in forms() {
            for _ in 0..200 {
                let mut point = || {
                    let [x, y, z] = std::array::from_fn(|_| 40.0 * random(seed) - 20.0);
                    Point3::new(x, y, z + 20.0)
                };
                let (a, b, c) = (point(), point(), point());
                let along = b - a;
                if let Some(t) = form.lowest_on_line(&a, &along).filter(|t| (-0.2..1.2).contains(t))
                {
                    let least = form.value(&(a + along * t));
                    for step in [-1e-3, 1e-3] {
                        assert!(form.value(&(a + along * (t + step))) >= least - 1e-12);
                    }
                }
                let n = along.cross(&(c - a));
                let lowest = form.lowest_in_plane(&a, &n).filter(|p| p.xy().coords.norm() < 40.0);
                if let Some(lowest) = lowest {
                    let least = form.value(&lowest);
                    for step in [along, c - a, -along, a - c] {
                        assert!(form.value(&(lowest + step * 1e-3)) >= least - 1e-12);
                    }
                }
            }
        }
    }
}
