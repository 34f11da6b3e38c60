//! The curve in which a layer cuts a facet, as a chain of chords.
//!
//! All in convex coordinates: the curve bounds the convex set K ∩ plane, so every chord of it lies
//! in K, and the place where the curve is parallel to a chord, its *shoulder*, is where it is
//! farthest from it. The shoulder lies on the line from the middle of the chord along the chord's
//! conjugate direction (Apollonius: the diameter that halves a system of parallel chords), and is
//! found exactly, whatever the kind of conic.

use nalgebra::{Point3, Vector3, center};

use crate::surface::Form;

/// A facet and the layer that cuts it.
pub(super) struct Cut<'a> {
    form: &'a Form,
    /// F of the layer.
    value: f64,
    /// Corners, counter-clockwise seen from outside.
    corners: [Point3<f64>; 3],
    /// Outward normal, not of unit length.
    normal: Vector3<f64>,
    /// How far the curve may lie from its chords, mm.
    tolerance: f64,
}

/// Chords shorter than this, mm, have no direction of their own. Rounding of their ends is a
/// millionth of it.
const SHORT_CHORD_MM: f64 = 1e-6;

/// How far outside its facet a shoulder may come to lie, mm, by rounding: farther, and the curve
/// is too ill-conditioned to be followed beyond the chord.
const OUTSIDE_MM: f64 = 1e-6;

/// Halvings of a chord: every one divides its deviation by about four.
const MOST_HALVINGS: u32 = 24;

impl<'a> Cut<'a> {
    pub(super) fn new(
        form: &'a Form,
        value: f64,
        corners: [Point3<f64>; 3],
        tolerance: f64,
    ) -> Self {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        Self { form, value, corners, normal, tolerance }
    }

    /// Appends the points between `enter` and `leave` in which the outline passes through the
    /// facet, without these two. `sides` tells the numbers of the sides that they lie on.
    pub(super) fn between(
        &self,
        enter: &Point3<f64>,
        leave: &Point3<f64>,
        sides: impl Fn() -> [usize; 2],
        points: &mut Vec<Point3<f64>>,
    ) {
        let chord = enter - leave;
        if chord.norm_squared() >= SHORT_CHORD_MM * SHORT_CHORD_MM {
            self.split(leave, enter, MOST_HALVINGS, points);
            return;
        }
        // Nothing but a corner is cut off; otherwise K fills the facet almost to that place, and
        // the curve runs once around it.
        let [enter_side, leave_side] = sides();
        if enter_side == (leave_side + 1) % 3 {
            return;
        }
        let around = -(self.direction(enter_side) + self.direction(leave_side));
        if let Some((shoulder, _)) = self.shoulder(leave, enter, &around)
            && self.holds(&shoulder)
        {
            self.split(&shoulder, enter, MOST_HALVINGS, points);
            points.push(shoulder);
            self.split(leave, &shoulder, MOST_HALVINGS, points);
        }
    }

    /// Returns the curve around `lowest`, a place of the facet in K, when no side is crossed.
    pub(super) fn closed_curve(&self, lowest: &Point3<f64>) -> Vec<Point3<f64>> {
        let Some(first) = self.direction(0).try_normalize(0.0) else { return Vec::new() };
        let Some(second) = self.normal.cross(&first).try_normalize(0.0) else { return Vec::new() };
        let hits: Option<Vec<Point3<f64>>> = [first, second, -first, -second]
            .iter()
            .map(|direction| {
                let t = self.form.quadratic(self.value, lowest, direction).leaves();
                t.is_finite().then(|| lowest + direction * t)
            })
            .collect();
        let Some(hits) = hits else { return Vec::new() };
        let mut points = Vec::new();
        // The quarters have K to their left; outlines run the other way.
        for quarter in (0..4).rev() {
            let (from, to) = (hits[quarter], hits[(quarter + 1) % 4]);
            points.push(to);
            self.split(&from, &to, MOST_HALVINGS, &mut points);
        }
        points
    }

    /// Appends points from `enter` to `leave`, both excluded, until chords are near enough.
    fn split(
        &self,
        leave: &Point3<f64>,
        enter: &Point3<f64>,
        halvings: u32,
        points: &mut Vec<Point3<f64>>,
    ) {
        let chord = enter - leave;
        if self.is_near(leave, enter, &chord) {
            return;
        }
        let Some((shoulder, deviation)) = self.shoulder(leave, enter, &chord) else { return };
        if deviation <= self.tolerance || halvings == 0 || !self.holds(&shoulder) {
            return;
        }
        self.split(&shoulder, enter, halvings - 1, points);
        points.push(shoulder);
        self.split(leave, &shoulder, halvings - 1, points);
    }

    /// Whether the curve is plainly near enough to its chord: from the middle of that, F grows to the
    /// right at least as fast as it begins to. A single root tells it of nearly all chords of fine
    /// meshes.
    fn is_near(&self, leave: &Point3<f64>, enter: &Point3<f64>, chord: &Vector3<f64>) -> bool {
        let right = chord.cross(&self.normal);
        let (value, growth) = self.form.value_and_growth(&center(leave, enter), &right);
        let lacking = self.value - value;
        // Half the tolerance: the farthest place need not lie over the middle.
        let least = self.tolerance / 2.0 * growth;
        growth > 0.0 && lacking * lacking * right.norm_squared() <= least * least
    }

    /// The shoulder over a chord from `leave` to `enter` and its distance from the chord, mm;
    /// K lies to the left of `chord`.
    fn shoulder(
        &self,
        leave: &Point3<f64>,
        enter: &Point3<f64>,
        chord: &Vector3<f64>,
    ) -> Option<(Point3<f64>, f64)> {
        let right = chord.cross(&self.normal);
        let diameter = self.normal.cross(&self.form.conjugate(chord));
        let towards = if diameter.dot(&right) < 0.0 { -diameter } else { diameter };
        let towards = towards.try_normalize(0.0)?;
        let middle = center(leave, enter);
        let t = self.form.quadratic(self.value, &middle, &towards).leaves();
        let deviation = t * towards.dot(&right) / right.norm();
        (deviation.is_finite() && deviation > 0.0).then(|| (middle + towards * t, deviation))
    }

    /// Whether a point of the facet's plane lies in the facet.
    fn holds(&self, p: &Point3<f64>) -> bool {
        (0..3).all(|k| {
            let inwards = self.normal.cross(&self.direction(k));
            inwards.dot(&(p - self.corners[k])) >= -OUTSIDE_MM * inwards.norm()
        })
    }

    /// Side `k`, in the direction in which the facet runs along it.
    fn direction(&self, k: usize) -> Vector3<f64> {
        self.corners[(k + 1) % 3] - self.corners[k]
    }
}
