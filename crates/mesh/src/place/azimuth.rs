//! A direction that turns with the part.
//!
//! Whatever starts somewhere on the bed, a seam or a fan of infill lines, should start at the
//! same place of the part however it is turned. The direction comes from the harmonics of the
//! surface about the centre of the footprint,
//!
//! ```text
//! c_k = ∫ (x + i y)^k dA / (A R^k),      R the radius of the footprint
//! ```
//!
//! which are exact polynomial integrals, so they do not depend on how faces are cut into
//! triangles: over a triangle with corners z₁, z₂, z₃ in the complex plane, the integral of z^k is
//! A · 2/((k+1)(k+2)) · h_k(z₁, z₂, z₃) with h_k the complete homogeneous symmetric polynomial.
//! When the part turns by φ, c_k turns by kφ. The lowest k with a harmonic to speak of gives k
//! directions, arg(c_k)/k apart by a k-th of a turn; all harmonics together choose among them, with
//! those weighted by height, so that a part that looks the same from above after half a turn, but
//! is higher on one side, still has one direction. A part that looks the same from everywhere
//! after a k-th of a turn is indifferent to the choice.
//!
//! Of a fine mesh, a facet is first counted in one of many small cells, and the harmonics are those
//! of the cells (`cells`).

mod cells;

use super::footprint;
use crate::measure;
use crate::mesh::Mesh;
use geom::circle::Circle;
use nalgebra::{Complex, Point3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::f64::consts::TAU;

/// Harmonics below this are noise. Rounding to `f32` leaves 1e-7, text with three decimals 1e-5
/// on a part of 100 mm; an asymmetry that the eye finds is above 1e-2.
const LEAST: f64 = 1e-3;

/// Harmonics that nearly every part has one of.
const LOW: usize = 6;

/// Harmonics for parts of high symmetry: gears have as many as teeth. Beyond, a part is round.
const HIGH: usize = 48;

/// Scores that differ by less are equal.
const SAME_SCORE: f64 = 1e-9;

/// Triangles that are summed by one thread: the sum is the same for any number of threads.
const CHUNK: usize = 1 << 14;

/// Returns an azimuth, rad in (−π, π], that turns with the part about z; 0 when the part is round.
///
/// Parts with a symmetry about z have several such directions, of which any may be returned.
#[must_use]
pub fn reference_azimuth(mesh: &Mesh) -> f64 {
    let Some(surface) = Surface::of(mesh) else { return 0.0 };
    let fine = mesh.triangles.len() >= cells::WORTH_IT;
    let cells = fine.then(|| cells::Cells::of(&surface));
    let low = |weight| match &cells {
        Some(cells) => cells.harmonics(weight),
        None => surface.harmonics(LOW, weight),
    };
    let by_area = low(Weight::Area);
    let found = lowest(&by_area).or_else(|| lowest(&low(Weight::Height))).or_else(|| {
        // A round part of many facets is known to be one in less time than this would take.
        let many = mesh.triangles.len() >= cells::TELL_ROUND;
        let cells = cells.as_ref().map(Cow::Borrowed);
        let cells = cells.or_else(|| many.then(|| Cow::Owned(cells::Cells::of(&surface))));
        let round = cells.is_some_and(|cells| cells.are_surely_round());
        if round { None } else { lowest(&surface.harmonics(HIGH, Weight::Area)) }
    });
    let Some((k, harmonic)) = found else { return 0.0 };
    let directions = (0..k).map(|j| (harmonic.arg() + TAU * f64::from(j)) / f64::from(k));
    let turn = choose(directions.collect(), &by_area, || low(Weight::Height)).rem_euclid(TAU);
    if turn > TAU / 2.0 { turn - TAU } else { turn }
}

/// The lowest harmonic to speak of, with its number.
fn lowest(harmonics: &[Complex<f64>]) -> Option<(u32, Complex<f64>)> {
    (1..).zip(harmonics.iter().copied()).find(|(_, harmonic)| harmonic.norm() > LEAST)
}

/// What the surface is weighted by.
#[derive(Clone, Copy, PartialEq)]
enum Weight {
    Area,
    /// Area times height, which runs from −1 to 1.
    Height,
}

/// A place in the complex plane, with the footprint as the unit circle, and a height from −1 to 1.
type Place = (Complex<f64>, f64);

/// A surface about the axis through the centre of its footprint.
struct Surface<'a> {
    mesh: &'a Mesh,
    circle: Circle,
    /// The height in the middle, and that of the upper half.
    middle: f64,
    half_height: f64,
}

