//! All unknowns at once: what the sightings say together, and how well.
//!
//! Unknown are the rail `(a, b)`, the ring `(ex, ey, rho, psi)` and by how much each magnet misses
//! its place. Observed are `s` and `theta` of each sighting. With a magnet at `q` on the bed and
//! `u = ±√(|q|² − b²)`, `s = u − a`, `theta = atan2(u·qy − b·qx, u·qx + b·qy)`:
//!
//! ```text
//! ds/da = −1     ds/db = −b/u        ds/dq = q/u
//!                dtheta/db = −1/u    dtheta/dq = (−qy, qx)/r² + b·q/(u·r²)
//! ```
//!
//! Residuals are divided by their standard deviations, `theta` taken as an arc at the magnet, and a
//! sighting's two residuals together get Huber's weight. The misses of single magnets are
//! eliminated before anything is solved (the Schur complement of a block-diagonal matrix), so what
//! remains is a system of six. Method: Levenberg (1944) and Marquardt (1963).

use nalgebra::{Matrix2, Matrix6, SMatrix, SymmetricEigen, Vector2, Vector6};

use super::pairing::HUBER;
use super::{Sighting, wrap};

/// Where a magnet is believed to stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// On the ring, at an azimuth from its index magnet, radians.
    Ring {
        /// Radians.
        azimuth: f64,
    },
    /// Fixed to the ring at a known radius.
    Fixed {
        /// mm.
        radius: f64,
        /// Radians from the index magnet.
        azimuth: f64,
    },
    /// Anywhere; at first here, mm on the bed from the axis.
    Free {
        /// mm.
        at: Vector2<f64>,
    },
}

/// A magnet and the sightings of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Magnet {
    /// Where it is believed to stand.
    pub place: Place,
    /// What was seen of it.
    pub sightings: Vec<Sighting>,
}

/// Standard deviations of what is observed, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Along the rail.
    pub rail: f64,
    /// Across it.
    pub cross: f64,
    /// Of a magnet about its place, each way; `None` for magnets that are where they belong.
    pub placement: Option<f64>,
}

/// The six unknowns, in this order: a, b, ex, ey, rho in mm, psi in radians.
pub type Unknowns = Vector6<f64>;

/// Index of the radius among the unknowns.
pub const RHO: usize = 4;

/// Index of the angle among the unknowns.
pub const PSI: usize = 5;

/// What is known beforehand of one of the unknowns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Which.
    pub index: usize,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}

/// The problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The magnets.
    pub magnets: Vec<Magnet>,
    /// How well they are seen.
    pub noise: Noise,
    /// What is known beforehand.
    pub priors: Vec<Prior>,
    /// Which unknowns may change.
    pub is_free: [bool; 6],
}

/// What solves it.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The unknowns.
    pub unknowns: Unknowns,
    /// Their standard errors, 0 for those that may not change, infinite for what the data do not
    /// say at all.
    pub errors: Unknowns,
    /// Huber's function of the residuals, summed up.
    pub cost: f64,
}

/// Smallest share of the largest eigenvalue, of a matrix with ones on its diagonal, that is not
/// rounding: sums of a few hundred terms are exact to some 1e-14.
const ROUNDING: f64 = 1e-12;

/// A step this much smaller than a standard error says nothing more.
const STILL: f64 = 1e-9;

/// Row of an observation: derivatives by the unknowns and by the place of the magnet.
#[derive(Debug, Clone, Copy)]
struct Row {
    residual: f64,
    by_unknowns: Vector6<f64>,
    by_place: Vector2<f64>,
}

/// Normal equations with the magnets eliminated, and what is needed to go back.
#[derive(Debug, Clone)]
struct Normal {
    matrix: Matrix6<f64>,
    right: Vector6<f64>,
    magnets: Vec<(Matrix2<f64>, SMatrix<f64, 6, 2>, Vector2<f64>)>,
    cost: f64,
}

