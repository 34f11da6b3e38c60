//! Many short strokes as one move.
//!
//! A move is straight in joint space: circles about the axis and spirals are, however finely the
//! lines that stand for them are cut. The longest run of strokes is sought that one move follows to
//! within the chord tolerance, at the ends and in the middle of every stroke.

use machine::gcode::dialect::Space;
use nalgebra::{Point2, Vector3};

use super::{Leg, Resampler, Target, turned};
use crate::route::{Kind, Stroke};

/// Largest turn of the bed in one move for several strokes, radians: 15°. An arc and its chord, by
/// which readers of a program measure speed, then differ by 0.3 %.
const LONG_MOVE_TURN: f64 = std::f64::consts::FRAC_PI_6 / 2.0;

/// Most strokes that become one move; 15° of the finest arc has fewer.
const MOST_STROKES: usize = 256;

/// Strokes nearer than this to what is kept clear of the axis, mm, have moves of their own: there the
/// way round the axis is found stroke by stroke.
const LONG_MOVE_CLEARANCE_MM: f64 = 1.0;

/// How much the length of a long move may differ from that of its strokes, as a share: a line that
/// turns back on itself is no single move, however near it stays.
const LONG_MOVE_LENGTH: f64 = 0.01;

impl Resampler {
    /// One move for as many strokes as possible, at least two, and their number: circles about the
    /// axis and spirals are straight in joint space, however finely their strokes are cut.
    pub(super) fn long_move(&mut self, strokes: &[Stroke]) -> Option<(usize, Leg)> {
        let is_off_line = self.meant.over_bed != self.over_bed;
        let is_joints = self.params.dialect.space == Space::Joints;
        if !is_joints || strokes[0].kind != Kind::Print || is_off_line {
            return None;
        }
        if !strokes.get(1)?.continues {
            return None;
        }
        let clearance = self.clear_radius(self.joints.z);
        let target = |stroke: &Stroke| {
            let at = turned(&self.azimuth, &stroke.to);
            let over_bed = Point2::from(self.alignment.over_bed(&at.xy()));
            let far_enough = over_bed.coords.norm() > clearance + LONG_MOVE_CLEARANCE_MM;
            far_enough.then_some(Target { over_bed, z: stroke.to.z })
        };
        // Most strokes end at a corner, which needs no kinematics to be seen.
        if !self.may_follow(&target(&strokes[0])?, &target(&strokes[1])?) {
            return None;
        }
        let continued = strokes[1..].iter().take(MOST_STROKES - 1);
        let mut most = 1 + continued.take_while(|stroke| stroke.continues).count();
        let mut places = strokes[..most].iter().map_while(target);
        let mut targets: Vec<Target> = Vec::new();
        // Twice as many as long as that goes well, then the exact number between. Most moves are a
        // few strokes long, so the way ahead is not looked at before it is needed.
        let (mut good, mut bad) = (1, most + 1);
        while good + 1 < bad {
            let count = if bad > most { (2 * good).min(most) } else { (good + bad) / 2 };
            targets.extend(places.by_ref().take(count.saturating_sub(targets.len())));
            if targets.len() < count {
                (most, bad) = (targets.len(), targets.len() + 1);
            } else if self.follows(&targets[..count]) {
                good = count;
            } else {
                bad = count;
            }
        }
        if good < 2 {
            return None;
        }
        let mut legs = Vec::new();
        let target = &targets[good - 1];
        let to = self.joints_at(target).ok()?;
        self.push(Kind::Print, to, target, &mut legs).ok()?;
        let leg = legs.pop()?;
        self.meant = *target;
        let filament = strokes[..good].iter().map(|stroke| stroke.filament).sum();
        let filament = self.with_owed(Kind::Print, filament, true);
        // No stroke may be passed faster than its own flow allows.
        let speeds = strokes[..good].iter().map(|stroke| stroke.speed);
        let speed = speeds.fold(f64::INFINITY, f64::min);
        Some((good, Leg { filament, speed, ..leg }))
    }

    /// Whether a move past the first of two targets could end at the second: how far the first lies
    /// from the straight line is compared with how far a move can bend, twice over.
    fn may_follow(&self, first: &Target, second: &Target) -> bool {
        let (to_first, along) = (first.over_bed - self.over_bed, second.over_bed - self.over_bed);
        let length = along.norm();
        let off = along.perp(&to_first).abs() / length;
        let ends = [self.over_bed, first.over_bed, second.over_bed];
        let nearest = ends.iter().map(|p| p.coords.norm()).fold(f64::INFINITY, f64::min);
        off <= self.params.chord + length * length / (4.0 * nearest)
    }