impl<'a> Surface<'a> {
    fn of(mesh: &'a Mesh) -> Option<Self> {
        let circle = footprint(mesh).filter(|circle| circle.radius > 0.0)?;
        let bounds = mesh.bounds();
        let middle = nalgebra::center(&bounds.min, &bounds.max).z;
        let half_height = (bounds.size().z / 2.0).max(f64::MIN_POSITIVE);
        Some(Self { mesh, circle, middle, half_height })
    }

    fn place(&self, p: &Point3<f64>) -> Place {
        let arm = (p.xy() - self.circle.centre) / self.circle.radius;
        (Complex::new(arm.x, arm.y), (p.z - self.middle) / self.half_height)
    }

    /// The places of the corners of a triangle, and its area.
    fn triangle(&self, corners: &[u32; 3]) -> ([Place; 3], f64) {
        let corners = corners.map(|v| self.mesh.vertices[v as usize]);
        (corners.map(|p| self.place(&p)), measure::area_of(&corners))
    }

    /// The harmonics 1 … n.
    fn harmonics(&self, n: usize, weight: Weight) -> Vec<Complex<f64>> {
        let of_chunk = |triangles: &[[u32; 3]]| {
            let mut area = 0.0;
            let mut sums = vec![Complex::new(0.0, 0.0); n];
            for corners in triangles {
                let (places, own) = self.triangle(corners);
                area += own;
                match weight {
                    Weight::Area => add_plain(&mut sums, places.map(|(z, _)| z), own),
                    Weight::Height => add_by_height(&mut sums, places, own),
                }
            }
            (area, sums)
        };
        let chunks: Vec<_> = self.mesh.triangles.par_chunks(CHUNK).map(of_chunk).collect();
        let area: f64 = chunks.iter().map(|(area, _)| area).sum();
        let total = |k: usize| chunks.iter().map(|(_, sums)| sums[k]).sum::<Complex<f64>>();
        let share = if area > 0.0 { 1.0 / area } else { 0.0 };
        (0..n).map(|k| total(k) * share).collect()
    }
}

/// The direction that all low harmonics together prefer.
fn choose(
    directions: Vec<f64>,
    by_area: &[Complex<f64>],
    by_height: impl FnOnce() -> Vec<Complex<f64>>,
) -> f64 {
    if directions.len() == 1 {
        return directions[0];
    }
    let by_height = by_height();
    let families = [by_area, &by_height];
    let mut best: Option<(f64, Complex<f64>)> = None;
    for azimuth in directions {
        let score = families.iter().map(|family| score(family, azimuth)).sum();
        if best.is_none_or(|(_, best)| is_better(score, best)) {
            best = Some((azimuth, score));
        }
    }
    best.map_or(0.0, |(azimuth, _)| azimuth)
}

/// Adds the integrals of z, z², … over a triangle of a given area.
fn add_plain(sums: &mut [Complex<f64>], [z1, z2, z3]: [Complex<f64>; 3], area: f64) {
    // h_k of one, two, three variables: h_k(…, z) = h_k(…) + z h_{k−1}(…, z).
    let one = Complex::new(1.0, 0.0);
    let (mut h1, mut h2, mut h3) = (one, one, one);
    for (k, sum) in (1..).zip(sums) {
        h1 *= z1;
        h2 = h1 + z2 * h2;
        h3 = h2 + z3 * h3;
        *sum += h3 * (2.0 * area / f64::from((k + 1) * (k + 2)));
    }
}

/// Adds the integrals of height times z, z², … over a triangle of a given area.
///
/// With heights ζ that is A · 2/((k+1)(k+2)(k+3)) · Σ ζ_i h_k(z₁, z₂, z₃, z_i), from the integrals
/// of barycentric monomials.
fn add_by_height(sums: &mut [Complex<f64>], corners: [(Complex<f64>, f64); 3], area: f64) {
    let [z1, z2, z3] = corners.map(|(z, _)| z);
    let one = Complex::new(1.0, 0.0);
    let (mut h1, mut h2, mut h3, mut h4) = (one, one, one, [one; 3]);
    for (k, sum) in (1..).zip(sums) {
        h1 *= z1;
        h2 = h1 + z2 * h2;
        h3 = h2 + z3 * h3;
        let share = 2.0 * area / f64::from((k + 1) * (k + 2) * (k + 3));
        for (h4, (z, height)) in h4.iter_mut().zip(corners) {
            *h4 = h3 + z * *h4;
            *sum += *h4 * (height * share);
        }
    }
}

