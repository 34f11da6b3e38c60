//! The flat map of a layer: true lengths, areas and distances in it.
//!
//! A chart shows the point at meridian length `s` from the axis and azimuth `θ` at
//! `(u, v) = s·(cos θ, sin θ)`, mm. Lengths along the meridian are true; across it the chart is too
//! long by `1/stretch`, where `stretch(s) = radius(s)/s`: 1 on a plane, cos(angle) on a cone, sin
//! psi/psi on a sphere. Areas are `stretch` times those in the chart.
//!
//! [`Chart::inset`] and its like move borders by true distances; [`carried`] takes regions from one
//! layer to another, along the normals.

mod carry;
mod offset;

pub use carry::{carried, carried_point, carried_to_side};

use geom::grid::mm;
use geom::region::{Region, Ring, ring_sides, signed_area};
use nalgebra::{Point2, Vector2};

/// The metric of one layer's chart. See the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Chart {
    /// The layer is the plane itself.
    Plane,
    /// A cone, opening upwards or downwards.
    Cone {
        /// Cosine of the angle between cone and plane: more than 0, at most 1.
        cos: f64,
    },
    /// A cap of a sphere.
    Sphere {
        /// Radius of the sphere, mm.
        radius: f64,
    },
}

impl Chart {
    /// Returns the chart of cones that slope by `angle` (radians, either way).
    #[must_use]
    pub fn cone(angle: f64) -> Self {
        if angle == 0.0 { Self::Plane } else { Self::Cone { cos: angle.cos() } }
    }

