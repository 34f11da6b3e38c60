//! How thick the material is at a place of a layer that begins on a flat base, or ends below one.
//!
//! Curved layers meet a flat bed, or the planar layers that they stand on, in wedges. The *depth*
//! of a place is its distance from that base along the normal of the layer. Where the depth is less
//! than the least printable thickness nothing is laid, and the layer above takes over what is
//! missing; elsewhere a bead is as thick as it is deep, up to the nominal thickness. The rule needs
//! no knowledge of neighbours, and the volumes of all layers add up to that of the part.

use nalgebra::Point3;

use crate::surface::LayerSurface;

/// What a bead may be where layers begin on a flat base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WedgeRule {
    /// Height of the base, mm: 0 for the bed.
    pub base: f64,
    /// The least thickness of a bead, mm. Half a layer is a good choice: beads then are at most one
    /// and a half layers thick.
    pub least: f64,
}

impl WedgeRule {
    /// Returns the thickness of the bead whose top is at `p` (part frame), mm: 0 where none is
    /// laid. `level_step` is the difference of the levels above and below it.
    #[must_use]
    pub fn thickness(&self, surface: &dyn LayerSurface, p: &Point3<f64>, level_step: f64) -> f64 {
        self.thickness_at_depth(
            depth(surface, p, self.base),
            level_step * surface.thickness_per_level(p),
        )
    }

    /// Returns the thickness of a bead at `depth` in a layer that is `nominal` thick, all mm.
    #[must_use]
    pub fn thickness_at_depth(&self, depth: f64, nominal: f64) -> f64 {
        if depth < self.least {
            0.0
        } else if depth < nominal + self.least {
            depth
        } else {
            nominal
        }
    }

    /// Returns the mean thickness over places whose depth changes evenly between two values, in a layer
    /// `nominal` thick, all mm.
    #[must_use]
    pub fn mean_thickness(&self, [a, b]: [f64; 2], nominal: f64) -> f64 {
        // The integral of the thickness over the depth.
        let sum = |depth: f64| {
            let wedge = depth.clamp(self.least, nominal + self.least);
            let beyond = (depth - nominal - self.least).max(0.0);
            (wedge * wedge - self.least * self.least) / 2.0 + nominal * beyond
        };
        if (b - a).abs() < EVEN_MM {
            return self.thickness_at_depth(f64::midpoint(a, b), nominal);
        }
        (sum(b) - sum(a)) / (b - a)
    }

    /// Returns the pieces of a line of a layer `nominal` thick between two depths, in order;
    /// depths change evenly along it, and so does the thickness in each piece.
    #[must_use]
    pub fn pieces(&self, [begin, end]: [f64; 2], nominal: f64) -> Vec<WedgePiece> {
        let mut cuts = vec![0.0];
        let mut limits = [self.least, nominal + self.least];
        if end < begin {
            limits.reverse();
        }
        let at = |limit: f64| (limit - begin) / (end - begin);
        cuts.extend(limits.map(at).into_iter().filter(|share| 0.0 < *share && *share < 1.0));
        cuts.push(1.0);
        cuts.windows(2)
            .map(|ends| {
                let depth = |share: f64| begin + (end - begin) * share;
                let middle = depth(f64::midpoint(ends[0], ends[1]));
                let thickness = match self.thickness_at_depth(middle, nominal) {
                    thickness if thickness == middle => [depth(ends[0]), depth(ends[1])],
                    same => [same, same],
                };
                WedgePiece { from: ends[0], to: ends[1], thickness }
            })
            .collect()
    }
}

/// Depths that differ by less are one, mm: far below what any bead is thick, and far above rounding.
const EVEN_MM: f64 = 1e-7;

/// The curved layers that end below a flat top: where each place of the first planar layer above
/// them finds its ground.
///
/// A curved layer is laid where its upper side lies at least the least thickness below the top of
/// that planar layer, which takes over what is missing: its beads are from `least` to `least` and a
/// curved layer, measured upright, thick.
#[derive(Clone, Copy)]
pub struct Stair<'a> {
    /// The family of the curved layers.
    pub surface: &'a dyn LayerSurface,
    /// The upper level of one of them, mm.
    pub level: f64,
    /// Difference of the levels of neighbours, mm.
    pub step: f64,
    /// Height of the flat floor that the curved layers stand on, mm: there is no deeper ground.
    pub floor: f64,
    /// Height of the upper side of the first planar layer, mm.
    pub top: f64,
    /// The least thickness of a bead of it, mm.
    pub least: f64,
}

impl Stair<'_> {
    /// Returns up to which height curved layers are laid, mm.
    #[must_use]
    pub fn ceiling(&self) -> f64 {
        self.top - self.least
    }

    /// Returns how many layers above that of [`level`](Self::level) the ceiling lies at distance `r` from
    /// the axis: a whole number where one of them ends.
    #[must_use]
    pub fn steps(&self, r: f64) -> f64 {
        (self.surface.level(&Point3::new(r, 0.0, self.ceiling())) - self.level) / self.step
    }

    /// Returns how far the highest curved layer lies below the top at distance `r` from the axis,
    /// mm.
    #[must_use]
    pub fn thickness(&self, r: f64) -> f64 {
        let steps = (self.steps(r) + STEP_SLACK).floor();
        let ground = self.surface.height(self.level + steps * self.step, r);
        let ground = if ground.is_finite() { ground.max(self.floor) } else { self.floor };
        self.top - ground.max(self.end_face(r, self.level + (steps + 1.0) * self.step))
    }

    /// Returns the height at distance `r` from the axis of the side on which the layer with this upper
    /// level ends below the ceiling, mm. The side runs along the normal, so that the foot of the layer
    /// reaches out under the ceiling.
    fn end_face(&self, r: f64, level: f64) -> f64 {
        let ceiling = self.ceiling();
        let cos = self.surface.slope_cos(&Point3::new(r, 0.0, ceiling));
        let slope = (1.0 - cos * cos).max(0.0).sqrt() / cos;
        let aside = (self.surface.height(level, r) - ceiling) / slope;
        let height = ceiling - aside / slope;
        if height.is_finite() { height.min(ceiling) } else { f64::NEG_INFINITY }
    }

    /// Returns the mean of the thickness within half of `width` of distance `r` from the axis, mm: what
    /// a bead takes that lies on edges of curved layers.
    #[must_use]
    pub fn mean_thickness(&self, r: f64, width: f64) -> f64 {
        let at = |k: u32| r + width * ((f64::from(k) + 0.5) / f64::from(ACROSS) - 0.5);
        let sum: f64 = (0..ACROSS).map(|k| self.thickness(at(k).abs())).sum();
        sum / f64::from(ACROSS)
    }
}