/// Returns how `s` and `theta` of a sighting change with the unknowns, for a magnet of the ring at
/// an azimuth, seen from the near (+1) or far (−1) side; `None` where it cannot be seen.
#[must_use]
pub fn derivatives(unknowns: &Unknowns, azimuth: f64, side: f64) -> Option<[Vector6<f64>; 2]> {
    let place = Place::Ring { azimuth };
    let sighting = Sighting::new(side, 0.0);
    let q = place.over_bed(unknowns);
    let rows = rows(unknowns, &place, &q, &sighting)?;
    Some(rows.map(|row| row.by_unknowns))
}

impl Place {
    fn over_bed(&self, x: &Unknowns) -> Vector2<f64> {
        let centre = Vector2::new(x[2], x[3]);
        let on_circle = |radius: f64, azimuth: f64| {
            let angle = x[PSI] + azimuth;
            centre + radius * Vector2::new(angle.cos(), angle.sin())
        };
        match *self {
            Self::Ring { azimuth } => on_circle(x[RHO], azimuth),
            Self::Fixed { radius, azimuth } => on_circle(radius, azimuth),
            Self::Free { at } => at,
        }
    }

    /// How the place changes with the unknowns: one row for x, one for y.
    fn by_unknowns(&self, x: &Unknowns) -> SMatrix<f64, 2, 6> {
        let mut by = SMatrix::<f64, 2, 6>::zeros();
        let (radius, azimuth) = match *self {
            Self::Ring { azimuth } => (x[RHO], azimuth),
            Self::Fixed { radius, azimuth } => (radius, azimuth),
            Self::Free { .. } => return by,
        };
        let (sin, cos) = (x[PSI] + azimuth).sin_cos();
        (by[(0, 2)], by[(1, 3)]) = (1.0, 1.0);
        (by[(0, PSI)], by[(1, PSI)]) = (-radius * sin, radius * cos);
        if matches!(self, Self::Ring { .. }) {
            (by[(0, RHO)], by[(1, RHO)]) = (cos, sin);
        }
        by
    }

    /// Radius at which an angle is taken as an arc, mm: that of the ring for all of its magnets, so
    /// that one that sits loose counts no differently.
    fn arm(&self, q: &Vector2<f64>, ring: f64) -> f64 {
        if matches!(self, Self::Ring { .. }) { ring } else { q.norm() }
    }

    /// Whether the magnet may be elsewhere, and with what belief in its place, 1/mm².
    fn slack(&self, noise: &Noise) -> Option<f64> {
        match self {
            Self::Free { .. } => Some(0.0),
            _ => noise.placement.map(|sd| sd.powi(-2)),
        }
    }
}

/// Rows of `s` (mm) and `theta` (radians) of a magnet at `q`; `None` inside of the disc that the
/// rail misses.
fn rows(x: &Unknowns, place: &Place, q: &Vector2<f64>, seen: &Sighting) -> Option<[Row; 2]> {
    let (a, b) = (x[0], x[1]);
    let square = q.norm_squared() - b * b;
    if square <= 0.0 {
        return None;
    }
    let u = square.sqrt().copysign(seen.s);
    let theta = (u * q.y - b * q.x).atan2(u * q.x + b * q.y);
    let s_by_place = q / u;
    let theta_by_place = (Vector2::new(-q.y, q.x) + q * (b / u)) / q.norm_squared();
    let place_by = place.by_unknowns(x);
    let mut s_by = place_by.transpose() * s_by_place;
    let mut theta_by = place_by.transpose() * theta_by_place;
    s_by[0] -= 1.0;
    s_by[1] -= b / u;
    theta_by[1] -= 1.0 / u;
    let s_off = seen.s - (u - a);
    let theta_off = wrap(seen.theta - theta);
    Some([
        Row { residual: s_off, by_unknowns: s_by, by_place: s_by_place },
        Row { residual: theta_off, by_unknowns: theta_by, by_place: theta_by_place },
    ])
}

