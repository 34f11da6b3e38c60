//! Does one line follow from the line before?
//!
//! * No segment turns the bed by more than half a turn: a longer one is a wrapped angle that was
//!   not unwrapped.
//! * No extruding segment leaves its chord by more than [`JUMP`] farther than [`NEAR_AXIS`] from
//!   the axis, unless it turns the bed by no more than [`ARC`]: joint-linear moves follow straight
//!   lines only in pieces, and arcs about the axis in pieces of any length. `Custom` lines are free: priming along an arc about the axis is natural.
//! * No wall runs back over the line before: two lines that follow each other and turn by more than
//!   [`BACK`] are in the wrong order.
//! * Material is laid only with the filament at the nozzle's tip: what was drawn back must have
//!   been pushed forward again, and no more than that. How the print before left the filament is
//!   not known, so before the first time that it is drawn back anything may be pushed, and for
//!   `Custom` (purging) always. At the end no more than [`DRAWN_BACK`] is drawn back.
//! * Layers are numbered from 0 without a gap, and none lies lower than the one before.

use machine::program::Role;
use nalgebra::Vector3;

use crate::finding::{Findings, Place, exceeds};
use crate::replay::LayerMark;
use crate::rounding;
use crate::segment::{Kind, Segment};
use crate::totals::SHORT;

/// The name of this check.
pub const NAME: &str = "continuity";

/// Distance from the chord that makes an extruding segment a jump, mm. Paths are subdivided to
/// 0.005 mm; a missed subdivision is off by tenths of a millimetre and more.
pub const JUMP: f64 = 0.05;

/// Turn of the bed up to which an extruding segment may be an arc or a piece of a spiral, radians:
/// 16°. Whether it lies where the part is, other checks say.
pub const ARC: f64 = 16.0 * std::f64::consts::PI / 180.0;

/// Nearer to the axis a jump is not looked for, mm: a line that passes there has to leave its
/// chord for the bed's sake, and `axis` and `speed` watch it.
pub const NEAR_AXIS: f64 = 1.0;

/// Turn from one line of a wall to the next that is no corner of a part, radians: 178.9°, a tip of
/// 1.1°.
pub const BACK: f64 = std::f64::consts::PI - 0.02;

/// Filament that may be missing at the tip, or pushed too far, before it counts, mm. Words have 5
/// decimals; 0.001 mm is a hundredth of a visible drop.
pub const PRIMED: f64 = 1e-3;

/// Filament that may be drawn back when the program ends, mm. More, and the molten end sits in the
/// cold part of the hot end, where it jams; long tubes need up to 7.
pub const DRAWN_BACK: f64 = 10.0;

/// Judges each line by the ones before.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Continuity {
    /// Filament drawn back and not pushed forward again, mm.
    drawn: f64,
    layer: Option<LayerMark>,
    retractions: usize,
    /// The way of the line before, when it was of a wall.
    last_wall: Option<Vector3<f64>>,
    worst_deviation: f64,
    /// What is fed after a travel beyond what was drawn back, mm.
    extra: f64,
}

impl Continuity {
    /// For programs that feed more filament after a travel than was drawn back, or less, mm.
    pub(crate) fn with_extra(extra: f64) -> Self {
        Self { extra, ..Self::default() }
    }

    pub(crate) fn segment(&mut self, segment: &Segment, findings: &mut Findings) {
        half_turn(segment, findings);
        if segment.extrudes() && segment.role != Role::Custom {
            self.jump(segment, findings);
        }
        self.back(segment, findings);
        self.filament(segment, findings);
    }

    /// Judges whether a wall runs back over itself. Where the bed turns by much, the chord says little
    /// of a line's direction at its ends.
    fn back(&mut self, segment: &Segment, findings: &mut Findings) {
        let is_wall = segment.role.is_wall();
        let is_straight = segment.bed_change().abs() < 0.1 && segment.nearest > NEAR_AXIS;
        let way = segment.part[1] - segment.part[0];
        let is_judged = is_wall && is_straight && segment.extrudes() && segment.path > SHORT;
        let last = std::mem::replace(&mut self.last_wall, is_judged.then_some(way));
        let (Some(last), true) = (last, is_judged) else { return };
        // For nearly every pair the sign of the product says that they go on.
        if last.dot(&way) < 0.0 && last.angle(&way) > BACK {
            let angle = last.angle(&way);
            findings.warning(NAME, Place::end_of(segment), (angle, BACK), || {
                format!("a wall turns by {:.2}° and runs back over itself", angle.to_degrees())
            });
        }
    }