    /// Returns whether chart and layer are the same.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        *self == Self::Plane
    }

    /// Returns the distance from the axis of what the chart shows at radius `s`, mm.
    #[must_use]
    pub fn radius(&self, s: f64) -> f64 {
        match *self {
            Self::Plane => s,
            Self::Cone { cos } => s * cos,
            Self::Sphere { radius } => radius * (s / radius).sin(),
        }
    }

    /// Returns the radius at which the chart shows what is `r` mm from the axis: the inverse of
    /// [`radius`](Self::radius).
    #[must_use]
    pub fn meridian(&self, r: f64) -> f64 {
        match *self {
            Self::Plane => r,
            Self::Cone { cos } => r / cos,
            Self::Sphere { radius } => radius * (r / radius).clamp(-1.0, 1.0).asin(),
        }
    }

    /// Returns a place of the chart as it is seen along the axis.
    #[must_use]
    pub fn seen_from_above(&self, p: &Point2<f64>) -> Point2<f64> {
        p * self.stretch(p.coords.norm())
    }

    /// Returns the place of the chart that is seen along the axis at `p`.
    #[must_use]
    pub fn under(&self, p: &Point2<f64>) -> Point2<f64> {
        let r = p.coords.norm();
        if r == 0.0 { *p } else { p * (self.meridian(r) / r) }
    }

    /// Returns a region of the chart as it is seen along the axis.
    #[must_use]
    pub fn region_from_above(&self, region: &Region) -> Region {
        if self.is_flat() {
            return region.clone();
        }
        carry::image_of(region, |p| self.seen_from_above(p))
    }

    /// Returns the region of the chart that is seen along the axis as `region`.
    #[must_use]
    pub fn region_under(&self, region: &Region) -> Region {
        if self.is_flat() {
            return region.clone();
        }
        carry::image_of(region, |p| self.under(p))
    }

    /// Returns the true length by chart length across the meridian at radius `s`; also true area
    /// by chart area.
    #[must_use]
    pub fn stretch(&self, s: f64) -> f64 {
        match *self {
            Self::Plane => 1.0,
            Self::Cone { cos } => cos,
            Self::Sphere { radius } => sinc(s / radius),
        }
    }

    /// Returns the true area of a region, mm².
    #[must_use]
    pub fn area(&self, region: &Region) -> f64 {
        region.rings().map(|ring| self.ring_area(ring)).sum()
    }

    /// Returns the true signed area of a ring, mm²; positive when counter-clockwise.
    #[must_use]
    pub fn ring_area(&self, ring: &Ring) -> f64 {
        match *self {
            Self::Plane => signed_area(ring),
            Self::Cone { cos } => cos * signed_area(ring),
            Self::Sphere { radius } => {
                ring_sides(ring).map(|(a, b)| sector_on_sphere(radius, &mm(a), &mm(b))).sum()
            }
        }
    }

    /// Returns the true length of all rings, mm.
    #[must_use]
    pub fn perimeter(&self, region: &Region) -> f64 {
        region
            .rings()
            .flat_map(|ring| ring_sides(ring))
            .map(|(a, b)| self.length(&mm(a), &mm(b)))
            .sum()
    }

    /// Returns the true length of the line that is straight in the chart, mm.
    #[must_use]
    pub fn length(&self, a: &Point2<f64>, b: &Point2<f64>) -> f64 {
        let along = b - a;
        if self.is_flat() {
            return along.norm();
        }
        gauss_pieces(self, a, b).map(|(p, weight)| weight * self.speed(&p, &along)).sum()
    }

    /// Returns the true distance of two points within the layer, mm, as if it went on without end.
    #[must_use]
    pub fn distance(&self, a: &Point2<f64>, b: &Point2<f64>) -> f64 {
        let (p, q) = (a.coords, b.coords);
        let (s, t) = (p.norm(), q.norm());
        let turn = || p.perp(&q).atan2(p.dot(&q)).abs();
        match *self {
            Self::Plane => (q - p).norm(),
            Self::Cone { cos } => {
                let turn = turn() * cos;
                let half_chord = (turn / 2.0).sin();
                ((s - t) * (s - t) + 4.0 * s * t * half_chord * half_chord).sqrt()
            }
            Self::Sphere { radius } => {
                let across = (s / radius).sin() * (t / radius).sin();
                let haversine = ((s - t) / (2.0 * radius)).sin().powi(2)
                    + across * (turn() / 2.0).sin().powi(2);
                2.0 * radius * haversine.sqrt().min(1.0).asin()
            }
        }
    }

    /// Returns the place reached from `p` along the geodesic that leaves it in `direction`, a unit
    /// vector of (outwards along the meridian, counter-clockwise across it), after `distance` mm.
    ///
    /// At the axis itself the meridian is taken to lie along the u axis.
    #[must_use]
    pub fn walk(&self, p: &Point2<f64>, direction: &Vector2<f64>, distance: f64) -> Point2<f64> {
        let s = p.coords.norm();
        let outwards = if s == 0.0 { Vector2::x() } else { p.coords / s };
        self.walk_along(s, &outwards, &(direction * distance))
    }

    /// As [`walk`](Self::walk), from radius `s` on the meridian `outwards`, by `step`.
    fn walk_along(&self, s: f64, outwards: &Vector2<f64>, step: &Vector2<f64>) -> Point2<f64> {
        match *self {
            Self::Plane => {
                let across = Vector2::new(-outwards.y, outwards.x);
                Point2::from(outwards * (s + step.x) + across * step.y)
            }
            // On the unrolled cone geodesics are straight.
            Self::Cone { cos } => {
                let (x, y) = (s + step.x, step.y);
                turned(outwards, x.hypot(y), y.atan2(x) / cos)
            }
            Self::Sphere { radius } => {
                let distance = step.norm();
                if distance == 0.0 {
                    return Point2::from(outwards * s);
                }
                let (sin_psi, cos_psi) = (s / radius).sin_cos();
                let (sin, cos) = (distance / radius).sin_cos();
                let (along, across) = (step.x / distance, step.y / distance);
                let x = sin_psi * cos + cos_psi * sin * along;
                let y = sin * across;
                let z = cos_psi * cos - sin_psi * sin * along;
                let flat = x.hypot(y);
                let s = radius * flat.atan2(z);
                if flat == 0.0 {
                    Point2::from(outwards * s)
                } else {
                    spun(outwards, s, x / flat, y / flat)
                }
            }
        }
    }

    /// True length by parameter of a line through `p` along `along`, whose chart length by
    /// parameter is that of `along`.
    fn speed(&self, p: &Point2<f64>, along: &Vector2<f64>) -> f64 {
        self.in_metric(p, along).norm()
    }

    /// A chart direction at `p` in true lengths: (along the meridian, across it).
    fn in_metric(&self, p: &Point2<f64>, along: &Vector2<f64>) -> Vector2<f64> {
        let s = p.coords.norm();
        if s == 0.0 {
            return Vector2::new(along.norm(), 0.0);
        }
        let outwards = p.coords / s;
        Vector2::new(outwards.dot(along), self.stretch(s) * outwards.perp(along))
    }
}

