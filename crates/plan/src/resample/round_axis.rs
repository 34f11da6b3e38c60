//! Ways that would come too near to the axis, bent round it ([`axis`](crate::axis)), and their heights.

use machine::gcode::dialect::Space;
use machine::kinematics::Unreachable;
use nalgebra::{Point2, UnitComplex};

use super::{Leg, Resampler, Target, turned};
use crate::axis::{Piece, crossings_of_rim, distance_to_axis, keep_clear, outside};
use crate::route::{Kind, Stroke};

/// Turn of the bed in one move round the axis, radians: 30°. Small enough that chord and arc, by
/// which readers of a program measure speed, differ by only 1 %, and that the bed can be sped up
/// and braked in steps; large enough that few moves are tiny.
const ARC_STEP: f64 = std::f64::consts::FRAC_PI_6;

/// The same where the firmware runs straight between the ends of a move, so that its chord must
/// keep clear too: the ends lie 0.5 % farther out.
const ARC_CHORD: f64 = std::f64::consts::PI / 16.0;

/// How far an arc may bow from the straight line between the ends of a move, mm: where the clearance is wide,
/// moves are shorter.
const ARC_BOW_MM: f64 = 0.04;

/// How far rounding may bring two words from their place near the axis, mm: half a last place each, and
/// both ends of a move.
const NEAR_AXIS_ROUNDING_MM: f64 = 2e-5;

impl Resampler {
    /// A travel to where lines begin too near to the axis ends at the height at which they leave the
    /// clearance.
    pub(super) fn beside_axis(&self, strokes: &[Stroke], index: usize, target: Target) -> Target {
        let clearance = self.clear_radius(target.z);
        if strokes[index].kind != Kind::Travel || target.over_bed.coords.norm() >= clearance {
            return target;
        }
        let after = strokes[index + 1..].iter().filter(|stroke| stroke.kind != Kind::Filament);
        let mut from = target;
        for stroke in after.take_while(|stroke| stroke.kind == Kind::Print) {
            let at = turned(&self.azimuth, &stroke.to);
            let to = Point2::from(self.alignment.over_bed(&at.xy()));
            if let [_, Some(share)] = crossings_of_rim([&from.over_bed, &to], clearance) {
                return Target { z: from.z + (stroke.to.z - from.z) * share, ..target };
            }
            from = Target { over_bed: to, z: stroke.to.z };
        }
        target
    }

    /// Follows a stroke on the present side of the rail, round the axis where need be.
    pub(super) fn clear_of_axis(
        &mut self,
        kind: Kind,
        target: &Target,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        let tolerance =
            if kind == Kind::Print { self.params.chord } else { self.params.travel_chord };
        let clearance = self.clear_radius(self.joints.z).max(self.clear_radius(target.z));
        // Most lines are nowhere near.
        if distance_to_axis(&self.over_bed, &target.over_bed) >= clearance
            && self.meant.over_bed == self.over_bed
        {
            return self.line(kind, target, tolerance, legs);
        }
        let from = Target {
            over_bed: outside(self.over_bed, target.over_bed, clearance),
            z: self.joints.z,
        };
        let line = [&self.meant.over_bed, &target.over_bed];
        let way = keep_clear(&from.over_bed, line, clearance);
        let heights = match kind {
            Kind::Print => self.heights_on_layer(&way, target, clearance),
            _ => heights_by_length(&way, &from, target.z, clearance),
        };
        for (piece, z) in way.iter().zip(heights) {
            match piece {
                Piece::Line(to) => {
                    self.line(kind, &Target { over_bed: *to, z }, tolerance, legs)?;
                }
                Piece::Arc(sweep, to) => {
                    self.arc(kind, *sweep, &Target { over_bed: *to, z }, legs)?;
                }
            }
        }
        Ok(())
    }

    /// The heights at the ends of the pieces of a way that lays material. Outside of the clearance they are
    /// those of the line, so that it stays on its layer, and on the rim those where the line crosses it: a
    /// layer that slopes has another height on the axis, where nothing gets to.
    fn heights_on_layer(&self, way: &[Piece], target: &Target, clearance: f64) -> Vec<f64> {
        let crossings = crossings_of_rim([&self.meant.over_bed, &target.over_bed], clearance);
        let height = |share: f64| self.meant.z + (target.z - self.meant.z) * share;
        let [entry, exit] = match crossings.map(|share| share.map(height)) {
            [Some(entry), Some(exit)] => [entry, exit],
            [Some(rim), None] | [None, Some(rim)] => [rim; 2],
            [None, None] => [self.joints.z; 2],
        };
        let ends_outside = crossings[1].is_some();
        let last = way.len() - 1;
        let at_end = |(k, piece): (usize, &Piece)| match piece {
            Piece::Line(_) if k == last && ends_outside => target.z,
            Piece::Line(_) => entry,
            Piece::Arc(..) => exit,
        };
        way.iter().enumerate().map(at_end).collect()
    }

    /// How far from the axis places of the bed must be at a height, so that the nozzle and the carriage
    /// both keep the printer's clearance.
    pub(super) fn clear_radius(&self, z: f64) -> f64 {
        let clear = self.alignment.clear_radius_at(self.clearance, z);
        match self.params.dialect.space {
            Space::IdealPlane => (clear + NEAR_AXIS_ROUNDING_MM) / (ARC_CHORD / 2.0).cos(),
            Space::Joints | Space::Part => clear,
        }
    }

    /// A piece of a circle about the axis.
    fn arc(
        &mut self,
        kind: Kind,
        sweep: f64,
        target: &Target,
        legs: &mut Vec<Leg>,
    ) -> Result<(), Unreachable> {
        let start = self.over_bed.coords;
        let rise = target.z - self.joints.z;
        let base = self.joints.z;
        let step = match self.params.dialect.space {
            Space::IdealPlane => ARC_CHORD,
            Space::Joints | Space::Part => ARC_STEP,
        };
        let step = step.min(2.0 * (1.0 - ARC_BOW_MM / start.norm()).max(-1.0).acos());
        let pieces = (sweep.abs() / step).ceil().max(1.0) as u32;
        for k in 1..=pieces {
            let share = f64::from(k) / f64::from(pieces);
            let over_bed = if k == pieces {
                target.over_bed
            } else {
                Point2::from(UnitComplex::new(sweep * share) * start)
            };
            let step = Target { over_bed, z: base + rise * share };
            let to = self.joints_at(&step)?;
            self.push(kind, to, &step, legs)?;
        }
        Ok(())
    }
}

/// The heights at the ends of the pieces of a way that changes its height evenly, exactly `z` at its end.
fn heights_by_length(way: &[Piece], from: &Target, z: f64, clearance: f64) -> Vec<f64> {
    let mut at = from.over_bed;
    let lengths: Vec<f64> = way
        .iter()
        .map(|piece| {
            let length = match piece {
                Piece::Line(to) => (to - at).norm(),
                Piece::Arc(sweep, _) => sweep.abs() * clearance,
            };
            at = piece.end();
            length
        })
        .collect();
    let whole: f64 = lengths.iter().sum();
    // What is left of the way decides, so that the end is exactly at the target.
    let left = |k: usize| lengths[k + 1..].iter().sum::<f64>();
    (0..way.len())
        .map(|k| match left(k) {
            left if left > 0.0 => z - (z - from.z) * left / whole,
            _ => z,
        })
        .collect()
}
