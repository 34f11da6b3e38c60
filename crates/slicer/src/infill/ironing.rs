//! A second run over what is seen from above: close lines with hardly any material, at which the
//! flat end of the nozzle smooths the first.

use geom::region::Region;

use super::{FillLayer, FillLine, SOLID_JOINS, open_lines, rectilinear, sparse};
use crate::bead::Bead;
use crate::toolpath::Role;

/// How tops are ironed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IroningParams {
    /// Distance of the lines, mm.
    pub spacing: f64,
    /// Material by what a solid layer would take, 0 to 1.
    pub flow: f64,
    /// Distance from the edge of the top, mm.
    pub inset: f64,
}

/// The lines over a top, in the direction `angle` as seen along the axis.
pub(crate) fn ironing(
    top: &Region,
    angle: f64,
    layer: &FillLayer<'_>,
    params: &IroningParams,
) -> Vec<FillLine> {
    let inside = layer.chart.inset(top, params.inset.max(params.spacing / 2.0));
    let bead = Bead::with_spacing(params.spacing * params.flow, layer.thickness);
    let mut lines = Vec::new();
    for island in inside.islands() {
        let area = layer.chart.region_from_above(&Region::from_island(island.clone()));
        let even = rectilinear::evenly(&area, params.spacing, angle);
        let (core, chords) = (&even.core, &even.chords);
        lines.extend(open_lines(core, chords, &SOLID_JOINS, Role::Ironing, bead, layer));
    }
    for line in &mut lines {
        line.points = sparse::under(&line.points, layer);
    }
    lines
}
