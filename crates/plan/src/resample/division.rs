//! Where a straight line is cut into moves.
//!
//! A move is straight in joint space, over the part a piece of a spiral. Along a line that passes the
//! axis at a signed distance `c`, the nozzle at `(u, v)` in the frame of the rail, `y` from the foot of
//! the perpendicular and `r² = c² + y²`, the rates per mm are
//!
//! ```text
//! t_x = (u·y − v·c)/r²,  t_y = (v·y + u·c)/r²,  θ' = t_y/u,  u' = t_x + v·t_y/u
//! ```
//!
//! and a short move of length `l` leaves the line by `l²/8·K`, `K = |θ'²·c + 2·θ'·u'·t_x|`. So
//! `√(K/8ε)` moves belong on each mm, and as many as the integral of that, rounded up, keep within ε
//! when each has an equal share of it; no fewer do. What else bounds a move counts likewise: the turn
//! of the bed, how unevenly it turns, how much the misalignment bends a straight line of the firmware.
//! The integral runs over `τ`, `y = w·sinh τ`, in which it is smooth however near the axis is.
//!
//! All pieces are then looked at as they will be written; should one be too far off, one more is made,
//! and in the end pieces are halved until they are near enough, which always is possible.
//!
//! Source: own derivation; for `v = 0` it is `N = √(c/8ε)·[G(y₁/c) − G(y₀/c)]`,
//! `G(t) = √2·asinh(√2·t) − atanh(t/√(1 + 2t²))`.

use machine::gcode::dialect::Space;
use machine::kinematics::Unreachable;
use machine::program::Joints;
use nalgebra::{Point2, Vector2};

use super::{LARGEST_TURN, LARGEST_UNEVENNESS, Leg, Resampler, SMALL_TURN, Target};
use crate::route::Kind;

/// Share of the tolerance for which moves are counted: the formula is that of short moves, and long
/// ones may be 5 % farther off.
const COUNTED_SHARE: f64 = 0.95;

/// Share by which the number of moves may grow beyond the count before pieces are halved instead.
const MOST_GROWTH: f64 = 0.2;

/// Step of the integral in `τ`: the density changes over about 1.
const STEP: f64 = 0.4;

/// Lines that pass the axis nearer than this are taken to pass it at this distance, mm, as far as the
/// step of the integral goes; nothing is planned nearer.
const LEAST_WIDTH_MM: f64 = 1e-3;

/// Halvings after which a piece is taken as it is; 2⁻⁴⁰ of any stroke is far below a step.
const MOST_HALVINGS: u32 = 40;

/// Moves of one line at most; beyond that the count is not to be believed.
const MOST_PIECES: f64 = 1e5;

/// How much a miss of the rail bends a straight line, against an error along it: the greatest second
/// derivative of the warp of a line, times the square of its distance, is 0.859 of the miss.
const WARP: f64 = 0.859;

/// How the moves of a line are spread over it.
struct Spread {
    /// Foot of the perpendicular from the axis, over the bed.
    foot: Point2<f64>,
    along: Vector2<f64>,
    /// `y = width·sinh τ`.
    width: f64,
    /// `τ` at the begin of the line, and the step of the table.
    begin: f64,
    step: f64,
    /// The number of moves up to each step.
    moves: Vec<f64>,
}

impl Spread {
    /// Returns where share `done` of the moves ends.
    fn at(&self, done: f64) -> Point2<f64> {
        let wanted = done * self.moves.last().copied().unwrap_or(0.0);
        let after = self.moves.partition_point(|&moves| moves < wanted).max(1);
        let (low, high) = (self.moves[after - 1], self.moves[after]);
        let between = if high > low { (wanted - low) / (high - low) } else { 0.0 };
        let tau = self.begin + self.step * ((after - 1) as f64 + between);
        self.foot + self.along * (self.width * tau.sinh())
    }
}

impl Resampler {
    /// A straight piece, cut into as few moves as stay near enough to it.
    pub(super) fn line(
        &mut self,
        kind: Kind,
        target: &Target,
        tolerance: f64,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        let to = self.joints_at(target)?;
        if self.may_be_one_move(kind, &to, target, tolerance) {
            return self.push(kind, to, target, legs);
        }
        if self.follows_bed_anyhow(target) {
            let spread = self.spread(target, tolerance);
            let least = spread.moves.last().map_or(f64::INFINITY, |moves| moves.ceil()).max(2.0);
            let most = least + (least * MOST_GROWTH).ceil();
            let mut count = least;
            while count <= most && count <= MOST_PIECES {
                if self.in_pieces(kind, target, tolerance, (&spread, count as u32), legs)? {
                    return Ok(());
                }
                count += (count * MOST_GROWTH / 4.0).ceil();
            }
        }
        self.halves(kind, (target, to), tolerance, 0, legs)
    }