    pub(crate) fn layer(&mut self, layer: LayerMark, findings: &mut Findings) {
        let place = Place::line(layer.line, Some(layer.index));
        let expected = self.layer.map_or(0, |last| last.index.saturating_add(1));
        if layer.index != expected {
            findings.error(NAME, place, (layer.index as f64, expected as f64), || {
                format!("layer {} begins where layer {expected} is due", layer.index)
            });
        }
        let last = self.layer.and_then(|last| last.top);
        match (layer.top, last) {
            (None, _) => findings.error(NAME, place, (0.0, 1.0), || {
                "a layer begins without its height in ;Z:".into()
            }),
            (Some(top), Some(last)) if exceeds(last, top) => {
                findings.error(NAME, place, (top, last), || {
                    format!("the layer lies at {top} mm, the one before at {last} mm")
                });
            }
            _ => {}
        }
        self.layer = Some(LayerMark { top: layer.top.or(last), ..layer });
    }

    pub(crate) fn end(&self, place: Place, findings: &mut Findings) {
        if exceeds(self.drawn, DRAWN_BACK) {
            let drawn = self.drawn;
            findings.warning(NAME, place, (drawn, DRAWN_BACK), || {
                format!("the program ends with {drawn:.3} mm of filament drawn back")
            });
        }
    }

    /// Returns how often filament was drawn back from the tip.
    #[must_use]
    pub(crate) fn retractions(&self) -> usize {
        self.retractions
    }

    /// Returns the greatest distance of an extruding segment from its chord so far, farther than
    /// [`NEAR_AXIS`] from the axis, mm.
    #[must_use]
    pub(crate) fn worst_deviation(&self) -> f64 {
        self.worst_deviation
    }

    fn jump(&mut self, segment: &Segment, findings: &mut Findings) {
        let bound = segment.curve.deviation_bound();
        if bound <= self.worst_deviation && bound <= JUMP {
            return;
        }
        let deviation = segment.curve.deviation(NEAR_AXIS);
        self.worst_deviation = self.worst_deviation.max(deviation);
        let is_arc = segment.bed_change().abs() <= ARC;
        if (exceeds(deviation, JUMP) && !is_arc) || bound.is_nan() {
            findings.error(NAME, Place::end_of(segment), (deviation, JUMP), || {
                format!(
                    "a line that lays material bows {deviation:.3} mm from straight, at most \
                     {JUMP} mm: it is not subdivided, or jumps"
                )
            });
        }
    }

    fn filament(&mut self, segment: &Segment, findings: &mut Findings) {
        match segment.kind() {
            Kind::Retraction | Kind::Wipe => {
                if self.drawn < PRIMED {
                    self.retractions += 1;
                }
                self.drawn -= segment.filament;
            }
            Kind::Prime => {
                self.drawn -= segment.filament;
                if self.retractions > 0
                    && segment.role != Role::Custom
                    && exceeds(-self.drawn, PRIMED + self.extra.max(0.0))
                {
                    let surplus = -self.drawn;
                    let most = PRIMED + self.extra.max(0.0);
                    findings.error(NAME, Place::end_of(segment), (surplus, most), || {
                        format!("{surplus:.5} mm more filament is pushed than was drawn back")
                    });
                }
                // Purging is no debt, and last places must not add up; nor does what is left out on purpose.
                if self.drawn < PRIMED - self.extra.min(0.0) {
                    self.drawn = 0.0;
                }
            }
            Kind::Extrusion => {
                if exceeds(self.drawn, PRIMED) {
                    let drawn = self.drawn;
                    findings.error(NAME, Place::end_of(segment), (drawn, PRIMED), || {
                        format!("material is laid with {drawn:.5} mm of filament drawn back")
                    });
                    // One fault, told once.
                    self.drawn = 0.0;
                }
            }
            Kind::Travel | Kind::Still => {}
        }
    }
}