impl Problem {
    /// Returns the best unknowns near `start`.
    #[must_use]
    pub fn solve(&self, start: &Unknowns) -> Solution {
        let mut x = *start;
        let mut misses = vec![Vector2::zeros(); self.magnets.len()];
        let mut normal = self.normal(&x, &misses, x[RHO]);
        // Small at first: the start is a closed-form solution.
        let mut damping = 1e-6;
        for _ in 0..100 {
            let Some(step) = self.step(&normal, damping) else { break };
            let next_misses: Vec<Vector2<f64>> = normal
                .magnets
                .iter()
                .zip(&misses)
                .map(|((inverse, cross, right), miss)| {
                    miss + inverse * (right - cross.transpose() * step)
                })
                .collect();
            // A step is judged with the arc at the radius it began with: otherwise a smaller ring
            // would do for smaller angles.
            let next = self.normal(&(x + step), &next_misses, x[RHO]);
            if next.cost <= normal.cost {
                let errors = errors(&normal.matrix, &self.is_free);
                let is_still = (0..6).all(|k| step[k].abs() <= STILL * errors[k]);
                (x, misses) = (x + step, next_misses);
                normal = self.normal(&x, &misses, x[RHO]);
                damping *= 0.1;
                if is_still {
                    break;
                }
            } else {
                damping *= 100.0;
            }
            if damping > 1e9 {
                break;
            }
        }
        Solution { unknowns: x, errors: errors(&normal.matrix, &self.is_free), cost: normal.cost }
    }

    /// Returns the standard errors that the unknowns would have at `x`.
    #[must_use]
    pub fn errors(&self, x: &Unknowns) -> Unknowns {
        let normal = self.normal(x, &vec![Vector2::zeros(); self.magnets.len()], x[RHO]);
        errors(&normal.matrix, &self.is_free)
    }

    /// Returns the rank of the problem at `x` and its condition, columns normalised; infinite where
    /// the rank is less than the number of unknowns.
    #[must_use]
    pub fn rank_and_condition(&self, x: &Unknowns) -> (usize, f64) {
        let normal = self.normal(x, &vec![Vector2::zeros(); self.magnets.len()], x[RHO]);
        let eigenvalues = scaled(&normal.matrix, &self.is_free).0.eigenvalues;
        let mut values: Vec<f64> =
            (0..6).filter(|&k| self.is_free[k]).map(|_| 0.0).collect::<Vec<_>>();
        let mut sorted: Vec<f64> = eigenvalues.iter().copied().collect();
        sorted.sort_by(|p, q| q.total_cmp(p));
        let n_values = values.len();
        values.copy_from_slice(&sorted[..n_values]);
        let most = values.first().copied().unwrap_or(0.0);
        let rank = values.iter().filter(|&&value| value > ROUNDING * most).count();
        let condition = match values.last() {
            Some(least) if rank == n_values => (most / least).sqrt(),
            _ => f64::INFINITY,
        };
        (rank, condition)
    }

    fn step(&self, normal: &Normal, damping: f64) -> Option<Vector6<f64>> {
        let mut matrix = normal.matrix;
        let mut right = normal.right;
        for k in 0..6 {
            if self.is_free[k] {
                matrix[(k, k)] *= 1.0 + damping;
            } else {
                matrix.row_mut(k).fill(0.0);
                matrix.column_mut(k).fill(0.0);
                (matrix[(k, k)], right[k]) = (1.0, 0.0);
            }
        }
        Some(matrix.cholesky()?.solve(&right)).filter(|step| step.iter().all(|v| v.is_finite()))
    }

    fn normal(&self, x: &Unknowns, misses: &[Vector2<f64>], arm: f64) -> Normal {
        let mut normal = Normal {
            matrix: Matrix6::zeros(),
            right: Vector6::zeros(),
            magnets: Vec::with_capacity(self.magnets.len()),
            cost: 0.0,
        };
        for prior in &self.priors {
            let weight = prior.sd.powi(-2);
            let off = prior.value - x[prior.index];
            let off = if prior.index == PSI { wrap(off) } else { off };
            normal.matrix[(prior.index, prior.index)] += weight;
            normal.right[prior.index] += weight * off;
            normal.cost += weight * off * off / 2.0;
        }
        for (magnet, miss) in self.magnets.iter().zip(misses) {
            self.add(&mut normal, x, magnet, miss, arm);
        }
        normal
    }