/// sin x / x.
fn sinc(x: f64) -> f64 {
    // Below this x² is less than the last bit of the result.
    const SMALL: f64 = 1e-8;
    if x.abs() < SMALL { 1.0 } else { x.sin() / x }
}

fn turned(outwards: &Vector2<f64>, s: f64, turn: f64) -> Point2<f64> {
    let (sin, cos) = turn.sin_cos();
    spun(outwards, s, cos, sin)
}

fn spun(outwards: &Vector2<f64>, s: f64, cos: f64, sin: f64) -> Point2<f64> {
    Point2::new(
        s * (outwards.x * cos - outwards.y * sin),
        s * (outwards.x * sin + outwards.y * cos),
    )
}

/// True area between the axis and the line from `a` to `b`: ∫ R² (1 − cos(s/R)) dθ.
fn sector_on_sphere(radius: f64, a: &Point2<f64>, b: &Point2<f64>) -> f64 {
    let cross = a.coords.perp(&b.coords);
    let along = b - a;
    // dθ = cross/s² dt, and (1 − cos(s/R))·R²/s² = sinc²(s/2R)/2 is smooth everywhere.
    let pieces = (along.norm() / (0.5 * radius)).ceil().max(1.0);
    let mut sum = 0.0;
    for piece in 0..pieces as u32 {
        for (node, weight) in GAUSS {
            let t = (f64::from(piece) + node) / pieces;
            let s = (a + along * t).coords.norm();
            sum += weight * sinc(s / (2.0 * radius)).powi(2);
        }
    }
    0.5 * cross * sum / pieces
}

/// Nodes and weights of the Gauss rule of order 10 on 0…1.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// Points and weights (adding up to 1) for an integral along the line from `a` to `b`, in pieces
/// that see the axis from far enough away for the rule to be exact to 1e-7 of the length.
fn gauss_pieces(
    chart: &Chart,
    a: &Point2<f64>,
    b: &Point2<f64>,
) -> impl Iterator<Item = (Point2<f64>, f64)> {
    const MOST: f64 = 64.0;
    let (a, along) = (*a, b - a);
    let foot = geom::polyline::share_nearest(&a, b, &Point2::origin());
    let scale = match *chart {
        Chart::Sphere { radius } => radius,
        _ => (a + along * foot).coords.norm(),
    };
    // Cut at the foot of the axis, where the direction to it turns fastest.
    [(0.0, foot), (foot, 1.0)].into_iter().filter(|(from, to)| to > from).flat_map(
        move |(from, to)| {
            let share = to - from;
            let pieces = (share * along.norm() / scale).ceil().clamp(1.0, MOST);
            (0..pieces as u32).flat_map(move |piece| {
                GAUSS.into_iter().map(move |(node, weight)| {
                    let t = from + share * (f64::from(piece) + node) / pieces;
                    (a + along * t, weight * share / pieces)
                })
            })
        },
    )
}
