//! Where the ring of magnets lies on the bed.
//!
//! The magnets stand at `q = e + g·c`, complex numbers: `c` the N-th roots of one, `g = rho·e^(i·psi)`.
//! That is linear in `e` and `g`, so least squares are closed. Which magnet is which, and which
//! detections are no magnets of the ring, is found by consensus: every two detections with every
//! difference of their places make a ring; the one on which most places are taken wins. No random
//! numbers. Then Huber's weights, what is more than four standard deviations off is left out, and
//! the fit is done once more.

use nalgebra::{Complex, Vector2};

use super::known::MOST_MAGNETS;
use super::pairing::HUBER;
use std::f64::consts::TAU;

/// What the ring should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawing {
    /// Places round it; found from the detections where it is not known.
    pub count: Option<u32>,
    /// Radius, mm.
    pub radius: f64,
    /// Standard deviation of a magnet about its place, each way, mm.
    pub sd: f64,
}

/// A ring that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Ring {
    /// Places round it.
    pub count: u32,
    /// Its centre on the bed, mm from the axis.
    pub centre: Vector2<f64>,
    /// mm.
    pub radius: f64,
    /// Azimuth of place 0, radians, within half a pitch of 0.
    pub angle: f64,
    /// The place of each detection; none for those that are not of the ring.
    pub labels: Vec<Option<u32>>,
}

/// A ring is never farther off its drawing; a larger share would take wrong labels for right ones.
const RADIUS_SHARE: f64 = 0.05;

/// A detection nearer than this to a place may be its magnet, mm.
const NEAR_PLACE_MM: f64 = 0.4;

/// Beyond so many standard deviations a magnet sits loose.
const LOOSE: f64 = 4.0;

/// Fewer magnets are no ring.
const FEWEST: usize = 3;

/// A number of places is believed when so many of them are taken.
const TAKEN_SHARE: f64 = 0.6;

impl Ring {
    /// Returns where the magnet of a place should be.
    #[must_use]
    pub fn place(&self, label: u32) -> Vector2<f64> {
        let angle = self.angle + TAU * f64::from(label) / f64::from(self.count);
        self.centre + self.radius * Vector2::new(angle.cos(), angle.sin())
    }
}

/// Returns the ring on which most of the detections lie, given in mm from the axis; `None` when
/// fewer than three do.
#[must_use]
pub fn find(detections: &[Vector2<f64>], drawing: &Drawing) -> Option<Ring> {
    let points: Vec<Complex<f64>> = detections.iter().map(|q| Complex::new(q.x, q.y)).collect();
    let (count, start) = match drawing.count {
        Some(count) => (count, consensus(&points, count, drawing.radius)?),
        None => unknown_count(&points, drawing.radius)?,
    };
    let labels = one_each(&points, &start, count);
    let (fit, labels) = settle(&points, labels, start, count, drawing.sd)?;
    Some(named(&fit, &labels, count))
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    e: Complex<f64>,
    g: Complex<f64>,
}

impl Candidate {
    fn nearest(&self, q: Complex<f64>, count: u32) -> (u32, f64) {
        let turns = ((q - self.e) / self.g).arg() / TAU;
        let label = (turns * f64::from(count)).round().rem_euclid(f64::from(count)) as u32;
        (label, (q - self.e - self.g * root(label, count)).norm())
    }
}

fn root(label: u32, count: u32) -> Complex<f64> {
    Complex::from_polar(1.0, TAU * f64::from(label) / f64::from(count))
}

fn unknown_count(points: &[Complex<f64>], radius: f64) -> Option<(u32, Candidate)> {
    let mut best: Option<(usize, u32, Candidate)> = None;
    for count in FEWEST as u32..=MOST_MAGNETS {
        let Some(candidate) = consensus(points, count, radius) else { continue };
        let taken = score(points, &candidate, count).0;
        let is_believed = taken as f64 >= TAKEN_SHARE * f64::from(count);
        if is_believed && best.is_none_or(|(most, ..)| taken > most) {
            best = Some((taken, count, candidate));
        }
    }
    best.map(|(_, count, candidate)| (count, candidate))
}

fn consensus(points: &[Complex<f64>], count: u32, radius: f64) -> Option<Candidate> {
    let mut best: Option<((usize, f64), Candidate)> = None;
    for (i, &from) in points.iter().enumerate() {
        for &to in &points[i + 1..] {
            for difference in 1..count {
                let g = (to - from) / (root(difference, count) - 1.0);
                let is_drawn = (g.norm() - radius).abs() <= RADIUS_SHARE * radius;
                if !is_drawn {
                    continue;
                }
                let candidate = Candidate { e: from - g, g };
                let scored = score(points, &candidate, count);
                let is_better = best.is_none_or(|((taken, off), _)| {
                    scored.0 > taken || (scored.0 == taken && scored.1 < off)
                });
                if is_better {
                    best = Some((scored, candidate));
                }
            }
        }
    }
    best.filter(|((taken, _), _)| *taken >= FEWEST).map(|(_, candidate)| candidate)
}

/// How many places are taken, and the sum of squares cut off at the tolerance.
fn score(points: &[Complex<f64>], candidate: &Candidate, count: u32) -> (usize, f64) {
    let (mut taken, mut off_sum) = (0_u128, 0.0);
    for &q in points {
        let (label, off) = candidate.nearest(q, count);
        if off < NEAR_PLACE_MM {
            taken |= 1 << label;
        }
        off_sum += off.min(NEAR_PLACE_MM).powi(2);
    }
    (taken.count_ones() as usize, off_sum)
}

