//! How steep layers may be before an upright nozzle runs into them.
//!
//! Uphill of the nozzle the layer that is being laid rises above its tip. How far it does depends on
//! the order: laid from low to high, only the layer below lies uphill, lower by its thickness.

use std::f64::consts::FRAC_PI_2;

use mesh::topology::Solid;
use rayon::prelude::*;

use crate::surface::LayerSurface;

/// The shape of a nozzle and what carries it, as a solid of revolution about its axis: a flat face,
/// a cone, and a block above. Lengths mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NozzleProfile {
    /// Radius of the flat face around the bore.
    pub flat_radius: f64,
    /// Half the angle of the cone, from the axis, radians.
    pub half_angle: f64,
    /// Height of the underside of the block above the tip.
    pub block_height: f64,
    /// How far the block reaches from the axis.
    pub block_radius: f64,
}

/// In which order a layer is laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerOrder {
    /// From low to high places: uphill of the nozzle lies only the layer below.
    LowToHigh,
    /// Any other: the layer itself may already lie uphill.
    Any,
}

/// What lies around a nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uphill {
    /// How far layers rise from the nozzle, along the bed, mm: to the axis where they slope down
    /// outwards, to the rim of the part in bowls.
    pub extent: f64,
    /// Thickness of a layer along its normal, mm.
    pub thickness: f64,
    /// How deep the nozzle may press into what is laid, mm.
    pub allowance: f64,
    /// The order of a layer.
    pub order: LayerOrder,
}

impl NozzleProfile {
    /// Returns whether layers that slope by `angle` (radians) clear the nozzle.
    #[must_use]
    pub fn clears(&self, angle: f64, uphill: &Uphill) -> bool {
        let slope = angle.tan();
        let free = uphill.allowance
            + match uphill.order {
                LayerOrder::LowToHigh => uphill.thickness / angle.cos(),
                LayerOrder::Any => 0.0,
            };
        let tip = slope * self.flat_radius.min(uphill.extent) <= free;
        // The flank is straight like the layer: it is nearest at its lower or its upper end.
        let flank_radius = self.flat_radius + self.block_height * self.half_angle.tan();
        let reach = flank_radius.min(uphill.extent);
        let flank = angle <= FRAC_PI_2 - self.half_angle
            || slope * reach <= (reach - self.flat_radius) / self.half_angle.tan() + free;
        let block = uphill.extent <= flank_radius
            || slope * uphill.extent.min(self.block_radius) <= self.block_height + free;
        tip && flank && block
    }

    /// Returns the steepest layers that clear the nozzle, radians.
    #[must_use]
    pub fn steepest(&self, uphill: &Uphill) -> f64 {
        // 60 halvings of a right angle end at its last bit.
        const HALVINGS: u32 = 60;
        let (mut clear, mut hit) = (0.0, FRAC_PI_2);
        for _ in 0..HALVINGS {
            let angle = f64::midpoint(clear, hit);
            if self.clears(angle, uphill) {
                clear = angle;
            } else {
                hit = angle;
            }
        }
        clear
    }
}

/// Returns the steepest slope of the layers through a solid, radians.
#[must_use]
pub fn steepest_slope(solid: &Solid, surface: &dyn LayerSurface) -> f64 {
    // Places where layers are flatter than an angle fill a cylinder or a cone about the axis. These
    // are convex, so the steepest place of a facet is a corner.
    let least_cos =
        solid.mesh().vertices.par_iter().map(|p| surface.slope_cos(p)).reduce(|| 1.0, f64::min);
    least_cos.clamp(0.0, 1.0).acos()
}