/// How well harmonics agree with a direction (real part), and, when that is the same for two, on
/// which side of it they lie.
fn score(harmonics: &[Complex<f64>], azimuth: f64) -> Complex<f64> {
    let turn = |m: i32| Complex::from_polar(1.0, -f64::from(m) * azimuth);
    (1..).zip(harmonics).map(|(m, harmonic)| harmonic * turn(m)).sum()
}

fn is_better(score: Complex<f64>, best: Complex<f64>) -> bool {
    if (score.re - best.re).abs() > SAME_SCORE {
        score.re > best.re
    } else {
        score.im > best.im + SAME_SCORE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use nalgebra::{Isometry3, Vector3};

    fn turned(mesh: &Mesh, angle: f64) -> Mesh {
        mesh.transformed(&Isometry3::rotation(Vector3::z() * angle))
    }

    /// The difference of two azimuths, as the nearest turn of a part with `n`-fold symmetry.
    fn apart(a: f64, b: f64, n: u32) -> f64 {
        let step = TAU / f64::from(n);
        let turn = (a - b).rem_euclid(step);
        turn.min(step - turn)
    }

    #[test]
    fn it_turns_with_the_part() {
        let shapes = [
            ("steps", 1),
            ("plate", 1),
            ("cube", 4),
            ("tetrahedron", 3),
            ("cross", 4),
            ("gear", 24),
            ("wall-1.0", 2),
        ];
        for (name, symmetry) in shapes {
            let mesh = shapes::by_name(name).unwrap();
            let reference = reference_azimuth(&mesh);
            for angle in [0.1, 1.0, 2.2, 3.3, 5.9] {
                let found = reference_azimuth(&turned(&mesh, angle));
                assert!(apart(found, reference + angle, symmetry) < 1e-6, "{name} {angle}");
            }
        }
    }

    #[test]
    fn round_parts_have_none() {
        for name in ["cone", "dome", "lens", "mushroom", "torus", "umbrella", "vase"] {
            let mesh = shapes::by_name(name).unwrap();
            assert_eq!(reference_azimuth(&mesh), 0.0, "{name}");
        }
        assert_eq!(reference_azimuth(&Mesh::default()), 0.0);
    }

    #[test]
    fn height_tells_the_ends_of_a_wall_apart() {
        // A wall that slopes: from above, both ends look alike.
        let mut wall = shapes::block(40.0, 2.0, 20.0);
        for p in wall.vertices.iter_mut().filter(|p| p.z > 0.0 && p.x > 0.0) {
            p.z = 5.0;
        }
        let reference = reference_azimuth(&wall);
        for angle in [0.5, 1.5, 3.0, 4.5] {
            let found = reference_azimuth(&turned(&wall, angle));
            assert!(apart(found, reference + angle, 1) < 1e-6, "{angle}");
        }
    }

    #[test]
    fn integrals_do_not_depend_on_the_cut() {
        let corner = |x: f64, y: f64, z: f64| (Complex::new(x, y), z);
        let [a, b, c] = [corner(0.1, 0.2, -0.5), corner(0.9, -0.3, 0.4), corner(0.4, 0.8, 1.0)];
        let area =
            |[a, b, c]: [(Complex<f64>, f64); 3]| ((b.0 - a.0).conj() * (c.0 - a.0)).im / 2.0;
        let sums = |triangles: &[[(Complex<f64>, f64); 3]]| {
            let mut sums = [[Complex::new(0.0, 0.0); 5]; 2];
            for t in triangles {
                add_plain(&mut sums[0], t.map(|(z, _)| z), area(*t));
                add_by_height(&mut sums[1], *t, area(*t));
            }
            sums
        };
        let m = (b.0 * 0.7 + c.0 * 0.3, b.1 * 0.7 + c.1 * 0.3);
        let (whole, halves) = (sums(&[[a, b, c]]), sums(&[[a, b, m], [a, m, c]]));
        let pairs = whole.as_flattened().iter().zip(halves.as_flattened());
        assert!(pairs.into_iter().all(|(p, q)| (p - q).norm() < 1e-15));
        // The first is the centroid times the area.
        let centroid = (a.0 + b.0 + c.0) / 3.0 * area([a, b, c]);
        assert!((whole[0][0] - centroid).norm() < 1e-15);
    }
}