/// The detection nearest to each place.
fn one_each(points: &[Complex<f64>], candidate: &Candidate, count: u32) -> Vec<Option<u32>> {
    let mut labels = vec![None; points.len()];
    for place in 0..count {
        let nearest = points
            .iter()
            .enumerate()
            .map(|(index, &q)| (index, candidate.nearest(q, count)))
            .filter(|(_, (label, off))| *label == place && *off < NEAR_PLACE_MM)
            .min_by(|(_, (_, p)), (_, (_, q))| p.total_cmp(q));
        if let Some((index, _)) = nearest {
            labels[index] = Some(place);
        }
    }
    labels
}

fn settle(
    points: &[Complex<f64>],
    mut labels: Vec<Option<u32>>,
    start: Candidate,
    count: u32,
    sd: f64,
) -> Option<(Candidate, Vec<Option<u32>>)> {
    let mut fit = reweighted(points, &labels, start, count, sd)?;
    let off = |fit: &Candidate, q: Complex<f64>, label: u32| {
        (q - fit.e - fit.g * root(label, count)).norm()
    };
    for (label, &q) in labels.iter_mut().zip(points) {
        *label = label.filter(|&label| off(&fit, q, label) <= LOOSE * sd);
    }
    if labels.iter().flatten().count() >= FEWEST {
        fit = reweighted(points, &labels, fit, count, sd)?;
    }
    Some((fit, labels))
}

/// Least squares with Huber's weights on the distance, repeated until nothing moves.
fn reweighted(
    points: &[Complex<f64>],
    labels: &[Option<u32>],
    start: Candidate,
    count: u32,
    sd: f64,
) -> Option<Candidate> {
    let members: Vec<(Complex<f64>, Complex<f64>)> = labels
        .iter()
        .zip(points)
        .filter_map(|(label, &q)| label.map(|label| (q, root(label, count))))
        .collect();
    let mut fit = start;
    for _ in 0..200 {
        let weight = |(q, c): &(Complex<f64>, Complex<f64>)| {
            (HUBER * sd / (q - fit.e - fit.g * c).norm()).min(1.0)
        };
        let next = weighted(&members, &members.iter().map(weight).collect::<Vec<_>>())?;
        let is_still = next.e == fit.e && next.g == fit.g;
        fit = next;
        if is_still {
            break;
        }
    }
    Some(fit)
}

fn weighted(members: &[(Complex<f64>, Complex<f64>)], weights: &[f64]) -> Option<Candidate> {
    let total: f64 = weights.iter().sum();
    let (mut mean_q, mut mean_c) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
    for ((q, c), w) in members.iter().zip(weights) {
        mean_q += q * (w / total);
        mean_c += c * (w / total);
    }
    let (mut cross, mut square) = (Complex::new(0.0, 0.0), 0.0);
    for ((q, c), w) in members.iter().zip(weights) {
        cross += (q - mean_q) * (c - mean_c).conj() * *w;
        square += (c - mean_c).norm_sqr() * w;
    }
    let g = cross / square;
    (g.is_finite() && g.norm() > 0.0).then(|| Candidate { e: mean_q - g * mean_c, g })
}

/// Counts the places from the one nearest to azimuth 0.
fn named(fit: &Candidate, labels: &[Option<u32>], count: u32) -> Ring {
    let pitch = TAU / f64::from(count);
    let first = (fit.g.arg() / pitch).round();
    let shift = first.rem_euclid(f64::from(count)) as u32;
    Ring {
        count,
        centre: Vector2::new(fit.e.re, fit.e.im),
        radius: fit.g.norm(),
        angle: fit.g.arg() - first * pitch,
        labels: labels.iter().map(|label| label.map(|label| (label + shift) % count)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring_of(count: u32, skipped: &[u32]) -> Vec<Vector2<f64>> {
        let ring = Ring {
            count,
            centre: Vector2::new(0.8, -0.3),
            radius: 99.0,
            angle: 0.04,
            labels: Vec::new(),
        };
        (0..count).filter(|k| !skipped.contains(k)).map(|k| ring.place(k)).collect()
    }

    #[test]
    fn missing_loose_and_alien_detections_do_not_matter() {
        let mut points = ring_of(16, &[3, 4]);
        points[5] += Vector2::new(1.2, 0.4);
        points.push(Vector2::new(60.0, 70.0));
        let drawing = Drawing { count: Some(16), radius: 100.0, sd: 0.05 };
        let ring = find(&points, &drawing).unwrap();
        assert!((ring.centre - Vector2::new(0.8, -0.3)).norm() < 1e-9, "{ring:?}");
        assert!((ring.radius - 99.0).abs() < 1e-9 && (ring.angle - 0.04).abs() < 1e-12);
        assert_eq!(ring.labels[..4], [Some(0), Some(1), Some(2), Some(5)]);
        assert_eq!((ring.labels[5], ring.labels[14]), (None, None));
    }

    #[test]
    fn any_number_of_magnets_is_found() {
        for (count, skipped) in [(3, &[][..]), (5, &[]), (12, &[1, 7]), (24, &[0, 3, 4, 9])] {
            let drawing = Drawing { count: None, radius: 100.0, sd: 0.05 };
            let ring = find(&ring_of(count, skipped), &drawing).unwrap();
            assert_eq!(ring.count, count);
            assert!((ring.centre - Vector2::new(0.8, -0.3)).norm() < 1e-9);
        }
    }

    #[test]
    fn too_few_magnets_are_no_ring() {
        let drawing = Drawing { count: Some(16), radius: 100.0, sd: 0.05 };
        assert_eq!(find(&ring_of(16, &[])[..2], &drawing), None);
        assert_eq!(find(&[], &drawing), None);
        let same = vec![Vector2::new(1.0, 1.0); 5];
        assert_eq!(find(&same, &drawing), None);
    }
}