    fn may_be_one_move(&self, kind: Kind, to: &Joints, target: &Target, tolerance: f64) -> bool {
        !self.is_surely_too_far(to, target, tolerance)
            && self.is_near_enough(to, target, tolerance)
            && (kind != Kind::Print || self.follows_bed(target))
    }

    /// Makes moves of equal shares; takes them back, and returns false, where one is not near enough.
    fn in_pieces(
        &mut self,
        kind: Kind,
        target: &Target,
        tolerance: f64,
        (spread, count): (&Spread, u32),
        legs: &mut Vec<Leg>,
    ) -> Result<bool, Unreachable> {
        let before = (self.joints, self.facing, self.over_bed, self.at_part);
        let legs_before = legs.len();
        let (from, from_z) = (self.over_bed, self.joints.z);
        let length = (target.over_bed - from).norm();
        for k in 1..=count {
            let end = if k == count {
                *target
            } else {
                let over_bed = spread.at(f64::from(k) / f64::from(count));
                let share = (over_bed - from).norm() / length;
                Target { over_bed, z: from_z + (target.z - from_z) * share }
            };
            let to = self.joints_at(&end)?;
            if !self.is_near_enough(&to, &end, tolerance) {
                legs.truncate(legs_before);
                (self.joints, self.facing, self.over_bed, self.at_part) = before;
                return Ok(false);
            }
            self.push(kind, to, &end, legs)?;
        }
        Ok(true)
    }

    fn spread(&self, target: &Target, tolerance: f64) -> Spread {
        let from = self.over_bed;
        let along = (target.over_bed - from).normalize();
        let (begin, end) = (along.dot(&from.coords), along.dot(&target.over_bed.coords));
        let foot = from - along * begin;
        let c = from.coords.perp(&along);
        let width = c.abs().max(LEAST_WIDTH_MM);
        let (low, high) = ((begin / width).asinh(), (end / width).asinh());
        let steps = ((high - low) / STEP).ceil().clamp(2.0, MOST_PIECES);
        let step = (high - low) / steps;
        // Sums of the density over τ: midpoints, which never meet the axis itself.
        let mut moves = vec![0.0];
        let mut sum = 0.0;
        for k in 0..steps as u32 {
            let tau = low + step * (f64::from(k) + 0.5);
            let y = width * tau.sinh();
            sum += self.density(y, c, target.z, tolerance) * width * tau.cosh() * step;
            moves.push(sum);
        }
        Spread { foot, along, width, begin: low, step, moves }
    }

    /// Moves on each mm, `y` from the foot of the perpendicular.
    fn density(&self, y: f64, c: f64, z: f64, tolerance: f64) -> f64 {
        let v = self.alignment.miss(z);
        let square = c * c + y * y;
        let u = (square - v * v).max(LEAST_WIDTH_MM * LEAST_WIDTH_MM).sqrt() * self.branch.sign();
        let along = (u * y - v * c) / square;
        let across = (v * y + u * c) / square;
        let (turn, run) = (across / u, along + v * across / u);
        let bend = (turn * turn * c + 2.0 * turn * run * along).abs();
        let eight = 8.0 * tolerance * COUNTED_SHARE;
        let mut density = (bend / eight).sqrt().max(turn.abs() / LARGEST_TURN);
        if self.params.dialect.space == Space::IdealPlane {
            let uneven = 2.0 * y.abs() / square / (8.0 * LARGEST_UNEVENNESS);
            let warp = WARP * v.abs() + (self.alignment.a + self.alignment.a1 * z).abs();
            density = density
                .max(uneven.min(turn.abs() / SMALL_TURN))
                .max((warp / eight / square).sqrt());
        }
        density
    }

    /// A straight piece, halved until its moves are near enough to it.
    fn halves(
        &mut self,
        kind: Kind,
        (target, to): (&Target, Joints),
        tolerance: f64,
        halvings: u32,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        if halvings < MOST_HALVINGS && !self.may_be_one_move(kind, &to, target, tolerance) {
            let middle = Target {
                over_bed: nalgebra::center(&self.over_bed, &target.over_bed),
                z: f64::midpoint(self.joints.z, target.z),
            };
            let halfway = self.joints_at(&middle)?;
            self.halves(kind, (&middle, halfway), tolerance, halvings + 1, legs)?;
            return self.halves(kind, (target, to), tolerance, halvings + 1, legs);
        }
        self.push(kind, to, target, legs)
    }
}