    fn add(
        &self,
        normal: &mut Normal,
        x: &Unknowns,
        magnet: &Magnet,
        miss: &Vector2<f64>,
        arm: f64,
    ) {
        let slack = magnet.place.slack(&self.noise);
        let q = magnet.place.over_bed(x) + miss;
        let mut own = Matrix2::zeros();
        let mut cross = SMatrix::<f64, 6, 2>::zeros();
        let mut right = Vector2::zeros();
        for seen in &magnet.sightings {
            let Some([s, theta]) = rows(x, &magnet.place, &q, seen) else {
                // A magnet that cannot be seen is as wrong as can be.
                normal.cost = f64::INFINITY;
                continue;
            };
            let sds = [self.noise.rail, self.noise.cross / magnet.place.arm(&q, arm)];
            let norm = (s.residual / sds[0]).hypot(theta.residual / sds[1]);
            let huber = (HUBER / norm).min(1.0);
            normal.cost +=
                if norm <= HUBER { norm * norm / 2.0 } else { HUBER * (norm - HUBER / 2.0) };
            for (row, sd) in [s, theta].iter().zip(sds) {
                let weight = huber / (sd * sd);
                normal.matrix += row.by_unknowns * row.by_unknowns.transpose() * weight;
                normal.right += row.by_unknowns * (row.residual * weight);
                own += row.by_place * row.by_place.transpose() * weight;
                cross += row.by_unknowns * row.by_place.transpose() * weight;
                right += row.by_place * (row.residual * weight);
            }
        }
        let Some(belief) = slack else {
            normal.magnets.push((Matrix2::zeros(), cross, right));
            return;
        };
        own += Matrix2::identity() * belief;
        right -= miss * belief;
        normal.cost += belief * miss.norm_squared() / 2.0;
        // Each sighting fixes a place in both directions, so its matrix has an inverse.
        let inverse = own.try_inverse().unwrap_or_else(Matrix2::zeros);
        normal.matrix -= cross * inverse * cross.transpose();
        normal.right -= cross * inverse * right;
        normal.magnets.push((inverse, cross, right));
    }
}

/// Eigenvalues of the matrix with ones on its diagonal, and the diagonal's roots; rows and columns
/// of what may not change are left empty.
fn scaled(
    matrix: &Matrix6<f64>,
    is_free: &[bool; 6],
) -> (SymmetricEigen<f64, nalgebra::Const<6>>, Vector6<f64>) {
    let scale = Vector6::from_fn(|k, _| {
        let diagonal = matrix[(k, k)];
        if is_free[k] && diagonal > 0.0 { diagonal.sqrt() } else { 0.0 }
    });
    let divide = |value: f64, by: f64| if by > 0.0 { value / by } else { 0.0 };
    let unit = Matrix6::from_fn(|i, j| divide(matrix[(i, j)], scale[i] * scale[j]));
    (SymmetricEigen::new(unit), scale)
}

fn errors(matrix: &Matrix6<f64>, is_free: &[bool; 6]) -> Unknowns {
    let (eigen, scale) = scaled(matrix, is_free);
    let most = eigen.eigenvalues.max();
    Vector6::from_fn(|k, _| {
        if !is_free[k] {
            return 0.0;
        }
        if scale[k] == 0.0 {
            return f64::INFINITY;
        }
        let variance: f64 = (0..6)
            .filter(|&m| eigen.eigenvectors[(k, m)].abs() > ROUNDING.sqrt())
            .map(|m| {
                let value = eigen.eigenvalues[m];
                let share = eigen.eigenvectors[(k, m)].powi(2);
                if value > ROUNDING * most { share / value } else { f64::INFINITY }
            })
            .sum();
        variance.sqrt() / scale[k]
    })
}
