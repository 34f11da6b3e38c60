//! A move straight in joint space, as it runs over the bed: a piece of a spiral.

use machine::kinematics::Alignment;
use machine::program::Joints;
use nalgebra::{Point2, UnitComplex, Vector2};

/// A move from where the joints stand, seen from the rail as it then points over the bed.
pub(super) struct Sweep {
    /// From the rail's frame at the begin to the bed's.
    facing: UnitComplex<f64>,
    /// The nozzle in the frame of the rail at the begin, and how far it runs in it.
    nozzle: Vector2<f64>,
    run: Vector2<f64>,
    /// How far the rail turns over the bed, radians, counter-clockwise.
    turn: f64,
}

impl Sweep {
    /// The move to `to` from `from`, where the rail points over the bed as `facing` says.
    pub(super) fn new(
        alignment: &Alignment,
        facing: UnitComplex<f64>,
        from: &Joints,
        to: &Joints,
    ) -> Self {
        let nozzle = alignment.nozzle(from);
        Self {
            facing,
            nozzle,
            run: alignment.nozzle(to) - nozzle,
            turn: alignment.bed.azimuth(to.turn) - alignment.bed.azimuth(from.turn),
        }
    }

    /// Where the nozzle is over the bed when a share of the move is done, and which way it goes there:
    /// the derivative by the share.
    pub(super) fn at(&self, share: f64) -> (Point2<f64>, Vector2<f64>) {
        let by = self.facing * UnitComplex::new(self.turn * share);
        let nozzle = self.nozzle + self.run * share;
        let heading = self.run + Vector2::new(-nozzle.y, nozzle.x) * self.turn;
        (Point2::from(by * nozzle), by * heading)
    }

    /// Whether the middle and both quarters lie within `tolerance` of the line through `point` along
    /// `unit`. The middle is mostly the farthest.
    pub(super) fn is_near(&self, point: &Point2<f64>, unit: &Vector2<f64>, tolerance: f64) -> bool {
        let (point, unit) = (self.facing.inverse() * point, self.facing.inverse() * unit);
        let is_near = |by: &UnitComplex<f64>, share: f64| {
            let nozzle = by * (self.nozzle + self.run * share);
            unit.perp(&(nozzle - point.coords)).abs() <= tolerance
        };
        let quarter = UnitComplex::new(self.turn / 4.0);
        let half = quarter * quarter;
        is_near(&half, 0.5) && is_near(&quarter, 0.25) && is_near(&(half * quarter), 0.75)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use machine::gcode::dialect::POLAR;
    use machine::kinematics::BedScale;
    use machine::program::BedTurn;

    #[test]
    fn places_are_those_of_the_joints_between_and_headings_their_derivative() {
        let bed = BedScale { zero: 0.7, is_reversed: true, backlash: 0.0 };
        let leaning = Alignment { a: 0.2, b: 0.35, b1: -0.002, bed, ..Alignment::IDEAL };
        let from = Joints { s: 31.0, turn: BedTurn::accumulated(40.3), z: 2.0 };
        let to = Joints { s: 27.5, turn: BedTurn::accumulated(40.9), z: 2.4 };
        let facing = UnitComplex::new(leaning.bed.azimuth(from.turn));
        let sweep = Sweep::new(&leaning, facing, &from, &to);
        let place = |share: f64| leaning.over_bed_from_joints(&POLAR.between(&from, &to, share));
        for share in [0.0, 0.25, 0.4, 0.75, 1.0] {
            let (at, heading) = sweep.at(share);
            assert!((at.coords - place(share)).norm() < 1e-12);
            let step = 1e-5;
            let slope = (place(share + step) - place(share - step)) / (2.0 * step);
            assert!((heading - slope).norm() < 1e-6, "{heading} {slope}");
        }
    }

    #[test]
    fn a_move_is_near_its_own_line_up_to_its_sagitta() {
        let from = Joints { s: 40.0, turn: BedTurn::accumulated(0.0), z: 0.0 };
        let to = Joints { turn: BedTurn::accumulated(0.2), ..from };
        let sweep = Sweep::new(&Alignment::IDEAL, UnitComplex::identity(), &from, &to);
        let ends = [sweep.at(0.0).0, sweep.at(1.0).0];
        let unit = (ends[1] - ends[0]).normalize();
        let sagitta = 40.0 * (1.0 - 0.1_f64.cos());
        assert!(sweep.is_near(&ends[0], &unit, sagitta + 1e-9));
        assert!(!sweep.is_near(&ends[0], &unit, sagitta - 1e-9));
    }
}
