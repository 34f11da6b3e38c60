//! How thick the material is at a place of a layer: wedges on the bed, and cones that grow out of
//! planes.
//!
//! Curved layers meet a flat bed, or the planar layers that they stand on, in wedges. The *depth*
//! of a place is its distance from that base along the normal of the layer. Where the depth is less
//! than the least printable thickness nothing is laid, and the layer above takes over what is
//! missing; elsewhere a bead is as thick as it is deep, up to the nominal thickness. The rule needs
//! no knowledge of neighbours, and the volumes of all layers add up to that of the part.

use nalgebra::Point3;

use crate::surface::{Cone, LayerSurface, SurfaceError};

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

/// One layer of a [`blend`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlendLayer {
    /// Height of its upper side on the axis above the base, mm.
    pub level: f64,
    /// Its cone.
    pub cone: Cone,
}

/// Returns the layers that lead from a plane to the cone of `slope` in the fewest steps, over a
/// part that reaches `radius` mm from the axis, with layers between `thinnest` and `thickest` mm
/// thick everywhere.
///
/// A layer is thickest on the axis when cones slope down outwards, at the rim when they are bowls.
/// About `radius·asinh(|slope|)/(thickest − thinnest)` layers are needed.
///
/// # Errors
///
/// [`SurfaceError::NotFinite`] unless `0 < thinnest < thickest`, and radius and slope are numbers.
pub fn blend(
    slope: f64,
    radius: f64,
    [thinnest, thickest]: [f64; 2],
) -> Result<Vec<BlendLayer>, SurfaceError> {
    let is_sound = 0.0 < thinnest && thinnest < thickest && thickest.is_finite();
    if !(is_sound && slope.is_finite() && radius.is_finite() && radius > 0.0) {
        return Err(SurfaceError::NotFinite);
    }
    let mut layers = Vec::new();
    let (mut steepness, mut level): (f64, f64) = (0.0, 0.0);
    while steepness < slope.abs() {
        // Thickness is (step of level − step of slope · r)·cos; the cosine is that of the new
        // layer, which the step itself depends on: the flatter one before is a fraction off, so
        // the step is found twice.
        let mut next = steepness;
        for _ in 0..2 {
            next = steepness + (thickest - thinnest) / radius * next.hypot(1.0);
        }
        steepness = next.min(slope.abs());
        let on_axis = if slope > 0.0 { thickest } else { thinnest };
        level += on_axis * steepness.hypot(1.0);
        let cone = Cone::from_slope(steepness.copysign(slope))?;
        layers.push(BlendLayer { level, cone });
    }
    Ok(layers)
}
