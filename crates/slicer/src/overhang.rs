//! What hangs over: places of a layer that the layer below does not carry.
//!
//! The overhang of a facet is the angle by which it leans out over the layers, seen along their
//! normal: 0 where it runs along the normal, 90° where it is a ceiling. From one layer to the next
//! the outline then moves by `thickness·tan(overhang)` along the layer.

use geom::region::Region;
use nalgebra::{Point3, Vector3};

use crate::chart::carried;
use crate::surface::LayerSurface;

/// Returns the overhang, radians, of a facet with the outward unit normal `outward` at `p`;
/// negative where it leans back.
#[must_use]
pub fn overhang(surface: &dyn LayerSurface, p: &Point3<f64>, outward: &Vector3<f64>) -> f64 {
    let up = surface.normal(p);
    // Exact for ceilings too, where the arc sine would lose half the digits.
    (-outward.dot(&up)).atan2(outward.cross(&up).norm())
}

/// Returns the largest overhang that carries itself, radians: a bead `width` wide in a layer
/// `thickness` thick (mm) rests with at least the share `carried_share` of its width on the bead
/// below.
#[must_use]
pub fn steepest_overhang(width: f64, thickness: f64, carried_share: f64) -> f64 {
    ((1.0 - carried_share) * width / thickness).atan()
}

/// What the layer below does not carry.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Unsupported {
    /// All of it, in the chart of the layer.
    pub region: Region,
    /// The islands of the layer that begin in mid-air: nothing at all is below them.
    pub floating: Region,
}

/// Returns what of `layer` the layer below does not carry; each is a region and its level. Edges
/// may reach out by `reach` mm along the layer.
#[must_use]
pub fn unsupported(
    surface: &dyn LayerSurface,
    layer: (&Region, f64),
    below: (&Region, f64),
    reach: f64,
) -> Unsupported {
    let ground = carried(surface, below.0, below.1, layer.1);
    let floating = layer
        .0
        .filtered(|island| Region::from_island((*island).clone()).intersection(&ground).is_empty());
    let region = layer.0.difference(&surface.chart(layer.1).outset(&ground, reach));
    Unsupported { region, floating }
}