fn half_turn(segment: &Segment, findings: &mut Findings) {
    let turn = segment.bed_change().abs();
    let limit = std::f64::consts::PI;
    if exceeds(turn, limit + rounding::TURN) {
        findings.error(NAME, Place::end_of(segment), (turn, limit), || {
            format!("the bed turns by {:.3}° in one line, at most 180° is safe", turn.to_degrees())
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{filament_segment, polar_segment};

    fn laid(mut segment: Segment) -> Segment {
        segment.filament = 0.05;
        segment
    }

    fn found(segments: &[Segment]) -> Vec<f64> {
        let (mut check, mut findings) = (Continuity::default(), Findings::default());
        for segment in segments {
            check.segment(segment, &mut findings);
        }
        check.end(Place::line(9, None), &mut findings);
        findings.kept().iter().map(|finding| finding.limit).collect()
    }

    #[test]
    fn a_wall_that_runs_back_over_itself_is_found() {
        // Radial lines, on whose way back the bed stands.
        let out = laid(polar_segment([20.0, 0.0], [20.5, 0.0], 20.0));
        let back = laid(polar_segment([20.5, 0.0], [20.2, 0.0], 20.0));
        let aside = laid(polar_segment([20.5, 0.0], [20.2, 0.01], 20.0));
        assert_eq!(found(&[out, back]), [BACK]);
        assert_eq!(found(&[out, aside]), []);
        let fill = |segment| Segment { role: Role::SolidInfill, ..segment };
        assert_eq!(found(&[fill(out), fill(back)]), []);
        let travel = polar_segment([20.5, 0.0], [20.2, 0.0], 20.0);
        assert_eq!(found(&[out, travel]), []);
    }

    #[test]
    fn turns_and_jumps() {
        let pi = std::f64::consts::PI;
        assert_eq!(found(&[polar_segment([20.0, 0.0], [20.0, pi], 20.0)]), []);
        assert_eq!(found(&[polar_segment([20.0, 0.0], [20.0, -1.01 * pi], 20.0)]), [pi]);
        let within = 0.99 * ARC;
        assert_eq!(found(&[laid(polar_segment([20.0, 0.0], [20.0, within], 20.0))]), []);
        assert_eq!(found(&[laid(polar_segment([20.0, 0.0], [20.0, 1.01 * ARC], 20.0))]), [JUMP]);
        assert_eq!(found(&[polar_segment([20.0, 0.0], [20.0, 1.01 * ARC], 20.0)]), []);
        assert_eq!(found(&[laid(polar_segment([0.9, 0.0], [0.9, 2.0], 20.0))]), []);
        let mut priming = laid(polar_segment([20.0, 0.0], [20.0, 1.5], 20.0));
        priming.role = Role::Custom;
        assert_eq!(found(&[priming]), []);
    }

    #[test]
    fn filament_must_be_at_the_tip() {
        let line = || laid(polar_segment([20.0, 0.0], [20.0, 0.02], 20.0));
        let alone = |filament| filament_segment(filament, 30.0);
        assert_eq!(found(&[alone(20.0), line(), alone(-0.8), alone(0.8), line()]), []);
        assert_eq!(found(&[line(), alone(-0.8), alone(0.9), line()]), [PRIMED]);
        let mut purge = alone(20.0);
        purge.role = Role::Custom;
        assert_eq!(found(&[line(), alone(-0.8), purge, line(), alone(-0.8)]), []);
        assert_eq!(found(&[alone(-0.8), line()]), [PRIMED]);
        assert_eq!(found(&[alone(-0.8), alone(0.7995), line()]), []);
        assert_eq!(found(&[alone(-0.8), alone(0.798), line()]), [PRIMED]);
        assert_eq!(found(&[alone(-0.8), alone(0.8), alone(0.8), line()]), [PRIMED]);
        let mut wipe = polar_segment([20.0, 0.0], [20.0, 0.02], 20.0);
        wipe.filament = -0.3;
        assert_eq!(found(&[wipe, alone(-0.5), alone(0.8), line()]), []);
        assert_eq!(found(&[alone(-9.0), alone(-2.0)]), [DRAWN_BACK]);
        let found = |extra: f64, fed: f64| {
            let (mut check, mut findings) = (Continuity::with_extra(extra), Findings::default());
            for segment in
                [line(), alone(-0.8), alone(fed), line(), alone(-0.8), alone(fed), line()]
            {
                check.segment(&segment, &mut findings);
            }
            findings.kept().len()
        };
        assert_eq!([found(0.1, 0.9), found(-0.1, 0.7), found(0.1, 0.8)], [0; 3]);
        assert_eq!([found(0.1, 0.95), found(-0.1, 0.65), found(-0.1, 0.9)], [2; 3]);
    }

    #[test]
    fn layers_come_in_order() {
        let found = |marks: &[(usize, Option<f64>)]| {
            let (mut check, mut findings) = (Continuity::default(), Findings::default());
            for &(index, top) in marks {
                check.layer(
                    LayerMark { line: 1, index, top, height: None, family: None, climbs: false },
                    &mut findings,
                );
            }
            findings.kept().len()
        };
        assert_eq!(found(&[(0, Some(0.2)), (1, Some(0.4)), (2, Some(0.4))]), 0);
        assert_eq!(found(&[(1, Some(0.2))]), 1);
        assert_eq!(found(&[(0, Some(0.2)), (2, Some(0.4)), (3, Some(0.6))]), 1);
        assert_eq!(found(&[(0, Some(0.2)), (1, Some(0.1))]), 1);
        assert_eq!(found(&[(0, Some(0.2)), (1, None), (2, Some(0.1))]), 2);
    }
}