/// Places across a bead at which its ground is looked at: the steps of the stair lie about as far apart
/// as beads are wide, so that one or two edges run under it.
const ACROSS: u32 = 12;

/// Rounding of a level, as a share of a step: a layer that just reaches the ceiling is laid.
const STEP_SLACK: f64 = 1e-6;

/// A piece of a line along which the thickness changes evenly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WedgePiece {
    /// Where it begins, as a share of the line.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// Thickness of the bead at both ends, mm: both 0 where none is laid.
    pub thickness: [f64; 2],
}

/// Returns the distance of `p` from the plane at height `base` along the normal of the layer
/// through `p`, mm; negative below the plane.
#[must_use]
pub fn depth(surface: &dyn LayerSurface, p: &Point3<f64>, base: f64) -> f64 {
    (p.z - base) / surface.slope_cos(p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Caps, Cone, Spheres};

    #[test]
    fn the_mean_over_a_wedge_is_that_of_its_places() {
        let rule = WedgeRule { base: 0.0, least: 0.1 };
        for [a, b] in [[0.0, 0.5], [0.05, 0.2], [0.45, 0.15], [0.2, 0.2], [0.02, 0.08], [0.4, 0.9]]
        {
            let at = |k: u32| a + (b - a) * (f64::from(k) + 0.5) / 10_000.0;
            let places = (0..10_000).map(|k| rule.thickness_at_depth(at(k), 0.2));
            let mean = places.sum::<f64>() / 10_000.0;
            assert!((rule.mean_thickness([a, b], 0.2) - mean).abs() < 1e-4, "{a} {b}");
        }
    }

    #[test]
    fn the_layer_on_a_stair_takes_what_curved_layers_leave() {
        let cone = Cone::new(0.5).unwrap();
        let bowl = Cone::new(-0.7).unwrap();
        let spheres = Spheres::new(-30.0).unwrap();
        let caps = Caps::new(60.0).unwrap();
        let families: [&dyn LayerSurface; 4] = [&cone, &bowl, &spheres, &caps];
        for surface in families {
            let (step, top, least) = (surface.level_step(0.2), 12.0, 0.1);
            let stair = Stair { surface, level: 3.07, step, floor: 0.4, top, least };
            for k in 0..200 {
                let r = f64::from(k) * 0.1;
                let thickness = stair.thickness(r);
                let ground = top - thickness;
                // The ground is a curved layer that is laid, or the side of the next one, which is not.
                let level = surface.level(&Point3::new(r, 0.0, ground));
                let steps = (level - 3.07) / step;
                let on_layer = (steps - steps.round()).abs() < 1e-6;
                let next = 3.07 + (steps - 1e-6).ceil() * step;
                let on_side = (stair.end_face(r, next) - ground).abs() < 1e-6;
                assert!(on_layer || on_side, "{r}: {steps}");
                assert!(ground <= stair.ceiling() + 1e-6 && thickness >= least - 1e-6);
                assert!(surface.height(level + step, r) > stair.ceiling() - 1e-6);
            }
            // Rings side by side take together what the ground leaves.
            let (width, inner) = (0.4, 4.0);
            let ring = |k: u32| inner + width * f64::from(k);
            let taken: f64 = (0..20).map(|k| stair.mean_thickness(ring(k), width) * width).sum();
            let fine = |k: u32| inner - width / 2.0 + 1e-3 * (f64::from(k) + 0.5);
            let left: f64 = (0..8000).map(|k| stair.thickness(fine(k)) * 1e-3).sum();
            assert!((taken / left - 1.0).abs() < 0.01, "{taken} {left}");
        }
        // On a cone all layers end alike: half a layer upright is missing on the mean below the ceiling,
        // less the feet, right triangles over the side of a layer.
        let (sin, cos) = 0.5_f64.sin_cos();
        let stair = Stair {
            surface: &cone,
            level: 3.07,
            step: 0.2 / cos,
            floor: 0.4,
            top: 12.0,
            least: 0.1,
        };
        let (inner, terrace) = (4.0, 0.2 / sin);
        let at = |k: u32| inner + terrace * 5.0 * (f64::from(k) + 0.5) / 5000.0;
        let mean = (0..5000).map(|k| stair.thickness(at(k))).sum::<f64>() / 5000.0;
        let wanted = 0.1 + 0.1 / cos - 0.1 * sin * sin / cos;
        assert!((mean / wanted - 1.0).abs() < 1e-3, "{mean} {wanted}");
        // The highest layer below the ceiling would lie 0.23 mm high, under the floor.
        let low = Stair { surface: &cone, level: 0.6, step: 0.5, floor: 0.4, top: 0.7, least: 0.1 };
        assert!((low.thickness(8.0) - 0.3).abs() < 1e-12, "there is nothing below the floor");
    }
}