    /// Whether one move to the last target stays within the chord tolerance of the way past all.
    fn follows(&self, targets: &[Target]) -> bool {
        let Some(Ok(to)) = targets.last().map(|last| self.joints_at(last)) else { return false };
        let turn = to.turn.radians() - self.joints.turn.radians();
        if turn.abs() > LONG_MOVE_TURN {
            return false;
        }
        let from = Target { over_bed: self.over_bed, z: self.joints.z };
        let lengths: Vec<f64> = std::iter::once(&from)
            .chain(targets)
            .zip(targets)
            .map(|(a, b)| (b.over_bed - a.over_bed).norm().hypot(b.z - a.z))
            .collect();
        let whole: f64 = lengths.iter().sum();
        if (self.path_length(&to, self.alignment.part_from_joints(&to)) - whole).abs()
            > LONG_MOVE_LENGTH * whole
        {
            return false;
        }
        let sweep = self.sweep(&to);
        let rise = to.z - from.z;
        let passes = |place: &Target, share: f64| {
            // Where the move should be about there it passes at this distance.
            let (here, heading) = sweep.at(share);
            let aside = place.over_bed - here;
            let off = Vector3::new(aside.x, aside.y, place.z - (from.z + rise * share));
            let along = Vector3::new(heading.x, heading.y, rise);
            let along_it = off.dot(&along) / along.norm_squared();
            (off - along * along_it).norm() <= self.params.chord
        };
        let mut done = 0.0;
        let mut before = from;
        targets.iter().zip(&lengths).all(|(target, length)| {
            let middle = Target {
                over_bed: nalgebra::center(&before.over_bed, &target.over_bed),
                z: f64::midpoint(before.z, target.z),
            };
            let near = passes(&middle, (done + length / 2.0) / whole)
                && passes(target, (done + length) / whole);
            done += length;
            before = *target;
            near
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{PARAMS, print, travel};
    use super::*;
    use crate::testing::printer;
    use machine::gcode::dialect::POLAR;
    use machine::kinematics::Alignment;

    #[test]
    fn a_line_that_turns_back_is_not_one_move() {
        let back = Stroke { continues: true, ..print(30.2, 0.0) };
        let strokes = [travel(30.0, 0.0), print(30.4, 0.0), back];
        let legs = Resampler::new(&printer(), PARAMS).legs(&strokes).unwrap();
        assert_eq!(legs[1..].iter().map(Vec::len).collect::<Vec<_>>(), [1, 1]);
        let ahead = Stroke { continues: true, ..print(30.8, 0.0) };
        let strokes = [travel(30.0, 0.0), print(30.4, 0.0), ahead];
        let legs = Resampler::new(&printer(), PARAMS).legs(&strokes).unwrap();
        assert_eq!(legs[1..].iter().map(Vec::len).collect::<Vec<_>>(), [0, 1]);
    }

    #[test]
    fn a_circle_about_the_axis_is_a_few_long_moves_within_the_tolerance() {
        let (radius, count) = (20.0, 400);
        let point = |k: u32| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(count);
            (radius * angle.cos(), radius * angle.sin())
        };
        let (x, y) = point(0);
        let mut strokes = vec![travel(x, y)];
        strokes.extend((1..=count).map(|k| {
            let (x, y) = point(k);
            Stroke { continues: k > 1, ..print(x, y) }
        }));
        let mut resampler = Resampler::new(&printer(), PARAMS);
        let mut from = resampler.joints();
        let groups = resampler.legs(&strokes).unwrap();
        assert_eq!(groups.len(), strokes.len());
        let legs: Vec<Leg> = groups[1..].iter().flatten().copied().collect();
        assert!((24..=30).contains(&legs.len()), "{} moves", legs.len());
        let fed: f64 = legs.iter().map(|leg| leg.filament).sum();
        assert!((fed - 0.1 * f64::from(count)).abs() < 1e-9);
        for (k, leg) in groups.iter().flatten().enumerate() {
            if k >= groups[0].len() {
                for share in [0.1, 0.3, 0.5, 0.7, 0.9] {
                    let at = Alignment::default()
                        .part_from_joints(&POLAR.between(&from, &leg.to, share));
                    assert!((at.xy().coords.norm() - radius).abs() < 0.005);
                }
            }
            from = leg.to;
        }
    }
}
