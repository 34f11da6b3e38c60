//! Strokes through the axis, to the other side of the rail: one move, for which the bed does not turn.

use machine::kinematics::Branch;

use super::{Resampler, Target, turned};
use crate::route::{Kind, Stroke};

impl Resampler {
    /// Whether a stroke runs through the axis, and the rail reaches what follows from the other
    /// side.
    pub(super) fn passes_through(&self, strokes: &[Stroke], index: usize, target: &Target) -> bool {
        if self.far_reach <= 0.0 {
            return false;
        }
        let (a, b) = (self.over_bed.coords, target.over_bed.coords);
        let Some(unit) = (b - a).try_normalize(0.0) else { return false };
        // The carriage runs along a line that passes the axis as the rail does.
        let miss = self.alignment.miss(target.z);
        let wanted = if self.branch == Branch::Near { -miss } else { miss };
        // A pass needs room on both sides, or it is an end on the axis.
        let room = 2.0 * self.params.chord;
        (unit.perp(&a) - wanted).abs() <= self.params.chord
            && -unit.dot(&a) > room
            && unit.dot(&b) > room
            && self.runs_straight_to(target, self.branch.opposite())
            && self.reaches_run(strokes, index, self.branch.opposite())
    }

    /// Whether one move to the other side of the axis stays near its line: with one end close to
    /// the axis a small miss is a large angle there, which the bed turns through all along the move.
    pub(super) fn runs_straight_to(&self, target: &Target, branch: Branch) -> bool {
        self.joints_on(target, branch)
            .is_ok_and(|to| self.is_near_enough(&to, target, self.params.chord))
    }

    /// Whether the rail reaches the end of stroke `index`, and of all that follows up to the next
    /// travel across the bed, from one side.
    pub(super) fn reaches_run(&self, strokes: &[Stroke], index: usize, branch: Branch) -> bool {
        if branch == Branch::Near {
            return true;
        }
        let mut from = strokes[index].to.xy();
        let run = strokes[index + 1..].iter().take_while(|stroke| {
            let crosses = stroke.kind == Kind::Travel && stroke.to.xy() != from;
            from = stroke.to.xy();
            !crosses
        });
        std::iter::once(&strokes[index]).chain(run).all(|stroke| {
            let at = turned(&self.azimuth, &stroke.to);
            self.alignment.over_bed(&at.xy()).norm() <= self.far_reach
        })
    }
}
